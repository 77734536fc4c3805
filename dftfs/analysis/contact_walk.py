"""One direction of the curve: states up to the first contact of the coils, and where that is.

Until the engine's contact lands, the coils may pass through each other; the walk goes one state
too far, so that the zero of the gap is bracketed, and drops that state.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dftfs.analysis.results import ContactOnset, hermite
from dftfs.analysis.torsion_problem import TorsionProblem
from dftfs.errors import SolveError
from dftfs.fem.newton import PathState, solve_path
from dftfs.fem.problem import StaticProblem

_BEYOND = 1.02  # one state past the expected contact, so that the gap's zero is bracketed
_FIRST_LOOK_STEP_RAD = 0.03
_FARTHEST_RAD = 1.5


@dataclass(frozen=True, kw_only=True)
class Walk:
    """Contact-free states of one direction, without the state at rest, and the onset."""

    rest: PathState
    states: tuple[PathState, ...]
    clearance_m: tuple[float, ...]
    rest_clearance_m: float
    onset: ContactOnset
    solver: str


def first_look(problem: TorsionProblem, static: StaticProblem, sign: float, solver: str) -> float:
    """Where contact roughly is: wide steps until the gap has gone, then its zero."""
    gaps = [(0.0, problem.void.clearance().smallest_m)]

    def touched(state: PathState) -> bool:
        gaps.append((abs(state.t), _gap(problem, state)[0]))
        return gaps[-1][1] <= 0

    targets = sign * np.arange(_FIRST_LOOK_STEP_RAD, _FARTHEST_RAD, _FIRST_LOOK_STEP_RAD)
    path = solve_path(static, targets, solver=solver, step_callback=touched)
    if not path.stopped:
        raise SolveError(
            f"no contact of the coils up to {sign * _FARTHEST_RAD:+.2f} rad: the spring is softer"
            " than this analysis is made for; give the deflections explicitly"
        )
    deflection, gap = np.array(gaps[-4:]).T
    return float(np.interp(0.0, gap[::-1], deflection[::-1]))


def _gap(problem: TorsionProblem, state: PathState) -> tuple[float, NDArray]:
    planar = state.displacement_m[: len(problem.sector.nodes), :2]
    clearance = problem.void.clearance(planar)
    return clearance.smallest_m, clearance.at_m


def walk(
    problem: TorsionProblem,
    static: StaticProblem,
    sign: float,
    expected: float,
    count: int,
    extra: list[float],
    solver: str,
) -> Walk:
    even = np.linspace(0, expected, count + 1)[1:]
    inside = [d for d in extra if d < expected * _BEYOND]
    targets = sign * np.unique([*even, *inside, _BEYOND * expected])
    states: list[PathState] = []
    gaps: list[float] = []
    places: list[NDArray] = []
    goals = {float(t) for t in targets}

    def keep(state: PathState) -> bool:
        if state.t in goals:
            gap, at = _gap(problem, state)
            states.append(state)
            gaps.append(gap)
            places.append(at)
            return gap <= 0
        return False

    further = [sign * expected * (1.05 + 0.03 * k) for k in range(20)]
    goals |= {float(t) for t in further}
    path = solve_path(static, [*targets, *further], solver=solver, step_callback=keep)
    if not path.stopped:
        raise SolveError(
            f"no contact found near the expected {sign * expected:+.4f} rad; last gap"
            f" {gaps[-1] * 1e3:.3f} mm"
        )
    rest, rest_gap = path.states[0], problem.void.clearance().smallest_m
    return Walk(
        rest=rest,
        states=tuple(states[:-1]),
        clearance_m=tuple(gaps[:-1]),
        rest_clearance_m=rest_gap,
        onset=_onset(problem, [rest, *states], [rest_gap, *gaps], places[-1]),
        solver=path.solver,
    )


def _onset(
    problem: TorsionProblem, states: list[PathState], gaps: list[float], at: NDArray
) -> ContactOnset:
    """Zero of the gap by inverse quadratic interpolation; torque there by Hermite."""
    (g0, g1, g2), (t0, t1, t2) = gaps[-3:], [s.t for s in states[-3:]]
    zero = (
        t0 * g1 * g2 / ((g0 - g1) * (g0 - g2))
        + t1 * g0 * g2 / ((g1 - g0) * (g1 - g2))
        + t2 * g0 * g1 / ((g2 - g0) * (g2 - g1))
    )
    if not min(t1, t2) <= zero <= max(t1, t2):
        zero = t1 + (t2 - t1) * g1 / (g1 - g2)
    pair = sorted(states[-2:], key=lambda s: s.t)
    t, force, slope = (
        np.array([getattr(s, name) for s in pair])
        for name in ("t", "drive_force", "drive_stiffness")
    )
    torque = problem.copies * float(hermite(zero, t, force, slope))
    return ContactOnset(
        deflection_rad=float(zero), torque_Nm=torque, at_m=(float(at[0]), float(at[1]))
    )
