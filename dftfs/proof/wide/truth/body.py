"""One axis: its constants on the output side, and what no rig file states.

SI and radians (a linear axis: 1 m as 1 rad, 1 N as 1 Nm). Named tuples, because the compiled
integrator reads their fields by name. The default of an effect's number means that it is absent.
"""

from typing import NamedTuple

import numpy as np

NO_DRIVE, BY_CURRENT, BY_VOLTAGE = 0, 1, 2
SWINGING, LOCKED = 0, 1
STOPS, BRANCHES = 6, 2
COPPER_PER_K = 0.00393


class Body(NamedTuple):
    """The constants that a rig file names, with their true values.

    ``drive``: `NO_DRIVE`, `BY_CURRENT` or `BY_VOLTAGE`; ``sprung``: 1 with a spring between gear
    and load, 0 where both are one rigid body; ``supply``: volts of a full command (1 where the
    command is in volts); ``gravity``: m g d.
    """

    drive: int
    sprung: int
    gear_ratio: float = 1.0
    supply: float = 1.0
    resistance: float = 1.0
    inductance: float = 0.0
    torque_constant: float = 0.0
    emf_constant: float = 0.0
    current_limit: float = 1e12
    motor_inertia: float = 0.0
    motor_viscous: float = 0.0
    output_inertia: float = 0.0
    output_viscous: float = 0.0
    stiffness: float = 0.0
    load_inertia: float = 0.0
    load_viscous: float = 0.0
    gravity: float = 0.0
    gravity_offset: float = 0.0


class Extra(NamedTuple):
    """What the machine has beyond its constants, in the units of the output side.

    Friction is a bristle (LuGre, Canudas de Wit 1995); hysteresis a sum of elastic stops
    (Prandtl-Ishlinskii); creep a sum of Maxwell branches.
    """

    # dry friction of the gear; by transmitted torque: driving and backdriven
    gear_plus: float = 0.0
    gear_minus: float = 0.0
    gear_static: float = 1.0
    gear_stribeck: float = 1.0
    gear_bristle: float = 1e-4
    share_driving: float = 0.0
    share_back: float = 0.0
    gap: float = 0.0
    wheel_error: float = 0.0
    wheel_phase: float = 0.0
    worm_error: float = 0.0
    worm_phase: float = 0.0
    cogging: float = 0.0  # at the motor
    cogging_cycles: float = 1.0
    cogging_phase: float = 0.0
    # drive; the dead zone in units of the command
    dead_zone: float = 0.0
    source_ohm: float = 0.0
    winding_capacity: float = 1e12
    case_capacity: float = 1e12
    winding_to_case: float = 1.0
    case_to_air: float = 1.0
    copper_per_K: float = 0.0
    magnet_per_K: float = 0.0
    # spring
    hardening: float = 0.0
    touch_at: float = 1e12
    touch_stiffness: float = 0.0
    touch_side: float = 0.0
    stop_stiffness: np.ndarray = np.zeros(STOPS)
    stop_torque: np.ndarray = np.ones(STOPS)
    branch_stiffness: np.ndarray = np.zeros(BRANCHES)
    branch_time: np.ndarray = np.ones(BRANCHES)
    # load
    parallel: float = 0.0
    load_coulomb: float = 0.0
    load_static: float = 1.0
    load_stribeck: float = 1.0
    load_bristle: float = 1e-4
    drag: float = 0.0
    drag_exponent: float = 2.0
    unbalance: float = 0.0
    unbalance_angle: float = 0.0
    tip_share: float = 0.0
    link_stiffness: float = 0.0
    link_damping: float = 0.0
    # laws that no catalogue names
    iron_A: float = 1e12  # current at which iron has cost half of the torque constant
    gain_minus: float = 0.0  # how much less the amplifier does in one direction
    grease: float = 0.0  # |w|^0.4 friction of the gear
    grease_speed: float = 1.0
    magnet: float = 0.0
    magnet_angle: float = 0.0
    magnet_reach: float = 1.0
    angle_share: float = 0.0  # load friction grows and falls once in a turn or a travel
    angle_cycles: float = 1.0
    clamp_stiffness: float = 0.0  # of a locked load; 0 holds exactly
    clamp_damping: float = 0.0


class Loop(NamedTuple):
    """Feedback around a reference: PD on a counted angle, every ``tick`` steps.

    ``delay``: steps between a tick and the command acting.
    """

    proportional: float = 0.0
    derivative: float = 0.0
    count: float = 0.0
    limit: float = 1.0
    tick: int = 1
    delay: int = 0


class Start(NamedTuple):
    """Angle and speed of the output, at which a recording begins, and the warmth left over."""

    angle: float = 0.0
    speed: float = 0.0
    winding_K: float = 0.0
    case_K: float = 0.0


OUTPUTS = ("gear_angle", "gear_speed", "load_angle", "load_speed", "current", "torque", "case_K")
