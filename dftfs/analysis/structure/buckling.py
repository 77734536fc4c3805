"""Does a turned spring stay in its plane? The lowest out-of-plane vibration along the path.

A wide strip bends in its plane; a strip lower than it is thick may tip over sideways first. The
tangent of the deflected spring, rim and hub clamped, is asked for its lowest out-of-plane
frequency: at zero the flat equilibrium has lost its stability. Negative pivots of the tangent
count the unstable modes (Sylvester's law of inertia).

Source: Bathe, Finite Element Procedures (1996), 6.8.2; Timoshenko & Gere, Theory of Elastic
Stability (1961), 6 (lateral buckling).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from dftfs.analysis.structure.linear_spring import OUT_OF_PLANE, WholeSpring
from dftfs.errors import DesignError
from dftfs.fem.linear_model import lowest_modes
from dftfs.fem.newton import solve_path

_MOST_NEARER = 8  # stable modes nearer to zero than an unstable one, at most
FARTHEST = 5.0  # times the last state: an extrapolated loss of stability beyond it is none


@dataclass(frozen=True, kw_only=True)
class StabilityState:
    """One deflection: the square of the lowest out-of-plane frequency, and unstable modes."""

    deflection_rad: float
    torque_Nm: float
    lowest_per_s2: float
    unstable: int

    @property
    def frequency_Hz(self) -> float | None:
        """None where the flat equilibrium is unstable."""
        if self.lowest_per_s2 <= 0:
            return None
        return float(np.sqrt(self.lowest_per_s2) / (2 * np.pi))


@dataclass(frozen=True, kw_only=True)
class Stability:
    """States of one direction, the first at rest.

    ``critical_rad`` is where the lowest square crosses zero: between two states, or, if
    ``extrapolated``, beyond the last one in a straight line through the last two; None where it
    does not within FARTHEST times the last deflection.
    """

    states: tuple[StabilityState, ...]
    critical_rad: float | None
    extrapolated: bool

    @property
    def stable(self) -> bool:
        """Whether every state is stable."""
        return all(state.unstable == 0 for state in self.states)


def stability(
    spring: WholeSpring, deflections_rad: Sequence[float], *, solver: str = "auto"
) -> Stability:
    """Follow one direction without contact and find the stability of every state.

    Parameters
    ----------
    deflections_rad : sequence of float
        Of one sign, moving away from 0; before the coils touch.

    Raises
    ------
    DesignError
        If the deflections are none, of two signs or do not grow.
    SolveError
        If an increment has no equilibrium.
    """
    goals = [float(d) for d in deflections_rad]
    if not goals or not np.all(np.diff(np.abs([0.0, *goals])) > 0) or np.ptp(np.sign(goals)):
        raise DesignError(f"deflections {goals} rad must grow from 0 in one direction")
    problem = spring.torsion
    path = solve_path(problem.static_problem(), goals, solver=solver)
    transform = spring.reduction(OUT_OF_PLANE).transform
    mass = (transform.T @ spring.mass @ transform).tocsr()
    states = []
    for state in (path.states[0], *(path.at(goal) for goal in goals)):
        tangent = spring.tangent(spring.spread(state.displacement_m))
        reduced = (transform.T @ tangent @ transform).tocsr()
        values, _, unstable = lowest_modes(reduced, mass, 1, solver=solver)
        for more in range(_MOST_NEARER):  # next to zero is not the lowest
            if np.count_nonzero(values < 0) >= unstable:
                break
            values, _, _ = lowest_modes(reduced, mass, unstable + more, solver=solver)
        lowest = values.min()
        states.append(
            StabilityState(
                deflection_rad=state.t,
                torque_Nm=problem.copies * state.drive_force,
                lowest_per_s2=float(lowest),
                unstable=unstable,
            )
        )
    critical, beyond = _zero(states)
    return Stability(states=tuple(states), critical_rad=critical, extrapolated=beyond)


def _zero(states: list[StabilityState]) -> tuple[float | None, bool]:
    for before, after in pairwise(states):
        if before.lowest_per_s2 > 0 >= after.lowest_per_s2:
            return _crossing(before, after), False
    if states[0].lowest_per_s2 <= 0:
        return 0.0, False
    found = _crossing(states[-2], states[-1])
    last = states[-1].deflection_rad
    if found is None or not 1 < found / last <= FARTHEST:
        return None, False
    return found, True


def _crossing(first: StabilityState, second: StabilityState) -> float | None:
    fall = first.lowest_per_s2 - second.lowest_per_s2
    if fall == 0:
        return None
    step = second.deflection_rad - first.deflection_rad
    return float(first.deflection_rad + step * first.lowest_per_s2 / fall)
