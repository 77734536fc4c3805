"""The shape with the most torque at yield per mass, by sequential linear programming.

Unknowns are the variables x of `dftfs.analysis.shape.space` and a bound b on the stress at every
place, so that the largest stress needs no smoothing:

    minimise   log(area) + log(b)
    subject to stress_i / torque <= b, torque at contact >= the asked one in both directions and
               within a given share of each other, stiffness >= the asked one at the widest part.

Area and stress per torque change with the width in opposite senses, so that their product is the
inverse of torque at yield per mass whatever the width. Each round solves the linearised program
within a trust region by HiGHS (scipy); a round counts only if an exact penalty function falls.
Source: R. Fletcher & E. Sainz de la Maza, "Nonlinear programming and nonsmooth optimization by
successive linear programming", Mathematical Programming 43 (1989) 235-256.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from dftfs.analysis.shape.responses import Correction, Responses, responses
from dftfs.analysis.shape.space import ShapeSpace
from dftfs.errors import DesignError, SolveError

_RESERVE = 1.02  # of the asked torque at contact, for rounding and the rod's error
_TRUST = 0.06  # how far a variable may go in one round: beyond, the linear constraints mislead
_SETTLED = 2e-4  # of the objective, from one round to the next
_PENALTY = 10.0  # per relative shortfall of a limit, above the multipliers met (below 3)
_FOUL = 10.0  # what a shape that cannot be built is worse by


@dataclass(frozen=True, kw_only=True)
class Aim:
    """What the shape must keep: stiffness, torque without contact and at yield, balance, width.

    Raises
    ------
    DesignError
        If a number is not positive.
    """

    stiffness_Nm_per_rad: float
    contact_free_torque_Nm: float
    largest_width_m: float
    torque_at_yield_Nm: float
    balance: float = 0.10

    def __post_init__(self) -> None:
        for entry in fields(self):
            if not getattr(self, entry.name) > 0:
                raise DesignError(
                    f"shape: {entry.name} = {getattr(self, entry.name)} must be positive"
                )

    @property
    def angle_rad(self) -> float:
        """Turn at the torque asked for."""
        return self.contact_free_torque_Nm / self.stiffness_Nm_per_rad


@dataclass(frozen=True, kw_only=True)
class Shape:
    """A shape by the rod model at the width that its stiffness asks for.

    broken : largest relative shortfall of a limit, 0 where all are kept.
    """

    variables: NDArray
    width_m: float
    torque_at_yield_Nm: float
    mass_kg: float
    contact_Nm: tuple[float, float]
    stress_per_torque: NDArray
    arc_m: NDArray
    broken: float

    @property
    def torque_per_mass(self) -> float:
        """Torque at yield per mass, in Nm/kg."""
        return self.torque_at_yield_Nm / self.mass_kg


def optimised(
    space: ShapeSpace,
    aim: Aim,
    *,
    correction: Correction | None = None,
    start: NDArray | None = None,
    rounds: int = 12,
    on_progress: Callable[[str], None] = lambda message: None,
) -> Shape:
    """Improve a shape in rounds of linearised programs within a trust region.

    Raises
    ------
    DesignError
        If the starting shape is no solid.
    SolveError
        If its rod cannot be solved.
    """
    x = space.origin if start is None else start
    here = responses(space, x, angle_rad=aim.angle_rad, correction=correction)
    best, reach = _merit(space, aim, here), _TRUST
    for number in range(rounds):
        target = _program(space, aim, here, x, reach)
        try:
            ahead = responses(space, target, angle_rad=aim.angle_rad, correction=correction)
            merit = _merit(space, aim, ahead)
        except (DesignError, SolveError):
            merit = best + _FOUL
        if merit < best:
            gain, x, here, best = best - merit, target, ahead, merit
            reach = min(1.6 * reach, 2 * _TRUST)
            shape = shape_of(space, aim, x, here)
            on_progress(
                f"round {number + 1}: {shape.torque_per_mass:.2f} Nm/kg, contact"
                f" {shape.contact_Nm[0]:.2f} and {shape.contact_Nm[1]:.2f} Nm,"
                f" limits kept within {100 * shape.broken:.2f} %"
            )
            if gain < _SETTLED:
                break
        else:
            reach /= 3
            if reach < 1e-4:
                break
    return shape_of(space, aim, x, here)


def shape_of(space: ShapeSpace, aim: Aim, variables: NDArray, found: Responses) -> Shape:
    """What the responses mean at the width that the stiffness asks for."""
    start = space.start
    share = aim.stiffness_Nm_per_rad / found.stiffness_Nm_per_rad
    stress = found.stress_per_torque / share
    contact = found.contact_Nm * share
    mass = found.area_m2 * start.width_m * share * start.material.density_kg_per_m3
    return Shape(
        variables=variables,
        width_m=start.width_m * share,
        torque_at_yield_Nm=float(start.material.yield_strength_Pa / np.max(stress)),
        mass_kg=float(mass),
        contact_Nm=(float(contact[0]), float(contact[1])),
        stress_per_torque=stress,
        arc_m=found.arc_m,
        broken=float(max(0.0, -np.min(_limits(space, aim, found)[0]))),
    )


def _limits(space: ShapeSpace, aim: Aim, found: Responses) -> tuple[NDArray, NDArray]:
    """Limits as numbers that must not be negative, with their derivatives (n, 6).

    The last one is of torque at yield; its derivative leaves out that of the stress bound.
    """
    yields = space.start.material.yield_strength_Pa
    log_k = found.stiffness_gradient / found.stiffness_Nm_per_rad
    log_t = found.contact_gradient / found.contact_Nm
    share = np.log(aim.stiffness_Nm_per_rad / found.stiffness_Nm_per_rad)
    torque = np.log(found.contact_Nm) + share
    asked = np.log(_RESERVE * aim.contact_free_torque_Nm)
    apart = np.log1p(0.7 * aim.balance)  # a reserve for what finite elements add
    values = [*(torque - asked), apart - torque[0] + torque[1], apart + torque[0] - torque[1]]
    values.append(np.log(aim.largest_width_m / space.start.width_m) - share)
    allowed = np.log(yields / aim.torque_at_yield_Nm / _RESERVE)
    values.append(allowed + share - np.log(np.max(found.stress_per_torque)))
    free = [log_t[:, 0] - log_k, log_t[:, 1] - log_k]
    even = log_t[:, 1] - log_t[:, 0]
    return np.array(values), np.column_stack([*free, even, -even, log_k, -log_k])


def _merit(space: ShapeSpace, aim: Aim, found: Responses) -> float:
    """Objective with an exact penalty for broken limits (a multiple above any multiplier)."""
    values, _ = _limits(space, aim, found)
    objective = np.log(found.area_m2) + np.log(np.max(found.stress_per_torque))
    return float(objective + _PENALTY * np.sum(np.maximum(-values, 0)))


def _program(space: ShapeSpace, aim: Aim, found: Responses, x: NDArray, reach: float) -> NDArray:
    """The linearised program within a trust region; slack keeps it solvable."""
    values, jacobian = _limits(space, aim, found)
    stress = np.log(found.stress_per_torque)
    stress_jacobian = found.stress_gradient / found.stress_per_torque
    keep = stress > np.max(stress) - 0.7  # places that one round could make the worst
    stress, stress_jacobian = stress[keep], stress_jacobian[:, keep]
    area = found.area_gradient / found.area_m2
    low, high = space.bounds
    count, extra = len(x), len(values)
    cost = np.concatenate([area, [1.0], np.full(extra, _PENALTY)])
    below = np.column_stack(
        [-stress_jacobian.T, np.ones(len(stress)), np.zeros((len(stress), extra))]
    )
    bound = np.zeros(extra)
    bound[-1] = -1.0  # torque at yield falls with the bound, counted from the largest stress
    values[-1] += np.max(stress)
    kept = np.column_stack([jacobian.T, bound, np.eye(extra)])
    ranges = [(max(low[j] - x[j], -reach), min(high[j] - x[j], reach)) for j in range(count)]
    ranges += [(None, None)] + [(0, None)] * extra
    solved = linprog(
        cost,
        A_ub=-np.vstack([below, kept]),
        b_ub=np.concatenate([-stress, values]),
        bounds=ranges,
        method="highs",
    )
    if solved.x is None:
        raise SolveError("shape: the linear program of a round has no solution")
    return x + solved.x[:count]
