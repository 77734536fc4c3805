"""Thousands of runs of the exact propagator: other plants, other gains, the same rows.

Every run is computed by itself, so the result is the same to the bit on any number of threads.
"""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import rsea_core.effects.layout as e
import rsea_core.engines.piecewise_linear.events as pe
import rsea_core.engines.piecewise_linear.kernel as pk
from rsea_core.engines.piecewise_linear.propagate import LinearMachine, require_done
from rsea_core.errors import InputError
from rsea_core.numeric.arrays import read_only

SHARE = 8  # runs of one machine that a thread takes at a time


@dataclass(frozen=True, kw_only=True)
class Batch:
    """What a batch of runs gave; (runs,) arrays, NaN where a run left the range of numbers.

    Attributes
    ----------
    rmse, peak_error : array
        Of reference less torque, in Nm, over the rows that are judged.
    command_rms, current_peak_A : array
    wheel_stuck_s : array
        Time in which dry friction held the wheel.
    torque_Nm : (runs, n) array or None
        Where it was asked for.
    """

    rmse_Nm: NDArray
    peak_error_Nm: NDArray
    command_rms: NDArray
    current_peak_A: NDArray
    wheel_stuck_s: NDArray
    torque_Nm: NDArray | None


def propagate_batch(
    machines: LinearMachine | Sequence[LinearMachine],
    *,
    time_s: NDArray,
    controller,
    parameters: NDArray,
    state: NDArray,
    reference: NDArray,
    rows_per_sample: int = 1,
    delay_samples: int = 0,
    command_limit: float = np.inf,
    initial_angles_rad: tuple[float, float] = (0.0, 0.0),
    judge_from_s: float = 0.0,
    keep_torque: bool = False,
    threads: int | None = None,
) -> Batch:
    """Run a compiled controller with every row of parameters, from rest.

    Parameters
    ----------
    machines : LinearMachine or sequence of them
        One for all runs, or one a run.
    parameters : (runs, p) array
    state : (s,) array
        Of the controller before its first sample, for every run.
    reference : (n, 3) array
    threads : int or None
        None: one for each processor.

    Raises
    ------
    InputError
        If the numbers of machines and parameter rows differ, or the rows are not even.
    SimulationError
        If a mode is too fast for the rows or a row has too many switches.
    """
    parameters = np.ascontiguousarray(np.atleast_2d(parameters), dtype=float)
    runs, rows = parameters.shape[0], time_s.size
    given = [machines] * runs if isinstance(machines, LinearMachine) else list(machines)
    if len(given) != runs:
        raise InputError(f"{len(given)} machines for {runs} rows of parameters: give one a run")
    time, reference = np.array(time_s, dtype=float), np.ascontiguousarray(reference, dtype=float)
    grid = pk.Grid(
        start_s=float(time[0]),
        row_s=float(time[-1] - time[0]) / (rows - 1),
        rows_per_sample=rows_per_sample,
        delay_samples=delay_samples,
        command_limit=float(command_limit),
    )
    first = int(np.searchsorted(time, judge_from_s - 1e-9))
    if not first < rows:
        raise InputError(f"judge_from_s = {judge_from_s:g} leaves no row to judge")
    found = np.full((runs, 5), np.nan)
    torque = np.full((runs, rows), np.nan) if keep_torque else None
    states = np.tile(np.asarray(state, dtype=float), (runs, 1))
    count = os.cpu_count() or 1 if threads is None else threads
    if count < 1:
        raise InputError(f"threads = {threads} must be at least 1")

    def work(share: range) -> None:
        log, here = np.empty((pk.N_LOG, rows)), slice(share.start, share.stop)
        machine = given[share.start]
        dry = bool(machine.effects[e.WHEEL_DRY] != 0.0)
        status, row = pk.run(
            machine.plant, machine.regions, machine.effects, controller, parameters[here],
            states[here], grid, time, reference, np.zeros(0), np.zeros(0),
            (initial_angles_rad[0] / machine.plant.gear_ratio, initial_angles_rad[1]),
            np.array((False, False, dry, False)), log, first, found[here],
            np.zeros((0, 0)) if torque is None else torque[here],
        )  # fmt: skip
        if status != pe.NOT_FINITE:
            require_done(status, float(time[row]))

    shares = _shares(given)
    if runs > 0:
        work(range(1))  # compiled before there are threads
        states[0] = state
    with ThreadPoolExecutor(count) as pool:
        list(pool.map(work, shares))
    columns = [read_only(np.ascontiguousarray(column)) for column in found.T]
    return Batch(
        rmse_Nm=columns[0],
        peak_error_Nm=columns[1],
        command_rms=columns[2],
        current_peak_A=columns[3],
        wheel_stuck_s=columns[4],
        torque_Nm=None if torque is None else read_only(torque),
    )


def _shares(machines: Sequence[LinearMachine]) -> list[range]:
    """Neighbouring runs of one machine, at most SHARE together."""
    shares, begin = [], 0
    for run in range(1, len(machines) + 1):
        last = run == len(machines)
        if last or machines[run] is not machines[begin] or run - begin == SHARE:
            shares.append(range(begin, run))
            begin = run
    return shares
