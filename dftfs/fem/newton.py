"""Static equilibrium along a path of a scalar parameter.

After felupe's steps and hooks, but a failure names the parameter, the residual and a remedy.
"""

import math
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, closing
from dataclasses import dataclass

import numpy as np

from dftfs.errors import SolveError
from dftfs.fem.equilibrium import Equilibrium
from dftfs.fem.path_state import PathState
from dftfs.fem.problem import StaticProblem

__all__ = ["PathResult", "PathState", "StaticProblem", "linear_tangent", "solve_path"]

Guess = Callable[[PathState, float], np.ndarray | None]

_TOLERANCE, _ITERATIONS = 1e-9, 30
_SMALLEST_STEP = 1e-4  # of the way to the next target


@dataclass(frozen=True, kw_only=True, eq=False)
class PathResult:
    """States in the order they were reached, the first at t = 0 or the given start.

    Parameters
    ----------
    solver : str
        Name of the linear solver used.
    stopped : bool
        Whether the caller's ``step_callback`` ended the path before its last target.
    """

    problem: StaticProblem
    states: tuple[PathState, ...]
    solver: str
    stopped: bool

    def at(self, t: float) -> PathState:
        """The last state reached at t (a target or 0)."""
        for state in reversed(self.states):
            if math.isclose(state.t, t, rel_tol=1e-12, abs_tol=1e-15):
                return state
        reached = ", ".join(f"{s.t:.6g}" for s in self.states)
        raise SolveError(f"no state at t={t:.6g}; the path has {reached}")


def solve_path(
    problem: StaticProblem,
    targets: Sequence[float],
    *,
    start: Sequence[PathState] = (),
    max_step: float | None = None,
    initial_step: float | None = None,
    tolerance: float = _TOLERANCE,
    max_iterations: int = _ITERATIONS,
    solver: str = "auto",
    on_progress: Callable[[PathState], None] | None = None,
    step_callback: Callable[[PathState], bool] | None = None,
    guess: Guess | None = None,
) -> PathResult:
    """Follow the equilibrium from the undeformed body at t = 0 through the targets.

    Parameters
    ----------
    targets : sequence of float
        Values of t to hit exactly, in order; they may turn back.
    start : sequence of PathState
        States of the same mesh to continue from, oldest first; none starts at rest.
    max_step, initial_step : float or None
        Largest and first increment of t; None goes to each target in one increment. Increments
        grow and shrink with the work they need; one that fails is halved.
    tolerance : float
        On the last correction's energy norm over the solution's. Forces and stiffnesses are one
        to two digits less accurate, but no better than round-off lets a slender part be.
    solver : {"auto", "pardiso", "superlu"}
    on_progress : function of a state, or None
    step_callback : function of a state, or None
        Called after every converged increment; True ends the path there.
    guess : function of a state and t, or None
        A start at t from the last state, tried before the states' extrapolation, or None.

    Raises
    ------
    SolveError
        If an increment fails however small, or an argument is out of range.
    """
    goals = [float(t) for t in targets]
    _require_path(goals, max_step=max_step, initial_step=initial_step)
    largest = np.inf if max_step is None else max_step
    step = largest if initial_step is None else min(initial_step, largest)
    stopped = False
    with _equilibrium(problem, tolerance, max_iterations, solver) as equilibrium:
        states = list(start) or [equilibrium.start()]
        equilibrium.resume(states[-1])
        for goal in goals:
            while states[-1].t != goal and not stopped:
                state, step = _one_increment(equilibrium, states, goal, step, guess)
                if abs(state.t - states[-1].t) >= 0.999 * step:  # not cut short by the goal
                    step = min(_next_step(step, state), largest)
                states.append(state)
                if on_progress is not None:
                    on_progress(state)
                stopped = step_callback is not None and step_callback(state)
    return PathResult(
        problem=problem, states=tuple(states), solver=equilibrium.solver_name, stopped=stopped
    )


def _require_path(goals: Sequence[float], **steps: float | None) -> None:
    if not goals or not np.isfinite(goals).all():
        raise SolveError(f"targets must be finite numbers, at least one; got {goals}")
    for name, value in steps.items():
        if value is not None and not value > 0:
            raise SolveError(f"{name}={value} must be above 0")


def linear_tangent(problem: StaticProblem, *, solver: str = "auto") -> float:
    """dT/dt at t = 0: the small-displacement stiffness, from one linear solve."""
    with _equilibrium(problem, _TOLERANCE, _ITERATIONS, solver) as equilibrium:
        return equilibrium.start().drive_stiffness


def _equilibrium(
    problem: StaticProblem, tolerance: float, max_iterations: int, solver: str
) -> AbstractContextManager[Equilibrium]:
    return closing(
        Equilibrium(problem, tolerance=tolerance, max_iterations=max_iterations, solver=solver)
    )


def _one_increment(
    equilibrium: Equilibrium,
    states: list[PathState],
    goal: float,
    step: float,
    guess: Guess | None,
) -> tuple[PathState, float]:
    here = states[-1].t
    while True:
        t = goal if abs(goal - here) <= step else float(here + np.copysign(step, goal - here))
        end = equilibrium.advance(states, t, None if guess is None else guess(states[-1], t))
        if isinstance(end, PathState):
            return end, step
        step = abs(t - here) / 2
        if step < _SMALLEST_STEP * abs(goal - here):
            raise SolveError(
                f"no equilibrium beyond t={here:.6g} towards {goal:.6g}: {end.reason}"
                f" (residual {end.residual:.2g} of the reactions, at t={t:.6g});"
                " a finer mesh, a smaller target or a check of the supports would help"
            )


def _next_step(step: float, state: PathState) -> float:
    if state.factorisations <= 3:
        return 2 * step
    return step if state.factorisations <= 6 else 0.7 * step
