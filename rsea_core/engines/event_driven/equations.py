"""The equations that every model shares, compiled once: states, powers, switches.

States on the output side of the gear: current, wheel angle and speed, load angle and speed.
A machine is a `Plant` of numbers, a controller a compiled function with the signature
`CONTROLLER`, so one compilation serves every machine, load and controller; the terms' numbers
are one array (`effects`). What switches (the current limit, the contact, stick and slip of a
dry joint, the sign of the transmitted torque, a pulse) is a `Mode`: with the mode fixed the
equations are smooth; `switches` says where it must change and `integrator` does the stepping.

Dry friction is set-valued. A stuck joint has no motion at all, its speed is zero and its angle
stays to the bit; it starts where what pushes it exceeds the breakaway level, and stops where
its speed crosses zero and the push is within the level. The current goes on meanwhile.

    L i'      = u - R i - k_e w_m                      (|i| held at the limit while u pushes out)
    J w_w'    = N k_t i - B w_w - tau_s - tau_f        J = N^2 J_m + J_o, B = N^2 B_m + B_o
    J_l w_l'  = tau_s + tau_load - B_l w_l - G sin(theta_l + offset) - tau_contact - tau_fl
    tau_s     = f(theta_w - theta_l)
"""

from typing import NamedTuple

import numpy as np
from numba import float64, njit, types

import rsea_core.effects.layout as e
import rsea_core.engines.event_driven.memory as m
from rsea_core.effects.gear_transmission_error import angle_error
from rsea_core.machine.plant import (
    CURRENT,
    DUTY,
    ELASTIC_FREE,
    ELASTIC_HELD,
    MOTOR_TORQUE,
    RIGID_FREE,
    VOLTAGE,
)
from rsea_core.machine.spring_table import table_torque

# states of the nominal machine; an angle's speed is the index after it
IM, TW, WW, TL, WL = range(5)


N_STATES = 5


# states of terms: wheel behind the play, outer link, Bouc-Wen stretch, Maxwell branches, heat
TB, WB, TO, WO, BW, BRANCH, WINDING, CASE = 5, 6, 7, 8, 9, 10, 13, 14


RAMP = 15  # share of a disturbance that rises


N_ALL_STATES = 16


# what stays between events and is carried behind the states: stop operators' anchors and ways,
# signs of the spring's rate and of the Bouc-Wen stretch, the flank in mesh (0 free), the energy
# that impacts have taken, knees of the spring passed, side of the gear's presliding stretch,
# whether a disturbance has risen
ANCHOR = N_ALL_STATES


WAY = ANCHOR + m.N_STOPS


RATE_SIGN = WAY + m.N_STOPS


STRETCH_SIGN, FLANK, IMPACT, KNEE, GEAR_SIDE, RISEN = range(RATE_SIGN + 1, RATE_SIGN + 7)


N_Y = RISEN + 1


# running integrals: energies [J], then times [s]
SUPPLIED, JOULE, DRIVE_VISCOUS, LOAD_VISCOUS, CONTACT_LOSS, LOAD_WORK, MISMATCH = range(7)


GEAR_FRICTION, LOAD_FRICTION, DRAG_LOSS, SPRING_LOSS, LINK_LOSS = range(7, 12)


LIMITED_TIME, CONTACT_TIME, WHEEL_STUCK_TIME, LOAD_STUCK_TIME = range(12, 16)


N_INTEGRALS = 16


# what a controller is given each time it acts
REFERENCE, REFERENCE_RATE, REFERENCE_ACCELERATION = 0, 1, 2


READ_MOTOR_ANGLE, READ_LOAD_ANGLE, READ_CURRENT = 3, 4, 5


TRUE_MOTOR_ANGLE, TRUE_LOAD_ANGLE, TRUE_TORQUE = 6, 7, 8


TRUE_MOTOR_VELOCITY, TRUE_LOAD_VELOCITY = 9, 10


N_SIGNALS = 11


# what a controller answers: the command, and what it would be without saturation
COMMAND, UNSATURATED = 0, 1


N_COMMANDS = 2


# columns of the log
LOG_STATES = 0


LOG_TORQUE = N_STATES


LOG_COMMAND = N_STATES + 1


LOG_UNSATURATED = N_STATES + 2


LOG_READ_MOTOR, LOG_READ_LOAD = N_STATES + 3, N_STATES + 4


LOG_INTEGRALS = N_STATES + 5


N_LOG = LOG_INTEGRALS + N_INTEGRALS


# what can switch
CURRENT_SWITCH, CONTACT_SWITCH, WHEEL_SWITCH, LOAD_SWITCH, TORQUE_SWITCH, PULSE_SWITCH = range(6)


FLANK_SWITCH, RATE_SWITCH, STRETCH_SWITCH, KNEE_SWITCH, STOP_SWITCH = range(6, 11)


SIDE_SWITCH, RISEN_SWITCH = STOP_SWITCH + m.N_STOPS, STOP_SWITCH + m.N_STOPS + 1


N_NOMINAL_SWITCHES, N_TERM_SWITCHES, N_SWITCHES = 2, 6, RISEN_SWITCH + 1


CONTROLLER = types.void(float64[::1], float64[::1], float64[::1], float64[::1])
"""Signature of a controller: (parameters, state, signals, command), the last one is written."""


class Mode(NamedTuple):
    """What stays as it is between two events, and the row's given motion of the load."""

    limited: int  # -1, 0, 1: the current is held at this limit
    contact: bool
    acceleration: float  # of the held load at the row's start
    jerk: float
    wheel: int  # -1, 0, 1: a dry wheel slides this way, 0 sticks
    load: int
    torque_sign: int  # -1, 1: of the spring torque, where friction depends on it
    pulse: bool  # the disturbance acts
    row_time: float  # of the row's start


@njit(error_model="numpy", inline="always")
def with_motion(mode, acceleration, jerk, row_time):
    """The mode with a row's start time and given motion of a held load."""
    return Mode(mode.limited, mode.contact, acceleration, jerk, mode.wheel, mode.load,
                mode.torque_sign, mode.pulse, row_time)  # fmt: skip


@njit(error_model="numpy", inline="always")
def winding(plant, fx, y):
    """Resistance [ohm] and the factor on k_t and k_e, by heat and the motor's angle."""
    if fx[e.ANY] == 0.0:
        return plant.resistance, 1.0
    resistance = plant.resistance * (1.0 + fx[e.RESISTANCE_RISE] * y[WINDING])
    return resistance, e.constant_factor(fx, y[TW], y[CASE], y[WINDING])


@njit(error_model="numpy", inline="always")
def current_and_voltage(plant, fx, mode, command, y):
    """Current and the voltage at the winding."""
    resistance, factor = winding(plant, fx, y)
    emf = factor * plant.volts_per_speed * y[WW]
    if plant.drive == DUTY or plant.drive == VOLTAGE:
        volts = command * plant.volts_per_command
        if mode.limited != 0:
            current = mode.limited * plant.current_limit
            return current, resistance * current + emf
        if plant.inductance > 0.0:
            sag = e.source_ohm(fx, command, y[IM])
            return y[IM], volts - sag * y[IM] - e.dead_time_volts(fx, plant, y[IM])
        sag = e.source_ohm(fx, command, volts - emf)
        current = e.dead_time_current(fx, plant, volts - emf, resistance + sag)
        return current, volts - sag * current - e.dead_time_volts(fx, plant, current)
    if plant.drive == CURRENT:
        current = min(max(command, -plant.current_limit), plant.current_limit)
        return current, resistance * current + emf
    return 0.0, 0.0


@njit(error_model="numpy", inline="always")
def _drive_torque(plant, command, current, factor):
    if plant.drive == MOTOR_TORQUE:
        return plant.torque_per_motor_torque * command
    return factor * plant.torque_per_ampere * current


@njit(error_model="numpy", inline="always")
def deflection_and_rate(plant, fx, y):
    """Deflection of the spring [rad], its rate [rad/s], lever of its torque on the wheel."""
    at = TB if fx[e.BACKLASH] > 0.0 else TW
    error, slope = angle_error(fx, y[at], plant.gear_ratio)
    return y[at] + error - y[TL], (1.0 + slope) * y[at + 1] - y[WL], 1.0 + slope


@njit(error_model="numpy", inline="always")
def stretch(fx, y, stop, coordinate):
    """Stretch [rad] of a stop operator at its coordinate."""
    way = y[WAY + stop]
    return coordinate - y[ANCHOR + stop] if way == 0.0 else way * m.stop_yield(fx, stop)


@njit(error_model="numpy", inline="always")
def pulse_share(fx, mode, y):
    """Share of the disturbance that acts."""
    if not mode.pulse:
        return 0.0
    return y[RAMP] if fx[e.PULSE_RISE] > 0.0 else 1.0


@njit(error_model="numpy")
def spring_memory(fx, y, deflection, rate):
    """Torque [Nm] and heat [W] of all that the spring remembers, and of its damper."""
    torque = fx[e.SPRING_DAMPING] * rate
    lost = torque * rate
    for i in range(e.N_SLIPS):
        if fx[e.SLIP_STIFFNESS + i] > 0.0:
            slip = fx[e.SLIP_STIFFNESS + i] * stretch(fx, y, i, deflection)
            torque += slip
            lost += slip * rate if y[WAY + i] != 0.0 else 0.0
    if fx[e.BOUC_WEN] > 0.0:
        part = fx[e.BOUC_WEN] * y[BW]
        torque += part
        same = y[RATE_SIGN] * y[STRETCH_SIGN]
        lost += part * (rate - m.bouc_wen_rate(fx, y[BW], rate, same))
    for i in range(e.N_BRANCHES):
        if fx[e.BRANCH_STIFFNESS + i] > 0.0:
            part = fx[e.BRANCH_STIFFNESS + i] * y[BRANCH + i]
            torque += part
            lost += part * y[BRANCH + i] / fx[e.BRANCH_TIME + i]
    return torque, lost


@njit(error_model="numpy")
def _with_memory(plant, fx, y):
    """What remembering terms add to the torques on motor side and load."""
    wheel, load = 0.0, 0.0
    if fx[e.GEAR_PRESLIDING] > 0.0:
        z = stretch(fx, y, m.GEAR_STOP, y[TW])
        wheel -= m.gear_presliding(fx, z, y[GEAR_SIDE], y[WAY + m.GEAR_STOP], y[WW])
    if fx[e.LOAD_PRESLIDING] > 0.0:
        z = stretch(fx, y, m.LOAD_STOP, y[TL])
        load -= m.load_presliding(fx, z, y[WAY + m.LOAD_STOP], y[WL])
    if fx[e.LINK_STIFFNESS] > 0.0:
        load -= fx[e.LINK_STIFFNESS] * (y[TL] - y[TO]) + fx[e.LINK_DAMPING] * (y[WL] - y[WO])
    if fx[e.BACKLASH] > 0.0:
        wheel += fx[e.BACKLASH_DAMPING] * y[WW]  # acts on the wheel behind the play
    return wheel, load


@njit(error_model="numpy", inline="always")
def torques(plant, spring, fx, mode, drive_torque, y):
    """Torque on the motor side, on the load, tau_s and its lever on the wheel, contact loss, drag.

    Motor side and load are without spring and set-valued friction.
    """
    wheel = drive_torque - plant.damping * y[WW]
    load = plant.load_torque - plant.load_damping * y[WL]
    lever, lost, drag, output = 1.0, 0.0, 0.0, 0.0
    if plant.gravity != 0.0:
        load -= plant.gravity * np.sin(y[TL] + plant.gravity_offset)
    if mode.contact:
        depth = y[TL] - plant.contact_angle
        lost = plant.contact_damping * y[WL]
        if fx[e.EXPONENT] == 0.0:
            load -= plant.contact_stiffness * depth
        else:
            elastic, damped = e.contact_torque(fx, plant.contact_stiffness, depth, y[WL])
            load -= elastic
            lost += damped
        load -= lost
    elastic_joint = plant.structure == ELASTIC_FREE or plant.structure == ELASTIC_HELD
    if fx[e.ANY] == 0.0:
        if elastic_joint:
            output = table_torque(spring, y[TW] - y[TL])
        return wheel, load, output, lever, lost, drag
    wheel += e.wheel_torque(fx, y[TW]) - e.gear_smooth_friction(fx, y[WW])
    added, drag = e.load_torque(fx, y[TL], y[WL], pulse_share(fx, mode, y))
    load += added
    deflection, rate, lever = deflection_and_rate(plant, fx, y)
    if elastic_joint:
        output = table_torque(spring, deflection)
    if fx[e.MEMORY] != 0.0:
        at_wheel, at_load = _with_memory(plant, fx, y)
        wheel += at_wheel
        load += at_load
        if elastic_joint:
            remembered, _ = spring_memory(fx, y, deflection, rate)
            output += remembered
    return wheel, load, output, lever, lost, drag


@njit(error_model="numpy")
def _memory_rates(plant, fx, mode, y, joule, slopes, row, power):
    """Rates of the states that only some terms have, but the wheel behind the play, and losses."""
    deflection, rate, _ = deflection_and_rate(plant, fx, y)
    _, power[SPRING_LOSS] = spring_memory(fx, y, deflection, rate)
    slopes[row, BW] = 0.0
    if fx[e.BOUC_WEN] > 0.0:
        same = y[RATE_SIGN] * y[STRETCH_SIGN]
        slopes[row, BW] = m.bouc_wen_rate(fx, y[BW], rate, same)
    for i in range(e.N_BRANCHES):
        slopes[row, BRANCH + i] = m.branch_rate(fx, i, y[BRANCH + i], rate)
    slopes[row, WINDING], slopes[row, CASE] = m.heat_rates(fx, y[WINDING], y[CASE], joule)
    slopes[row, RAMP] = 0.0
    if mode.pulse and y[RISEN] == 0.0 and fx[e.PULSE_RISE] > 0.0:
        slopes[row, RAMP] = 1.0 / fx[e.PULSE_RISE]
    slopes[row, TO] = slopes[row, WO] = 0.0
    if fx[e.LINK_STIFFNESS] > 0.0:
        twist_rate = y[WL] - y[WO]
        carried = fx[e.LINK_STIFFNESS] * (y[TL] - y[TO]) + fx[e.LINK_DAMPING] * twist_rate
        slopes[row, TO], slopes[row, WO] = y[WO], carried / fx[e.LINK_INERTIA]
        power[LINK_LOSS] = fx[e.LINK_DAMPING] * twist_rate * twist_rate
    if fx[e.GEAR_PRESLIDING] > 0.0 and y[WAY + m.GEAR_STOP] != 0.0:
        way = y[WAY + m.GEAR_STOP]
        power[GEAR_FRICTION] += m.gear_presliding(fx, 0.0, 1.0, way, y[WW]) * y[WW]
    if fx[e.LOAD_PRESLIDING] > 0.0 and y[WAY + m.LOAD_STOP] != 0.0:
        way = y[WAY + m.LOAD_STOP]
        power[LOAD_FRICTION] += m.load_presliding(fx, 0.0, way, y[WL]) * y[WL]


@njit(error_model="numpy", inline="always")
def meshing(fx, y, output):
    """The torque that the gear's mesh carries: none while the wheel is free in its play."""
    return 0.0 if fx[e.BACKLASH] > 0.0 and y[FLANK] == 0.0 else output


@njit(error_model="numpy", inline="always")
def _wheel_rates(plant, fx, y, wheel, pull, stuck, slopes, row):
    """Accelerations on the motor side and behind the play; `pull` is the spring's on the wheel."""
    if fx[e.BACKLASH] == 0.0:
        slopes[row, WW] = (wheel - pull) / plant.inertia
        return
    motor, behind = plant.inertia - fx[e.BACKLASH_INERTIA], fx[e.BACKLASH_INERTIA]
    pull += fx[e.BACKLASH_DAMPING] * y[WB]
    slopes[row, TB] = y[WB]
    if y[FLANK] == 0.0:
        slopes[row, WW], slopes[row, WB] = wheel / motor, -pull / behind
    else:
        slopes[row, WW] = slopes[row, WB] = (wheel - pull) / plant.inertia
        if stuck:
            slopes[row, TB] = slopes[row, WB] = 0.0


@njit(error_model="numpy", inline="always")
def derivative(plant, spring, fx, mode, command, time, y, slopes, row, power):
    """The torque tau_s; puts the states' time derivatives into a row of slopes, powers into power.

    `spring` is the `regions` of a `SpringTable`, `fx` the array of `effects`. Arrays are
    arguments of their own, not fields of a tuple, because taking one out of a tuple counts
    references each time.
    """
    current, volts = current_and_voltage(plant, fx, mode, command, y)
    resistance, factor = winding(plant, fx, y)
    torque = _drive_torque(plant, command, current, factor)
    power[SUPPLIED] = volts * current
    if plant.drive == MOTOR_TORQUE:
        power[SUPPLIED] = torque * y[WW]
    power[JOULE] = resistance * current * current
    mismatch = factor * (plant.torque_per_ampere - plant.volts_per_speed)
    power[MISMATCH] = mismatch * current * y[WW]
    power[DRIVE_VISCOUS] = plant.damping * y[WW] * y[WW]
    power[LOAD_VISCOUS] = plant.load_damping * y[WL] * y[WL]
    slopes[row, IM] = 0.0
    if plant.inductance > 0.0 and mode.limited == 0 and plant.drive in (DUTY, VOLTAGE):
        emf = factor * plant.volts_per_speed * y[WW]
        slopes[row, IM] = (volts - resistance * current - emf) / plant.inductance
    wheel, load, output, lever, lost, drag = torques(plant, spring, fx, mode, torque, y)
    power[CONTACT_LOSS] = lost * y[WL]
    power[DRAG_LOSS] = drag * y[WL]
    power[LOAD_WORK] = plant.load_torque * y[WL]
    power[LOAD_WORK] += pulse_share(fx, mode, y) * fx[e.PULSE] * y[WL]
    power[GEAR_FRICTION] = power[LOAD_FRICTION] = 0.0
    slopes[row, TW] = y[WW]
    slopes[row, TL] = y[WL]
    if fx[e.ANY] != 0.0:
        power[GEAR_FRICTION] = e.gear_smooth_friction(fx, y[WW]) * y[WW]
    if fx[e.BACKLASH] > 0.0:
        power[DRIVE_VISCOUS] += fx[e.BACKLASH_DAMPING] * (y[WB] * y[WB] - y[WW] * y[WW])
    if fx[e.MEMORY] != 0.0:
        _memory_rates(plant, fx, mode, y, power[JOULE], slopes, row, power)
    held = mode.acceleration + mode.jerk * time
    wheel_stuck = fx[e.WHEEL_DRY] != 0.0 and mode.wheel == 0
    load_stuck = fx[e.LOAD_DRY] != 0.0 and mode.load == 0
    wheel_dry, load_dry = 0.0, 0.0
    if fx[e.WHEEL_DRY] != 0.0 and mode.wheel != 0:
        carried = meshing(fx, y, output)
        level = e.gear_friction(fx, mode.wheel, y[WW], carried, mode.torque_sign)
        wheel_dry = mode.wheel * level
        power[GEAR_FRICTION] += wheel_dry * y[WW]
    if fx[e.LOAD_DRY] != 0.0 and mode.load != 0:
        load_dry = mode.load * e.load_friction(fx, y[WL], y[TL] + plant.gravity_offset)
        power[LOAD_FRICTION] += load_dry * y[WL]
    if plant.structure == ELASTIC_FREE:
        _wheel_rates(plant, fx, y, wheel - wheel_dry, lever * output, wheel_stuck, slopes, row)
        slopes[row, WL] = (load + output - load_dry) / plant.load_inertia
    elif plant.structure == ELASTIC_HELD:
        _wheel_rates(plant, fx, y, wheel - wheel_dry, lever * output, wheel_stuck, slopes, row)
        slopes[row, WL] = held
        power[LOAD_WORK], power[LOAD_VISCOUS] = -output * y[WL], 0.0
    elif plant.structure == RIGID_FREE:
        share = 1.0
        if mode.wheel != 0 and fx[e.WHEEL_DRY] != 0.0:
            share = e.rigid_share(fx, mode.wheel, mode.torque_sign)
        whole = plant.inertia + share * plant.load_inertia
        slopes[row, WW] = (wheel - wheel_dry + share * (load - load_dry)) / whole
        if wheel_stuck or load_stuck:
            slopes[row, WW] = 0.0
        slopes[row, WL] = slopes[row, WW]
        # of a stuck body the joint carries what the side without dry friction needs
        output = plant.load_inertia * slopes[row, WW] - load + load_dry
        if load_stuck:
            output = wheel
        power[GEAR_FRICTION] += (share - 1.0) * output * y[WW]
    else:
        slopes[row, WW], slopes[row, WL] = held, held
        output = wheel - plant.inertia * held
        power[LOAD_WORK], power[LOAD_VISCOUS] = -output * y[WL], 0.0
    if wheel_stuck or load_stuck:
        _hold(plant, wheel_stuck, load_stuck, slopes, row)
    return output


@njit(error_model="numpy")
def _hold(plant, wheel_stuck, load_stuck, slopes, row):
    rigid = plant.structure == RIGID_FREE
    if wheel_stuck or rigid:
        slopes[row, TW] = slopes[row, WW] = 0.0
    if load_stuck or rigid:
        slopes[row, TL] = slopes[row, WL] = 0.0


@njit(error_model="numpy")
def pushes(plant, spring, fx, mode, command, y):
    """What pushes a wheel and a load at rest [Nm], tau_s, and what the wheel feels of it.

    Of a rigid body tau_s is what its gear carries at rest.
    """
    current, _ = current_and_voltage(plant, fx, mode, command, y)
    _, factor = winding(plant, fx, y)
    drive = _drive_torque(plant, command, current, factor)
    wheel, load, output, lever, _, _ = torques(plant, spring, fx, mode, drive, y)
    if plant.structure == RIGID_FREE:
        return wheel + load, wheel + load, -load, 0.0
    return wheel, load + output, output, lever * output
