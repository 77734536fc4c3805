"""The sampled loop of the exact engine; compiled. See `modes` for the method."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

import rsea_core.effects.layout as e
import rsea_core.effects.sensor_reading as sensing
import rsea_core.engines.event_driven.equations as eq
import rsea_core.engines.event_driven.events as sw
import rsea_core.engines.event_driven.states as k
import rsea_core.engines.piecewise_linear.events as pe
import rsea_core.engines.piecewise_linear.modes as pm
import rsea_core.engines.piecewise_linear.whole_row as whole_row
import rsea_core.machine.plant as mp
from rsea_core.engines.piecewise_linear.controller_call import call_controller
from rsea_core.numeric.source_version import SOURCE_VERSION
from rsea_core.numeric.unowned import unowned

RENEWED = 256  # rows after which sine and cosine are computed anew
UNEVEN = 1e-8  # of a row: by how much rows may differ in length
# rows of the log: the five nominal states, tau_s, command, unsaturated, the readings of the
# encoders where a sensor term acts, then times [s], written where `timed`
LOG_TORQUE, LOG_COMMAND, LOG_UNSATURATED, LOG_READ_MOTOR, LOG_READ_LOAD, LOG_TIMES = range(5, 11)
LIMITED, CONTACT, WHEEL_STUCK, LOAD_STUCK = range(4)
N_LOG = LOG_TIMES + 4
# rows of the log beyond these are the places of `behind`: states that only some machines have
NO_FORCE = (0.0, 0.0, 0.0, 0.0)  # `whole_row.force_of` without gravity


class Rows(NamedTuple):
    """What is known of the rows before the run."""

    start_s: float
    row_s: float
    rows_per_sample: int
    delay_samples: int
    command_limit: float
    motor_noise_rad: float  # standard deviations of the readings, before they are counted
    load_noise_rad: float
    current_noise_A: float
    seed: int  # of that noise; -1: none
    wheel_start_rad: float
    load_start_rad: float
    time: NDArray  # (n,)
    reference: NDArray  # (n, 3)
    angle: NDArray  # (n,) a held load's motion, or (0,)
    speed: NDArray
    timed: NDArray  # (4,) bool: which of the times the log keeps
    behind: NDArray  # int64: places in y that the log keeps beyond N_LOG
    sensors: sensing.Sensors


@njit(error_model="numpy", inline="always")
def _quantised(angle, count):
    return np.floor(angle / count) * count if count > 0.0 else angle


@njit(error_model="numpy")
def _torque(machine, work, mode, command, time):
    """tau_s where it is more than a function of the angles, `time` after the last row."""
    plant, spring, fx = machine.plant, machine.spring, machine.fx
    return eq.derivative(
        plant, spring, fx, mode, command, k.Stage(time, 0), work.y, work.derivatives
    )


@njit(error_model="numpy")
def _given_motion(plant, rows, mode, row, y):
    """The mode with a held load's motion of this row: the cubic between its readings."""
    before, after = rows.speed[row], rows.speed[row + 1]
    y[k.TL], y[k.WL] = rows.angle[row], before
    if plant.structure == mp.RIGID_HELD:
        y[k.WW] = before
    slope = (rows.angle[row + 1] - rows.angle[row]) / rows.row_s
    acceleration = 2.0 * (3.0 * slope - 2.0 * before - after) / rows.row_s
    jerk = 6.0 * (before + after - 2.0 * slope) / rows.row_s**2
    return k.with_motion(mode, acceleration, jerk, mode.row_time)


@njit(error_model="numpy")
def _sensed(rows, row, log, ratio):
    """Readings of motor angle, load angle and current by the model's sensor terms."""
    numbers, noise, errors = rows.sensors
    time = rows.time
    motor = sensing.sensed(time, log[k.TW], log[k.WW], True, row, numbers[0], errors[0], ratio)
    load = sensing.sensed(time, log[k.TL], log[k.WL], True, row, numbers[1], errors[1], 1.0)
    current = sensing.sensed(time, log[k.IM], log[k.IM], False, row, numbers[2], errors[2], 1.0)
    return motor + noise[row, 0], load + noise[row, 1], current + noise[row, 2]


@njit(error_model="numpy")
def _noisy(rows, motor, load, current):
    """Readings with noise of their own."""
    if rows.motor_noise_rad > 0.0:
        motor += np.random.normal(0.0, rows.motor_noise_rad)
    if rows.load_noise_rad > 0.0:
        load += np.random.normal(0.0, rows.load_noise_rad)
    if rows.current_noise_A > 0.0:
        current += np.random.normal(0.0, rows.current_noise_A)
    return motor, load, current


@njit(error_model="numpy")
def _advance_row(machine, modes, work, mode, region, rows, log, acts):
    """One row with located events; where commands act late it is cut where the next one begins.

    acts : (3,) array, the last row whose command acts (-1 none), that command, and this row
    """
    row, delay, at, status = int(acts[2]), machine.fx[e.COMMAND_DELAY], 0.0, pe.DONE
    if delay > 0.0 and acts[0] < 0.0 and machine.plant.drive == mp.POSITION:  # the first goal
        acts[1] = e.acting_command(machine.fx, log[LOG_COMMAND, 0])
    slack, begin = pe.SLIVER * rows.row_s, rows.start_s + row * rows.row_s
    mode = k.with_motion(mode, 0.0, 0.0, begin)
    if rows.angle.size > 0:
        mode = _given_motion(machine.plant, rows, mode, row, work.y)
    while rows.row_s - at > slack and status == pe.DONE:
        following, end = int(acts[0]) + 1, rows.row_s
        if delay > 0.0 and following <= row:
            due = rows.start_s + following * rows.row_s + delay - begin
            if due <= at + slack:
                acts[0] = following
                acts[1] = e.acting_command(machine.fx, log[LOG_COMMAND, following])
                continue
            end = due if due < rows.row_s - slack else rows.row_s
        mode, region, status = pe.advance_piece(
            machine, modes, work, mode, region, acts[1], at, end
        )
        at = end
    return mode, region, status


@njit(error_model="numpy", forceinline=True)
def _read(plant, rows, row, z, torque, noisy, log, signals):
    """Fill the signals of a row: the reference, what is true and what is read."""
    i, tw, ww, tl, wl = z
    ratio = plant.gear_ratio
    motor, load, current = tw * ratio, tl, i
    signals[k.REFERENCE] = rows.reference[row, 0]
    signals[k.REFERENCE_RATE] = rows.reference[row, 1]
    signals[k.REFERENCE_ACCELERATION] = rows.reference[row, 2]
    signals[k.TRUE_MOTOR_ANGLE], signals[k.TRUE_LOAD_ANGLE] = motor, tl
    signals[k.TRUE_TORQUE] = torque
    signals[k.TRUE_MOTOR_VELOCITY], signals[k.TRUE_LOAD_VELOCITY] = ww * ratio, wl
    sensed = rows.sensors.numbers.shape[0] > 0
    if sensed:
        motor, load, current = _sensed(rows, row, log, ratio)
    if noisy:
        motor, load, current = _noisy(rows, motor, load, current)
    signals[k.READ_MOTOR_ANGLE] = _quantised(motor, plant.motor_count)
    signals[k.READ_LOAD_ANGLE] = _quantised(load, plant.load_count)
    signals[k.READ_CURRENT] = current
    if sensed:
        log[LOG_READ_MOTOR, row] = signals[k.READ_MOTOR_ANGLE]
        log[LOG_READ_LOAD, row] = signals[k.READ_LOAD_ANGLE]


@njit(error_model="numpy", forceinline=True)
def _command(fx, rows, controller, parameters, state, signals, commands):
    """What acts on the machine from this sample on; `commands`: answer, waiting, acting."""
    answer, waiting, acting = commands[0], commands[1], commands[2]
    call_controller(controller, parameters, state, signals, answer)
    command, unsaturated = answer[k.COMMAND], answer[k.UNSATURATED]
    if rows.delay_samples == 1:
        command, waiting[k.COMMAND] = waiting[k.COMMAND], command
        unsaturated, waiting[k.UNSATURATED] = waiting[k.UNSATURATED], unsaturated
    command = min(max(command, -rows.command_limit), rows.command_limit)
    acting[k.COMMAND], acting[k.UNSATURATED] = command, unsaturated
    if fx[e.DEAD_ZONE] + fx[e.ROUNDED_ZONE] > 0.0:
        return e.acting_command(fx, command)
    return command


@njit(error_model="numpy", forceinline=True)
def _write_rest(rows, work, row, acting, log):
    """Log the command, the times and the states that only some machines have."""
    log[LOG_COMMAND, row], log[LOG_UNSATURATED, row] = acting[k.COMMAND], acting[k.UNSATURATED]
    for m in range(4):
        if rows.timed[m]:  # memory that is not touched costs nothing
            log[LOG_TIMES + m, row] = work.times[m]
    for m in range(rows.behind.size):
        log[N_LOG + m, row] = work.y[rows.behind[m]]


@njit(error_model="numpy", forceinline=True)
def _whole(c, fixed, command, z, sines, fastest):
    """A step of the whole row, gravity's `sines` at its start: (smooth, states, sines)."""
    if fixed.gravity == 0.0:
        return True, whole_row.moved(c, command, z, NO_FORCE), sines
    force = whole_row.force_of(c, z, sines)
    z1 = whole_row.moved(c, command, z, force)
    predicted, sines1 = z1[3], whole_row.sine_near(z1[3] - z[3], sines)
    smooth, z1 = whole_row.with_high_order(c, fixed, command, z1, force, sines1, fastest)
    smooth = smooth and abs(predicted - z[3]) < whole_row.NEAR
    return smooth, z1, whole_row.sine_very_near(z1[3] - predicted, sines1)


@njit(error_model="numpy", forceinline=True)
def _passed(work, rows, fixed, now, z1):
    """Count the times of a row in which nothing switched."""
    y, times = work.y, work.times
    times[CONTACT] += rows.row_s if now.contact else 0.0
    times[WHEEL_STUCK] += rows.row_s if now.sticks else 0.0
    times[LOAD_STUCK] += rows.row_s if now.load_sticks else 0.0
    if fixed.algebraic or not fixed.elastic:
        y[k.IM], y[k.TW], y[k.WW], y[k.TL], y[k.WL] = z1
    work.fastest[0] = max(work.fastest[0], abs(z1[4]))


@njit(error_model="numpy", forceinline=True)
def _changes(plant, now, z, z1):
    """What a row changed: current, both speeds, the drive's torque over the load's, the load's."""
    load = now.c1 * (z1[1] - z[1] - z1[3] + z[3])
    drive = plant.torque_per_ampere * (z1[0] - z[0]) - load
    return abs(z1[0] - z[0]), abs(z1[2] - z[2]), abs(z1[4] - z[4]), abs(drive), abs(load)


@njit(error_model="numpy")
def _first(machine, modes, work, rows):
    """What a run does not change, and what holds in its first row."""
    fixed, y = whole_row.fixed_of(machine, rows.row_s, rows.angle.size > 0), work.y
    mode = sw.first_mode(machine.plant, machine.fx, y, rows.start_s)
    output = y[k.TB] if machine.fx[e.BACKLASH] > 0.0 else y[k.TW]
    region = pe.region_of(machine.spring, output - y[k.TL])
    now = whole_row.now_of(machine, modes, work, fixed, mode, region, -1, 0.0)
    return fixed, mode, region, now


@njit(error_model="numpy", inline="always")
def loop(machine, modes, work, rows, controller, parameters, state, log):
    """Run the sampled loop; `log` (N_LOG + behind, n) is filled. Returns (status, last row)."""
    plant, fx, y, time = machine.plant, machine.fx, work.y, rows.time
    n, row_s, until_sample = time.size, rows.row_s, 0
    signals, acts, commands, c = work.signals, work.acts, work.commands, work.coefficients
    noisy = rows.motor_noise_rad > 0.0 or rows.load_noise_rad > 0.0 or rows.current_noise_A > 0.0
    remembers, delayed = fx[e.INTERNAL_STATES] != 0.0, fx[e.COMMAND_DELAY] > 0.0
    fixed, mode, region, now = _first(machine, modes, work, rows)
    z = (y[k.IM], y[k.TW], y[k.WW], y[k.TL], y[k.WL])
    last, command = (0.0, 0.0, 0.0, 0.0, 0.0), 0.0
    turning, sines = False, (0.0, 0.0)  # gravity times sine and cosine, turned from row to row
    for row in range(n):
        torque = now.c0 + now.c1 * (z[1] - z[3] - now.anchor)
        if remembers or not fixed.elastic:
            torque = _torque(machine, work, mode, command, row_s if row > 0 else 0.0)
        log[k.IM, row], log[k.TW, row], log[k.WW, row], log[k.TL, row], log[k.WL, row] = z
        log[LOG_TORQUE, row] = torque
        _read(plant, rows, row, z, torque, noisy and until_sample == 0, log, signals)
        if until_sample == 0:
            until_sample = rows.rows_per_sample
            command = _command(fx, rows, controller, parameters, state, signals, commands)
        until_sample -= 1
        _write_rest(rows, work, row, commands[2], log)
        if row + 1 == n:
            break
        if not abs(time[row + 1] - time[row] - row_s) <= UNEVEN * row_s:
            return pe.NOT_EVEN, row
        passed, z1, sines1 = False, z, sines
        # a step of the whole row where nothing comes near an event
        if now.known and rows.start_s + (row + 1) * row_s < now.edge_s:
            if fixed.gravity != 0.0 and (row % RENEWED == 0 or not turning):
                angle = z[3] + fixed.gravity_offset
                sines = (fixed.gravity * np.sin(angle), fixed.gravity * np.cos(angle))
            smooth, z1, sines1 = _whole(c, fixed, command, z, sines, work.fastest[0])
            passed = smooth and whole_row.stays(c, fx, fixed, now, command, z, z1, last)
        turning = passed
        if passed:
            sines = sines1
            _passed(work, rows, fixed, now, z1)
        else:
            y[k.IM], y[k.TW], y[k.WW], y[k.TL], y[k.WL] = z
            acts[2] = row
            if not delayed:
                acts[1] = command
            mode, region, status = _advance_row(machine, modes, work, mode, region, rows, log, acts)
            command = acts[1]
            if status != pe.DONE:
                return status, row
            z1 = (y[k.IM], y[k.TW], y[k.WW], y[k.TL], y[k.WL])
            slot = -1 if fixed.never else pm.slot_of(machine, modes, work, mode, region)
            now = whole_row.now_of(machine, modes, work, fixed, mode, region, slot, command)
        if fixed.algebraic:
            y[k.IM], _ = eq.current_and_voltage(plant, fx, mode, command, y)
            z1 = (y[k.IM], z1[1], z1[2], z1[3], z1[4])
        last, z = _changes(plant, now, z, z1), z1
        if not np.isfinite(z[2] + z[4] + z[0]):
            return pe.NOT_FINITE, row
    return pe.DONE, n - 1


def _cached(version):
    def run(machine, modes, work, rows, controller, parameters, state, log):
        if rows.seed >= 0:
            np.random.seed(rows.seed % 4294967296 + version * 0)
        work.y[:] = 0.0
        work.times[:] = 0.0
        work.fastest[0] = 0.0
        work.signals[:] = 0.0
        work.commands[:] = 0.0
        work.acts[:] = 0.0
        work.acts[0] = -1.0
        work.y[k.TW], work.y[k.TL] = rows.wheel_start_rad, rows.load_start_rad
        return loop(  # the caller keeps the memory
            unowned(machine), unowned(modes), unowned(work), unowned(rows), controller,
            unowned(parameters), unowned(state), unowned(log),
        )  # fmt: skip

    return njit(cache=True, nogil=True, error_model="numpy")(run)


run = _cached(SOURCE_VERSION)
"""run(machine, modes, work, rows, controller, parameters, state, log) -> (status, last row)

Compiled. `modes` and `work` are of `modes.room` for this machine and the length of its rows;
`controller` is the address of a function of the signature `states.CONTROLLER`; `log`
(N_LOG + behind, n) is filled.
"""
