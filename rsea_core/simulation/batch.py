"""Thousands of closed-loop runs, each judged by its figures.

    result = run_batch(
        model, compiled.function, parameters, compiled.state,
        time_s=time, reference=reference.sample(time), command_name="duty", load=load,
    )
    best = result.metric("rmse").argmin()

Runs are shared out to threads in pieces and each writes its own rows, with its own random
numbers, so that results are the same to the bit on any number of threads.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

import rsea_core.engines.fixed_step.closed_loop as loop
import rsea_core.engines.fixed_step.rows as rows
from rsea_core.effects.sensor_reading import SCALE, controller_sensors
from rsea_core.engines.fixed_step.closed_loop import METRICS
from rsea_core.engines.fixed_step.kernel import engine as fixed_step_engine
from rsea_core.engines.fixed_step.layout import DONE, N_CHANNELS, N_STEP_STATES
from rsea_core.engines.fixed_step.packed_models import Grid, Numbers, packed_models
from rsea_core.errors import InputError, SimulationError
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.numeric.arrays import read_only
from rsea_core.numeric.threads import share_out
from rsea_core.simulation.batch_exact import not_exact, run_exactly
from rsea_core.simulation.batch_runs import BatchResult, BatchRuns
from rsea_core.simulation.trajectory import FIXED_STEP, PIECEWISE_LINEAR

__all__ = ("METRICS", "BatchResult", "BatchRuns", "run_batch")


def run_batch(
    models: ActuatorModel | Numbers | Sequence[ActuatorModel | Numbers],
    controller,
    parameters: ArrayLike,
    state: ArrayLike,
    *,
    failures: str = "raise",
    engine: str | None = None,
    **given,
) -> BatchResult:
    """Run a compiled controller with many parameters, references or models, in parallel.

    Parameters
    ----------
    models : one model for all runs, or one for each
    controller, parameters, state, **given
        As `BatchRuns`; needed are time_s, reference, command_name and load.
    failures : str
        "raise", or "nan": a run whose states leave the range of numbers is marked in `failed`.
    engine : str or None
        "piecewise-linear": exact exponentials between events. "fixed-step": steps of second
        order. None: the first where every model is linear between events, else the second.

    Raises
    ------
    InputError
        If shapes do not agree or a value is out of range.
    RigError, TermError
        As `ActuatorModel.plant` and `ActuatorModel.effects`.
    SimulationError
        Naming the first run that failed, unless failures = "nan"; or if the engine asked for
        cannot run a model.
    """
    several = isinstance(models, Sequence) and not isinstance(models, Numbers)
    models = tuple(models) if several else (models,)
    runs = BatchRuns(
        models=models, controller=controller, parameters=parameters, state=state, **given
    )
    if failures not in ("raise", "nan"):
        raise InputError(f'failures = {failures!r} must be "raise" or "nan"')
    (metrics, failed_at, kept), reason = _ran(runs, engine)
    failed = failed_at >= 0
    if failures == "raise" and failed.any():
        j = int(np.argmax(failed))
        raise SimulationError(
            f"run {j}: the states left the range of numbers at t = {runs.time_s[failed_at[j]]:.6g}"
            " s: is the loop unstable?"
        )
    return BatchResult(
        metrics=read_only(metrics),
        failed=read_only(failed),
        rows=read_only(kept) if runs.with_rows else None,
        engine=PIECEWISE_LINEAR if reason is None else FIXED_STEP,
        engine_reason=reason,
    )


def _ran(runs: BatchRuns, engine: str | None):
    """What an engine found (see `_by_fixed_steps`), and why it was not the piecewise linear one."""
    if engine not in (None, PIECEWISE_LINEAR, FIXED_STEP):
        raise InputError(f"engine = {engine!r} must be {PIECEWISE_LINEAR!r} or {FIXED_STEP!r}")
    reason = "it was asked for" if engine == FIXED_STEP else not_exact(runs)
    found = run_exactly(runs) if reason is None else reason
    reason = found if isinstance(found, str) else None
    if reason is not None:
        if engine == PIECEWISE_LINEAR:
            raise SimulationError(f"the piecewise linear engine cannot run this: {reason}")
        found = _by_fixed_steps(runs)
    return found, reason


def _by_fixed_steps(runs: BatchRuns) -> tuple[NDArray, NDArray, NDArray]:
    """Metrics (runs, METRICS), the row where each failed or -1, and rows, by second-order steps."""
    count, n = runs.count, runs.time_s.size
    packed = packed_models(runs.machines)
    at_rest = np.empty((len(packed.plants), N_STEP_STATES))
    rows.starts_at_rest(packed.plants, packed.fx, *map(float, runs.initial_angles_rad), at_rest)
    starts = np.array(np.broadcast_to(at_rest, (count, N_STEP_STATES)), order="C")
    metrics, status = np.zeros((count, len(METRICS))), np.empty(count, np.int64)
    out = np.empty((count if runs.with_rows else 0, n, N_CHANNELS + 1))
    steps, times = Grid(runs.time_s, runs.step_s).steps(packed), np.array(runs.time_s)
    kernels = rows.Kernels(fixed_step_engine(False), fixed_step_engine(True))
    width, sensors = _sensors(runs.terms, n)
    counts = [runs.rows_per_sample, runs.delay_samples, runs.followed, runs.first, 0, width]
    limits, states = [runs.command_limit, *runs.noise], runs.state.copy()
    loops = loop.Loops(runs.parameters, states, runs.reference, starts, sensors, runs.seed)
    found = loop.Found(metrics, out, status)

    def run(begin: int, end: int) -> None:
        loop.run_loops(
            kernels, packed, (times, steps), runs.controller, loops, found,
            loop.scratch(n, counts, limits), (begin, end),
        )  # fmt: skip

    share_out(run, count)
    return metrics, np.where(status == DONE, -1, status), out


def _sensors(terms: Sequence[tuple], rows: int) -> tuple[int, NDArray]:
    """Numbers of each sensor before the controllers, and what `run_loops` takes of them."""
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
