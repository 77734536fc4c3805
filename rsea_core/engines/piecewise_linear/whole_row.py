"""Rows of the nominal five states in which nothing comes near a switch; compiled.

A row costs a product with a small matrix and a few comparisons here, states in registers and all
coefficients of the mode in one array. Each row depends on the one before, so that its time is the
latency of the longest chain of dependent operations: sums are made in pairs, and the command, which
is known last, enters last.

What a switch would need to act and go back within the row counts as near: more than a quarter of
what its value changed over this row and the one before.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

import rsea_core.effects.layout as e
import rsea_core.engines.event_driven.equations as eq
import rsea_core.engines.event_driven.states as k
import rsea_core.engines.piecewise_linear.modes as pm
import rsea_core.machine.plant as mp
from rsea_core.machine.spring_table import ANCHOR, C0, C1, UPPER

SINE_3, SINE_5, SINE_7 = -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0
COSINE_4, COSINE_6 = -1.0 / 24.0, 1.0 / 720.0
NEAR = 0.02  # rad: there the series of sine and cosine are exact to the last bit
LANE, COLUMNS = pm.LANE, pm.COLUMNS
# places in `Work.coefficients`: columns of the step's matrix, what gravity's value and its slope
# that are missing at the row's end add to the states, and the rates of two states
MISSING, SLOPE = COLUMNS * LANE, (COLUMNS + 1) * LANE
LOAD_SPEED_RATE = (COLUMNS + 2) * LANE
CURRENT_RATE = LOAD_SPEED_RATE + COLUMNS


class Fixed(NamedTuple):
    """What a run does not change."""

    row_s: float
    hermite: tuple[float, float, float]  # `modes.hermite` of a row
    gravity: float
    gravity_offset: float
    limit_A: float
    contact_angle: float
    torque_per_ampere: float
    elastic: bool
    worm: bool
    never: bool  # a row must always be looked at: see `fixed_of`
    algebraic: bool  # the current follows its command at once


class Now(NamedTuple):
    """What holds until the next switch."""

    known: bool  # its rows may be quick
    c0: float
    c1: float
    anchor: float
    lower: float
    upper: float
    contact: bool
    wheel: int
    load: int
    torque_sign: int
    sticks: bool  # friction holds the wheel
    load_sticks: bool
    load_applied_Nm: float  # on a load that sticks, without the spring's torque
    load_level: float  # of friction that holds it
    edge_s: float  # when the disturbance next begins or ends


@njit(error_model="numpy")
def fixed_of(machine, row_s, given):
    """What stays for a run; `given`: a held load's motion is."""
    plant, fx = machine.plant, machine.fx
    elastic = plant.structure == mp.ELASTIC_FREE or plant.structure == mp.ELASTIC_HELD
    algebraic = plant.inductance == 0.0 or plant.drive not in (mp.DUTY, mp.VOLTAGE)
    limited = plant.current_limit < np.inf
    # a given motion, a limited current that follows its command at once, what remembers
    never = given or (limited and algebraic)
    never = never or plant.structure == mp.RIGID_HELD or fx[e.INTERNAL_STATES] != 0.0
    return Fixed(
        row_s, pm.hermite(row_s), plant.gravity, plant.gravity_offset, plant.current_limit,
        plant.contact_angle, plant.torque_per_ampere, elastic,
        fx[e.GEAR_DRIVE_LOSS] != 0.0 or fx[e.GEAR_BACKDRIVE_LOSS] != 0.0,
        never or fx[e.COMMAND_DELAY] > 0.0, algebraic,
    )  # fmt: skip


@njit(error_model="numpy")
def _fill(c, modes, fixed, slot):
    """Copy what a row needs of a mode's matrices to its coefficients `c`."""
    by_value, by_slope, fourth_by_value = fixed.hermite
    step, system = modes.steps[slot, 0], modes.systems[slot]
    for column in range(COLUMNS):
        for j in range(k.N_STATES):
            c[column * LANE + j] = step[column, j]
        c[LOAD_SPEED_RATE + column] = system[column, k.WL]
        c[CURRENT_RATE + column] = system[column, k.IM]
    for j in range(k.N_STATES):
        third, fourth = step[pm.THIRD, j], step[pm.FOURTH, j]
        c[MISSING + j] = by_value * third - fourth_by_value * fourth
        c[SLOPE + j] = by_value * fourth - by_slope * third


@njit(error_model="numpy")
def now_of(machine, modes, work, fixed, mode, region, slot, command):
    """What holds in a mode and region; `slot` -1: its matrices are not made."""
    plant, fx, spring, y = machine.plant, machine.fx, machine.spring, work.y
    sticks = fx[e.WHEEL_DRY] != 0.0 and mode.wheel == 0
    load_sticks = fx[e.LOAD_DRY] != 0.0 and mode.load == 0
    known = slot >= 0 and not fixed.never and mode.limited == 0
    known = known and not (sticks and fixed.algebraic)
    known = known and (fixed.elastic or not (sticks or load_sticks))
    drive_change, level, edge_s = 0.0, 0.0, np.inf
    if known and load_sticks:
        _, load, output, _ = eq.pushes(plant, spring, fx, mode, command, y)
        drive_change, level = (
            load - output,
            e.load_friction(fx, 0.0, y[k.TL] + plant.gravity_offset),
        )
    if fx[e.PULSE] != 0.0 and (mode.pulse or mode.row_time < fx[e.PULSE_START]):
        edge_s = fx[e.PULSE_END] if mode.pulse else fx[e.PULSE_START]
    lower = spring[region - 1, UPPER] if region > 0 else -np.inf
    if known:
        _fill(work.coefficients, modes, fixed, slot)
    return Now(
        known, spring[region, C0], spring[region, C1], spring[region, ANCHOR], lower,
        spring[region, UPPER], mode.contact, mode.wheel, mode.load, mode.torque_sign, sticks,
        load_sticks, drive_change, level, edge_s,
    )  # fmt: skip


@njit(error_model="numpy", forceinline=True)
def _sum(c, j, command, z, force):
    """One state after a step of the whole row."""
    i, wheel, speed, load, load_speed = z
    states = pm.STATES * LANE + j
    forced = c[pm.FORCE * LANE + j] * force[0] + c[pm.RATE * LANE + j] * force[1]
    drive = c[states] * i + c[states + 2 * LANE] * speed
    angles = c[states + LANE] * wheel + c[states + 3 * LANE] * load
    curve = c[pm.CURVE * LANE + j]
    forced += curve * force[2] + c[pm.CONSTANT * LANE + j]
    known = (drive + angles) + (c[states + 4 * LANE] * load_speed + forced)
    return known + (c[pm.COMMAND * LANE + j] + curve * force[3]) * command


@njit(error_model="numpy", forceinline=True)
def _added(c, j, missing, slope):
    """What gravity's third and fourth derivative add to a state."""
    return c[MISSING + j] * missing + c[SLOPE + j] * slope


@njit(error_model="numpy", forceinline=True)
def sine_near(turned, gravity_sines):
    """Sine and cosine of an angle that is `turned` from one whose sine and cosine are known."""
    sine, cosine = gravity_sines
    square = turned * turned
    fourth = square * square
    small = turned + turned * square * (SINE_3 + square * SINE_5 + fourth * SINE_7)
    less = square * (0.5 + square * COSINE_4 + fourth * COSINE_6)
    return (sine - sine * less) + cosine * small, (cosine - cosine * less) - sine * small


@njit(error_model="numpy", forceinline=True)
def sine_very_near(turned, gravity_sines):
    """The same for a turn whose square is below rounding: what gravity's bend adds in a row."""
    return gravity_sines[0] + gravity_sines[1] * turned, gravity_sines[1] - gravity_sines[
        0
    ] * turned


@njit(error_model="numpy", forceinline=True)
def force_of(c, z, gravity_sines):
    """Gravity's torque and its first two derivatives; `gravity_sines` are times gravity.

    The second derivative is the third number plus the fourth times the command.
    """
    i, wheel, speed, load, load_speed = z
    sine, cosine = gravity_sines
    states = LOAD_SPEED_RATE + pm.STATES
    drive = c[states] * i + c[states + 2] * speed
    angles = c[states + 1] * wheel + c[states + 3] * load
    rest = c[LOAD_SPEED_RATE + pm.CONSTANT] - c[LOAD_SPEED_RATE + pm.FORCE] * sine
    known = (drive + angles) + (c[states + 4] * load_speed + rest)
    curve = sine * load_speed * load_speed - cosine * known
    return -sine, -cosine * load_speed, curve, -cosine * c[LOAD_SPEED_RATE + pm.COMMAND]


@njit(error_model="numpy", forceinline=True)
def moved(c, command, z, force):
    """The five states a row later, by gravity's first three terms."""
    return (
        _sum(c, k.IM, command, z, force),
        _sum(c, k.TW, command, z, force),
        _sum(c, k.WW, command, z, force),
        _sum(c, k.TL, command, z, force),
        _sum(c, k.WL, command, z, force),
    )


@njit(error_model="numpy", forceinline=True)
def with_high_order(c, fixed, command, z, force, gravity_sines, fastest):
    """The states with gravity met at the row's end too, and whether that is enough."""
    i, wheel, speed, load, load_speed = z
    missing, slope = pm.missing_at_end(
        fixed.row_s, force[0], force[1], force[2] + force[3] * command, -gravity_sines[0],
        -gravity_sines[1] * load_speed,
    )  # fmt: skip
    third, fourth = pm.high_derivatives(fixed.hermite, missing, slope)
    missed = c[pm.THIRD * LANE + k.TL] * third * fixed.gravity
    smooth = pm.is_smooth(
        c[pm.THIRD * LANE + k.WL] * third, c[pm.FOURTH * LANE + k.WL] * fourth,
        c[pm.FORCE * LANE + k.WL] * missed, fastest,
    )  # fmt: skip
    return smooth, (
        i + _added(c, k.IM, missing, slope),
        wheel + _added(c, k.TW, missing, slope),
        speed + _added(c, k.WW, missing, slope),
        load + _added(c, k.TL, missing, slope),
        load_speed + _added(c, k.WL, missing, slope),
    )


@njit(error_model="numpy", forceinline=True)
def first_change(c, row_s, command, z):
    """What the current would change in a row at the slope with which it begins [A].

    The command jumps between rows: the current may rise first and fall then, which neither its
    change over this row nor the one before shows.
    """
    states = CURRENT_RATE + pm.STATES
    drive = c[states] * z[0] + c[states + 2] * z[2]
    given = c[CURRENT_RATE + pm.COMMAND] * command + c[CURRENT_RATE + pm.CONSTANT]
    return row_s * abs(drive + given)


@njit(error_model="numpy", forceinline=True)
def stays(c, fx, fixed, now, command, z, z1, last):
    """Whether nothing came near a switch from z to z1; `last`: what changed in the row before."""
    i, wheel, speed, load, load_speed = z
    i1, wheel1, speed1, load1, load_speed1 = z1
    quarter = 0.25 * fixed.row_s
    first_A = first_change(c, fixed.row_s, command, z)
    rise_A = max(last[0], first_A)
    clear = max(abs(i), abs(i1)) + 0.25 * (abs(i1 - i) + rise_A) < fixed.limit_A
    clear = clear and now.wheel * speed1 >= 0.25 * abs(now.wheel) * (abs(speed1 - speed) + last[1])
    slip_limit = 0.25 * abs(now.load) * (abs(load_speed1 - load_speed) + last[2])
    clear = clear and now.load * load_speed1 >= slip_limit
    if fixed.contact_angle < np.inf:
        beyond = load1 - fixed.contact_angle
        reach = quarter * (abs(load_speed) + abs(load_speed1))
        clear = clear and (beyond > reach if now.contact else beyond + reach < 0.0)
    after = now.c0 + now.c1 * (wheel1 - load1 - now.anchor)
    reach = quarter * (abs(speed - load_speed) + abs(speed1 - load_speed1))
    if fixed.elastic:
        clear = clear and now.lower + reach <= wheel1 - load1 <= now.upper - reach
    if fixed.worm:
        clear = clear and now.torque_sign * after >= now.c1 * reach
    before = now.c0 + now.c1 * (wheel - load - now.anchor)
    if now.sticks:
        drive_change = fixed.torque_per_ampere * i1 - after
        drive_sign, sign = (1 if drive_change > 0.0 else -1), (1 if after > 0.0 else -1)
        begun = fixed.torque_per_ampere * i - before
        change = 0.25 * (
            abs(drive_change - begun) + max(last[3], fixed.torque_per_ampere * first_A)
        )
        most = max(abs(drive_change), abs(begun)) + change
        clear = clear and most <= e.gear_friction(fx, drive_sign, 0.0, after, sign)
    if now.load_sticks:
        change = 0.25 * (abs(after - before) + last[4])
        clear = clear and abs(now.load_applied_Nm + after) + change <= now.load_level
    return clear
