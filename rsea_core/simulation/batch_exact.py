"""Batches of closed loops by the piecewise linear engine."""

from itertools import groupby

import numpy as np
from numba import njit
from numpy.typing import NDArray

import rsea_core.engines.event_driven.states as k
import rsea_core.engines.fixed_step.closed_loop as cl
import rsea_core.engines.fixed_step.layout as p
import rsea_core.engines.piecewise_linear.events as pe
import rsea_core.engines.piecewise_linear.kernel as pk
import rsea_core.machine.plant as mp
from rsea_core.effects.sensor_reading import controller_sensors
from rsea_core.engines.fixed_step.packed_models import Numbers
from rsea_core.engines.piecewise_linear.machine import LinearMachine, obstacle_of, require_done
from rsea_core.engines.piecewise_linear.run import NOT_HERE, Runner, rows_of
from rsea_core.numeric.source_version import SOURCE_VERSION
from rsea_core.numeric.threads import share_out
from rsea_core.simulation.batch_runs import BatchRuns


def _plant(numbers: Numbers) -> mp.Plant:
    drive, structure, *rest = map(float, numbers.plant)
    return mp.Plant(int(drive), int(structure), *rest)


def not_exact(runs: BatchRuns) -> str | None:
    """Why the piecewise linear engine cannot run a batch, None where it can."""
    if runs.step_s is not None:
        return "a step length was given"
    for numbers in runs.machines:
        problem = obstacle_of(_plant(numbers), numbers.spring, numbers.fx)
        if problem is not None:
            return problem
    return None


def run_exactly(runs: BatchRuns) -> tuple[NDArray, NDArray, NDArray] | str:
    """Metrics (runs, METRICS), the row where each failed or -1, and the rows asked for.

    Or why the rows do not allow it.

    Raises
    ------
    SimulationError
        If a row has too many switches.
    """
    count, n = runs.count, runs.time_s.size
    machines = [LinearMachine.of(_plant(m), m.spring, m.fx) for m in runs.machines]
    metrics, status = np.full((count, cl.N_METRICS), np.nan), np.full((count, 2), pe.DONE)
    kept = np.zeros((count if runs.with_rows else 0, n, p.N_CHANNELS + 1))
    loop = np.zeros(cl.N_COUNTS, np.int64)
    loop[cl.FOLLOWED], loop[cl.FIRST] = runs.followed, runs.first

    def run(begin: int, end: int) -> None:
        of = [0] * runs.count if len(machines) == 1 else range(runs.count)
        for model, share in groupby(range(begin, end), key=lambda j: of[j]):
            machine, runner = machines[model], None
            rows = rows_of(
                machine,
                runs.time_s,
                runs.reference[0],
                controller_sensors(runs.terms[model], n),
                start_rad=runs.initial_angles_rad,
                rows_per_sample=runs.rows_per_sample,
                delay_samples=runs.delay_samples,
                command_limit=runs.command_limit,
                noise=runs.noise,
            )
            for j in share:
                runner = runner or Runner(machine, rows)
                followed = runs.reference[j if len(runs.reference) > 1 else 0]
                own = rows._replace(reference=followed, seed=runs.seed + j)
                status[j] = runner.run(own, runs.controller, runs.parameters[j], runs.state[j])
                if status[j, 0] == pe.DONE:
                    line = kept[j] if runs.with_rows else kept[:0].reshape(0, p.N_CHANNELS + 1)
                    ratio = machine.numbers.plant.gear_ratio
                    _judge(runner.log, followed, rows.time, ratio, loop.copy(), metrics[j], line)

    share_out(run, count)
    for code, reason in NOT_HERE.items():
        if np.any(status[:, 0] == code):
            return reason
    for code, row in status[(status[:, 0] != pe.DONE) & (status[:, 0] != pe.NOT_FINITE)]:
        require_done(int(code), float(runs.time_s[row]))
    return metrics, np.where(status[:, 0] == pe.DONE, -1, status[:, 1]), kept


def _cached(version):
    def judged(log, reference, time, ratio, loop, metrics, kept):
        read, limits = np.zeros(p.N_CHANNELS), np.zeros(cl.N_LIMITS)
        answers, first, before = np.zeros(cl.N_ANSWERS), loop[cl.FIRST] + version * 0, 0.0
        holds = cl.prepare(loop, limits, reference, answers, metrics)
        for row in range(time.size):
            read[p.MOTOR_ANGLE], read[p.LOAD_ANGLE] = log[k.TW, row] * ratio, log[k.TL, row]
            read[p.TORQUE], read[p.READ_CURRENT] = log[pk.LOG_TORQUE, row], log[k.IM, row]
            read[p.MOTOR_SPEED], read[p.LOAD_SPEED_READ] = log[k.WW, row] * ratio, log[k.WL, row]
            command = log[pk.LOG_COMMAND, row]
            if kept.shape[0] > 0:
                kept[row, : p.N_CHANNELS] = read
                kept[row, p.N_CHANNELS] = command
            if row >= first:
                value = read[loop[cl.FOLLOWED]]
                if row == first:
                    limits[cl.HEIGHT] = limits[cl.FINAL] - value
                limited = 1.0 if log[pk.LOG_UNSATURATED, row] != command else 0.0
                acted = cl.Acted(
                    command, before, limited, read[p.READ_CURRENT], read[p.MOTOR_SPEED]
                )
                wanted = reference[row, 0]
                cl.add_row(metrics, loop, limits, time, row, value, wanted, acted)
            before = command
        cl.finish(metrics, time.size - first, holds and limits[cl.HEIGHT] != 0.0)

    return njit(cache=True, nogil=True, error_model="numpy")(judged)


_judge = _cached(SOURCE_VERSION)
"""_judge(log, reference, time, ratio, loop, metrics, kept)

Compiled; fills the metrics of a run by its log, and its rows (n or 0, CHANNELS + 1).
"""
