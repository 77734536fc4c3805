"""What a controller is tuned or judged on, and what it costs there.

Costs: "rmse", "iae", "itae" of what the controller follows, "ise" (mean square times duration),
and "angle-force", the thesis' 4.40 with its scale made explicit:

    mean over time of sqrt( (e_x / x_scale)^2 + (e_f / f_scale)^2 )

where the thesis adds degrees and newtons (x_scale 1 degree, f_scale 1 N). To each
`effort_weight` times the mean change of the command per sample is added. A run that leaves the
range of numbers, or a loop without a finite cost, counts as infinite.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import rsea_core.control.tuning.figures_of_merit as merit
from rsea_core.control.closed_loop import require_samples, rows_per_sample, simulate_closed_loop
from rsea_core.control.laws.base import Controller
from rsea_core.effects.registry import SensorNoise
from rsea_core.engines.fixed_step.layout import CHANNELS
from rsea_core.errors import InputError, RseaError
from rsea_core.machine.inputs import Load
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.simulation.batch import BatchResult, run_batch
from rsea_core.simulation.reference import AngleReference, Reference
from rsea_core.simulation.trajectory import Trajectory

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
    least_modulus_margin : float
        Distance from -1 that a loop must keep to be tuned to or ranked, the inverse of the largest
        sensitivity; by its describing function the phase margin that it implies, 2 asin(m / 2).
    step_s : float or None
        Longest step of the fixed-step engine; None: what the fastest mode allows.

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
    step_s: float | None = None
    least_modulus_margin: float = 0.0

    def __post_init__(self):
        if self.cost not in COSTS:
            raise InputError(f"cost = {self.cost!r} must be one of {', '.join(COSTS)}")
        if self.cost == "angle-force" and self.reference.unit != "rad":
            raise InputError('cost = "angle-force" needs a reference in rad, not in Nm')
        if not self.loads:
            raise InputError("a task needs a load")
        if not 0.0 <= self.from_s < self.duration_s:
            raise InputError(
                f"from_s = {self.from_s:g} must be at least 0 and below duration_s ="
                f" {self.duration_s:g}"
            )
        if not 0.0 <= self.least_modulus_margin < 1.0:
            raise InputError(
                f"least_modulus_margin = {self.least_modulus_margin:g} must be in 0..1"
            )
        if not (self.effort_weight >= 0.0 and self.angle_scale_rad > 0.0 < self.force_scale_N):
            raise InputError("effort_weight must not be negative, scales must be above 0")


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
    require_samples(first, task.reference, task.duration_s)
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
        step_s=task.step_s,
        with_rows=with_rows,
        failures="nan",
    )


def costs_of(task: Task, controllers: Sequence[Controller]) -> NDArray:
    """(controllers,) array of costs; infinite where a loop fails."""
    return costs_and_engine(task, controllers)[0]


def squares_of(task: Task, controllers: Sequence[Controller]) -> tuple[NDArray, NDArray, NDArray]:
    """Costs (n,), and errors (n, m) and weights (n, m) whose product is the gradient of the cost.

    With noise every controller runs by itself, under the same draw.
    """
    parts = []
    for load in task.loads:
        groups = [[c] for c in controllers] if any(task.noise) else [list(controllers)]
        ran = [run_all(task, group, load, with_rows=True) for group in groups]
        rows = np.concatenate([each.rows for each in ran])
        failed = np.concatenate([each.failed for each in ran])
        parts.append(_squares(task, rows, failed, controllers[0].sample_time_s))
    costs = sum(part[0] for part in parts) / len(parts)
    errors = np.concatenate([part[1] for part in parts], axis=1)
    weights = np.concatenate([part[2] for part in parts], axis=1) / len(parts)
    return np.where(np.isfinite(costs), costs, np.inf), errors, weights


LEAST_ERROR = 1e-2  # of the rms, below which a magnitude counts as a square


def _squares(
    task: Task, rows: NDArray, failed: NDArray, period_s: float
) -> tuple[NDArray, NDArray, NDArray]:
    """Of one load: costs, errors, weights."""
    time = np.linspace(0.0, task.duration_s, rows.shape[1])
    first = int(np.searchsorted(time, task.from_s - 1e-9))
    time, judged = time[first:], rows[:, first:]
    span, n = task.duration_s - task.from_s, time.size
    wanted = task.reference.sample(time)[:, 0]
    error = judged[:, :, CHANNELS.index(FOLLOWED[task.reference.unit])] - wanted
    ones = np.ones(n)
    if task.cost in ("rmse", "ise"):
        mean = (error**2).mean(axis=1)
        costs = np.sqrt(mean) if task.cost == "rmse" else mean * span
        factor = 1.0 / np.maximum(costs, 1e-300) if task.cost == "rmse" else 2.0 * span
        weights = np.outer(np.broadcast_to(factor, len(rows)), ones) / n
    elif task.cost in ("iae", "itae"):
        each = ones * span / n if task.cost == "iae" else (time - time[0]) * span / n
        costs, weights = np.abs(error) @ each, each / _at_least(error)
    else:
        force = task.force_per_torque_per_m * judged[:, :, CHANNELS.index("torque_Nm")]
        error = np.hstack(
            (error / task.angle_scale_rad, (force - task.force_N) / task.force_scale_N)
        )
        both = np.hypot(error[:, :n], error[:, n:])
        costs, weights = both.mean(axis=1), np.tile(1.0 / (n * _at_least(both)), 2)
    if task.effort_weight > 0.0:
        change, each = np.diff(judged[:, :, -1], axis=1), task.effort_weight * period_s / span
        costs = costs + each * np.abs(change).sum(axis=1)
        error, weights = np.hstack((error, change)), np.hstack((weights, each / _at_least(change)))
    return np.where(failed, np.inf, costs), error, weights


def _at_least(errors: NDArray) -> NDArray:
    rms = np.sqrt((errors**2).mean(axis=1, keepdims=True))
    return np.maximum(np.abs(errors), np.maximum(LEAST_ERROR * rms, 1e-300))


def costs_and_engine(task: Task, controllers: Sequence[Controller]) -> tuple[NDArray, str]:
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


READ = ("motor_angle_rad", "load_angle_rad", "current_A")


def precise_run(
    task: Task, controller: Controller, load: Load, model: ActuatorModel | None = None
) -> Trajectory:
    """One run of the task on the engine that locates every event, with the task's noise.

    Raises
    ------
    RseaError
        As `simulate_closed_loop`.
    """
    model = model or task.model
    noises = tuple(
        SensorNoise(column=column, standard_deviation=sd, seed=float(task.noise_seed + j))
        for j, (column, sd) in enumerate(zip(READ, task.noise, strict=True))
        if sd > 0.0
    )
    return simulate_closed_loop(
        replace(model, terms=(*model.terms, *noises)),
        controller,
        task.reference,
        load,
        duration_s=task.duration_s,
        refuse_unstable=False,
        known_model=task.known_model or task.model,
    )


def precise_cost(task: Task, controller: Controller) -> float:
    """The cost by `precise_run`, infinite where a run fails."""
    total = 0.0
    for load in task.loads:
        try:
            ran = precise_run(task, controller, load)
        except RseaError:
            return np.inf
        total += _cost_of_run(task, controller, ran)
    total /= len(task.loads)
    return total if np.isfinite(total) else np.inf


def _cost_of_run(task: Task, controller: Controller, ran: Trajectory) -> float:
    rows = ran.time_s >= task.from_s
    time, wanted = ran.time_s[rows], task.reference.sample(ran.time_s[rows])[:, 0]
    response = getattr(ran, FOLLOWED[task.reference.unit])[rows]
    if task.cost == "angle-force":
        force = task.force_per_torque_per_m * ran.torque_Nm[rows] - task.force_N
        angle = (response - wanted) / task.angle_scale_rad
        found = float(np.hypot(angle, force / task.force_scale_N).mean())
    else:
        found = getattr(merit.following(time, wanted, response), task.cost)
    if task.effort_weight > 0.0:
        samples = (task.duration_s - task.from_s) / controller.sample_time_s
        change = np.abs(np.diff(ran.command[rows])).sum() / samples
        found += task.effort_weight * float(change)
    return found
