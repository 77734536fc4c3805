"""The numbers by which the event-driven engine and its users name states, signals and events.

States are on the output side of the gear; an angle's speed is the index after it.
"""

from typing import NamedTuple

from numba import float64, njit, types

import rsea_core.engines.event_driven.internal_states as m

# states of the nominal machine
IM, TW, WW, TL, WL = range(5)
N_STATES = 5
# states of terms: wheel behind the backlash, link, Bouc-Wen deflection, Maxwell branches, heat
TB, WB, TO, WO, BW, BRANCH, WINDING, CASE = 5, 6, 7, 8, 9, 10, 13, 14
RAMP = 15  # share of a disturbance that rises
GEAR_BRISTLE_DEFLECTION, LOAD_BRISTLE_DEFLECTION = 16, 17  # deflection of bristles
N_WITHOUT_BRISTLES, N_ALL_STATES = 16, 18
# what stays between events and is carried behind the states: anchors and directions of the stop
# operators, signs of the spring's rate and of the Bouc-Wen deflection, the flank in contact
# (`flanks`), the energy that impacts have taken, knees of the spring passed, side of the gear's
# presliding deflection, whether a disturbance has risen, whether the damping of bristles acts
# (their direction is a stop's)
ANCHOR = N_ALL_STATES
DIRECTION = ANCHOR + m.N_STOPS
RATE_SIGN = DIRECTION + m.N_STOPS
BOUC_WEN_SIGN, FLANK, IMPACT, KNEE, GEAR_SIDE, RISEN = range(RATE_SIGN + 1, RATE_SIGN + 7)
GEAR_DAMPED, LOAD_DAMPED = RISEN + 1, RISEN + 2
N_Y = LOAD_DAMPED + 1

# running integrals: energies [J], then times [s]
SUPPLIED, JOULE, DRIVE_VISCOUS, LOAD_VISCOUS, CONTACT_LOSS, LOAD_WORK, MISMATCH = range(7)
GEAR_FRICTION, LOAD_FRICTION, DRAG_LOSS, SPRING_LOSS, LINK_LOSS = range(7, 12)
LIMITED_TIME, CONTACT_TIME, WHEEL_STUCK_TIME, LOAD_STUCK_TIME = range(12, 16)
N_INTEGRALS = 16
N_POWERS = LIMITED_TIME  # the integrals before it are of powers, the others count time
POWER = N_ALL_STATES  # in a row of derivatives the powers follow the states' rates
N_DERIVATIVES = POWER + N_POWERS

# what a controller is given each time it acts
REFERENCE, REFERENCE_RATE, REFERENCE_ACCELERATION = 0, 1, 2
READ_MOTOR_ANGLE, READ_LOAD_ANGLE, READ_CURRENT = 3, 4, 5
TRUE_MOTOR_ANGLE, TRUE_LOAD_ANGLE, TRUE_TORQUE = 6, 7, 8
TRUE_MOTOR_VELOCITY, TRUE_LOAD_VELOCITY = 9, 10
N_SIGNALS = 11
# what a controller answers: the command, and what it would be without saturation
COMMAND, UNSATURATED = 0, 1
N_COMMANDS = 2
CONTROLLER = types.void(float64[::1], float64[::1], float64[::1], float64[::1])
"""Signature of a controller: (parameters, state, signals, command), the last one is written."""

# columns of the log
LOG_TORQUE = N_STATES
LOG_COMMAND = N_STATES + 1
LOG_UNSATURATED = N_STATES + 2
LOG_READ_MOTOR, LOG_READ_LOAD = N_STATES + 3, N_STATES + 4
LOG_INTEGRALS = N_STATES + 5
N_LOG = LOG_INTEGRALS + N_INTEGRALS

# what can switch
CURRENT_SWITCH, CONTACT_SWITCH, WHEEL_SWITCH, LOAD_SWITCH, TORQUE_SWITCH, PULSE_SWITCH = range(6)
FLANK_SWITCH, RATE_SWITCH, BOUC_WEN_SWITCH, KNEE_SWITCH, STOP_SWITCH = range(6, 11)
SIDE_SWITCH, RISEN_SWITCH = STOP_SWITCH + m.N_STOPS, STOP_SWITCH + m.N_STOPS + 1
N_NOMINAL_EVENTS, N_TERM_EVENTS, N_EVENTS = 2, 6, RISEN_SWITCH + 1


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


class Stage(NamedTuple):
    """One evaluation of the equations within a step."""

    time: float  # since the row's start
    row: int  # of the derivatives, to be filled


@njit(error_model="numpy", inline="always")
def with_motion(mode, acceleration, jerk, row_time):
    """The mode with a row's start time and given motion of a held load."""
    return Mode(mode.limited, mode.contact, acceleration, jerk, mode.wheel, mode.load,
                mode.torque_sign, mode.pulse, row_time)  # fmt: skip


@njit(error_model="numpy", inline="always")
def with_limit(mode, side):
    """The mode with the current held at the limit on this side, 0: not held."""
    return Mode(side, mode.contact, mode.acceleration, mode.jerk, mode.wheel, mode.load,
                mode.torque_sign, mode.pulse, mode.row_time)  # fmt: skip


@njit(error_model="numpy", inline="always")
def with_sliding(mode, wheel, load):
    """The mode with dry joints that slide these ways, 0: that stick."""
    return Mode(mode.limited, mode.contact, mode.acceleration, mode.jerk, wheel, load,
                mode.torque_sign, mode.pulse, mode.row_time)  # fmt: skip


@njit(error_model="numpy", inline="always")
def with_contact(mode, contact):
    """The mode in contact or out of it."""
    return Mode(mode.limited, contact, mode.acceleration, mode.jerk, mode.wheel, mode.load,
                mode.torque_sign, mode.pulse, mode.row_time)  # fmt: skip


@njit(error_model="numpy", inline="always")
def with_torque_sign(mode, sign):
    """The mode with a spring torque of this sign."""
    return Mode(mode.limited, mode.contact, mode.acceleration, mode.jerk, mode.wheel, mode.load,
                sign, mode.pulse, mode.row_time)  # fmt: skip


@njit(error_model="numpy", inline="always")
def with_pulse(mode, pulse):
    """The mode with the disturbance on or off."""
    return Mode(mode.limited, mode.contact, mode.acceleration, mode.jerk, mode.wheel, mode.load,
                mode.torque_sign, pulse, mode.row_time)  # fmt: skip
