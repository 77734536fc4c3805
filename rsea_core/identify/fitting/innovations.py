"""Replays turned into innovations as they are made, on threads.

A fit asks for thousands of replays and reads of each a few innovations per block. A model's rows
are kept only until they are whitened, in an array that stays in the processor's cache; pieces of
all recordings are shared out together, so that no thread waits at a recording's end.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

import rsea_core.engines.fixed_step.rows as rows
from rsea_core.effects.variant import RunConditions, TrialMachine
from rsea_core.engines.fixed_step.kernel import engine
from rsea_core.engines.fixed_step.layout import N_CHANNELS, Record
from rsea_core.engines.fixed_step.replay import CHANNELS, Replay
from rsea_core.identify.fitting.predictions import (
    Windows,
    numbers_of,
    reads_as_run,
    run_machines,
    starts_of,
)
from rsea_core.identify.fitting.predictions import readings_of as readings
from rsea_core.identify.smoothing.whitening import ErrorFilter, Whitener, average_run, whiten_one
from rsea_core.numeric.source_version import SOURCE_VERSION
from rsea_core.numeric.threads import share_out_all

BATCH = 32  # replays at once whose readings are made of rows: they are kept until then


@dataclass(frozen=True, kw_only=True)
class ReplayTask:
    """Machines on one recording.

    Attributes
    ----------
    measured : (rows, p) array
        Readings of the whitener's channels.
    """

    replay: Replay
    machines: Sequence[TrialMachine]
    where: RunConditions
    windows: Windows | None
    measured: NDArray
    whitener: Whitener


class Comparison(NamedTuple):
    """What compiled code needs to make innovations of runs.

    measured : (rows, p) array
    wanted : (p,) int array, columns of a run that are compared
    block : int, rows averaged to one
    at : (m,) int array, rows of `out` that the models' innovations go to
    out : (models, blocks, p) array
    """

    measured: NDArray
    wanted: NDArray
    block: int
    errors: ErrorFilter
    at: NDArray
    out: NDArray


def replay_innovations(tasks: Sequence[ReplayTask]) -> list[NDArray]:
    """Innovations (m, blocks, p) of each task, NaN where a replay failed."""
    found, works, lost = [], [], []
    for task in tasks:
        w, machines = task.whitener, task.machines
        out = np.empty((len(machines), w.blocks, len(w.channels)))
        found.append(out)
        plain = [j for j, d in enumerate(machines) if reads_as_run(d, w.channels)]
        made = [j for j in range(len(machines)) if j not in set(plain)]
        if made:
            out[made] = _of_readings(task, [machines[j] for j in made])
        if plain:
            numbers = numbers_of(few := [machines[j] for j in plain])
            starts, gone = starts_of(task.replay, numbers, few, task.where, task.windows)
            plan = task.replay.plan(numbers, task.windows and task.windows.rows, starts)
            works.append((_work(plan, task, np.array(plain), out), len(plain)))
            lost.append((out, np.array(plain)[gone]))
    share_out_all(works)
    for out, gone in lost:
        out[gone] = np.nan
    return found


def _work(plan, task: ReplayTask, at: NDArray, out: NDArray) -> Callable[[int, int], None]:
    """Work on models whose innovations go to rows `at` of `out`."""
    w, kernels = task.whitener, rows.Kernels(engine(False), engine(True))
    wanted = np.array([CHANNELS.index(name) for name in w.channels])
    comparison = Comparison(task.measured, wanted, w.block, w.filter, at, out)

    def run(begin: int, end: int) -> None:
        _replay_and_whiten(kernels, *plan, rows.no_controller, comparison, begin, end)

    return run


def _of_readings(task: ReplayTask, machines: Sequence[TrialMachine]) -> NDArray:
    """As `replay_innovations` of machines whose readings are more than columns of the run.

    Machines that differ in their sensors alone run once.
    """
    out = np.empty((len(machines), task.whitener.blocks, len(task.whitener.channels)))
    alike: dict[bytes, list[int]] = {}
    for j, d in enumerate(machines):
        alike.setdefault(d.machine, []).append(j)
    groups = list(alike.values())
    for first in range(0, len(groups), BATCH):
        few = groups[first : first + BATCH]
        runs = run_machines(task.replay, [machines[g[0]] for g in few], task.where, task.windows)
        left = []
        for run, group in zip(runs, few, strict=True):
            same = np.broadcast_to(run, (len(group), *run.shape))
            own = [machines[j] for j in group]
            left.append(readings(same, own, task.whitener.channels, task.where))
            np.subtract(task.measured, left[-1], out=left[-1])
        out[[j for group in few for j in group]] = task.whitener(np.concatenate(left))
    return out


def _cached(version):
    def _replay_and_whiten(kernels, models, columns, jobs, controller, comparison, begin, end):
        measured, wanted, block, errors, at, out = comparison
        run = np.empty((measured.shape[0] + version * 0, N_CHANNELS))
        states = np.empty((0, jobs.starts.shape[1]))
        each = jobs.rows.shape[0] // models.plants.shape[0]
        for j in range(begin, end):
            rows.run_jobs(
                kernels, models, columns, jobs, Record(run, states), controller, j * each,
                (j + 1) * each,
            )  # fmt: skip
            left = out[at[j]]
            average_run(measured, run, wanted, block, left)
            whiten_one(left, errors, left)

    return njit(cache=True, nogil=True, error_model="numpy")(_replay_and_whiten)


_replay_and_whiten = _cached(SOURCE_VERSION)
