"""The equations that every model shares, compiled once: states, powers, switches.

States on the output side of the gear: current, wheel angle and speed, load angle and speed.
A machine is a `Plant` of numbers, a controller a compiled function with the signature
`CONTROLLER`, so one compilation serves every machine, load and controller. What switches (the
current limit, the contact) is a `Mode`: with the mode fixed the equations are smooth, and
`switch_value` says where it must change. `integrator` does the stepping.

    L i'      = u - R i - k_e w_m                      (|i| held at the limit while u pushes out)
    J w_w'    = N k_t i - B w_w - tau_s                J = N^2 J_m + J_o, B = N^2 B_m + B_o
    J_l w_l'  = tau_s + tau_load - B_l w_l - G sin(theta_l + offset) - tau_contact
    tau_s     = f(theta_w - theta_l)
"""

from typing import NamedTuple

import numpy as np
from numba import float64, njit, types

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
LIMITED_TIME, CONTACT_TIME = 7, 8
N_INTEGRALS = 9
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
CURRENT_SWITCH, CONTACT_SWITCH = range(2)
N_SWITCHES = 2

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


@njit(error_model="numpy", inline="always")
def current_and_voltage(plant, mode, command, y):
    """Current and the voltage at the winding."""
    if plant.drive == DUTY or plant.drive == VOLTAGE:
        volts = command * plant.volts_per_command
        emf = plant.volts_per_speed * y[WW]
        if mode.limited != 0:
            current = mode.limited * plant.current_limit
            return current, plant.resistance * current + emf
        if plant.inductance > 0.0:
            return y[IM], volts
        return (volts - emf) / plant.resistance, volts
    if plant.drive == CURRENT:
        current = min(max(command, -plant.current_limit), plant.current_limit)
        return current, plant.resistance * current + plant.volts_per_speed * y[WW]
    return 0.0, 0.0


@njit(error_model="numpy", inline="always")
def derivative(plant, spring, mode, command, time, y, slopes, row, power):
    """The torque tau_s; puts the states' time derivatives into a row of slopes, powers into power.

    `spring` is the `regions` of a `SpringTable`. Arrays are arguments of their own, not fields
    of a tuple, because taking one out of a tuple counts references each time.
    """
    current, volts = current_and_voltage(plant, mode, command, y)
    torque = plant.torque_per_ampere * current
    power[SUPPLIED] = volts * current
    if plant.drive == MOTOR_TORQUE:
        torque = plant.torque_per_motor_torque * command
        power[SUPPLIED] = torque * y[WW]
    power[JOULE] = plant.resistance * current * current
    power[MISMATCH] = (plant.torque_per_ampere - plant.volts_per_speed) * current * y[WW]
    power[DRIVE_VISCOUS] = plant.damping * y[WW] * y[WW]
    power[LOAD_VISCOUS] = plant.load_damping * y[WL] * y[WL]
    power[LOAD_WORK] = plant.load_torque * y[WL]
    power[CONTACT_LOSS] = 0.0
    slopes[row, IM] = 0.0
    if plant.inductance > 0.0 and mode.limited == 0 and plant.drive in (DUTY, VOLTAGE):
        emf = plant.volts_per_speed * y[WW]
        slopes[row, IM] = (volts - plant.resistance * current - emf) / plant.inductance
    wheel = torque - plant.damping * y[WW]
    load = plant.load_torque - plant.load_damping * y[WL]
    if plant.gravity != 0.0:
        load -= plant.gravity * np.sin(y[TL] + plant.gravity_offset)
    if mode.contact:
        load -= plant.contact_stiffness * (y[TL] - plant.contact_angle)
        load -= plant.contact_damping * y[WL]
        power[CONTACT_LOSS] = plant.contact_damping * y[WL] * y[WL]
    slopes[row, TW] = y[WW]
    slopes[row, TL] = y[WL]
    held = mode.acceleration + mode.jerk * time
    if plant.structure == ELASTIC_FREE:
        output = table_torque(spring, y[TW] - y[TL])
        slopes[row, WW] = (wheel - output) / plant.inertia
        slopes[row, WL] = (load + output) / plant.load_inertia
    elif plant.structure == ELASTIC_HELD:
        output = table_torque(spring, y[TW] - y[TL])
        slopes[row, WW] = (wheel - output) / plant.inertia
        slopes[row, WL] = held
        power[LOAD_WORK], power[LOAD_VISCOUS] = -output * y[WL], 0.0
    elif plant.structure == RIGID_FREE:
        slopes[row, WW] = (wheel + load) / (plant.inertia + plant.load_inertia)
        slopes[row, WL] = slopes[row, WW]
        output = plant.load_inertia * slopes[row, WW] - load
    else:
        slopes[row, WW], slopes[row, WL] = held, held
        output = wheel - plant.inertia * held
        power[LOAD_WORK], power[LOAD_VISCOUS] = -output * y[WL], 0.0
    return output


@njit(error_model="numpy")
def switch_value(plant, mode, command, y, switch):
    """Negative while the mode holds, zero where this switch must change it."""
    if switch == CONTACT_SWITCH:
        if not plant.contact_angle < np.inf:
            return -1.0
        beyond = y[TL] - plant.contact_angle
        return -beyond if mode.contact else beyond
    if not plant.current_limit < np.inf or plant.drive not in (DUTY, VOLTAGE):
        return -1.0
    if mode.limited == 0:
        current, _ = current_and_voltage(plant, mode, command, y)
        return abs(current) - plant.current_limit
    return -mode.limited * _push(plant, mode.limited, command, y)


@njit(error_model="numpy")
def _push(plant, side, command, y):
    """Voltage left to raise the current when it is at the limit on this side."""
    held = plant.resistance * side * plant.current_limit + plant.volts_per_speed * y[WW]
    return command * plant.volts_per_command - held


@njit(error_model="numpy")
def switched(plant, mode, y, command, switch):
    """The mode after this switch; puts a current that met its limit exactly there."""
    if switch == CONTACT_SWITCH:
        return Mode(mode.limited, not mode.contact, mode.acceleration, mode.jerk)
    side = 0
    if mode.limited == 0:
        current, _ = current_and_voltage(plant, mode, command, y)
        side = 1 if current > 0.0 else -1
        y[IM] = side * plant.current_limit
    return Mode(side, mode.contact, mode.acceleration, mode.jerk)


@njit(error_model="numpy")
def mode_at_start(plant, mode, command, y):
    """The mode once a new command acts: a jump of it can switch the current limit."""
    if plant.drive == CURRENT:
        side = 1 if command > plant.current_limit else -1 if command < -plant.current_limit else 0
        return Mode(side, mode.contact, mode.acceleration, mode.jerk)
    if not plant.current_limit < np.inf or plant.drive not in (DUTY, VOLTAGE):
        return mode
    side = mode.limited
    if side != 0 and side * _push(plant, side, command, y) < 0.0:
        side = 0
    if side == 0:
        free = Mode(0, mode.contact, mode.acceleration, mode.jerk)
        current, _ = current_and_voltage(plant, free, command, y)
        toward = 1 if current > 0.0 else -1
        if abs(current) >= plant.current_limit and toward * _push(plant, toward, command, y) > 0.0:
            side = toward
    return Mode(side, mode.contact, mode.acceleration, mode.jerk)
