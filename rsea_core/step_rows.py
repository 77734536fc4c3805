"""Rows of the fast engine: inputs held from row to row, readings, restarts; compiled.

A job is a window of one recording run by one set of numbers from one start state. Jobs are
independent and each writes its own rows, so that results do not depend on the threads.
"""

from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

import rsea_core.effects as e
import rsea_core.kernel as k
import rsea_core.step_laws as s
import rsea_core.step_parts as p
import rsea_core.stepping as st
from rsea_core.compiled import SOURCE_VERSION

DONE = -1  # a job's status; else the row that was not finite
HUGE = 1e100


class Columns(NamedTuple):
    """What is known of every row; columns that a recording does not have are empty."""

    time: NDArray  # (n,)
    steps: NDArray  # (n,) steps within each row, the last unused
    command: NDArray  # (n,)
    supply: NDArray  # (n,) or (0,) measured supply [V]
    enabled: NDArray  # (n,) or (0,) 0 where the bridge is open
    load_angle: NDArray  # (n,) or (0,) of a given load
    load_speed: NDArray
    wheel_angle: NDArray  # (n,) or (0,) of a given wheel (a spring bench)
    wheel_speed: NDArray


@njit(error_model="numpy")
def as_plant(p):
    """The `Plant` of its numbers in an array."""
    return k.Plant(
        int(p[0]), int(p[1]), p[2], p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11],
        p[12], p[13], p[14], p[15], p[16], p[17], p[18], p[19], p[20], p[21],
    )  # fmt: skip


@njit(error_model="numpy")
def _motion(angle, speed, row, h):
    """The cubic between two rows of a given motion."""
    if angle.size == 0 or row + 1 >= angle.size:
        return p.Motion(0.0, 0.0, 0.0, 0.0)
    slope = (angle[row + 1] - angle[row]) / h
    before, after = speed[row], speed[row + 1]
    return p.Motion(
        angle[row],
        before,
        2.0 * (3.0 * slope - 2.0 * before - after) / h,
        6.0 * (before + after - 2.0 * slope) / (h * h),
    )


@njit(error_model="numpy")
def start_state(plant, fx, wheel, load, y):
    """A machine at rest without current and with relaxed branches, brought there once."""
    for m in range(s.N_STEP_STATES):
        y[m] = 0.0
    y[s.WHEEL], y[s.LOAD], y[s.LINK] = wheel, load, load
    half = 0.5 * fx[e.BACKLASH]
    y[s.OUTPUT] = min(max(load, wheel - half), wheel + half) if half > 0.0 else wheel
    y[s.WINDING_RISE], y[s.CASE_RISE] = fx[e.START_WINDING], fx[e.START_CASE]
    deflection = p.deflection_of(plant, fx, y[s.OUTPUT], load)
    pieces = 200
    for _ in range(pieces):
        s.remember(fx, y, deflection / pieces, 1.0)
    y[s.BRANCH : s.BRANCH + e.N_BRANCHES] = 0.0


@njit(error_model="numpy")
def resting_joint(plant, fx, y):
    """Torque between the two sides of a rigid machine that starts without command."""
    load = plant.load_torque - plant.gravity * np.sin(y[s.LOAD] + plant.gravity_offset)
    hold = fx[e.GEAR_FORWARD] + fx[e.LOAD_COULOMB]
    if abs(load) <= hold or plant.structure == k.RIGID_HELD:
        return -load
    return plant.load_inertia * load / (plant.inertia + plant.load_inertia) - load


@njit(error_model="numpy")
def read(plant, spring, fx, on, y, joint, out, row):
    out[row, p.MOTOR_ANGLE] = y[s.WHEEL] * plant.gear_ratio
    out[row, p.LOAD_ANGLE] = y[s.LOAD]
    out[row, p.TORQUE] = joint if on.rigid else p.spring_reading(plant, spring, fx, on, y)
    out[row, p.READ_CURRENT] = y[s.CURRENT]
    out[row, p.TEMPERATURE] = y[s.CASE_RISE]
    out[row, p.MOTOR_SPEED] = y[s.WHEEL_SPEED] * plant.gear_ratio
    out[row, p.LOAD_SPEED_READ] = y[s.LOAD_SPEED]


@njit(error_model="numpy")
def _next_piece(time, row, delay, offset, latest):
    """The last row whose command acts at an offset within a row, and where that piece ends.

    Rows are searched from `latest` on, -1 before the first one acts.
    """
    length = time[row + 1] - time[row]
    slack = 1e-9 * length  # a delay of whole rows makes no slivers
    now = time[row] + offset - delay + slack
    while latest < row and time[latest + 1] <= now:
        latest += 1
    if latest == row:
        return latest, length
    due = time[latest + 1] + delay - time[row]
    return latest, due if due < length - slack else length


@njit(error_model="numpy")
def _later(motion, t):
    """A given motion counted from a later time."""
    angle, speed = p.motion_at(motion, t)
    return p.Motion(angle, speed, motion.acceleration + t * motion.jerk, motion.jerk)


@njit(error_model="numpy")
def one_row(
    plant, spring, fx, on, time, steps, command, row, latest, source, enabled, load_motion,
    wheel_motion, y,
):  # fmt: skip
    """Advance y over one row; returns the last row whose command acts, and the joint torque.

    A row is cut where a late command begins to act. `source` is the voltage of a duty of one.
    """
    length, delay, joint = time[row + 1] - time[row], fx[e.COMMAND_DELAY], 0.0
    offset = 0.0
    while offset < length:
        acting, end, n = row, length, steps
        if delay > 0.0:
            latest, end = _next_piece(time, row, delay, offset, latest)
            acting = latest
            n = max(int(np.ceil(n * (end - offset) / length - 1e-9)), 1)
        told = p.acting_command(fx, command[acting]) if acting >= 0 else 0.0
        piece = p.Input(told * source, told, enabled, time[row] + offset)
        h = (end - offset) / n
        if on.plain:
            st.advance_plain(plant, spring, fx, on, piece, load_motion, wheel_motion, h, n, y)
        else:
            joint = st.advance(plant, spring, fx, on, piece, load_motion, wheel_motion, h, n, y)
        if end < length:
            load_motion = _later(load_motion, end - offset)
            wheel_motion = _later(wheel_motion, end - offset)
        offset = end
    return latest, joint


@njit(error_model="numpy")
def is_finite(y):
    """Whether the states are numbers that mean something."""
    size = abs(y[s.CURRENT]) + abs(y[s.WHEEL]) + abs(y[s.WHEEL_SPEED])
    size += abs(y[s.LOAD]) + abs(y[s.LOAD_SPEED]) + abs(y[s.WINDING_RISE])
    return size < HUGE


@njit(error_model="numpy")
def run_window(
    plant, spring, fx, time, steps, command, supply, enabled, load_angle, load_speed,
    wheel_angle, wheel_speed, first, last, y, out, states,
):  # fmt: skip
    """Run rows first..last from the state y at row first; DONE or the row that failed.

    Arrays are those of `Columns`, arguments of their own because taking one out of a tuple
    counts references each time.

    out : (last - first + 1, N_CHANNELS) array, filled
    states : (last - first + 1, N_STEP_STATES) array to be filled, or one without rows
    """
    on = p.switches(plant, spring, fx)
    joint, latest = resting_joint(plant, fx, y), -1
    measured = supply.size > 0 and plant.drive == k.DUTY
    switched, given, benched = enabled.size > 0, load_angle.size > 0, wheel_angle.size > 0
    none = p.Motion(0.0, 0.0, 0.0, 0.0)
    if on.load_given and given:
        y[s.LOAD], y[s.LOAD_SPEED] = load_angle[first], load_speed[first]
    if on.wheel_given:
        y[s.WHEEL], y[s.WHEEL_SPEED] = y[s.LOAD], y[s.LOAD_SPEED]
        if benched:
            y[s.WHEEL], y[s.WHEEL_SPEED] = wheel_angle[first], wheel_speed[first]
    for row in range(first, last + 1):
        read(plant, spring, fx, on, y, joint, out, row - first)
        if states.shape[0] > 0:
            for m in range(s.N_STEP_STATES):
                states[row - first, m] = y[m]
        if row == last:
            break
        length = time[row + 1] - time[row]
        load_motion, wheel_motion = none, none
        if given:
            load_motion = wheel_motion = _motion(load_angle, load_speed, row, length)
        elif on.load_given:
            load_motion = p.Motion(y[s.LOAD], 0.0, 0.0, 0.0)
            wheel_motion = load_motion
        if benched:
            wheel_motion = _motion(wheel_angle, wheel_speed, row, length)
        open_bridge = switched and enabled[row] == 0.0
        source = supply[row] if measured else plant.volts_per_command
        latest, joint = one_row(
            plant, spring, fx, on, time, steps[row], command, row, latest, source,
            not open_bridge, load_motion, wheel_motion, y,
        )  # fmt: skip
        if not is_finite(y):
            for late in range(row + 1 - first, out.shape[0]):
                for m in range(p.N_CHANNELS):
                    out[late, m] = np.nan
            return row + 1
    return DONE


@intrinsic
def unowned(typing_context, array):
    """The same array without an owner, so that passing it on counts no references.

    The counting is atomic and takes as long as a step. Whoever calls keeps the memory alive.
    """

    def build(context, builder, signature, arguments):
        found = context.make_array(array)(context, builder, arguments[0])
        found.meminfo = cgutils.get_null_value(found.meminfo.type)
        found.parent = cgutils.get_null_value(found.parent.type)
        return found._getvalue()

    return array(array), build


def _cached(version, parallel):
    def run_jobs(plants, springs, ends, fx, columns, jobs, starts, out, states, status):
        for j in prange(jobs.shape[0]):
            model, first, last, at = jobs[j]
            begin = ends[model - 1] if model > 0 else version * 0
            rows = last - first + 1
            kept = states[at : at + rows] if states.shape[0] > 0 else states
            status[j] = run_window(
                as_plant(plants[model]), unowned(springs[begin : ends[model]]),
                unowned(fx[model]), unowned(columns.time), unowned(columns.steps),
                unowned(columns.command), unowned(columns.supply), unowned(columns.enabled),
                unowned(columns.load_angle), unowned(columns.load_speed),
                unowned(columns.wheel_angle), unowned(columns.wheel_speed), first, last,
                unowned(starts[j]), unowned(out[at : at + rows]), unowned(kept),
            )  # fmt: skip

    return njit(cache=True, nogil=True, error_model="numpy", parallel=parallel)(run_jobs)


run_jobs = _cached(SOURCE_VERSION, False)
"""run_jobs(plants, springs, ends, fx, columns, jobs, starts, out, states, status), compiled.

plants (m, plant numbers), springs (all regions, 6) whose model j ends at row ends[j], fx (m,
N_EFFECTS); jobs (n, 4) of model, first row, last row, row of `out` where it writes; starts (n,
N_STEP_STATES) overwritten, out (rows, N_CHANNELS), states (rows or 0, N_STEP_STATES), status (n,).
"""
run_jobs_parallel = _cached(SOURCE_VERSION, True)


@njit(error_model="numpy", cache=True)
def starts_at_rest(plants, fx, motor_angle, load_angle, starts):
    """Start states (n, N_STEP_STATES) at rest for each model."""
    for j in range(starts.shape[0]):
        plant = as_plant(plants[j])
        start_state(plant, fx[j], motor_angle / plant.gear_ratio, load_angle, starts[j])


@njit(error_model="numpy", cache=True)
def warm(plant_numbers, fx, time, path, y, states):
    """Internal states along a given motion.

    path : (n, 5) array of current, wheel angle and speed, load angle and speed
    y : start state, overwritten; states : (n, N_STEP_STATES) array, filled
    """
    plant = as_plant(plant_numbers)
    half = 0.5 * fx[e.BACKLASH]
    thermal, deflection = fx[e.WINDING_CAPACITY] > 0.0, 0.0
    for row in range(time.size):
        y[s.CURRENT : s.LOAD_SPEED + 1] = path[row]
        wheel, load = y[s.WHEEL], y[s.LOAD]
        if half > 0.0:
            near = y[s.OUTPUT] if row > 0 else load
            y[s.OUTPUT] = min(max(near, wheel - half), wheel + half)
            touching = abs(wheel - y[s.OUTPUT]) >= half
            y[s.OUTPUT_SPEED] = y[s.WHEEL_SPEED] if touching else y[s.LOAD_SPEED]
        else:
            y[s.OUTPUT], y[s.OUTPUT_SPEED] = wheel, y[s.WHEEL_SPEED]
        y[s.LINK], y[s.LINK_SPEED] = load, y[s.LOAD_SPEED]
        now = p.deflection_of(plant, fx, y[s.OUTPUT], load)
        if row > 0:
            h = time[row] - time[row - 1]
            s.remember(fx, y, now - deflection, h)
            moved, swung = wheel - path[row - 1, 1], load - path[row - 1, 3]
            y[s.GEAR_STRETCH] = s.clip(y[s.GEAR_STRETCH] + moved, fx[e.GEAR_PRESLIDING])
            y[s.LOAD_STRETCH] = s.clip(y[s.LOAD_STRETCH] + swung, fx[e.LOAD_PRESLIDING])
            if thermal:
                resistance = plant.resistance * (1.0 + fx[e.RESISTANCE_RISE] * y[s.WINDING_RISE])
                s.warm_up(fx, y, resistance * path[row - 1, 0] ** 2, h)
        deflection = now
        states[row] = y
