"""One direction of the curve: up to the first contact of the coils, and beyond it with contact.

Up to the first contact the coils may pass through each other: one state too many is solved, so
that the zero of the gap is bracketed, and dropped. Contact continuation starts from the last
state before it.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dftfs.analysis.torsion.planar_guess import planar_guess
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.result import ContactOnset
from dftfs.errors import SolveError
from dftfs.fem.newton import PathResult, PathState, solve_path
from dftfs.fem.problem import StaticProblem

_BEYOND = 1.02  # one state past the expected contact, so that the gap's zero is bracketed
_FURTHER_STATES = 20
_GRAZED = 1.01  # of the first contact's deflection: the first state in contact
_AFTER = 1.05  # where the tangent beyond the knee is read: past the contact's smoothing
_GAP_GONE = 1e-4  # of the strip's thickness: the gap at the onset is less than this
_MOST_REFINEMENTS = 16  # solves for the first contact: first by interpolation, then by bisection
_INTERPOLATED = 4
_SAME_STATE = 0.01  # an evenly spaced state this near the first contact adds nothing
_ESTIMATE_STEP_RAD = 0.03
FARTHEST_RAD = 1.0  # where a direction ends if its coils have not touched


@dataclass(frozen=True, kw_only=True)
class ContactPath:
    """States of one direction without the state at rest, and the onset.

    Where there is an onset, state ``touch`` is the one there, interpolated between two
    equilibria; those after it are in contact. ``free`` are the last states before it. ``end``
    says why the path ends.
    """

    rest: PathState
    states: tuple[PathState, ...]
    clearance_m: tuple[float, ...]
    rest_clearance_m: float
    onset: ContactOnset | None
    solver: str
    free: tuple[PathState, ...]
    touch: int
    end: str


def estimated_onset(
    problem: TorsionProblem, static: StaticProblem, sign: float, solver: str
) -> float:
    """Where contact roughly is (FARTHEST_RAD if not before): wide steps, then the gap's zero."""
    gaps = [(0.0, problem.coil_gap.clearance().smallest_m)]

    def touched(state: PathState) -> bool:
        gaps.append((abs(state.t), _gap(problem, state)[0]))
        return gaps[-1][1] <= 0

    targets = sign * np.arange(_ESTIMATE_STEP_RAD, FARTHEST_RAD, _ESTIMATE_STEP_RAD)
    path = solve_path(static, targets, solver=solver, step_callback=touched)
    if not path.stopped:
        return FARTHEST_RAD
    deflection, gap = np.array(gaps[-4:]).T
    return float(np.interp(0.0, gap[::-1], deflection[::-1]))


def _gap(problem: TorsionProblem, state: PathState) -> tuple[float, NDArray]:
    planar = problem.on_sector(state.displacement_m)[:, :2]
    clearance = problem.coil_gap.clearance(planar)
    return clearance.smallest_m, clearance.at_m


def path_to_contact(
    problem: TorsionProblem,
    static: StaticProblem,
    sign: float,
    expected: float,
    count: int,
    extra: list[float],
    solver: str,
) -> ContactPath:
    """States up to the first contact, or up to FARTHEST_RAD.

    Contact is ``expected`` (rad, positive) in the direction of ``sign``; ``count`` evenly spaced
    states up to there and ``extra`` deflections (rad, positive) are kept. ``static`` is the
    problem without contact.

    Raises
    ------
    SolveError
        If no contact is found near where it was expected.
    """
    targets = _targets(sign, expected, count, extra)
    goals = {float(t) for t in targets}
    states: list[PathState] = []
    gaps: list[float] = []

    def keep(state: PathState) -> bool:
        if state.t in goals:
            states.append(state)
            gaps.append(_gap(problem, state)[0])
        return bool(gaps) and gaps[-1] <= 0

    guess = planar_guess(problem, [0.0, float(targets[0])], contact=False, solver=solver)
    path = solve_path(static, targets, solver=solver, step_callback=keep, guess=guess)
    rest, rest_gap = path.states[0], problem.coil_gap.clearance().smallest_m
    onset = None
    if path.stopped:
        touch = _touch(problem, static, path, [rest, *states], [rest_gap, *gaps])
        states[-1], gaps[-1] = touch, 0.0
        near = len(states) > 1 and abs(states[-2].t - touch.t) < _SAME_STATE * abs(touch.t)
        if near and states[-2].t not in {sign * d for d in extra}:
            del states[-2], gaps[-2]
        onset = _onset(problem, touch)
    elif expected < FARTHEST_RAD:
        raise SolveError(
            f"no contact near {sign * expected:+.4f} rad, where it was expected; the last gap is"
            f" {gaps[-1] * 1e3:.3f} mm at {states[-1].t:+.4f} rad"
        )
    return ContactPath(
        rest=rest,
        states=tuple(states),
        clearance_m=tuple(gaps),
        rest_clearance_m=rest_gap,
        onset=onset,
        solver=path.solver,
        free=path.states[-4:-1],
        touch=len(states) - 1,
        end="first contact of the coils" if onset else "no contact up to here",
    )


def _targets(sign: float, expected: float, count: int, extra: list[float]) -> NDArray:
    """Deflections to solve at, in order of size: as asked, and past the expected contact."""
    bounded = expected >= FARTHEST_RAD
    even = np.linspace(0, expected, count + 1)[1:]
    inside = [d for d in extra if d < expected * (1 if bounded else _BEYOND)]
    beyond = [] if bounded else [expected * (_BEYOND + 0.03 * k) for k in range(_FURTHER_STATES)]
    return sign * np.unique([*even, *inside, *beyond])


def _onset(problem: TorsionProblem, touch: PathState) -> ContactOnset:
    at = _gap(problem, touch)[1]
    return ContactOnset(
        deflection_rad=touch.t,
        torque_Nm=problem.copies * touch.drive_force,
        at_m=(float(at[0]), float(at[1])),
    )


def continued_in_contact(
    problem: TorsionProblem, path: ContactPath, end_rad: float, count: int, extra: list[float]
) -> ContactPath:
    """The path continued with contact to ``end_rad`` (signed), in ``count`` states or more.

    Where no equilibrium is found the path ends, with the reason in ``end``.
    """
    onset = path.onset
    sign = np.sign(end_rad)
    first = abs(onset.deflection_rad)
    even = np.linspace(first * _AFTER, abs(end_rad), max(count, 1))
    inside = [d for d in extra if first < d <= abs(end_rad)]
    goals = [float(t) for t in sign * np.unique([first * _GRAZED, *even, *inside])]
    states: list[PathState] = []

    def keep(state: PathState) -> bool:
        if state.t in goals:
            states.append(state)
        return False

    why = "the deflection asked for, coils in contact"
    static = problem.static_problem(contact=True)
    known = [path.free[-1].t, *goals[:2]]  # then two states in contact can be extrapolated
    guess = planar_guess(problem, known, contact=True, solver=path.solver)
    try:
        solve_path(
            static, goals, start=path.free, solver=path.solver, step_callback=keep, guess=guess
        )
    except SolveError as error:
        why = f"in contact, {error}"
    if not states:
        return replace(path, end=why)
    after = states[min(1, len(states) - 1)]
    knee = replace(
        onset,
        tangent_before_Nm_per_rad=problem.copies * path.states[path.touch].drive_stiffness,
        tangent_after_Nm_per_rad=problem.copies * after.drive_stiffness,
        penetration_m=max(state.touch.penetration_m for state in states),
    )
    return replace(
        path,
        states=(*path.states, *states),
        clearance_m=(*path.clearance_m, *(_gap(problem, state)[0] for state in states)),
        onset=knee,
        end=why,
    )


def _touch(
    problem: TorsionProblem,
    static: StaticProblem,
    path: PathResult,
    states: list[PathState],
    gaps: list[float],
) -> PathState:
    """The state at which the gap is gone: solved for, so that it does not depend on the steps.

    ``states`` and ``gaps`` end with the first state whose gap is negative.
    """
    known = sorted(zip(states, gaps), key=lambda pair: abs(pair[0].t))
    for number in range(_MOST_REFINEMENTS):
        last = next(k for k, (_, gap) in enumerate(known) if gap <= 0)
        here = known[max(0, last - 2) : last + 1]
        if number < _INTERPOLATED:
            zero = _zero([state for state, _ in here], [gap for _, gap in here])
        else:  # a gap with a kink, where other points of the edges become the nearest
            zero = (known[last - 1][0].t + known[last][0].t) / 2
        found = _between(known[last - 1][0], known[last][0], zero)
        if abs(zero - known[last - 1][0].t) < 1e-6 or abs(zero - known[last][0].t) < 1e-6:
            break
        free = [state for state in path.states if abs(state.t) < abs(zero)][-3:]
        solved = solve_path(static, [zero], start=free, solver=path.solver).states[-1]
        gap = _gap(problem, solved)[0]
        known = sorted([*known, (solved, gap)], key=lambda pair: abs(pair[0].t))
        found = solved
        if abs(gap) < _GAP_GONE * problem.design.spiral.thickness_m:
            break
    return found


def _zero(states: list[PathState], gaps: list[float]) -> float:
    """Deflection at which the gap vanishes: inverse quadratic interpolation, secant for two."""
    if len(states) == 2:
        first, last = states
        return float(first.t + (last.t - first.t) * gaps[0] / (gaps[0] - gaps[1]))
    (g0, g1, g2), (t0, t1, t2) = gaps[-3:], [s.t for s in states[-3:]]
    zero = (
        t0 * g1 * g2 / ((g0 - g1) * (g0 - g2))
        + t1 * g0 * g2 / ((g1 - g0) * (g1 - g2))
        + t2 * g0 * g1 / ((g2 - g0) * (g2 - g1))
    )
    if not min(t1, t2) <= zero <= max(t1, t2):
        zero = t1 + (t2 - t1) * g1 / (g1 - g2)
    return float(zero)


def _between(first: PathState, second: PathState, t: float) -> PathState:
    """The state at t between two, by the cubics through values and exact rates of both."""
    step = second.t - first.t
    s = (t - first.t) / step
    weights = (1 + 2 * s) * (1 - s) ** 2, s**2 * (3 - 2 * s), s * (1 - s) ** 2, s**2 * (s - 1)
    hermite_rates = 6 * s * (s - 1), 6 * s * (1 - s), (1 - s) * (1 - 3 * s), s * (3 * s - 2)

    def cubic(value: str, rate: str) -> object:
        w = weights
        values = w[0] * getattr(first, value) + w[1] * getattr(second, value)
        return values + step * (w[2] * getattr(first, rate) + w[3] * getattr(second, rate))

    stiffness = (
        hermite_rates[0] * first.drive_force + hermite_rates[1] * second.drive_force
    ) / step
    stiffness += (
        hermite_rates[2] * first.drive_stiffness + hermite_rates[3] * second.drive_stiffness
    )
    return replace(
        second,
        t=float(t),
        displacement_m=cubic("displacement_m", "rate_m"),
        drive_force=float(cubic("drive_force", "drive_stiffness")),
        drive_stiffness=float(stiffness),
        energy_J=float(cubic("energy_J", "drive_force")),
    )
