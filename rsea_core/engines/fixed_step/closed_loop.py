"""Closed loops by the fixed-step engine: reading, control, figures of merit; compiled.

`sample` is what a loop adds to a row of the kernel; `run_loops` runs many, each with its own
parameters, state and random numbers.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

import rsea_core.effects.sensor_reading as sensing
import rsea_core.engines.event_driven.states as k
import rsea_core.engines.fixed_step.layout as at
import rsea_core.engines.fixed_step.rows as rows
from rsea_core.numeric.source_version import SOURCE_VERSION

# the loop's counts: rows between two actions of the controller, samples (0 or 1) from reading to
# acting, place in `layout.CHANNELS` of what the reference belongs to, first row that counts, rows
# of the steady state, numbers of each sensor (0: the readings are the truth)
PER_SAMPLE, LATE, FOLLOWED, FIRST, ROWS_LEFT, WIDTH = range(6)
N_COUNTS = 6
# and the others: largest command, deviations of the readings of motor angle, load angle and
# current, last reference, change of the reference over the rows that count; with sensors their
# numbers, their noise by row, and by row what was true, its rates, and the errors of tables
COMMAND_LIMIT, NOISE, FINAL, HEIGHT = 0, 1, 4, 5
N_LIMITS = 6
# the controller's answer, then what waits for the next sample and what acts now
WAITING, ACTING, N_ANSWERS = k.N_COMMANDS, 2 * k.N_COMMANDS, 3 * k.N_COMMANDS
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
SETTLING_BAND = 0.02  # of the reference's change, as `step_response`
LAST_SHARE = 0.2  # of the rows, for the steady state
PER_ROW = 11  # numbers of sensors by row: noise and truth of three, rates of two, errors of three


class Loops(NamedTuple):
    """What differs from loop to loop of a batch."""

    parameters: NDArray  # (loops, p)
    states: NDArray  # (loops, s) of the controllers, overwritten
    references: NDArray  # (1 or loops, n, 3)
    starts: NDArray  # (loops, N_STEP_STATES), overwritten
    sensors: NDArray  # (models or 0, 3 width + 3 n) numbers and noise of sensors
    seed: int


class Found(NamedTuple):
    """What a batch of loops fills."""

    metrics: NDArray  # (loops, N_METRICS)
    out: NDArray  # (loops or 0, n, N_CHANNELS + 1)
    status: NDArray  # (loops,) of int


class Scratch(NamedTuple):
    """Memory that one thread's loops work in."""

    on: NDArray
    carried: NDArray
    none: NDArray
    unkept: NDArray
    signals: NDArray
    answers: NDArray
    commands: NDArray
    counts: NDArray
    limits: NDArray


class Acted(NamedTuple):
    """What a row's figures of merit take of the loop."""

    command: float
    before: float  # the last row's command
    limited: float  # 1 where the command was limited
    current: float
    speed: float


def scratch(n: int, counts: list[int], limits: list[float]) -> Scratch:
    """Memory for loops of n rows; counts, limits: as named above, up to what `prepare` fills."""
    counts, limits = [*counts], [*limits, *[0.0] * (N_LIMITS - len(limits))]
    counts += [0] * (N_COUNTS - len(counts))
    if counts[WIDTH] > 0:
        limits += [0.0] * (3 * counts[WIDTH] + PER_ROW * n)
    return Scratch(
        on=np.zeros(at.N_FEATURES, np.int64),
        carried=np.zeros(at.N_CARRIED),
        none=np.zeros(0),
        unkept=np.zeros((0, at.N_STEP_STATES)),
        signals=np.zeros(k.N_SIGNALS),
        answers=np.zeros(N_ANSWERS),
        commands=np.zeros(n),
        counts=np.array(counts, np.int64),
        limits=np.array(limits),
    )


@njit(error_model="numpy")
def _quantised(angle, count):
    return np.floor(angle / count) * count if count > 0.0 else angle


@njit(error_model="numpy")
def _sensed(row, time, read, width, limits):
    """Readings of motor angle, load angle and current by the model's sensor terms."""
    n, begin = time.size, N_LIMITS + 3 * width
    motor, load, current = limits[begin + 3 * n : begin + 6 * n].reshape(3, n)
    rates = limits[begin + 6 * n : begin + 8 * n].reshape(2, n)
    errors = limits[begin + 8 * n : begin + 11 * n].reshape(3, n)
    motor[row], load[row], current[row] = (
        read[at.MOTOR_ANGLE], read[at.LOAD_ANGLE], read[at.READ_CURRENT],
    )  # fmt: skip
    rates[0, row], rates[1, row] = read[at.MOTOR_SPEED], read[at.LOAD_SPEED_READ]
    numbers = limits[N_LIMITS:begin].reshape(3, width)
    noise = limits[begin : begin + 3 * n].reshape(3, n)
    return (
        noise[0, row]
        + sensing.sensed(time, motor, rates[0], True, row, numbers[0], errors[0], 1.0),
        noise[1, row] + sensing.sensed(time, load, rates[1], True, row, numbers[1], errors[1], 1.0),
        noise[2, row]
        + sensing.sensed(time, current, current, False, row, numbers[2], errors[2], 1.0),
    )


@njit(error_model="numpy")
def _signals(motor_count, load_count, read, sensed, row, reference, limits, signals):
    """What the controller is given; `sensed` are the three readings before they are counted."""
    for m in range(3):
        signals[k.REFERENCE + m] = reference[row, m]
    motor, load, current = sensed
    signals[k.TRUE_MOTOR_ANGLE] = read[at.MOTOR_ANGLE]
    signals[k.TRUE_LOAD_ANGLE] = read[at.LOAD_ANGLE]
    signals[k.TRUE_TORQUE] = read[at.TORQUE]
    signals[k.TRUE_MOTOR_VELOCITY] = read[at.MOTOR_SPEED]
    signals[k.TRUE_LOAD_VELOCITY] = read[at.LOAD_SPEED_READ]
    if limits[NOISE] > 0.0:
        motor += np.random.normal(0.0, limits[NOISE])
    if limits[NOISE + 1] > 0.0:
        load += np.random.normal(0.0, limits[NOISE + 1])
    if limits[NOISE + 2] > 0.0:
        current += np.random.normal(0.0, limits[NOISE + 2])
    signals[k.READ_MOTOR_ANGLE] = _quantised(motor, motor_count)
    signals[k.READ_LOAD_ANGLE] = _quantised(load, load_count)
    signals[k.READ_CURRENT] = current


@njit(error_model="numpy")
def add_row(metrics, counts, limits, time, row, value, wanted, acted):
    """Add one row to the running metrics."""
    first, last_rows = counts[FIRST], counts[ROWS_LEFT]
    height, final = limits[HEIGHT], limits[FINAL]
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
    if row >= time.size - last_rows:
        metrics[6] += error / last_rows
    metrics[7] += acted.command * acted.command
    metrics[8] = max(metrics[8], abs(acted.command))
    metrics[9] += abs(acted.command - acted.before) if row > first else 0.0
    metrics[10] += acted.limited
    metrics[11] += acted.current * acted.current
    metrics[12] = max(metrics[12], abs(acted.current))
    metrics[13] = max(metrics[13], abs(acted.speed))


@njit(error_model="numpy", forceinline=True)
def sample(plant, row, time, read, before, controller, loop):
    """The command of a row by its readings `read` and the last command; counted in the metrics.

    plant : `Plant`, of which the encoder counts are read
    loop : `layout.Loop`
    """
    counts, limits, answers = loop.counts, loop.limits, loop.answers
    sensed = read[at.MOTOR_ANGLE], read[at.LOAD_ANGLE], read[at.READ_CURRENT]
    if counts[WIDTH] > 0:
        sensed = _sensed(row, time, read, counts[WIDTH], limits)
    if row % counts[PER_SAMPLE] == 0:
        _signals(
            plant.motor_count, plant.load_count, read, sensed, row, loop.reference, limits,
            loop.signals,
        )  # fmt: skip
        controller(loop.parameters, loop.internal, loop.signals, answers)
        for m in range(k.N_COMMANDS):
            answers[ACTING + m] = answers[WAITING + m] if counts[LATE] == 1 else answers[m]
            answers[WAITING + m] = answers[m]
        limit = limits[COMMAND_LIMIT]
        command = answers[ACTING + k.COMMAND]
        answers[ACTING + k.COMMAND] = min(max(command, -limit), limit)
    command = answers[ACTING + k.COMMAND]
    if row >= counts[FIRST]:
        value = read[counts[FOLLOWED]]
        if row == counts[FIRST]:
            limits[HEIGHT] = limits[FINAL] - value
        limited = 1.0 if answers[ACTING + k.UNSATURATED] != command else 0.0
        acted = Acted(command, before, limited, read[at.READ_CURRENT], read[at.MOTOR_SPEED])
        add_row(loop.metrics, counts, limits, time, row, value, loop.reference[row, 0], acted)
    return command


@njit(error_model="numpy")
def prepare(counts, limits, reference, answers, metrics):
    """Set a loop to its start; True where the reference holds over the steady state's rows."""
    n = reference.shape[0]
    counts[ROWS_LEFT] = max(round(LAST_SHARE * (n - counts[FIRST])), 1)
    limits[FINAL], limits[HEIGHT] = reference[n - 1, 0], 0.0
    for m in range(N_ANSWERS):
        answers[m] = 0.0
    for m in range(N_METRICS):
        metrics[m] = 0.0
    holds = True
    for row in range(n - counts[ROWS_LEFT], n):
        holds = holds and reference[row, 0] == limits[FINAL]
    return holds


@njit(error_model="numpy")
def finish(metrics, rows_counted, steps_to_end):
    """Metrics of their sums over rows; `steps_to_end`: the reference is a step that holds."""
    for m in (0, 7, 11):
        metrics[m] = np.sqrt(metrics[m] / rows_counted)
    for m in (2, 10):
        metrics[m] /= rows_counted
    if not steps_to_end:
        metrics[4] = metrics[5] = np.nan


def _cached(version):
    def run_loops(kernels, models, grid, controller, loops, found, work, span):
        time, none, n = grid[0], work.none, grid[0].size
        columns = at.Columns(time, grid[1], work.commands, none, none, none, none, none, none)
        counts, limits, out = work.counts, work.limits, found.out
        references, sensors = loops.references, loops.sensors
        for j in range(*span):
            np.random.seed((loops.seed + j) % 4294967296 + version * 0)
            of = j if models.plants.shape[0] > 1 else 0
            model = rows.model_of(models, of, work.on)
            kept = out[j] if out.shape[0] > 0 else out[0:0].reshape(0, at.N_CHANNELS + 1)
            reference = references[j if references.shape[0] > 1 else 0]
            metrics, y = found.metrics[j], loops.starts[j]
            rows.prepare(model, y, work.carried)
            rows.to_given_motion(work.on, columns, 0, y)
            if sensors.shape[0] > 0:
                for m in range(sensors.shape[1]):
                    limits[N_LIMITS + m] = sensors[of, m]
            holds = prepare(counts, limits, reference, work.answers, metrics)
            found.status[j] = (kernels.plain if work.on[at.PLAIN] != 0 else kernels.full)(
                model, columns, 0, n - 1, at.Carried(y, work.carried),
                at.Record(kept, work.unkept), controller,
                at.Loop(
                    counts, limits, loops.parameters[j], loops.states[j], reference, work.signals,
                    work.answers, metrics,
                ),
            )  # fmt: skip
            if found.status[j] == at.DONE:
                finish(metrics, n - counts[FIRST], holds and limits[HEIGHT] != 0.0)
            else:
                metrics[:] = np.nan

    return njit(cache=True, nogil=True, error_model="numpy")(run_loops)


run_loops = _cached(SOURCE_VERSION)
"""run_loops(kernels, models, grid, controller, loops, found, work, span), compiled: loops
span[0]..span[1] - 1 of a batch.

kernels : `rows.Kernels`; models : `layout.Models`, one for all loops or one for each; grid :
times (n,) and steps (n,) within each row; loops : `Loops`; found : `Found`; work : `Scratch`.
"""
