"""Derivatives of the innovations by the unknowns, exact also along what is nearly free.

A common factor of volts, resistance, inductance and back-EMF changes no reading at all; the
columns of the four, large each, must cancel along it. Differences of each column leave errors,
and errors of columns look like knowledge of what nothing tells. So the differences are taken
twice: along the unknowns, and again along the directions that the first ones find stiff and
free, where there is nothing left to cancel. Where play or cogging throw replays out, no
difference is good enough for that; there the factor is tried as a whole, and what the columns say
along it is taken out of them. (Steps that suit each direction: Dennis and Schnabel, Numerical
Methods for Unconstrained Optimization (1983), 5.6.)
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.sensor_scale import SensorScale
from rsea_core.identify.candidates.rig_parameters import held_jointly
from rsea_core.identify.fitting.least_squares import STEP, Fit, Fitter, robust, step_sizes
from rsea_core.identify.fitting.problem import Problem

SHORTEST = 1e-3  # share of a step that bounds must leave, or the first differences stand
FACTOR = 0.01  # change of the common factor that is tried
UNSEEN = 1e-2  # power of the change of innovations below which the factor is as good as not seen
SCALED = ("ohm", "J/K")  # units of laws' numbers that the factor scales
TORQUES = ("Nm", "Nm/rad", "Nms/rad", "kgm2")  # of numbers that a factor of all torques scales
SENSED = (SensorScale.effect, "torque_Nm")  # what would hide such a factor from the readings
LED = (SensorScale.effect, "current_A")  # what would hide one of the current
DRIVEN = ("terminal_resistance_ohm", "terminal_inductance_H", "torque_constant_Nm_per_A")
PER_AMPERE = {"ohm": -1.0, "J/K": 1.0, "A": 1.0}
"""How laws' numbers go with a factor of the current, by unit."""
ELECTRIC = (
    "supply_voltage_V",
    "terminal_resistance_ohm",
    "back_emf_constant_Vs_per_rad",
    "terminal_inductance_H",
)


@dataclass(frozen=True)
class Jacobian:
    """Innovations of each recording at a fit and how they change.

    Attributes
    ----------
    innovations : tuple of (blocks, channels) arrays
    weights : tuple of (blocks, channels) arrays
        Of their squares, from the robust fit.
    columns : tuple of (n, blocks, channels) arrays
        Derivatives by the unknowns.
    """

    innovations: tuple[NDArray, ...]
    weights: tuple[NDArray, ...]
    columns: tuple[NDArray, ...]


def jacobian_at(fitter: Fitter, fit: Fit) -> Jacobian:
    """Innovations and their derivatives at a fit, by central differences taken twice."""
    problem, x = fitter.problem, fit.x
    n = x.size
    count = sum(b.whitener.size for b in problem.fitted)
    msni = float(np.mean(fit.msni))
    sizes = np.full(n, STEP)
    if fit.hessian is not None and fit.hessian.shape == (n, n):
        sizes = step_sizes(fit.hessian, count, msni)
    here, weights, columns = _along(fitter, fit, np.diag(sizes))
    columns = [np.einsum("i,itc->itc", 1.0 / sizes, J) for J in columns]
    known = problem.prior(fit.hypothesis)[1]
    own = sum(np.einsum("itc,tc,itc->i", J, w, J) for J, w in zip(columns, weights, strict=True))
    scale = np.hypot(known, np.where(known > 0.0, 0.0, np.sqrt(own)))
    scale = np.where(scale > 0.0, scale, 1.0)
    hessian = sum(
        np.einsum("itc,tc,jtc->ij", J, w, J, optimize=True)
        for J, w in zip(columns, weights, strict=True)
    )
    stiffness, turned = np.linalg.eigh(hessian / np.outer(scale, scale))
    directions = (turned / scale[:, None]).T  # rows: directions, as long as priors are wide
    with np.errstate(over="ignore"):  # a direction that moves nothing: the longest step
        length = np.sqrt(count * max(msni, 1.0) / np.maximum(stiffness, 1e-300))
    length = np.minimum(length, STEP / np.max(np.abs(directions), axis=1))
    back = (turned * scale[:, None]).T  # of unknowns from coordinates along the directions
    first = [np.einsum("ki,itc->ktc", directions, J, optimize=True) for J in columns]
    _, _, again = _along(fitter, fit, directions * length[:, None], first, length)
    columns = [
        np.einsum("ki,ktc->itc", back, J / length[:, None, None], optimize=True) for J in again
    ]
    for direction in free_factors(fitter, fit):
        whole = _whole(fitter, fit, direction)
        columns = [
            _adding_to(J, direction, change) for J, change in zip(columns, whole, strict=True)
        ]
    return Jacobian(innovations=tuple(here), weights=tuple(weights), columns=tuple(columns))


def free_factors(fitter: Fitter, fit: Fit) -> list[NDArray]:
    """Changes of the unknowns (n,) by common factors that no reading shows."""
    directions = common_factor(fitter, fit), torque_factor(fitter, fit), current_factor(fitter, fit)
    return [direction for direction in directions if direction is not None]


def torque_factor(fitter: Fitter, fit: Fit) -> NDArray | None:
    """Change of the unknowns (n,) by a common factor of all torques, where nothing weighs them.

    Torque sensors do, unless their scale is free; known inertias, weights and contacts do.
    """
    return _unseen(fitter, fit, torque_direction(fitter.problem, fit))


def torque_direction(problem: Problem, fit: Fit) -> NDArray:
    """Change of the unknowns (n,) by a factor of all torques, seen or not."""
    direction = np.zeros(fit.x.size)
    for j, p in enumerate(problem.nominals):
        if p.key.endswith(("_Nm_per_A", "_kgm2", "_kg", "_Nm_per_rad", "_Nms_per_rad")):
            value = p.at(fit.x[j])
            # with what is held fixed together with it, or the whole would not move by the factor
            whole = value + held_jointly(problem.case.rig, p.key)
            direction[j] = FACTOR * (whole if p.additive else whole / value) / p.tolerance
    direction[len(problem.nominals) :] = _of_laws(problem, fit, dict.fromkeys(TORQUES, 1.0), SENSED)
    return direction


def current_factor(fitter: Fitter, fit: Fit) -> NDArray | None:
    """Change of the unknowns (n,) by a factor of the current, where its sensor's scale is free.

    A machine that takes less current by a factor, at the same volts and for the same torque, has
    more resistance, inductance and torque constant. A limit of the current that was met shows it.
    """
    if all((law.effect, law.sensor) != LED for law in fit.hypothesis.laws):
        return None
    return _unseen(fitter, fit, current_direction(fitter.problem, fit))


def current_direction(problem: Problem, fit: Fit) -> NDArray:
    """Change of the unknowns (n,) by a factor of the current, seen or not."""
    direction = np.zeros(fit.x.size)
    for j, p in enumerate(problem.nominals):
        if p.key in DRIVEN:
            direction[j] = -FACTOR / p.tolerance
    direction[len(problem.nominals) :] = _of_laws(problem, fit, PER_AMPERE, LED)
    return direction


def _of_laws(
    problem: Problem,
    fit: Fit,
    exponents: Mapping[str, float],
    sensed: tuple[str, str] | None = None,
) -> NDArray:
    """Change of the laws' unknowns by a factor: each by its unit's power of it, 0 for other units.

    Parameters
    ----------
    sensed : (effect, column) or None
        The reading's scale that goes against the factor.
    """
    found, at = [], len(problem.nominals)
    for law in fit.hypothesis.laws:
        for parameter in law.unknowns:
            if parameter.scale > 0.0:
                size = FACTOR * exponents.get(parameter.unit, 0.0)
                change = size / parameter.scale if parameter.log else size * fit.x[at]
                against = (law.effect, law.sensor) == sensed
                found.append(-FACTOR / parameter.scale if against else change)
                at += 1
    return np.array(found)


def common_factor(fitter: Fitter, fit: Fit) -> NDArray | None:
    """Change of the unknowns (n,) by a common factor of all that is electric.

    The heat that a winding holds goes with it, as its resistance makes the heat. None where the
    factor is not free, or where innovations change by more than is left of them.
    """
    problem = fitter.problem
    own = {p.key: j for j, p in enumerate(problem.nominals) if not p.additive}
    if not set(ELECTRIC[:3]) <= own.keys():
        return None
    direction = np.zeros(fit.x.size)
    for key in ELECTRIC:
        if key in own:
            direction[own[key]] = FACTOR / problem.nominals[own[key]].tolerance
    direction[len(problem.nominals) :] = _of_laws(problem, fit, dict.fromkeys(SCALED, 1.0))
    return _unseen(fitter, fit, direction)


def moved_along(problem: Problem, fit: Fit, direction: NDArray, times: float) -> NDArray:
    """Unknowns (n,) so many times a factor's way from a fit, by exactly that factor.

    Values that are no logarithms, or have others held fixed together with them, leave the straight
    line.
    """
    x = fit.x + times * direction
    for j, p in enumerate(problem.nominals):
        other = held_jointly(problem.case.rig, p.key)
        if direction[j] != 0.0 and other > 0.0 and not p.additive:
            value = p.at(fit.x[j])
            own = (value + other) * np.exp(times * FACTOR) - other
            x[j] = fit.x[j] + np.log(max(own / value, SHORTEST)) / p.tolerance
    at = len(problem.nominals)
    for law in fit.hypothesis.laws:
        for parameter in law.unknowns:
            if parameter.scale > 0.0:
                if direction[at] != 0.0 and not parameter.log:
                    x[at] = fit.x[at] * np.exp(times * direction[at] / fit.x[at])
                at += 1
    return x


def _unseen(fitter: Fitter, fit: Fit, direction: NDArray) -> NDArray | None:
    """The way if there is one and no innovation shows it."""
    problem = fitter.problem
    low, high = problem.bounds(fit.hypothesis)
    if not np.any(direction[: len(problem.nominals)]):
        return None
    if np.any((fit.x + direction > high) | (fit.x - direction < low)):
        return None
    moved = sum(float(np.sum(change**2)) for change in _whole(fitter, fit, direction))
    return direction if moved < UNSEEN * sum(b.whitener.size for b in problem.fitted) else None


def _whole(fitter: Fitter, fit: Fit, direction: NDArray) -> list[NDArray]:
    """Changes of the innovations (blocks, channels) over a way (n,) taken as a whole."""
    X = np.array([fit.x + direction, fit.x - direction])
    return [0.5 * (e[0] - e[1]) for e in fitter.problem.innovations(fit.hypothesis, X)]


def _adding_to(columns: NDArray, direction: NDArray, whole: NDArray) -> NDArray:
    """Columns (n, blocks, channels) that add along a way (n,) to a known whole change.

    What they say beyond it is error, laid on those that are large in it.
    """
    parts = columns * direction[:, None, None]
    excess = parts.sum(axis=0) - whole
    sizes = np.sum(parts**2, axis=(1, 2))
    if not sizes.sum() > 0.0:
        return columns
    share = np.divide(
        sizes / sizes.sum(), direction, out=np.zeros_like(direction), where=direction != 0.0
    )
    return columns - share[:, None, None] * excess


def _along(
    fitter: Fitter,
    fit: Fit,
    steps: NDArray,
    known: list[NDArray] | None = None,
    lengths: NDArray | None = None,
) -> tuple[list[NDArray], list[NDArray], list[NDArray]]:
    """Innovations, weights and changes over given steps (m, n), halves of central differences.

    Where bounds leave no room, or a replay fails, `known` derivatives times `lengths` stand.
    """
    problem, x = fitter.problem, fit.x
    low, high = problem.bounds(fit.hypothesis)
    m = len(steps)
    up, down = _room(x, steps, low, high), _room(x, -steps, low, high)
    X = np.vstack([x, *(x + up[:, None] * steps), *(x - down[:, None] * steps)])
    X = np.clip(X, low, high)
    _, _, found = fitter.evaluate(fit.hypothesis, X)
    here, weights, changes = [], [], []
    wide = up + down > SHORTEST
    for b, e in enumerate(found):
        change = (e[1 : m + 1] - e[m + 1 :]) / np.where(wide, up + down, 1.0)[:, None, None]
        lost = ~wide | ~np.all(np.isfinite(change), axis=(1, 2))
        change[lost] = 0.0 if known is None else known[b][lost] * lengths[lost, None, None]
        here.append(e[0])
        weights.append(np.ones_like(e[0]) if np.isinf(fitter.far) else robust(e[0], fitter.far)[1])
        changes.append(change)
    return here, weights, changes


def _room(x: NDArray, steps: NDArray, low: NDArray, high: NDArray) -> NDArray:
    """Shares (m,) of steps, at most 1, that stay within bounds."""
    ahead = np.where(steps > 0.0, high - x, x - low)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(steps == 0.0, 1.0, np.maximum(ahead, 0.0) / np.abs(steps))
    return np.minimum(share.min(axis=1), 1.0)
