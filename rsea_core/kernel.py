"""The equations that every model shares, compiled once: states, powers, switches.

States on the output side of the gear: current, wheel angle and speed, load angle and speed.
A machine is a `Plant` of numbers, a controller a compiled function with the signature
`CONTROLLER`, so one compilation serves every machine, load and controller; the terms' numbers
are one array (`effects`). What switches (the current limit, the contact, stick and slip of a
dry joint, the sign of the transmitted torque, a pulse) is a `Mode`: with the mode fixed the
equations are smooth, and `switch_value` says where it must change. `integrator` does the
stepping.

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

import rsea_core.effects as e
from rsea_core.terms.table import table_torque

# what the command of a row is
NO_DRIVE, DUTY, VOLTAGE, CURRENT, MOTOR_TORQUE = range(5)
# how wheel and load are joined, and whether the load's motion is free or given
ELASTIC_FREE, ELASTIC_HELD, RIGID_FREE, RIGID_HELD = range(4)
# states
IM, TW, WW, TL, WL = range(5)
N_STATES = 5
# running integrals: energies [J], then times [s]
SUPPLIED, JOULE, DRIVE_VISCOUS, LOAD_VISCOUS, CONTACT_LOSS, LOAD_WORK, MISMATCH = range(7)
GEAR_FRICTION, LOAD_FRICTION, DRAG_LOSS = 7, 8, 9
LIMITED_TIME, CONTACT_TIME, WHEEL_STUCK_TIME, LOAD_STUCK_TIME = range(10, 14)
N_INTEGRALS = 14
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
N_NOMINAL_SWITCHES = 2
N_SWITCHES = 6

CONTROLLER = types.void(float64[::1], float64[::1], float64[::1], float64[::1])
"""Signature of a controller: (parameters, state, signals, command), the last one is written."""


class Plant(NamedTuple):
    """The numbers of a machine; everything on the output side of the gear, SI."""

    drive: int
    structure: int
    volts_per_command: float  # DUTY: supply; VOLTAGE: 1
    resistance: float
    inductance: float  # 0: the current follows the voltage at once
    torque_per_ampere: float
    volts_per_speed: float
    torque_per_motor_torque: float
    current_limit: float  # inf: none
    inertia: float
    damping: float
    load_inertia: float
    load_damping: float
    gravity: float  # m g d
    gravity_offset: float
    load_torque: float
    contact_stiffness: float
    contact_damping: float
    contact_angle: float  # inf: none
    gear_ratio: float
    motor_count: float  # encoder count, motor side; 0: no quantisation
    load_count: float


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
def _limited(mode, side):
    return Mode(side, mode.contact, mode.acceleration, mode.jerk, mode.wheel, mode.load,
                mode.torque_sign, mode.pulse, mode.row_time)  # fmt: skip


@njit(error_model="numpy", inline="always")
def _sliding(mode, wheel, load):
    return Mode(mode.limited, mode.contact, mode.acceleration, mode.jerk, wheel, load,
                mode.torque_sign, mode.pulse, mode.row_time)  # fmt: skip


@njit(error_model="numpy", inline="always")
def with_motion(mode, acceleration, jerk, row_time):
    """The mode with a row's start time and given motion of a held load."""
    return Mode(mode.limited, mode.contact, acceleration, jerk, mode.wheel, mode.load,
                mode.torque_sign, mode.pulse, row_time)  # fmt: skip


@njit(error_model="numpy")
def first_mode(plant, fx, y, time):
    """The mode of a machine at rest: what is dry sticks until `mode_at_start` looks."""
    pulse = fx[e.PULSE] != 0.0 and fx[e.PULSE_START] <= time < fx[e.PULSE_END]
    return Mode(0, y[TL] > plant.contact_angle, 0.0, 0.0, 0, 0, 1, pulse, time)


@njit(error_model="numpy", inline="always")
def current_and_voltage(plant, fx, mode, command, y):
    """Current and the voltage at the winding."""
    if plant.drive == DUTY or plant.drive == VOLTAGE:
        volts = command * plant.volts_per_command
        sag = command * command * fx[e.SOURCE_RESISTANCE]  # a bridge draws duty times i
        emf = plant.volts_per_speed * y[WW]
        if mode.limited != 0:
            current = mode.limited * plant.current_limit
            return current, plant.resistance * current + emf
        if plant.inductance > 0.0:
            return y[IM], volts - sag * y[IM]
        current = (volts - emf) / (plant.resistance + sag)
        return current, volts - sag * current
    if plant.drive == CURRENT:
        current = min(max(command, -plant.current_limit), plant.current_limit)
        return current, plant.resistance * current + plant.volts_per_speed * y[WW]
    return 0.0, 0.0


@njit(error_model="numpy", inline="always")
def _drive_torque(plant, command, current):
    if plant.drive == MOTOR_TORQUE:
        return plant.torque_per_motor_torque * command
    return plant.torque_per_ampere * current


@njit(error_model="numpy", inline="always")
def _torques(plant, spring, fx, mode, drive_torque, y):
    """Torque on the wheel, on the load, tau_s and its lever on the wheel, contact loss, drag.

    Wheel and load are without spring and dry friction.
    """
    wheel = drive_torque - plant.damping * y[WW]
    load = plant.load_torque - plant.load_damping * y[WL]
    lever, error, lost, drag = 1.0, 0.0, 0.0, 0.0
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
    if fx[e.ANY] != 0.0:
        wheel += e.wheel_torque(fx, y[TW])
        added, drag = e.load_torque(fx, y[TL], y[WL], mode.pulse)
        load += added
        error, slope = e.angle_error(fx, y[TW], plant.gear_ratio)
        lever = 1.0 + slope
    output = 0.0
    if plant.structure == ELASTIC_FREE or plant.structure == ELASTIC_HELD:
        output = table_torque(spring, y[TW] + error - y[TL])
    return wheel, load, output, lever, lost, drag


@njit(error_model="numpy", inline="always")
def derivative(plant, spring, fx, mode, command, time, y, slopes, row, power):
    """The torque tau_s; puts the states' time derivatives into a row of slopes, powers into power.

    `spring` is the `regions` of a `SpringTable`, `fx` the array of `effects`. Arrays are
    arguments of their own, not fields of a tuple, because taking one out of a tuple counts
    references each time.
    """
    current, volts = current_and_voltage(plant, fx, mode, command, y)
    torque = _drive_torque(plant, command, current)
    power[SUPPLIED] = volts * current
    if plant.drive == MOTOR_TORQUE:
        power[SUPPLIED] = torque * y[WW]
    power[JOULE] = plant.resistance * current * current
    power[MISMATCH] = (plant.torque_per_ampere - plant.volts_per_speed) * current * y[WW]
    power[DRIVE_VISCOUS] = plant.damping * y[WW] * y[WW]
    power[LOAD_VISCOUS] = plant.load_damping * y[WL] * y[WL]
    slopes[row, IM] = 0.0
    if plant.inductance > 0.0 and mode.limited == 0 and plant.drive in (DUTY, VOLTAGE):
        emf = plant.volts_per_speed * y[WW]
        slopes[row, IM] = (volts - plant.resistance * current - emf) / plant.inductance
    wheel, load, output, lever, lost, drag = _torques(plant, spring, fx, mode, torque, y)
    power[CONTACT_LOSS] = lost * y[WL]
    power[DRAG_LOSS] = drag * y[WL]
    power[LOAD_WORK] = plant.load_torque * y[WL]
    if mode.pulse:
        power[LOAD_WORK] += fx[e.PULSE] * y[WL]
    power[GEAR_FRICTION] = power[LOAD_FRICTION] = 0.0
    slopes[row, TW] = y[WW]
    slopes[row, TL] = y[WL]
    held = mode.acceleration + mode.jerk * time
    wheel_stuck = fx[e.WHEEL_DRY] != 0.0 and mode.wheel == 0
    load_stuck = fx[e.LOAD_DRY] != 0.0 and mode.load == 0
    wheel_dry, load_dry = 0.0, 0.0
    if fx[e.WHEEL_DRY] != 0.0 and mode.wheel != 0:
        level = e.gear_friction(fx, mode.wheel, y[WW], output, mode.torque_sign)
        wheel_dry = mode.wheel * level
        power[GEAR_FRICTION] = wheel_dry * y[WW]
    if fx[e.LOAD_DRY] != 0.0 and mode.load != 0:
        load_dry = mode.load * e.load_friction(fx, y[WL], y[TL] + plant.gravity_offset)
        power[LOAD_FRICTION] = load_dry * y[WL]
    if plant.structure == ELASTIC_FREE:
        slopes[row, WW] = (wheel - lever * output - wheel_dry) / plant.inertia
        slopes[row, WL] = (load + output - load_dry) / plant.load_inertia
    elif plant.structure == ELASTIC_HELD:
        slopes[row, WW] = (wheel - lever * output - wheel_dry) / plant.inertia
        slopes[row, WL] = held
        power[LOAD_WORK], power[LOAD_VISCOUS] = -output * y[WL], 0.0
    elif plant.structure == RIGID_FREE:
        whole = plant.inertia + plant.load_inertia
        slopes[row, WW] = (wheel + load - wheel_dry - load_dry) / whole
        if wheel_stuck or load_stuck:
            slopes[row, WW] = 0.0
        slopes[row, WL] = slopes[row, WW]
        # of a stuck body the joint carries what the side without dry friction needs
        output = plant.load_inertia * slopes[row, WW] - load + load_dry
        if load_stuck:
            output = wheel
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
def _pushes(plant, spring, fx, mode, command, y):
    """What pushes a wheel and a load at rest [Nm], and tau_s."""
    current, _ = current_and_voltage(plant, fx, mode, command, y)
    drive = _drive_torque(plant, command, current)
    wheel, load, output, lever, _, _ = _torques(plant, spring, fx, mode, drive, y)
    if plant.structure == RIGID_FREE:
        return wheel + load, wheel + load, 0.0
    return wheel - lever * output, load + output, output


@njit(error_model="numpy")
def _excess(plant, spring, fx, mode, command, y, switch):
    """How far the push on a stuck joint exceeds its breakaway level, and its direction."""
    wheel, load, output = _pushes(plant, spring, fx, mode, command, y)
    if switch == LOAD_SWITCH:
        return abs(load) - e.load_friction(
            fx, 0.0, y[TL] + plant.gravity_offset
        ), 1 if load > 0.0 else -1
    way = 1 if wheel > 0.0 else -1
    level = e.gear_friction(fx, way, 0.0, output, 1 if output > 0.0 else -1)
    return abs(wheel) - level, way


@njit(error_model="numpy")
def _released(plant, spring, fx, mode, command, y):
    """The mode with every stuck joint let go whose push exceeds its breakaway level."""
    wheel, load = mode.wheel, mode.load
    if fx[e.WHEEL_DRY] != 0.0 and wheel == 0:
        excess, way = _excess(plant, spring, fx, mode, command, y, WHEEL_SWITCH)
        wheel = way if excess > 0.0 else 0
    if fx[e.LOAD_DRY] != 0.0 and load == 0:
        excess, way = _excess(plant, spring, fx, mode, command, y, LOAD_SWITCH)
        load = way if excess > 0.0 else 0
    return _sliding(mode, wheel, load)


@njit(error_model="numpy")
def switch_value(plant, spring, fx, mode, command, time, y, switch):
    """Negative while the mode holds, above zero where this switch must change it.

    `time` counts from the row's start.
    """
    if switch == CONTACT_SWITCH:
        if not plant.contact_angle < np.inf:
            return -1.0
        beyond = y[TL] - plant.contact_angle
        return -beyond if mode.contact else beyond
    if switch == CURRENT_SWITCH:
        if not plant.current_limit < np.inf or plant.drive not in (DUTY, VOLTAGE):
            return -1.0
        if mode.limited == 0:
            current, _ = current_and_voltage(plant, fx, mode, command, y)
            return abs(current) - plant.current_limit
        return -mode.limited * _push(plant, fx, mode.limited, command, y)
    return _term_switch(plant, spring, fx, mode, command, time, y, switch)


@njit(error_model="numpy")
def _term_switch(plant, spring, fx, mode, command, time, y, switch):
    if switch == PULSE_SWITCH:
        if fx[e.PULSE] == 0.0:
            return -1.0
        now = mode.row_time + time
        if mode.pulse:
            return now - fx[e.PULSE_END]
        return now - fx[e.PULSE_START] if now < fx[e.PULSE_END] else -1.0
    if switch == TORQUE_SWITCH:
        if fx[e.GEAR_DRIVE_LOSS] == 0.0 and fx[e.GEAR_BACKDRIVE_LOSS] == 0.0:
            return -1.0
        _, _, output = _pushes(plant, spring, fx, mode, command, y)
        return -mode.torque_sign * output
    dry, way, speed = fx[e.WHEEL_DRY], mode.wheel, y[WW]
    if switch == LOAD_SWITCH:
        dry, way, speed = fx[e.LOAD_DRY], mode.load, y[WL]
    if dry == 0.0:
        return -1.0
    if way != 0:
        return -way * speed
    excess, _ = _excess(plant, spring, fx, mode, command, y, switch)
    return excess


@njit(error_model="numpy")
def _push(plant, fx, side, command, y):
    """Voltage left to raise the current when it is at the limit on this side."""
    resistance = plant.resistance + command * command * fx[e.SOURCE_RESISTANCE]
    held = resistance * side * plant.current_limit + plant.volts_per_speed * y[WW]
    return command * plant.volts_per_command - held


@njit(error_model="numpy")
def switched(plant, spring, fx, mode, y, command, switch):
    """The mode after this switch; a current at its limit or a speed at zero is put there."""
    if switch == CONTACT_SWITCH:
        mode = Mode(mode.limited, not mode.contact, mode.acceleration, mode.jerk, mode.wheel,
                    mode.load, mode.torque_sign, mode.pulse, mode.row_time)  # fmt: skip
    elif switch == PULSE_SWITCH:
        mode = Mode(mode.limited, mode.contact, mode.acceleration, mode.jerk, mode.wheel,
                    mode.load, mode.torque_sign, not mode.pulse, mode.row_time)  # fmt: skip
    elif switch == TORQUE_SWITCH:
        mode = Mode(mode.limited, mode.contact, mode.acceleration, mode.jerk, mode.wheel,
                    mode.load, -mode.torque_sign, mode.pulse, mode.row_time)  # fmt: skip
    elif switch == CURRENT_SWITCH:
        side = 0
        if mode.limited == 0:
            current, _ = current_and_voltage(plant, fx, mode, command, y)
            side = 1 if current > 0.0 else -1
            y[IM] = side * plant.current_limit
        mode = _limited(mode, side)
    else:
        rigid = plant.structure == RIGID_FREE
        if switch == WHEEL_SWITCH and mode.wheel != 0:
            y[WW] = 0.0
            mode = _sliding(mode, 0, mode.load)
        if switch == LOAD_SWITCH and mode.load != 0:
            y[WL] = 0.0
            mode = _sliding(mode, mode.wheel, 0)
        if rigid:
            y[WW] = y[WL] = 0.0
    return _released(plant, spring, fx, mode, command, y)


@njit(error_model="numpy")
def mode_at_start(plant, spring, fx, mode, command, y):
    """The mode once a new command acts: a jump of it can switch limit and friction."""
    return _released(plant, spring, fx, _limit_at_start(plant, fx, mode, command, y), command, y)


@njit(error_model="numpy")
def _limit_at_start(plant, fx, mode, command, y):
    if plant.drive == CURRENT:
        side = 1 if command > plant.current_limit else -1 if command < -plant.current_limit else 0
        return _limited(mode, side)
    if not plant.current_limit < np.inf or plant.drive not in (DUTY, VOLTAGE):
        return mode
    side = mode.limited
    if side != 0 and side * _push(plant, fx, side, command, y) < 0.0:
        side = 0
    if side == 0:
        free = _limited(mode, 0)
        current, _ = current_and_voltage(plant, fx, free, command, y)
        toward = 1 if current > 0.0 else -1
        push = toward * _push(plant, fx, toward, command, y)
        if abs(current) >= plant.current_limit and push > 0.0:
            side = toward
    return _limited(mode, side)
