"""Tuning of a controller on the batch simulator: which values, on which task, at which cost.

    task = Task(model=..., loads=(load,), reference=..., duration_s=4.0)
    found = tune(task, PidTorque(), {"kp": (5.0, 150.0), "ki": (0.0, 80.0)}, seeds=(0, 1, 2))
    found.controller                       # the best one, ready for simulate_closed_loop

Every point is a controller of its own, compiled for what is known of the machine, and a whole
generation runs side by side, so that the result depends on the seed and on nothing else. The
bounds grow until the optimum is inside (`grown_bounds`); a loop that is unstable at rest, or nearer
to -1 than the task allows, and one that swings on after a step have an infinite cost; the best
points of each search are judged again on the engine with located events, and the lowest of those
that may be ranked (`standing`) is taken.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.control.laws.base import Controller
from rsea_core.control.stability.describing_functions import harmonic_loop
from rsea_core.control.stability.margins import (
    STABLE_RADIUS,
    open_loop_response,
    pole_radius,
)
from rsea_core.control.tuning.grown_bounds import Accepts, AtBound, at_bounds, search_and_grow
from rsea_core.control.tuning.least_squares import Squares
from rsea_core.control.tuning.optimisers import DEFAULT, Starts
from rsea_core.control.tuning.search_record import LEADERS, Box, Search
from rsea_core.control.tuning.standing import Standing, fine_amplitudes, standing, swings_on
from rsea_core.control.tuning.tune_task import (
    COSTS,
    FOLLOWED,
    Task,
    costs_and_engine,
    costs_of,
    precise_cost,
    run_all,
    squares_of,
)
from rsea_core.errors import InputError, RseaError
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.simulation.reference import largest_amplitude

__all__ = ("COSTS", "FOLLOWED", "Task", "Tuned", "costs_of", "run_all", "tune")


@dataclass(frozen=True, kw_only=True)
class Tuned:
    """What tuning found.

    Attributes
    ----------
    controller : Controller
        The best one that may be ranked; where none may, the one of the lowest cost.
    starts : Starts
        One search for each seed.
    engine : str
        What ran the loops, see `BatchResult`.
    at_bounds : tuple of AtBound
        Its values that lie at a side of what was searched.
    standing : Standing
    fast_cost, precise_cost : float
        Of the controller, by the engine of the search and by the one that locates events.
    by_seed : tuple of Controller
        What each seed would have delivered: its best that may be ranked; seeds without one are
        left out.
    """

    controller: Controller
    starts: Starts
    engine: str
    at_bounds: tuple[AtBound, ...]
    standing: Standing
    fast_cost: float
    precise_cost: float
    by_seed: tuple[Controller, ...]


def tune(
    task: Task,
    controller: Controller,
    bounds: Mapping[str, tuple[float, float]],
    *,
    method: str = DEFAULT,
    seeds: Sequence[int] = (0,),
    population: int = 10,
    generations: int = 40,
    done: Mapping[int, Search] | None = None,
    on_search=None,
) -> Tuned:
    """Search the best values of some of a controller's fields.

    Parameters
    ----------
    bounds : mapping
        Field names to lowest and highest value, where the search begins.
    seeds : sequence of int
        One search for each; one alone says little.
    done : mapping or None
        Searches of an interrupted run by seed, which are not made again.
    on_search : callable or None
        Called with each finished search.

    Raises
    ------
    InputError
        If a bound names no number of the controller, or the method is unknown.
    RseaError
        If the controller cannot run on the task at all.
    """
    box = _box(controller, bounds)
    _, engine = costs_and_engine(task, [controller])  # what cannot run at all says so here

    def accepts(name: str, value: float) -> bool:
        return with_values(controller, (name,), np.array([value])) is not None

    def one_search(seed: int) -> Search:
        found = search_and_grow(
            TaskCost(task, controller, box.names),
            box,
            accepts,
            method=method,
            seed=seed,
            population=population,
            generations=generations,
        )
        if on_search is not None:
            on_search(found)
        return found

    known = done or {}
    starts = Starts(searches=tuple(known.get(s) or one_search(s) for s in seeds))
    return _chosen(task, controller, box.names, starts, accepts, engine)


class TaskCost:
    """Costs of points of a box: the values of a controller's fields on a task."""

    def __init__(self, task: Task, controller: Controller, names: tuple[str, ...]):
        self.task, self.controller, self.names = task, controller, names

    def __call__(self, points: NDArray) -> NDArray:
        """(n,) costs; infinite where a point is refused, its loop unstable, or swings on."""
        found, usable, tried, _ = self._usable(points)
        if usable:
            swings = swings_on(self.task, tried)
            found[usable] = np.where(swings, np.inf, costs_of(self.task, tried))
        return found

    def squares(self, points: NDArray) -> Squares:
        """The same costs with what they are made of, for `gauss_newton`."""
        costs, usable, tried, slack = self._usable(points)
        errors = weights = np.full((len(points), 1), np.nan)
        if usable:
            found, own, own_weights = squares_of(self.task, tried)
            costs[usable] = np.where(swings_on(self.task, tried), np.inf, found)
            errors, weights = np.full((2, len(points), own.shape[1]), np.nan)
            errors[usable], weights[usable] = own, own_weights
        return Squares(costs=costs, errors=errors, weights=weights, slack=slack)

    def _usable(self, points: NDArray) -> tuple[NDArray, list[int], list[Controller], NDArray]:
        """Infinite costs, which points may run, their controllers, and the margins of all."""
        made = [with_values(self.controller, self.names, point) for point in points]
        slack = np.array([-np.inf if c is None else _slack(self.task, c) for c in made])
        usable = [j for j, (c, s) in enumerate(zip(made, slack, strict=True)) if c and s > 0.0]
        return np.full(len(points), np.inf), usable, [made[j] for j in usable], slack


SEARCHED_Hz, SEARCHED, BETWEEN = 1.0, 14, 7  # frequencies of a describing function in a search


def _slack(task: Task, controller: Controller) -> float:
    """Distance from -1 beyond what the task asks; -inf if unstable, inf if none is asked.

    Of the loop at rest; of a fuzzy table also at the task's amplitude, where it has least damping
    beside its integral, and at two of the smallest, of those that `standing` judges.
    """
    if not controller.has_gain_at_rest:
        return np.inf
    known = task.known_model or task.model
    if any(pole_radius(known, controller, load) >= STABLE_RADIUS for load in task.loads):
        return -np.inf
    if task.least_modulus_margin == 0.0 or task.reference.unit != "Nm":
        return np.inf
    f = np.geomspace(0.1, 0.5 / controller.sample_time_s, 300)
    loops = (open_loop_response(known, controller, load, f) for load in task.loads)
    rest = min(float(np.abs(1.0 + loop).min()) for loop in loops) - task.least_modulus_margin
    if rest <= 0.0 or not controller.gain_varies:
        return rest
    for amplitude in (largest_amplitude(task.reference), *fine_amplitudes(task)[:3:2]):
        rest = min(rest, _distance(known, controller, task, amplitude) - task.least_modulus_margin)
        if rest <= 0.0:
            break
    return rest


def _distance(known: ActuatorModel, controller: Controller, task: Task, amplitude: float) -> float:
    """Smallest distance from -1 by the describing function: a coarse grid, then about its least."""
    own = {"load": task.loads[0], "amplitude": amplitude}
    f = np.geomspace(SEARCHED_Hz, 0.45 / controller.sample_time_s, SEARCHED)
    found = np.abs(1.0 + harmonic_loop(controller, known, frequencies_Hz=f, **own))
    j = int(found.argmin())
    near = np.geomspace(f[max(j - 1, 0)], f[min(j + 1, f.size - 1)], BETWEEN + 2)[1:-1]
    finer = np.abs(1.0 + harmonic_loop(controller, known, frequencies_Hz=near, **own))
    return float(min(found[j], finer.min()))


@dataclass(frozen=True, kw_only=True)
class _Judged:
    """A point of a search, judged with located events."""

    controller: Controller
    cost: float
    standing: Standing
    at_bounds: tuple[AtBound, ...]

    @property
    def is_ranked(self) -> bool:
        return self.standing.is_ranked and all(bound.is_physical for bound in self.at_bounds)


def _chosen(
    task: Task,
    controller: Controller,
    names: tuple[str, ...],
    starts: Starts,
    accepts: Accepts,
    engine: str,
) -> Tuned:
    """Of the best of each search the one of the lowest cost, those that may be ranked first."""
    found = []
    for own in starts.searches:
        points = [with_values(controller, names, point) for point in own.leaders[:LEADERS]]
        made = sorted(
            ((precise_cost(task, c), j, c) for j, c in enumerate(points) if c is not None),
            key=lambda entry: entry[:2],
        )
        found.append(_first(task, names, own, made or [(np.inf, 0, controller)], accepts))
    ranked = [each for each in found if each.is_ranked]
    best = min(ranked or found, key=lambda each: each.cost)
    return Tuned(
        controller=best.controller,
        starts=starts,
        engine=engine,
        at_bounds=best.at_bounds,
        standing=best.standing,
        fast_cost=float(costs_of(task, [best.controller])[0]),
        precise_cost=best.cost,
        by_seed=tuple(each.controller for each in ranked),
    )


def _first(
    task: Task,
    names: tuple[str, ...],
    own: Search,
    made: Sequence[tuple[float, int, Controller]],
    accepts: Accepts,
) -> _Judged:
    """The first of a search's points that may be ranked, else the first of all."""
    first = None
    box = Box(names=names, low=own.low, high=own.high)
    for cost, _, controller in made:
        point = np.array([getattr(controller, name) for name in names])
        judged = _Judged(
            controller=controller,
            cost=cost,
            standing=standing(task, controller),
            at_bounds=at_bounds(point, box, accepts),
        )
        first = first or judged
        if judged.is_ranked:
            return judged
    return first


def _box(controller: Controller, bounds: Mapping[str, tuple[float, float]]) -> Box:
    for name in bounds:
        if not isinstance(getattr(controller, name, None), float):
            raise InputError(f"{controller.kind} has no number {name!r} to tune")
    return Box(
        names=tuple(bounds),
        low=np.array([b[0] for b in bounds.values()]),
        high=np.array([b[1] for b in bounds.values()]),
    )


def with_values(
    controller: Controller, names: tuple[str, ...], values: NDArray
) -> Controller | None:
    """The controller with other values, None where it refuses them."""
    try:
        return replace(controller, **dict(zip(names, map(float, values), strict=True)))
    except RseaError:
        return None
