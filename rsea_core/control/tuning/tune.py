"""Tuning of a controller on the batch simulator: which values, on which task, at which cost.

    task = Task(model=..., load=..., reference=..., duration_s=4.0)
    found = tune(task, PidTorque(), {"kp": (5.0, 150.0), "ki": (0.0, 80.0)}, seeds=(0, 1, 2))
    found.controller                       # the best one, ready for simulate_closed_loop

Every point is a controller of its own, compiled for what is known of the machine, and a whole
generation runs side by side, so that the result depends on the seed and on nothing else.

Costs: "rmse", "iae", "itae" of what the controller follows, "ise" (mean square times duration),
and "angle-force", the thesis' 4.40 with its scale made explicit:

    mean over time of sqrt( (e_x / x_scale)^2 + (e_f / f_scale)^2 )

where the thesis adds degrees and newtons (x_scale 1 degree, f_scale 1 N). To each
`effort_weight` times the mean change of the command per sample is added. A run that leaves the
range of numbers, or a loop without a finite cost, counts as infinite.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.control.closed_loop import rows_per_sample
from rsea_core.control.laws.base import Controller
from rsea_core.control.tuning.optimisers import Box, Search, Starts, search
from rsea_core.engines.fixed_step.layout import CHANNELS
from rsea_core.errors import InputError, RseaError
from rsea_core.machine.inputs import Load
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.simulation.batch import BatchResult, run_batch
from rsea_core.simulation.reference import AngleReference, Reference

COSTS = ("rmse", "ise", "iae", "itae", "angle-force")
FOLLOWED = {"Nm": "torque_Nm", "rad": "load_angle_rad"}


@dataclass(frozen=True, kw_only=True)
class Task:
    """What a controller is tuned or judged on.

    Attributes
    ----------
    model : ActuatorModel
        The machine that runs.
    known_model : ActuatorModel or None
        What the controllers are made for; None: the same.
    loads : tuple of Load
        The cost is the mean over them.
    reference : Reference or AngleReference
    duration_s, from_s : float
        Judged is from `from_s` on.
    cost : str
        One of COSTS.
    effort_weight : float
    force_N : float
        Force reference of "angle-force".
    force_per_torque_per_m : float
        Force = this times the torque.
    angle_scale_rad, force_scale_N : float
        What counts as an error of one.
    noise : (float, float, float)
        Of the readings of motor angle, load angle [rad] and current [A].
    noise_seed : int

    Raises
    ------
    InputError
        If a value is outside what it may be.
    """

    model: ActuatorModel
    known_model: ActuatorModel | None = None
    loads: tuple[Load, ...]
    reference: Reference | AngleReference
    duration_s: float
    from_s: float = 0.0
    cost: str = "rmse"
    effort_weight: float = 0.0
    force_N: float = 0.0
    force_per_torque_per_m: float = 4.0
    angle_scale_rad: float = np.radians(1.0)
    force_scale_N: float = 1.0
    noise: tuple[float, float, float] = (0.0, 0.0, 0.0)
    noise_seed: int = 0

    def __post_init__(self):
        if self.cost not in COSTS:
            raise InputError(f"cost = {self.cost!r} must be one of {', '.join(COSTS)}")
        if not self.loads:
            raise InputError("a task needs a load")
        if not 0.0 <= self.from_s < self.duration_s:
            raise InputError(
                f"from_s = {self.from_s:g} must be at least 0 and below duration_s ="
                f" {self.duration_s:g}"
            )
        if not (self.effort_weight >= 0.0 and self.angle_scale_rad > 0.0 < self.force_scale_N):
            raise InputError("effort_weight must not be negative, scales must be above 0")


@dataclass(frozen=True, kw_only=True)
class Tuned:
    """What tuning found.

    Attributes
    ----------
    controller : Controller
        The best one.
    starts : Starts
        One search for each seed.
    engine : str
        What ran the loops, see `BatchResult`.
    """

    controller: Controller
    starts: Starts
    engine: str


def run_all(
    task: Task,
    controllers: Sequence[Controller],
    load: Load,
    *,
    models: Sequence[ActuatorModel] | None = None,
    with_rows: bool = False,
) -> BatchResult:
    """Every controller on the task with one of its loads, side by side.

    Parameters
    ----------
    models : sequence of ActuatorModel or None
        A machine for each controller; None: the task's.

    Raises
    ------
    InputError
        If the controllers are of different kinds or sampling, or follow something else.
    RseaError
        As a controller's `compile`.
    """
    first = controllers[0]
    if task.reference.unit not in first.reference_name:
        raise InputError(
            f"{first.kind} follows {first.reference_name}, not a reference in {task.reference.unit}"
        )
    timing = {(type(c), c.sample_time_s, c.delay_samples) for c in controllers}
    if len(timing) > 1:
        raise InputError("controllers that run side by side must share kind, sample time and delay")
    known = task.known_model or task.model
    made = {id(c): c.compile(known, load) for c in controllers}
    compiled = [made[id(c)] for c in controllers]
    per_sample, row = rows_per_sample(first.sample_time_s, None)
    time = np.arange(round(task.duration_s / row) + 1) * row
    return run_batch(
        task.model if models is None else list(models),
        compiled[0].function,
        np.array([c.parameters for c in compiled]),
        np.array([c.state for c in compiled]),
        time_s=time,
        reference=task.reference.sample(time),
        command_name=compiled[0].command_name,
        load=load,
        follow=FOLLOWED[task.reference.unit],
        rows_per_sample=per_sample,
        delay_samples=first.delay_samples,
        command_limit=compiled[0].command_limit,
        from_s=task.from_s,
        noise=task.noise,
        seed=task.noise_seed,
        with_rows=with_rows,
        failures="nan",
    )


def costs_of(task: Task, controllers: Sequence[Controller]) -> NDArray:
    """(controllers,) array of costs; infinite where a loop fails."""
    return _costs_and_engine(task, controllers)[0]


def _costs_and_engine(task: Task, controllers: Sequence[Controller]) -> tuple[NDArray, str]:
    """Costs, and the engine that ran the loops with the last load."""
    total, engine = np.zeros(len(controllers)), ""
    for load in task.loads:
        result = run_all(task, controllers, load, with_rows=task.cost == "angle-force")
        found, engine = _cost(task, result), result.engine
        if task.effort_weight > 0.0:
            samples = (task.duration_s - task.from_s) / controllers[0].sample_time_s
            found = found + task.effort_weight * result.metric("command_variation") / samples
        total += np.where(result.failed | ~np.isfinite(found), np.inf, found)
    return total / len(task.loads), engine


def _cost(task: Task, result: BatchResult) -> NDArray:
    span = task.duration_s - task.from_s
    if task.cost == "rmse":
        return result.metric("rmse")
    if task.cost == "ise":
        return result.metric("rmse") ** 2 * span
    if task.cost == "iae":
        return result.metric("mean_absolute_error") * span
    if task.cost == "itae":
        return result.metric("time_weighted_error")
    rows = result.rows
    n = rows.shape[1]
    time = np.linspace(0.0, task.duration_s, n)
    judged = time >= task.from_s
    wanted = task.reference.sample(time)[:, 0]
    angle = rows[:, :, CHANNELS.index("load_angle_rad")] - wanted
    force = task.force_per_torque_per_m * rows[:, :, CHANNELS.index("torque_Nm")] - task.force_N
    both = np.hypot(angle / task.angle_scale_rad, force / task.force_scale_N)
    return both[:, judged].mean(axis=1)


def tune(
    task: Task,
    controller: Controller,
    bounds: Mapping[str, tuple[float, float]],
    *,
    method: str = "particle-swarm",
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
        Field names to lowest and highest value.
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
    _, engine = _costs_and_engine(task, [controller])  # what cannot run at all says so here

    def cost(points: NDArray) -> NDArray:
        made = [_with(controller, box.names, point) for point in points]
        usable = [c for c in made if c is not None]
        found = np.full(len(points), np.inf)
        if usable:
            found[[c is not None for c in made]] = costs_of(task, usable)
        return found

    searches = []
    for seed in seeds:
        one = (done or {}).get(seed)
        if one is None:
            one = search(
                cost, box, method=method, seed=seed, population=population, generations=generations
            )
            if on_search is not None:
                on_search(one)
        searches.append(one)
    starts = Starts(searches=tuple(searches))
    best = _with(controller, box.names, starts.best.best)
    return Tuned(controller=best or controller, starts=starts, engine=engine)


def _box(controller: Controller, bounds: Mapping[str, tuple[float, float]]) -> Box:
    for name in bounds:
        if not isinstance(getattr(controller, name, None), float):
            raise InputError(f"{controller.kind} has no number {name!r} to tune")
    return Box(
        names=tuple(bounds),
        low=np.array([b[0] for b in bounds.values()]),
        high=np.array([b[1] for b in bounds.values()]),
    )


def _with(controller: Controller, names: tuple[str, ...], values: NDArray) -> Controller | None:
    """The controller with other values, None where it refuses them."""
    try:
        return replace(controller, **dict(zip(names, map(float, values), strict=True)))
    except RseaError:
        return None
