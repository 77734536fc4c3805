"""Steps, located events and the sampled loop: the compiled part of a simulation.

`run` integrates a `Plant` over its rows. A row's command acts from the row's time to the next
one's; the controller acts every `rows_per_sample` rows on what it reads there. Within a row
equal steps of order 8 (`runge_kutta`) are taken; a step over which a switch value changes sign
is cut at the sign change, found by the Illinois method to 1e-14 of the row, and the mode is
switched there. A switch that goes over and back within one step is not seen: what it would
have done is of the order of the step cubed.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

import rsea_core.effects.layout as e
import rsea_core.effects.sensor_reading as sensing
import rsea_core.engines.event_driven.bristles as b
import rsea_core.engines.event_driven.equations as eq
import rsea_core.engines.event_driven.events as sw
import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
from rsea_core.effects.gear_transmission_error import angle_error
from rsea_core.numeric.runge_kutta import MATRIX, NODES, STAGES, WEIGHTS
from rsea_core.numeric.source_version import SOURCE_VERSION

DONE, NOT_FINITE, TOO_MANY_EVENTS = range(3)
MAX_EVENTS_PER_ROW = 1000
EVENT_TOLERANCE = 1e-14  # of the row's length
# rows of a run's memory, one array because every array in a tuple counts references at each call;
# the slopes of a step's stages come first
POINT, TRIAL = STAGES, STAGES + 1  # states at a stage, and where the last trial step ended
NOW = STAGES + 2  # states where the machine is
GAINED, INTEGRALS = STAGES + 3, STAGES + 4  # over the last trial step, and since the start
LATE = STAGES + 5  # the last row whose command has begun to act, -1 none; that command
N_WORK = STAGES + 6


class Step(NamedTuple):
    """A step within a row: when it starts since the row's start, how long it is."""

    start: float
    length: float
    tolerance: float  # of a located event


class Piece(NamedTuple):
    """A piece of a row under one command, of equal steps."""

    offset: float  # since the row's start
    length: float
    steps: int


class Control(NamedTuple):
    """What belongs to a controller."""

    parameters: NDArray
    state: NDArray


class Record(NamedTuple):
    """Where the machine starts, and what is written of each row."""

    start: NDArray  # (N_Y,)
    log: NDArray  # (n, N_LOG)
    internal_states: NDArray  # (n, N_Y) all of y, or (0, N_Y)


class Schedule(NamedTuple):
    """What is known of every row before the run."""

    time: NDArray  # (n,)
    steps: NDArray  # (n - 1,) integration steps within each row
    reference: NDArray  # (n, 3) reference and its first two time derivatives
    load_angle: NDArray  # (n,) of a held load
    load_velocity: NDArray  # (n,)
    rows_per_sample: int
    delay_samples: int  # 0 or 1
    command_limit: float


@njit(error_model="numpy", inline="always")
def _n_integrated(fx):
    """How many states move: those of terms only where there are such."""
    if fx[e.INTERNAL_STATES] == 0.0:
        return k.N_STATES
    return k.N_ALL_STATES if b.there_are(fx) else k.N_WITHOUT_BRISTLES


@njit(error_model="numpy")
def _trial(plant, spring, fx, mode, command, step, work):
    """One step from where the machine is; fills the rows TRIAL and GAINED of work."""
    point, start, length = work[POINT], step.start, step.length
    states = _n_integrated(fx)
    if fx[e.INTERNAL_STATES] != 0.0:
        for m in range(states, k.N_Y):
            work[POINT, m] = work[TRIAL, m] = work[NOW, m]
    for i in range(STAGES):
        for m in range(states):
            at = work[NOW, m]
            for j in range(i):
                at += length * MATRIX[i, j] * work[j, m]
            work[POINT, m] = at
        stage = k.Stage(start + length * NODES[i], i)
        eq.derivative(plant, spring, fx, mode, command, stage, point, work)
    for m in range(k.N_POWERS):
        gained = 0.0
        for i in range(STAGES):
            if WEIGHTS[i] != 0.0:
                gained += length * WEIGHTS[i] * work[i, k.POWER + m]
        work[GAINED, m] = gained
    for m in range(states):
        at = work[NOW, m]
        for i in range(STAGES):
            at += length * WEIGHTS[i] * work[i, m]
        work[TRIAL, m] = at


@njit(error_model="numpy")
def _locate(plant, spring, fx, mode, command, step, switch, work):
    """Length of the step at which this switch has just turned positive."""
    start, length, tolerance = step
    low, high, trial = 0.0, length, work[TRIAL]
    at_low = sw.switch_value(plant, spring, fx, mode, command, start, work[NOW], switch)
    at_high = sw.switch_value(plant, spring, fx, mode, command, start + length, trial, switch)
    last = 0
    for iteration in range(200):
        if high - low <= tolerance:
            break
        middle = 0.5 * (low + high)
        if iteration % 4 != 3 and at_high > at_low:
            secant = high - at_high * (high - low) / (at_high - at_low)
            if low < secant < high:
                middle = min(max(secant, low + 0.5 * tolerance), high - 0.5 * tolerance)
        _trial(plant, spring, fx, mode, command, Step(start, middle, tolerance), work)
        value = sw.switch_value(plant, spring, fx, mode, command, start + middle, trial, switch)
        if value > 0.0:
            high, at_high = middle, value
            at_low = 0.5 * at_low if last == 1 else at_low
            last = 1
        else:
            low, at_low = middle, value
            at_high = 0.5 * at_high if last == -1 else at_high
            last = -1
    return high


@njit(error_model="numpy")
def _step_to_switch(plant, spring, fx, mode, command, step, work):
    """A trial step, cut short at the first switch within it: (switch or -1, its length)."""
    _trial(plant, spring, fx, mode, command, step, work)
    first, taken, trial = -1, step.length, work[TRIAL]
    event_count = k.N_NOMINAL_EVENTS if fx[e.ANY] == 0.0 else k.N_TERM_EVENTS
    if fx[e.INTERNAL_STATES] != 0.0:
        event_count = k.N_EVENTS
    for switch in range(event_count):
        end = step.start + taken
        if sw.switch_value(plant, spring, fx, mode, command, end, trial, switch) > 0.0:
            shorter = Step(step.start, taken, step.tolerance)
            taken = _locate(plant, spring, fx, mode, command, shorter, switch, work)
            first = switch
            shorter = Step(step.start, taken, step.tolerance)
            _trial(plant, spring, fx, mode, command, shorter, work)
    return first, taken


@njit(error_model="numpy", inline="always")
def _keep(fx, mode, taken, work):
    """Go to the end of the last trial step, which was so long."""
    for m in range(_n_integrated(fx)):
        work[NOW, m] = work[TRIAL, m]
    for m in range(k.N_POWERS):
        work[INTEGRALS, m] += work[GAINED, m]
    work[INTEGRALS, k.LIMITED_TIME] += taken if mode.limited != 0 else 0.0
    work[INTEGRALS, k.CONTACT_TIME] += taken if mode.contact else 0.0
    wheel_stuck = mode.wheel == 0 and fx[e.WHEEL_DRY] != 0.0
    load_stuck = mode.load == 0 and fx[e.LOAD_DRY] != 0.0
    work[INTEGRALS, k.WHEEL_STUCK_TIME] += taken if wheel_stuck else 0.0
    work[INTEGRALS, k.LOAD_STUCK_TIME] += taken if load_stuck else 0.0


@njit(error_model="numpy")
def _advance(plant, spring, fx, mode, command, piece, work):
    """Integrate over a piece of a row, switching where the mode must."""
    y = work[NOW]
    mode = sw.mode_at_start(plant, spring, fx, mode, command, y)
    whole, tolerance = piece.length / piece.steps, EVENT_TOLERANCE * piece.length
    event_count, s, left = 0, 0, whole
    while s < piece.steps:
        start, length = piece.offset + (s + 1) * whole - left, left
        if b.there_are(fx):
            torque = eq.derivative(plant, spring, fx, mode, command, k.Stage(start, 0), y, work)
            longest = b.longest_step_s(fx, plant.inertia, torque, y, work)
            length = left / max(np.ceil(left / longest - 1e-9), 1.0)
        step = Step(start, length, tolerance)
        switch, taken = _step_to_switch(plant, spring, fx, mode, command, step, work)
        _keep(fx, mode, taken, work)
        left -= taken
        if switch >= 0:
            mode = sw.switched(plant, spring, fx, mode, y, command, switch)
            event_count += 1
        if event_count > MAX_EVENTS_PER_ROW:
            return mode, TOO_MANY_EVENTS
        if left <= 0.0:
            s, left = s + 1, whole
    for m in range(_n_integrated(fx)):
        if not np.isfinite(y[m]):
            return mode, NOT_FINITE
    current, _ = eq.current_and_voltage(plant, fx, mode, command, y)
    y[k.IM] = current
    return mode, DONE


@njit(error_model="numpy")
def _advance_late(plant, spring, fx, mode, schedule, log, row, work):
    """Integrate over one row where commands act late: it is cut where the next one begins."""
    begin, length = schedule.time[row], schedule.time[row + 1] - schedule.time[row]
    offset, slack, late = 0.0, 1e-9 * length, work[LATE]  # a delay of whole rows makes no slivers
    if late[0] < 0.0 and plant.drive == mp.POSITION:  # before its first goal: that one
        late[1] = e.acting_command(fx, log[0, k.LOG_COMMAND])
    while length - offset > slack:
        following = int(late[0]) + 1
        end = length
        if following <= row:
            due = schedule.time[following] + fx[e.COMMAND_DELAY] - begin
            if due <= offset + slack:
                late[0] = following
                late[1] = e.acting_command(fx, log[following, k.LOG_COMMAND])
                continue
            end = due if due < length - slack else length
        steps = max(int(np.ceil(schedule.steps[row] * (end - offset) / length - 1e-9)), 1)
        piece = Piece(offset, end - offset, steps)
        mode, status = _advance(plant, spring, fx, mode, late[1], piece, work)
        if status != DONE:
            return mode, status
        offset = end
    return mode, DONE


@njit(error_model="numpy")
def _quantised(angle, count):
    return np.floor(angle / count) * count if count > 0.0 else angle


@njit(error_model="numpy")
def _read(plant, schedule, sensors, row, y, log, signals):
    """What the controller is given at this row; its states are in the log already."""
    signals[k.REFERENCE : k.REFERENCE_ACCELERATION + 1] = schedule.reference[row]
    motor_angle, load_angle, current = y[k.TW] * plant.gear_ratio, log[row, k.TL], y[k.IM]
    signals[k.TRUE_MOTOR_ANGLE] = motor_angle
    signals[k.TRUE_LOAD_ANGLE] = load_angle
    signals[k.TRUE_TORQUE] = log[row, k.LOG_TORQUE]
    signals[k.TRUE_MOTOR_VELOCITY] = y[k.WW] * plant.gear_ratio
    signals[k.TRUE_LOAD_VELOCITY] = log[row, k.WL]
    numbers, noise, errors = sensors
    if numbers.shape[0] > 0:
        time, per = schedule.time, plant.gear_ratio  # the log holds the motor's angle at the output
        wheel, load, amperes = log[:, k.TW], log[:, k.TL], log[:, k.IM]
        motor_angle = sensing.sensed(
            time, wheel, log[:, k.WW], True, row, numbers[0], errors[0], per
        )
        load_angle = sensing.sensed(time, load, log[:, k.WL], True, row, numbers[1], errors[1], 1.0)
        current = sensing.sensed(time, amperes, amperes, False, row, numbers[2], errors[2], 1.0)
        motor_angle += noise[row, 0]
        load_angle += noise[row, 1]
        current += noise[row, 2]
    signals[k.READ_MOTOR_ANGLE] = _quantised(motor_angle, plant.motor_count)
    signals[k.READ_LOAD_ANGLE] = _quantised(load_angle, plant.load_count)
    signals[k.READ_CURRENT] = current


@njit(error_model="numpy")
def _given_motion(plant, schedule, row, mode, y):
    """The mode with the held load's motion of this row: the cubic between its readings."""
    free = plant.structure == mp.ELASTIC_FREE or plant.structure == mp.RIGID_FREE
    if row + 1 == schedule.time.size:
        return mode
    if free:
        return k.with_motion(mode, 0.0, 0.0, schedule.time[row])
    y[k.TL], y[k.WL] = schedule.load_angle[row], schedule.load_velocity[row]
    if plant.structure == mp.RIGID_HELD:
        y[k.WW] = y[k.WL]
    h = schedule.time[row + 1] - schedule.time[row]
    slope = (schedule.load_angle[row + 1] - y[k.TL]) / h
    before, after = y[k.WL], schedule.load_velocity[row + 1]
    acceleration = 2.0 * (3.0 * slope - 2.0 * before - after) / h
    jerk = 6.0 * (before + after - 2.0 * slope) / h**2
    return k.with_motion(mode, acceleration, jerk, schedule.time[row])


@njit(error_model="numpy")
def _loop(plant, spring, fx, controller, control, schedule, sensors, record):
    n, log, internal_states = schedule.time.size, record.log, record.internal_states
    if b.carry_the_load(fx):  # all of the gear's friction: none is set-valued
        fx = fx.copy()
        fx[e.WHEEL_DRY] = 0.0
    work = np.zeros((N_WORK, k.N_Y))  # N_Y >= N_SLOPES
    y, late = work[NOW], work[LATE]
    y[:] = record.start
    late[0] = -1.0
    signals = np.zeros(k.N_SIGNALS)
    answer = np.zeros(k.N_COMMANDS)
    waiting = np.zeros(k.N_COMMANDS)
    acting = np.zeros(k.N_COMMANDS)
    mode = sw.first_mode(plant, fx, y, schedule.time[0])
    for row in range(n):
        now = k.Stage(schedule.time[row] - schedule.time[row - 1] if row > 0 else 0.0, 0)
        torque = eq.derivative(plant, spring, fx, mode, late[1], now, y, work)
        log[row, : k.N_STATES] = y[: k.N_STATES]
        log[row, k.LOG_TORQUE] = torque
        if plant.structure == mp.RIGID_FREE:
            error, slope = angle_error(fx, y[k.TW], plant.gear_ratio)
            log[row, k.TL] += error
            log[row, k.WL] *= 1.0 + slope
        if internal_states.shape[0] > 0:
            internal_states[row] = y
        _read(plant, schedule, sensors, row, y, log, signals)
        if row % schedule.rows_per_sample == 0:
            controller(control.parameters, control.state, signals, answer)
            acting[:] = waiting if schedule.delay_samples == 1 else answer
            waiting[:] = answer
            limit = schedule.command_limit
            acting[k.COMMAND] = min(max(acting[k.COMMAND], -limit), limit)
        log[row, k.LOG_COMMAND] = acting[k.COMMAND]
        log[row, k.LOG_UNSATURATED] = acting[k.UNSATURATED]
        log[row, k.LOG_READ_MOTOR] = signals[k.READ_MOTOR_ANGLE]
        log[row, k.LOG_READ_LOAD] = signals[k.READ_LOAD_ANGLE]
        log[row, k.LOG_INTEGRALS :] = work[INTEGRALS, : k.N_INTEGRALS]
        if row + 1 == n:
            break
        mode = _given_motion(plant, schedule, row, mode, y)
        if fx[e.COMMAND_DELAY] > 0.0:
            mode, status = _advance_late(plant, spring, fx, mode, schedule, log, row, work)
        else:
            late[1] = e.acting_command(fx, acting[k.COMMAND])
            length = schedule.time[row + 1] - schedule.time[row]
            piece = Piece(0.0, length, schedule.steps[row])
            mode, status = _advance(plant, spring, fx, mode, late[1], piece, work)
        if status != DONE:
            return status, row
    return DONE, n - 1


def _cached(version):
    def run(plant, spring, fx, controller, control, schedule, sensors, record):
        if version < 0:
            return NOT_FINITE, 0
        return _loop(plant, spring, fx, controller, control, schedule, sensors, record)

    return njit(cache=True, nogil=True, error_model="numpy")(run)


run = _cached(SOURCE_VERSION)
"""run(plant, spring, fx, controller, control, schedule, sensors, record): status and last row.

Compiled. `spring` is a table's regions, `fx` the array of `effects.layout`, `sensors` a
`sensor_reading.Sensors`; `controller` has the signature `states.CONTROLLER`, its own arrays are a
`Control`; `record` is a `Record`.
"""
