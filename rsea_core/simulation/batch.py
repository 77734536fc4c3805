"""Thousands of closed-loop runs by the fast engine, judged while they run.

    result = run_batch(
        model, compiled.function, parameters, compiled.state,
        time_s=time, reference=reference.sample(time), command_name="duty", load=load,
    )
    best = result.metric("rmse").argmin()

Runs are shared out to threads in pieces and each writes its own rows, with its own random
numbers, so that results are the same to the bit on any number of threads.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

import rsea_core.engines.fixed_step.closed_loop as loop
import rsea_core.engines.fixed_step.rows as rows
from rsea_core.effects.sensor_reading import SCALE, controller_sensors
from rsea_core.engines.fixed_step.closed_loop import METRICS
from rsea_core.engines.fixed_step.kernel import engine
from rsea_core.engines.fixed_step.layout import CHANNELS, DONE, N_CHANNELS, N_STEP_STATES
from rsea_core.engines.fixed_step.packed_models import (
    Grid,
    Numbers,
    model_numbers,
    packed_models,
)
from rsea_core.errors import InputError, SimulationError
from rsea_core.machine.inputs import Load, checked_times
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.numeric.arrays import read_only
from rsea_core.numeric.threads import share_out


@dataclass(frozen=True, kw_only=True)
class BatchResult:
    """What a batch found; arrays are read-only.

    Attributes
    ----------
    metrics : (runs, len(METRICS)) array
        Over the rows from `from_s` on. In the unit of what is followed: rmse, peak_error,
        mean_absolute_error, time_weighted_error (ITAE, times s), steady_state_error (mean of the
        last 20 %). Of the change from the first judged row to the last reference, NaN where that
        does not hold for the last 20 %: overshoot_percent and settling_s (into 2 %, NaN if
        outside at the end). In the command's unit: command_rms, command_peak, command_variation
        (sum of changes). limited_share (of the rows in which the command was limited),
        current_rms_A, current_peak_A, motor_speed_peak_rad_per_s.
    failed : (runs,) bool array
        Runs whose states left the range of numbers; their metrics are NaN.
    rows : (runs, n, 8) array or None
        `layout.CHANNELS` and the command, where they were asked for.
    """

    metrics: NDArray
    failed: NDArray
    rows: NDArray | None

    def metric(self, name: str) -> NDArray:
        """One column of the metrics by name, (runs,) array.

        Raises
        ------
        InputError
            If there is no such metric.
        """
        if name not in METRICS:
            raise InputError(f"metric {name!r} is not one of {', '.join(METRICS)}")
        return self.metrics[:, METRICS.index(name)]


def run_batch(
    models: ActuatorModel | Numbers | Sequence[ActuatorModel | Numbers],
    controller,
    parameters: ArrayLike,
    state: ArrayLike,
    *,
    time_s: ArrayLike,
    reference: ArrayLike,
    command_name: str,
    load: Load,
    follow: str = "torque_Nm",
    rows_per_sample: int = 1,
    delay_samples: int = 0,
    command_limit: float = np.inf,
    from_s: float = 0.0,
    noise: tuple[float, float, float] = (0.0, 0.0, 0.0),
    seed: int = 0,
    initial_angles_rad: tuple[float, float] = (0.0, 0.0),
    step_s: float | None = None,
    with_rows: bool = False,
    failures: str = "raise",
) -> BatchResult:
    """Run a compiled controller with many parameters, references or models, in parallel.

    Parameters
    ----------
    models : one model for all runs, or one for each
    controller : compiled function of the signature `kernel.CONTROLLER`
    parameters : (runs, p) array
    state : (s,) or (runs, s) array
        The controller's state at the start.
    time_s : (n,) array
    reference : (n, 3) or (runs, n, 3) array
        What the controller follows, with its first two derivatives.
    follow : str
        The column of `layout.CHANNELS` that the reference belongs to and metrics judge.
    rows_per_sample : int
        Rows between two actions of the controller.
    delay_samples : int
        0, or 1 where a command acts one sample after its readings.
    noise : (float, float, float)
        Standard deviations of the readings of motor angle, load angle and current, before they
        are quantised in the rig's encoder counts; beside what the models' sensor terms do.
    seed : int
        Run j draws its noise from seed + j.
    failures : str
        "raise", or "nan": a run whose states leave the range of numbers is marked in `failed`.

    Raises
    ------
    InputError
        If shapes do not agree or a value is out of range.
    RigError, TermError
        As `ActuatorModel.plant` and `ActuatorModel.effects`.
    SimulationError
        Naming the first run that failed, unless failures = "nan".
    """
    time = checked_times(time_s)
    parameters = np.array(parameters, dtype=float, ndmin=2)
    count, n = len(parameters), time.size
    if load.kind == "imposed":
        raise InputError('a closed loop with the load "imposed" needs its motion: use "locked"')
    if follow not in CHANNELS:
        raise InputError(f"follow = {follow!r} is not one of {', '.join(CHANNELS)}")
    if rows_per_sample < 1 or delay_samples not in (0, 1):
        raise InputError("rows_per_sample must be at least 1 and delay_samples 0 or 1")
    if failures not in ("raise", "nan"):
        raise InputError(f'failures = {failures!r} must be "raise" or "nan"')
    several = isinstance(models, Sequence) and not isinstance(models, Numbers)
    machines = list(models) if several else [models]
    packed = packed_models(
        [
            each if isinstance(each, Numbers) else model_numbers(each, command_name, load)
            for each in machines
        ]
    )
    if len(packed.plants) not in (1, count):
        raise InputError(f"{len(packed.plants)} models for {count} rows of parameters")
    references = _shaped("reference", reference, (n, 3), count)
    states = _repeated(np.asarray(state, dtype=float), count)
    first = int(np.searchsorted(time, from_s))
    if n - first < 2:
        raise InputError(f"from_s = {from_s:g} s leaves less than 2 rows of {time[-1]:g} s")
    at_rest = np.empty((len(packed.plants), N_STEP_STATES))
    rows.starts_at_rest(packed.plants, packed.fx, *map(float, initial_angles_rad), at_rest)
    starts = _repeated(at_rest, count)
    metrics, status = np.zeros((count, len(METRICS))), np.empty(count, np.int64)
    out = np.empty((count if with_rows else 0, n, N_CHANNELS + 1))
    steps, times = Grid(time, step_s).steps(packed), np.array(time)

    width, sensors = _sensors(machines, n)
    counts = [rows_per_sample, delay_samples, CHANNELS.index(follow), first, 0, width]
    limits = [command_limit, *noise]
    kernels, found = rows.Kernels(engine(False), engine(True)), loop.Found(metrics, out, status)
    loops = loop.Loops(parameters, states, references, starts, sensors, seed)

    def run(begin: int, end: int) -> None:
        loop.run_loops(
            kernels, packed, (times, steps), controller, loops, found,
            loop.scratch(n, counts, limits), (begin, end),
        )  # fmt: skip

    share_out(run, count)
    failed = status != DONE
    if failures == "raise" and failed.any():
        j = int(np.argmax(failed))
        raise SimulationError(
            f"run {j}: the states left the range of numbers at t = {time[status[j]]:.6g} s: is"
            " the loop unstable?"
        )
    return BatchResult(
        metrics=read_only(metrics),
        failed=read_only(failed),
        rows=read_only(out) if with_rows else None,
    )


def _sensors(machines: Sequence[ActuatorModel | Numbers], rows: int) -> tuple[int, NDArray]:
    """Numbers of each sensor before the controllers, and what `run_loops` takes of them."""
    terms = [each.terms if isinstance(each, ActuatorModel) else () for each in machines]
    found = [controller_sensors(own, rows) for own in terms]
    width = max((sensors.numbers.shape[1] for sensors in found if sensors.noise.size), default=0)
    if width == 0:
        return 0, np.zeros((0, 0))
    packed = np.zeros((len(found), 3 * (width + rows)))
    for line, sensors in zip(packed, found, strict=True):
        numbers = line[: 3 * width].reshape(3, width)
        numbers[:, SCALE] = 1.0
        if sensors.noise.size:
            numbers[:, : sensors.numbers.shape[1]] = sensors.numbers
            line[3 * width :] = sensors.noise.T.ravel()
    return width, packed


def _repeated(values: NDArray, count: int) -> NDArray:
    return np.array(np.broadcast_to(values, (count, values.shape[-1])), order="C")


def _shaped(name: str, values: ArrayLike, shape: tuple[int, ...], count: int) -> NDArray:
    array = np.array(values, dtype=float)
    if array.shape == shape:
        array = array[None]
    if array.shape not in ((1, *shape), (count, *shape)) or not np.all(np.isfinite(array)):
        raise InputError(
            f"{name} of shape {np.shape(values)} must be {shape} or {(count, *shape)}"
            " finite numbers"
        )
    return array
