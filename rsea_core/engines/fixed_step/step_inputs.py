"""What comes from outside in a fixed step: given motions, late commands, pulses; compiled."""

from typing import NamedTuple

import numpy as np
from numba import njit

import rsea_core.effects.layout as e
import rsea_core.machine.plant as mp

# without numba's own inlining, see `step_torques`
acting_command = njit(error_model="numpy")(e.acting_command.py_func)


class Row(NamedTuple):
    """What the drive is given over a row."""

    index: int
    length: float  # [s]
    volts_per_command: float  # the supply, measured or the rig's
    closed: bool  # the bridge; open: no current flows


class Piece(NamedTuple):
    """The part of a row in which one command acts, in n steps of h."""

    command: float
    volts: float  # that it puts on the winding
    torque: float  # of a drive whose command is one, at the gear output
    closed: bool
    electric: bool  # the winding follows a voltage
    begin: float  # [s]
    length: float
    n: int
    h: float
    half: float
    per_h: float


class Motion(NamedTuple):
    """A given motion over a piece: x0 + v0 t + a t^2/2 + j t^3/6."""

    angle: float
    speed: float
    acceleration: float
    jerk: float


@njit(error_model="numpy")
def motion_at(motion, t):
    """Angle and speed of a given motion."""
    angle = motion.angle + t * (
        motion.speed + t * (0.5 * motion.acceleration + t * motion.jerk / 6.0)
    )
    return angle, motion.speed + t * (motion.acceleration + 0.5 * t * motion.jerk)


@njit(error_model="numpy")
def standing(angle):
    """The motion of what stands at an angle."""
    return Motion(angle, 0.0, 0.0, 0.0)


@njit(error_model="numpy")
def motion_of(angle, speed, row, h):
    """The cubic between two rows of a given motion."""
    slope = (angle[row + 1] - angle[row]) / h
    before, after = speed[row], speed[row + 1]
    return Motion(
        angle[row],
        before,
        2.0 * (3.0 * slope - 2.0 * before - after) / h,
        6.0 * (before + after - 2.0 * slope) / (h * h),
    )


@njit(error_model="numpy")
def later(motion, t):
    """A given motion counted from a later time."""
    angle, speed = motion_at(motion, t)
    return Motion(angle, speed, motion.acceleration + t * motion.jerk, motion.jerk)


@njit(error_model="numpy")
def next_piece(time, row, delay, offset, latest):
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


@njit(error_model="numpy", inline="always")
def tapered_area(x, taper):
    """Integral from 0 to x of a pulse over 0..1 whose flanks are cosines over taper/2 each."""
    x = min(max(x, 0.0), 1.0)
    if taper <= 0.0:
        return x
    half = 0.5 * taper
    rise = min(x, half)
    area = 0.5 * (rise - half / np.pi * np.sin(np.pi * rise / half))
    if x > half:
        area += min(x, 1.0 - half) - half
    if x > 1.0 - half:
        left = x - (1.0 - half)
        area += 0.5 * (left + half / np.pi * np.sin(np.pi * left / half))
    return area


@njit(error_model="numpy")
def risen_area(t, rise):
    """Integral from 0 to t of a share that rises from 0 to 1 within `rise`."""
    return 0.5 * t * t / rise if t < rise else t - 0.5 * rise


@njit(error_model="numpy")
def pulse_share(fx, start, h):
    """Mean of the disturbance over a step, of its peak: a pulse with cosine flanks (Tukey)."""
    if fx[e.PULSE] == 0.0:
        return 0.0
    rise = fx[e.PULSE_RISE]
    if rise > 0.0:
        begin = max(start, fx[e.PULSE_START])
        end = max(min(start + h, fx[e.PULSE_END]), begin)
        until, since = end - fx[e.PULSE_START], begin - fx[e.PULSE_START]
        return (risen_area(until, rise) - risen_area(since, rise)) / h
    length = fx[e.PULSE_END] - fx[e.PULSE_START]
    begin = (start - fx[e.PULSE_START]) / length
    after = tapered_area(begin + h / length, fx[e.PULSE_TAPER])
    return (after - tapered_area(begin, fx[e.PULSE_TAPER])) * length / h


@njit(error_model="numpy", forceinline=True)
def given_motions(columns, row, length, before):
    """Motions of load and gear over a row where they are given; `before`: those of the last row."""
    load, gear = before
    if columns.load_angle.size > 0:
        load = motion_of(columns.load_angle, columns.load_speed, row, length)
        gear = load
    if columns.gear_angle.size > 0:
        gear = motion_of(columns.gear_angle, columns.gear_speed, row, length)
    return load, gear


@njit(error_model="numpy", forceinline=True)
def row_of(plant, index, time, supply, enabled):
    """What the drive is given over a row; supply, enabled (n,) or (0,) arrays."""
    volts = plant.volts_per_command
    if supply.size > 0 and plant.drive == mp.DUTY:
        volts = supply[index]
    closed = enabled.size == 0 or enabled[index] != 0.0
    return Row(index, time[index + 1] - time[index], volts, closed)


@njit(error_model="numpy", forceinline=True)
def goal_of(plant, time, command, row):
    """The goal of a row, led by its rate since the row before."""
    goal = command[row]
    if plant.goal_rate_s > 0.0 and row > 0:
        rate = (goal - command[row - 1]) / (time[row] - time[row - 1])
        goal += plant.goal_rate_s * rate
    return goal


@njit(error_model="numpy", forceinline=True)
def piece_of(machine, fx, row, time, command, n, offset, latest):
    """The `Piece` that begins at an offset within a row, and the last row whose command acts.

    time, command : (n,) arrays
    n : steps of the whole row
    latest : as `next_piece`
    """
    acting, end = row.index, row.length
    delay = fx[e.COMMAND_DELAY]
    if delay > 0.0:
        latest, end = next_piece(time, row.index, delay, offset, latest)
        acting = latest
        n = max(int(np.ceil(n * (end - offset) / row.length - 1e-9)), 1)
    if machine.servo:  # its goal before the first one is that one
        acts = goal_of(machine.plant, time, command, max(acting, 0)) + fx[e.COMMAND_OFFSET]
    else:
        given = command[acting] if acting >= 0 else 0.0
        acts = acting_command(fx, given + fx[e.COMMAND_DRIFT] * (time[row.index] - time[0]))
    torque, length = 0.0, end - offset
    if machine.plant.drive == mp.MOTOR_TORQUE and row.closed:
        torque = machine.plant.torque_per_motor_torque * acts
    h = length / n if n > 1 else length
    electric = machine.winding and row.closed
    piece = Piece(
        command=acts,
        volts=acts * row.volts_per_command,
        torque=torque,
        closed=row.closed,
        electric=electric,
        begin=time[row.index] + offset,
        length=length,
        n=n,
        h=h,
        half=0.5 * h,
        per_h=1.0 / h,
    )
    return piece, end, latest
