"""Closed loops by the fast engine, judged while they run; compiled."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

import rsea_core.kernel as k
import rsea_core.step_laws as s
import rsea_core.step_parts as p
import rsea_core.step_rows as rows
from rsea_core.compiled import SOURCE_VERSION
from rsea_core.stepping import DONE

METRICS = (
    "rmse",
    "peak_error",
    "mean_absolute_error",
    "time_weighted_error",
    "overshoot_percent",
    "settling_s",
    "steady_state_error",
    "command_rms",
    "command_peak",
    "command_variation",
    "limited_share",
    "current_rms_A",
    "current_peak_A",
    "motor_speed_peak_rad_per_s",
)
N_METRICS = len(METRICS)
SETTLING_BAND = 0.02  # of the reference's change, as `step_metrics`
LAST_SHARE = 0.2  # of the rows, for the steady state


@njit(error_model="numpy")
def _quantised(angle, count):
    return np.floor(angle / count) * count if count > 0.0 else angle


@njit(error_model="numpy")
def _signals(plant, y, torque, reference, noise, signals):
    """What the controller is given; `noise` are standard deviations of what it reads."""
    for m in range(3):
        signals[k.REFERENCE + m] = reference[m]
    motor, load, current = y[s.WHEEL] * plant.gear_ratio, y[s.LOAD], y[s.CURRENT]
    signals[k.TRUE_MOTOR_ANGLE], signals[k.TRUE_LOAD_ANGLE] = motor, load
    signals[k.TRUE_TORQUE] = torque
    signals[k.TRUE_MOTOR_VELOCITY] = y[s.WHEEL_SPEED] * plant.gear_ratio
    signals[k.TRUE_LOAD_VELOCITY] = y[s.LOAD_SPEED]
    if noise[0] > 0.0:
        motor += np.random.normal(0.0, noise[0])
    if noise[1] > 0.0:
        load += np.random.normal(0.0, noise[1])
    if noise[2] > 0.0:
        current += np.random.normal(0.0, noise[2])
    signals[k.READ_MOTOR_ANGLE] = _quantised(motor, plant.motor_count)
    signals[k.READ_LOAD_ANGLE] = _quantised(load, plant.load_count)
    signals[k.READ_CURRENT] = current


@njit(error_model="numpy")
def _judge(metrics, first, rows_left, height, final, row, time, value, wanted, told, before):
    """Add one row to the running metrics; `told` is (command, whether limited, current, speed)."""
    command, limited, current, speed = told
    error = wanted - value
    length = time[row + 1] - time[row] if row + 1 < time.size else 0.0
    metrics[0] += error * error
    metrics[1] = max(metrics[1], abs(error))
    metrics[2] += abs(error)
    metrics[3] += (time[row] - time[first]) * abs(error) * length
    if height != 0.0:
        metrics[4] = max(metrics[4], 100.0 * (value - final) / height)
        if abs(value - final) > SETTLING_BAND * abs(height):
            metrics[5] = (time[row + 1] - time[first]) if row + 1 < time.size else np.nan
    if row >= time.size - rows_left:
        metrics[6] += error / rows_left
    metrics[7] += command * command
    metrics[8] = max(metrics[8], abs(command))
    metrics[9] += abs(command - before) if row > first else 0.0
    metrics[10] += limited
    metrics[11] += current * current
    metrics[12] = max(metrics[12], abs(current))
    metrics[13] = max(metrics[13], abs(speed))


@njit(error_model="numpy")
def _finish(metrics, count):
    for m in (0, 7, 11):
        metrics[m] = np.sqrt(metrics[m] / count)
    for m in (2, 10):
        metrics[m] /= count


class Scratch(NamedTuple):
    """Memory that one thread's loops work in, owned by the caller (see `step_rows.unowned`)."""

    on: NDArray
    carried: NDArray
    none: NDArray
    unkept: NDArray
    signals: NDArray
    readings: NDArray
    answer: NDArray
    waiting: NDArray
    acting: NDArray
    commands: NDArray


def scratch(n: int) -> Scratch:
    """Memory for loops of n rows."""
    return Scratch(
        on=np.zeros(p.N_SWITCHES, np.int64),
        carried=np.zeros(p.N_CARRIED),
        none=np.zeros(0),
        unkept=np.zeros((0, s.N_STEP_STATES)),
        signals=np.zeros(k.N_SIGNALS),
        readings=np.zeros((2, p.N_CHANNELS)),
        answer=np.zeros(k.N_COMMANDS),
        waiting=np.zeros(k.N_COMMANDS),
        acting=np.zeros(k.N_COMMANDS),
        commands=np.zeros(n),
    )


@njit(error_model="numpy")
def run_loop(
    plain, full, numbers, spring, fx, time, steps, controller, parameters, state, reference,
    per_sample, late, command_limit, followed, first, noise, y, metrics, out, on, carried, none,
    unkept, signals, readings, answer, waiting, acting, commands,
):  # fmt: skip
    """One closed loop; DONE or the row whose states are no numbers.

    followed : column of `step_parts.CHANNELS` that the reference belongs to
    late : 0 or 1 samples from reading to acting
    out : (rows, N_CHANNELS + 1) array to be filled, the command last, or one without rows
    on .. commands : as `Scratch`
    """
    plant = p.as_plant(numbers)
    rows.prepare(plant, spring, fx, y, on, carried)
    rows.on_the_given_motion(on, none, none, none, none, 0, y)
    n = time.size
    reading, before = readings[0], 0.0
    for m in range(k.N_COMMANDS):
        answer[m] = waiting[m] = acting[m] = 0.0
    height, final, rows_left = 0.0, reference[n - 1, 0], max(round(LAST_SHARE * (n - first)), 1)
    holds = True
    for row in range(n - rows_left, n):
        holds = holds and reference[row, 0] == final
    for row in range(n):
        before_it = max(row - 1, 0)
        status = rows.advance(
            plain, full, numbers, spring, fx, on, time, steps, commands, none, none, none,
            none, none, none, before_it, row, carried, y, readings, unkept,
        )  # fmt: skip
        if status != DONE or not np.isfinite(before):
            metrics[:] = np.nan
            for left in range(row, out.shape[0]):
                out[left, :] = np.nan
            return row
        reading = readings[row - before_it]
        value = reading[followed]
        if row % per_sample == 0:
            _signals(plant, y, reading[p.TORQUE], reference[row], noise, signals)
            controller(parameters, state, signals, answer)
            for m in range(k.N_COMMANDS):
                acting[m] = waiting[m] if late == 1 else answer[m]
                waiting[m] = answer[m]
            acting[k.COMMAND] = min(max(acting[k.COMMAND], -command_limit), command_limit)
        command = commands[row] = acting[k.COMMAND]
        if row >= first:
            height = final - value if row == first else height
            limited = 1.0 if acting[k.UNSATURATED] != command else 0.0
            told = (command, limited, reading[p.READ_CURRENT], reading[p.MOTOR_SPEED])
            _judge(
                metrics, first, rows_left, height, final, row, time, value, reference[row, 0],
                told, before,
            )  # fmt: skip
        before = command
        if out.shape[0] > 0:
            for m in range(p.N_CHANNELS):
                out[row, m] = reading[m]
            out[row, p.N_CHANNELS] = command
    _finish(metrics, n - first)
    if height == 0.0 or not holds:
        metrics[4] = metrics[5] = np.nan
    return DONE


def _cached(version):
    def run_loops(
        plain, full, plants, springs, ends, fx, time, steps, controller, parameters, states,
        references, per_sample, late, command_limit, followed, first, noise, seed, starts,
        metrics, out, status, work, begin, end,
    ):  # fmt: skip
        for j in range(begin, end):
            np.random.seed((seed + j) % 4294967296 + version * 0)
            model = j if plants.shape[0] > 1 else 0
            spring = springs[(ends[model - 1] if model > 0 else 0) : ends[model]]
            kept = out[j] if out.shape[0] > 0 else out[0:0].reshape(0, p.N_CHANNELS + 1)
            status[j] = run_loop(
                plain, full, rows.unowned(plants[model]), rows.unowned(spring),
                rows.unowned(fx[model]),
                rows.unowned(time), rows.unowned(steps), controller,
                rows.unowned(parameters[j]), rows.unowned(states[j]),
                rows.unowned(references[j if references.shape[0] > 1 else 0]), per_sample, late,
                command_limit, followed, first, noise, rows.unowned(starts[j]),
                rows.unowned(metrics[j]), rows.unowned(kept), rows.unowned(work.on),
                rows.unowned(work.carried), rows.unowned(work.none), rows.unowned(work.unkept),
                rows.unowned(work.signals), rows.unowned(work.readings),
                rows.unowned(work.answer), rows.unowned(work.waiting), rows.unowned(work.acting),
                rows.unowned(work.commands),
            )  # fmt: skip

    return njit(cache=True, nogil=True, error_model="numpy")(run_loops)


run_loops = _cached(SOURCE_VERSION)
"""Runs begin..end - 1 of a batch, each by its own parameters, state and random numbers."""
