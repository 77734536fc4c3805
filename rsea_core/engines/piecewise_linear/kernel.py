"""The sampled loop of the exact propagator; compiled. See `propagator_modes` for the method."""

from typing import NamedTuple

import numpy as np
from numba import njit

import rsea_core.effects.layout as e
import rsea_core.engines.event_driven.equations as eq
import rsea_core.engines.event_driven.events as sw
import rsea_core.engines.event_driven.states as k
import rsea_core.engines.piecewise_linear.events as pe
import rsea_core.engines.piecewise_linear.modes as pm
import rsea_core.machine.plant as mp
from rsea_core.machine.spring_table import ANCHOR, C0, C1, UPPER
from rsea_core.numeric.source_version import SOURCE_VERSION

SINE_3, SINE_5, SINE_7 = -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0
COSINE_4, COSINE_6 = -1.0 / 24.0, 1.0 / 720.0
NEAR = 0.02  # rad: there the series of sine and cosine are exact to the last bit
UNEVEN = 1e-6  # of a row: by how much rows may differ in length
# rows of the log: states, tau_s, command, unsaturated, then times [s], written where `timed`
LOG_TORQUE, LOG_COMMAND, LOG_UNSATURATED, LOG_TIMES = range(pm.N, pm.N + 4)
N_LOG = LOG_TIMES + 4
LIMITED, CONTACT, WHEEL_STUCK, LOAD_STUCK = range(4)


class Grid(NamedTuple):
    """What is known of the rows before the run, but for the arrays."""

    start_s: float
    row_s: float
    rows_per_sample: int
    delay_samples: int
    command_limit: float


@njit(error_model="numpy")
def _no_modes(regions):
    """Room for the matrices of every mode: levels (0: not met), A to e, and steps transposed."""
    n_modes = 3 * 3 * 2 * 2 * 3 * 2 * regions
    return (
        np.zeros(n_modes, np.int64),
        np.empty((n_modes, pm.COLUMNS, pm.LANES)),
        np.empty((n_modes, pm.LEVELS, pm.COLUMNS, pm.LANES)),
    )


@njit(error_model="numpy", inline="always")
def _quantised(angle, count):
    return np.floor(angle / count) * count if count > 0.0 else angle


@njit(error_model="numpy")
def _joint_torque(plant, spring, fx, mode, command, z, y, slopes):
    """tau_s where it is no function of the angles: wheel and load are one body."""
    for m in range(pm.N):
        y[m] = z[m]
    return eq.derivative(plant, spring, fx, mode, command, k.Stage(0.0, 0), y, slopes)


@njit(error_model="numpy")
def _given_motion(plant, mode, angle, speed, row, row_s, time, z):
    """The mode with a held load's motion of this row: the cubic between its readings."""
    before, after = speed[row], speed[row + 1]
    z[k.TL], z[k.WL] = angle[row], before
    if plant.structure == mp.RIGID_HELD:
        z[k.WW] = before
    slope = (angle[row + 1] - angle[row]) / row_s
    acceleration = 2.0 * (3.0 * slope - 2.0 * before - after) / row_s
    return k.with_motion(mode, acceleration, 6.0 * (before + after - 2.0 * slope) / row_s**2, time)


@njit(error_model="numpy")
def _sum(steps, index, m, command, i, wheel, speed, load, load_speed, force, rate, curve):
    """One state after a step of the whole row."""
    given = steps[index, 0, pm.COMMAND, m] * command + steps[index, 0, pm.CONSTANT, m]
    forced = steps[index, 0, pm.FORCE, m] * force + steps[index, 0, pm.FORCE_RATE, m] * rate
    forced += steps[index, 0, pm.FORCE_CURVE, m] * curve
    drive = steps[index, 0, k.IM, m] * i + steps[index, 0, k.WW, m] * speed
    angles = steps[index, 0, k.TW, m] * wheel + steps[index, 0, k.TL, m] * load
    return (drive + angles) + (steps[index, 0, k.WL, m] * load_speed + (given + forced))


@njit(error_model="numpy")
def loop(
    plant, spring, fx, controller, parameters, state, grid, time, reference, angle, speed, start,
    timed, ready, systems, steps, log,
):  # fmt: skip
    """Run the sampled loop; `log` (N_LOG, n) is filled. Returns (status, last row)."""
    rows, regions, row_s = reference.shape[0], spring.shape[0], grid.row_s
    z, trial, force_work = np.zeros(k.N_Y), np.zeros(max(k.N_Y, pm.LANES)), np.zeros(3)
    series = np.zeros((pm.TERMS + 1, pm.LANES))
    y, slopes = np.zeros(k.N_Y), np.zeros((1, k.N_SLOPES))
    signals, times = np.zeros(k.N_SIGNALS), np.zeros(4)
    answer, waiting, acting = np.zeros(k.N_COMMANDS), np.zeros(k.N_COMMANDS), np.zeros(k.N_COMMANDS)
    elastic = plant.structure == mp.ELASTIC_FREE or plant.structure == mp.ELASTIC_HELD
    algebraic = plant.inductance == 0.0 or plant.drive not in (mp.DUTY, mp.VOLTAGE)
    wheel_dry, load_dry = fx[e.WHEEL_DRY] != 0.0, fx[e.LOAD_DRY] != 0.0
    worm = fx[e.GEAR_DRIVE_LOSS] != 0.0 or fx[e.GEAR_BACKDRIVE_LOSS] != 0.0
    # what has to be looked at with care each row: a given motion, a pulse, a current that follows
    # its command at once
    limited = plant.current_limit < np.inf
    careful = angle.size > 0 or fx[e.PULSE] != 0.0 or (limited and algebraic)
    careful = careful or plant.structure == mp.RIGID_HELD
    gravity, offset, ratio = plant.gravity, plant.gravity_offset, plant.gear_ratio
    motor_count, load_count = plant.motor_count, plant.load_count
    limit_A, edge, most = plant.current_limit, plant.contact_angle, grid.command_limit
    z[k.TW], z[k.TL] = start
    i, tw, ww, tl, wl = 0.0, start[0], 0.0, start[1], 0.0
    region = pe.region_of(spring, tw - tl)
    mode, command, until_sample = sw.first_mode(plant, fx, z, grid.start_s), 0.0, 0
    about, sine_about, cosine_about = np.inf, 0.0, 1.0  # gravity's sine near an angle, by series
    index, known, sticks, lower, upper = 0, False, False, -np.inf, np.inf
    for row in range(rows):
        anchor, c0, c1 = spring[region, ANCHOR], spring[region, C0], spring[region, C1]
        torque = c0 + c1 * (tw - tl - anchor)
        if not elastic:
            torque = _joint_torque(plant, spring, fx, mode, command, z, y, slopes)
        motor_angle = tw * ratio
        signals[k.REFERENCE] = reference[row, 0]
        signals[k.REFERENCE_RATE] = reference[row, 1]
        signals[k.REFERENCE_ACCELERATION] = reference[row, 2]
        signals[k.READ_MOTOR_ANGLE] = _quantised(motor_angle, motor_count)
        signals[k.READ_LOAD_ANGLE] = _quantised(tl, load_count)
        signals[k.READ_CURRENT] = i
        signals[k.TRUE_MOTOR_ANGLE], signals[k.TRUE_LOAD_ANGLE] = motor_angle, tl
        signals[k.TRUE_TORQUE] = torque
        signals[k.TRUE_MOTOR_VELOCITY], signals[k.TRUE_LOAD_VELOCITY] = ww * ratio, wl
        if until_sample == 0:
            until_sample = grid.rows_per_sample
            controller(parameters, state, signals, answer)
            for m in range(k.N_COMMANDS):
                acting[m] = waiting[m] if grid.delay_samples == 1 else answer[m]
                waiting[m] = answer[m]
            acting[k.COMMAND] = min(max(acting[k.COMMAND], -most), most)
            command = e.acting_command(fx, acting[k.COMMAND])
        until_sample -= 1
        log[k.IM, row], log[k.TW, row], log[k.WW, row] = i, tw, ww
        log[k.TL, row], log[k.WL, row], log[LOG_TORQUE, row] = tl, wl, torque
        log[LOG_COMMAND, row], log[LOG_UNSATURATED, row] = acting[k.COMMAND], acting[k.UNSATURATED]
        for m in range(4):
            if timed[m]:  # memory that is not touched costs nothing
                log[LOG_TIMES + m, row] = times[m]
        if row + 1 == rows:
            break
        if not abs(time[row + 1] - time[row] - row_s) <= UNEVEN * row_s:
            return pe.NOT_EVEN, row
        # a step of the whole row where nothing comes near a switch, else the careful way
        quick = known and abs(i) < limit_A
        if quick:
            force = rate = curve = 0.0
            if gravity != 0.0:
                turned = tl - about
                if not abs(turned) < NEAR:
                    about, turned = tl, 0.0
                    sine_about, cosine_about = np.sin(tl + offset), np.cos(tl + offset)
                square = turned * turned
                small = turned * (1.0 + square * (SINE_3 + square * (SINE_5 + square * SINE_7)))
                less = square * (0.5 + square * (COSINE_4 + square * COSINE_6))
                sine = sine_about + (cosine_about * small - sine_about * less)
                cosine = cosine_about - (sine_about * small + cosine_about * less)
                force, rate = -gravity * sine, -gravity * cosine * wl
                acceleration = (
                    systems[index, k.TW, k.WL] * tw
                    + systems[index, k.TL, k.WL] * tl
                    + systems[index, k.WL, k.WL] * wl
                    + systems[index, k.IM, k.WL] * i
                    + systems[index, k.WW, k.WL] * ww
                    + systems[index, pm.COMMAND, k.WL] * command
                    + systems[index, pm.CONSTANT, k.WL]
                    + systems[index, pm.FORCE, k.WL] * force
                )
                curve = -gravity * (cosine * acceleration - sine * wl * wl)
            i1 = _sum(steps, index, k.IM, command, i, tw, ww, tl, wl, force, rate, curve)
            tw1 = _sum(steps, index, k.TW, command, i, tw, ww, tl, wl, force, rate, curve)
            ww1 = _sum(steps, index, k.WW, command, i, tw, ww, tl, wl, force, rate, curve)
            tl1 = _sum(steps, index, k.TL, command, i, tw, ww, tl, wl, force, rate, curve)
            wl1 = _sum(steps, index, k.WL, command, i, tw, ww, tl, wl, force, rate, curve)
            quick = abs(i1) <= limit_A and (tl1 > edge) == mode.contact
            quick = quick and mode.wheel * ww1 >= 0.0 and mode.load * wl1 >= 0.0
            if elastic:
                quick = quick and lower <= tw1 - tl1 <= upper
            after = c0 + c1 * (tw1 - tl1 - anchor)
            if worm:
                quick = quick and mode.torque_sign * after >= 0.0
            if sticks:
                push = plant.torque_per_ampere * i1 - after
                way, sign = (1 if push > 0.0 else -1), (1 if after > 0.0 else -1)
                quick = quick and abs(push) <= e.gear_friction(fx, way, 0.0, after, sign)
        if quick:
            i, tw, ww, tl, wl = i1, tw1, ww1, tl1, wl1
            times[1] += row_s if mode.contact else 0.0
            times[2] += row_s if sticks else 0.0
            if algebraic or not elastic:
                z[k.IM], z[k.TW], z[k.WW], z[k.TL], z[k.WL] = i, tw, ww, tl, wl
        else:
            z[k.IM], z[k.TW], z[k.WW], z[k.TL], z[k.WL] = i, tw, ww, tl, wl
            begin = grid.start_s + row * row_s
            if angle.size > 0:
                mode = _given_motion(plant, mode, angle, speed, row, row_s, begin, z)
            mode, region, status = pe.advance_row(
                plant, spring, fx, mode, region, command, begin, row_s, z, trial, force_work,
                series, ready, systems, steps, times,
            )  # fmt: skip
            if status != pe.DONE:
                return status, row
            i, tw, ww, tl, wl = z[k.IM], z[k.TW], z[k.WW], z[k.TL], z[k.WL]
            index = pm.index_of(mode, region, regions)
            known = ready[index] != 0 and not careful and mode.limited == 0
            known = known and not (load_dry and mode.load == 0)
            sticks = wheel_dry and mode.wheel == 0
            known = known and not (sticks and (algebraic or not elastic))
            lower = spring[region - 1, UPPER] if region > 0 else -np.inf
            upper = spring[region, UPPER]
        if algebraic:
            i, _ = eq.current_and_voltage(plant, fx, mode, command, z)
            z[k.IM] = i
        if not np.isfinite(ww + tl + i + wl):
            return pe.NOT_FINITE, row
    return pe.DONE, rows - 1


@njit(error_model="numpy")
def _judge(log, reference, first, dry, out):
    """The figures of one run: see `propagator_batch.Batch`."""
    rows = log.shape[1]
    squares = peak = commands = current = 0.0
    for row in range(first, rows):
        error = reference[row, 0] - log[LOG_TORQUE, row]
        squares += error * error
        peak = max(peak, abs(error))
        commands += log[LOG_COMMAND, row] ** 2
        current = max(current, abs(log[k.IM, row]))
    out[0], out[1] = np.sqrt(squares / (rows - first)), peak
    out[2], out[3] = np.sqrt(commands / (rows - first)), current
    out[4] = log[LOG_TIMES + WHEEL_STUCK, rows - 1] if dry else 0.0


def _cached(version):
    def run(
        plant, spring, fx, controller, parameters, states, grid, time, reference, angle, speed,
        start, timed, log, first, judged, kept,
    ):  # fmt: skip
        status, row = pe.DONE, 0
        ready, systems, steps = _no_modes(spring.shape[0])
        for each in range(parameters.shape[0]):
            status, row = loop(
                plant, spring, fx, controller, parameters[each], states[each], grid, time,
                reference, angle, speed, start, timed, ready, systems, steps, log,
            )  # fmt: skip
            if status != pe.DONE and status != pe.NOT_FINITE:
                break
            if judged.shape[0] > 0 and status == pe.DONE:
                _judge(log, reference, first, fx[e.WHEEL_DRY] != 0.0, judged[each])
                if kept.shape[0] > 0:
                    kept[each] = log[LOG_TORQUE]
        if version < 0:
            status = pe.NOT_FINITE
        return status, row

    return njit(cache=True, nogil=True, error_model="numpy")(run)


run = _cached(SOURCE_VERSION)
"""run(plant, spring, fx, controller, parameters, states, grid, time, reference, angle, speed,
start, timed, log, first, judged, kept) -> (status, last row)

Compiled; runs one machine with every row of parameters (runs, p) and states (runs, s). `time` is
(n,), `reference` (n, 3), `angle` and `speed` (n,) a held load's motion or (0,), `start` the wheel's
and the load's angle, `timed` says which of the four times a log (N_LOG, n) keeps. `judged`
(runs, 5) or (0, 5) and `kept` (runs, n) or (0, n) are filled over the rows from `first` on.
"""
