"""What a closed loop adds to a row of the fast engine: reading, control, judging; compiled."""

import numpy as np
from numba import njit

import rsea_core.effects.sensor_reading as sensing
import rsea_core.engines.event_driven.states as k
import rsea_core.engines.fixed_step.step_inputs as p

# the loop's whole numbers: rows between two actions of the controller, samples (0 or 1) from
# reading to acting, place in `step_parts.CHANNELS` of what the reference belongs to, first judged
# row, rows of the steady state, numbers of each sensor (0: the readings are the truth)
PER_SAMPLE, LATE, FOLLOWED, FIRST, ROWS_LEFT, WIDTH = range(6)
N_LOOP = 6
# and the others: largest command, deviations of the readings of motor angle, load angle and
# current, last reference, change of the reference over the judged rows; with sensors their
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
SETTLING_BAND = 0.02  # of the reference's change, as `step_metrics`
LAST_SHARE = 0.2  # of the rows, for the steady state


@njit(error_model="numpy")
def _quantised(angle, count):
    return np.floor(angle / count) * count if count > 0.0 else angle


@njit(error_model="numpy")
def _sensed(row, time, read, width, limits):
    """Readings of motor angle, load angle and current by the model's sensor terms."""
    n, at = time.size, N_LIMITS + 3 * width
    motor, load, current = limits[at + 3 * n : at + 6 * n].reshape(3, n)
    rates = limits[at + 6 * n : at + 8 * n].reshape(2, n)
    errors = limits[at + 8 * n : at + 11 * n].reshape(3, n)
    motor[row], load[row], current[row] = (
        read[p.MOTOR_ANGLE], read[p.LOAD_ANGLE], read[p.READ_CURRENT],
    )  # fmt: skip
    rates[0, row], rates[1, row] = read[p.MOTOR_SPEED], read[p.LOAD_SPEED_READ]
    numbers = limits[N_LIMITS:at].reshape(3, width)
    noise = limits[at : at + 3 * n].reshape(3, n)
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
    signals[k.TRUE_MOTOR_ANGLE] = read[p.MOTOR_ANGLE]
    signals[k.TRUE_LOAD_ANGLE] = read[p.LOAD_ANGLE]
    signals[k.TRUE_TORQUE] = read[p.TORQUE]
    signals[k.TRUE_MOTOR_VELOCITY] = read[p.MOTOR_SPEED]
    signals[k.TRUE_LOAD_VELOCITY] = read[p.LOAD_SPEED_READ]
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
def judge_row(metrics, first, rows_left, limits, row, time, value, wanted, told, before):
    """Add one row to the running metrics; `told` is (command, whether limited, current, speed)."""
    command, limited, current, speed = told
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
def closed_loop(
    motor_count, load_count, row, time, read, before, controller, loop, limits, parameters, state,
    reference, signals, answers, metrics,
):  # fmt: skip
    """The command of a row by its readings `read` and the last command; judged into `metrics`.

    loop (N_LOOP,), limits (N_LIMITS,): as named above; parameters, state, signals: as
    `kernel.CONTROLLER`; answers (N_ANSWERS,); reference (n, 3) with its first two derivatives
    """
    sensed = read[p.MOTOR_ANGLE], read[p.LOAD_ANGLE], read[p.READ_CURRENT]
    if loop[WIDTH] > 0:
        sensed = _sensed(row, time, read, loop[WIDTH], limits)
    if row % loop[PER_SAMPLE] == 0:
        _signals(motor_count, load_count, read, sensed, row, reference, limits, signals)
        controller(parameters, state, signals, answers)
        for m in range(k.N_COMMANDS):
            answers[ACTING + m] = answers[WAITING + m] if loop[LATE] == 1 else answers[m]
            answers[WAITING + m] = answers[m]
        limit = limits[COMMAND_LIMIT]
        command = answers[ACTING + k.COMMAND]
        answers[ACTING + k.COMMAND] = min(max(command, -limit), limit)
    command = answers[ACTING + k.COMMAND]
    first = loop[FIRST]
    if row >= first:
        value = read[loop[FOLLOWED]]
        if row == first:
            limits[HEIGHT] = limits[FINAL] - value
        limited = 1.0 if answers[ACTING + k.UNSATURATED] != command else 0.0
        told = (command, limited, read[p.READ_CURRENT], read[p.MOTOR_SPEED])
        judge_row(
            metrics, first, loop[ROWS_LEFT], limits, row, time, value, reference[row, 0], told,
            before,
        )  # fmt: skip
    return command


@njit(error_model="numpy")
def prepare(loop, limits, reference, answers, metrics):
    """Set a loop to its start; True where the reference holds over the steady state's rows."""
    n = reference.shape[0]
    loop[ROWS_LEFT] = max(round(LAST_SHARE * (n - loop[FIRST])), 1)
    limits[FINAL], limits[HEIGHT] = reference[n - 1, 0], 0.0
    for m in range(N_ANSWERS):
        answers[m] = 0.0
    for m in range(N_METRICS):
        metrics[m] = 0.0
    holds = True
    for row in range(n - loop[ROWS_LEFT], n):
        holds = holds and reference[row, 0] == limits[FINAL]
    return holds


@njit(error_model="numpy")
def finish(metrics, count, steps_to_end):
    """Metrics of sums over `count` rows; `steps_to_end`: the reference is a step that holds."""
    for m in (0, 7, 11):
        metrics[m] = np.sqrt(metrics[m] / count)
    for m in (2, 10):
        metrics[m] /= count
    if not steps_to_end:
        metrics[4] = metrics[5] = np.nan
