"""The numbers of the terms as compiled code reads them, and the laws that are smooth.

A model's terms fill one array of `N_EFFECTS` numbers, everything on the output side of the
gear; zero means absent. A term names its numbers by `EFFECTS` and knows no indices, so that a
new law is a name here, a line in the equations and a class in `terms`.
"""

import numpy as np
from numba import njit

from rsea_core.numeric.uniform_spline import steepest, uniform_spline

EFFECTS = (
    "any",
    "wheel_dry",
    "gear_coulomb_forward",
    "gear_coulomb_backward",
    "gear_stribeck_rise",
    "gear_stribeck_velocity",
    "gear_drive_loss",
    "gear_backdrive_loss",
    "load_dry",
    "load_coulomb",
    "load_stribeck_rise",
    "load_stribeck_velocity",
    "load_drag",
    "unbalance_torque",
    "unbalance_angle",
    "pulse_torque",
    "pulse_start",
    "pulse_end",
    "parallel_stiffness",
    "parallel_rest_angle",
    "dead_zone",
    "command_delay",
    "source_resistance",
    "cogging_torque",
    "cogging_cycles_at_output",
    "cogging_phase",
    "wheel_error",
    "wheel_error_phase",
    "worm_error",
    "worm_error_phase",
    "contact_exponent",
    "contact_reference_depth",
    "contact_loss_factor",
    "gear_presliding",
    "load_presliding",
    "gear_atan_level",
    "gear_atan_velocity",
    "gear_offset",
    "load_normal_friction",
    "backlash_width",
    "backlash_wheel_inertia",
    "slip_stiffness_1",
    "slip_stiffness_2",
    "slip_stiffness_3",
    "slip_stiffness_4",
    "slip_stiffness_5",
    "slip_stiffness_6",
    "slip_yield_1",
    "slip_yield_2",
    "slip_yield_3",
    "slip_yield_4",
    "slip_yield_5",
    "slip_yield_6",
    "bouc_wen_stiffness",
    "bouc_wen_yield",
    "bouc_wen_exponent",
    "bouc_wen_shape",
    "spring_damping",
    "branch_stiffness_1",
    "branch_stiffness_2",
    "branch_stiffness_3",
    "branch_time_1",
    "branch_time_2",
    "branch_time_3",
    "winding_heat_capacity",
    "winding_to_case",
    "case_heat_capacity",
    "case_to_ambient",
    "resistance_rise",
    "torque_constant_fall",
    "start_winding_rise",
    "start_case_rise",
    "link_stiffness",
    "link_inertia",
    "link_damping",
    "ripple_fraction",
    "ripple_cycles_at_output",
    "ripple_phase",
    "memory",
    "load_weight",
    "load_mass_lever",
    "backlash_wheel_damping",
    "gear_viscous",
    "knee_1",
    "knee_2",
    "knee_3",
    "knee_4",
    "gear_stribeck_shape",
    "dead_time_duty",
    "dead_time_current",
    "cogging_torque_2",
    "cogging_cycles_2_at_output",
    "cogging_phase_2",
    "cogging_torque_3",
    "cogging_cycles_3_at_output",
    "cogging_phase_3",
    "wheel_error_2",
    "wheel_error_2_phase",
    "worm_error_2",
    "worm_error_2_phase",
    "gear_error_at_zero",
    "gear_bristle",
    "load_bristle",
    "gear_bristle_damping",
    "load_bristle_damping",
    "pulse_rise",
    "pulse_taper",
    "gear_viscous_skew",
    "torque_constant_fall_by_winding",
    "backlash_rebound",
    "worm_error_3",
    "worm_error_3_phase",
    "position_first",
    "position_step",
    *(f"position_torque_{j}" for j in range(1, 33)),
    "source_one_way",
    "source_ripples",
)
(
    ANY,
    WHEEL_DRY,
    GEAR_FORWARD,
    GEAR_BACKWARD,
    GEAR_RISE,
    GEAR_STRIBECK,
    GEAR_DRIVE_LOSS,
    GEAR_BACKDRIVE_LOSS,
    LOAD_DRY,
    LOAD_COULOMB,
    LOAD_RISE,
    LOAD_STRIBECK,
    DRAG,
    UNBALANCE,
    UNBALANCE_ANGLE,
    PULSE,
    PULSE_START,
    PULSE_END,
    PARALLEL,
    PARALLEL_REST,
    DEAD_ZONE,
    COMMAND_DELAY,
    SOURCE_RESISTANCE,
    COGGING,
    COGGING_CYCLES,
    COGGING_PHASE,
    WHEEL_ERROR,
    WHEEL_PHASE,
    WORM_ERROR,
    WORM_PHASE,
    EXPONENT,
    DEPTH,
    LOSS_FACTOR,
    GEAR_PRESLIDING,
    LOAD_PRESLIDING,
    ATAN_LEVEL,
    ATAN_VELOCITY,
    GEAR_OFFSET,
    NORMAL_FRICTION,
    BACKLASH,
    BACKLASH_INERTIA,
    SLIP_STIFFNESS,
    _,
    _,
    _,
    _,
    _,
    SLIP_YIELD,
    _,
    _,
    _,
    _,
    _,
    BOUC_WEN,
    BOUC_WEN_YIELD,
    BOUC_WEN_EXPONENT,
    BOUC_WEN_SHAPE,
    SPRING_DAMPING,
    BRANCH_STIFFNESS,
    _,
    _,
    BRANCH_TIME,
    _,
    _,
    WINDING_CAPACITY,
    WINDING_TO_CASE,
    CASE_CAPACITY,
    CASE_TO_AMBIENT,
    RESISTANCE_RISE,
    CONSTANT_FALL,
    START_WINDING,
    START_CASE,
    LINK_STIFFNESS,
    LINK_INERTIA,
    LINK_DAMPING,
    RIPPLE,
    RIPPLE_CYCLES,
    RIPPLE_PHASE,
    MEMORY,
    WEIGHT,
    MASS_LEVER,
    BACKLASH_DAMPING,
    GEAR_VISCOUS,
    KNEE,
    _,
    _,
    _,
    STRIBECK_SHAPE,
    DEAD_TIME,
    DEAD_TIME_CURRENT,
    COGGING_2,
    COGGING_2_CYCLES,
    COGGING_2_PHASE,
    COGGING_3,
    COGGING_3_CYCLES,
    COGGING_3_PHASE,
    WHEEL_ERROR_2,
    WHEEL_PHASE_2,
    WORM_ERROR_2,
    WORM_PHASE_2,
    ERROR_AT_ZERO,
    GEAR_BRISTLE,
    LOAD_BRISTLE,
    GEAR_BRISTLE_DAMPING,
    LOAD_BRISTLE_DAMPING,
    PULSE_RISE,
    PULSE_TAPER,
    VISCOUS_SKEW,
    CONSTANT_FALL_WINDING,
    BACKLASH_REBOUND,
    WORM_ERROR_3,
    WORM_PHASE_3,
    POSITION_FIRST,
    POSITION_STEP,
    POSITION_TORQUE,
    *_,
    SOURCE_ONE_WAY,
    SOURCE_RIPPLES,
) = range(len(EFFECTS))
N_EFFECTS = len(EFFECTS)
COGGING_WAVES = (COGGING, COGGING_2, COGGING_3)  # each followed by its cycles and phase
N_POSITIONS = 32  # nodes of a load's position torque
N_SLIPS, N_BRANCHES = 6, 3  # elements of a Maxwell-slip hysteresis, branches of a Maxwell model
DEEP_rad = 0.3  # depth of a nonlinear contact that the default step is made for


@njit(error_model="numpy", inline="always")
def gear_slip(fx, speed):
    """Factor of the gear's friction level that slides at a speed (Stribeck)."""
    if fx[GEAR_RISE] == 0.0:
        return 1.0
    share = np.abs(speed / fx[GEAR_STRIBECK])
    fallen = share * share
    if fx[STRIBECK_SHAPE] > 0.0:  # zero: the usual 2
        fallen = share ** fx[STRIBECK_SHAPE]
    return 1.0 + fx[GEAR_RISE] * np.exp(-fallen)


@njit(error_model="numpy", inline="always")
def gear_coulomb(fx, direction, speed):
    """Coulomb and Stribeck level [Nm] of motor and gear that slide this way."""
    level = fx[GEAR_FORWARD] if direction > 0 else fx[GEAR_BACKWARD]
    return level * gear_slip(fx, speed)


@njit(error_model="numpy", inline="always")
def gear_friction(fx, direction, speed, torque, torque_sign):
    """Magnitude of the set-valued friction [Nm] at the wheel that slides (or is about to) so.

    `torque_sign` is the sign of the spring torque: friction is driven where it opposes the
    motion, back-driven where it helps it. With presliding the Coulomb part is elastic at first
    (`memory.gear_presliding`) and only what the load causes stays set-valued.
    """
    level = gear_coulomb(fx, direction, speed) if fx[GEAR_PRESLIDING] == 0.0 else 0.0
    loss = fx[GEAR_DRIVE_LOSS] if direction * torque_sign > 0 else fx[GEAR_BACKDRIVE_LOSS]
    return level + loss * torque_sign * torque


@njit(error_model="numpy", inline="always")
def rigid_share(fx, way, torque_sign):
    """Factor on load and load inertia that a worm without spring adds to what moves the wheel.

    Its friction is in proportion to the torque tau = J_l w' - tau_load that it transmits, so that
    (J + E J_l) w' = tau_wheel + E tau_load with E = 1 + loss where it drives, 1 - loss where it is
    back-driven.
    """
    if way * torque_sign > 0.0:
        return 1.0 + fx[GEAR_DRIVE_LOSS]
    return 1.0 - fx[GEAR_BACKDRIVE_LOSS]


@njit(error_model="numpy", inline="always")
def gear_smooth_friction(fx, speed):
    """Viscous and arctangent friction of the thesis' NLFM [Nm], with the sign of the speed."""
    friction = fx[GEAR_VISCOUS] * speed + fx[VISCOUS_SKEW] * abs(speed)
    if fx[ATAN_LEVEL] != 0.0:
        friction += fx[ATAN_LEVEL] * np.arctan(speed / fx[ATAN_VELOCITY])
    return friction


@njit(error_model="numpy", inline="always")
def load_coulomb(fx, speed):
    """Coulomb and Stribeck level [Nm] of the load's joint."""
    level = fx[LOAD_COULOMB]
    if fx[LOAD_RISE] > 0.0:
        level *= 1.0 + fx[LOAD_RISE] * np.exp(-((speed / fx[LOAD_STRIBECK]) ** 2))
    return level


@njit(error_model="numpy", inline="always")
def load_friction(fx, speed, hanging):
    """Magnitude of the set-valued friction [Nm] of the load's joint.

    `hanging` is the load's angle from where it hangs: the bearing carries weight and
    centrifugal force, |N| = hypot(m d w^2 + m g cos, m g sin) (eq. 3.6 with its sign set right).
    """
    level = load_coulomb(fx, speed) if fx[LOAD_PRESLIDING] == 0.0 else 0.0
    if fx[NORMAL_FRICTION] > 0.0:
        along = fx[MASS_LEVER] * speed * speed + fx[WEIGHT] * np.cos(hanging)
        level += fx[NORMAL_FRICTION] * np.hypot(along, fx[WEIGHT] * np.sin(hanging))
    return level


@njit(error_model="numpy", inline="always")
def acting_command(fx, command):
    """What a bridge with a dead zone makes of a duty."""
    if abs(command) <= fx[DEAD_ZONE]:
        return 0.0
    return command - fx[DEAD_ZONE] if command > 0.0 else command + fx[DEAD_ZONE]


@njit(error_model="numpy", inline="always")
def source_ohm(fx, command, current):
    """What a sagging supply adds to the winding's resistance [ohm].

    Only the sign of the current counts: `SOURCE_ONE_WAY` takes its share away where the bridge
    returns current. With a capacitor the bridge draws duty times the current, evenly; without one
    it draws all of it for a share |duty| of the time (`SOURCE_RIPPLES`: share without one).
    """
    size = abs(command)
    share = size * (size + fx[SOURCE_RIPPLES] * (1.0 - size))
    if command * current < 0.0:
        share *= 1.0 - fx[SOURCE_ONE_WAY]
    return share * fx[SOURCE_RESISTANCE]


@njit(error_model="numpy")
def dead_time_volts(fx, plant, current):
    """What the dead time of a bridge takes of the winding's voltage [V]."""
    if fx[DEAD_TIME] == 0.0:
        return 0.0
    lost = fx[DEAD_TIME] * plant.volts_per_command
    return lost * np.tanh(current / fx[DEAD_TIME_CURRENT])


@njit(error_model="numpy")
def dead_time_current(fx, plant, volts, resistance):
    """The current [A] of a winding without inductance, R i + dead time's loss = volts."""
    if fx[DEAD_TIME] == 0.0:
        return volts / resistance
    # Newton from below: the sum is concave in |i|, so that no step passes the root
    wanted, lost = abs(volts), fx[DEAD_TIME] * plant.volts_per_command
    current = max(wanted - lost, 0.0) / resistance
    for _ in range(60):
        share = np.tanh(current / fx[DEAD_TIME_CURRENT])
        slope = resistance + lost * (1.0 - share * share) / fx[DEAD_TIME_CURRENT]
        step = (wanted - resistance * current - lost * share) / slope
        current += step
        if abs(step) <= 1e-15 * current:
            break
    return current if volts > 0.0 else -current


@njit(error_model="numpy", inline="always")
def wheel_torque(fx, wheel):
    """What terms of the motor's angle add to the torque on the wheel [Nm]."""
    torque = -fx[GEAR_OFFSET]
    if fx[COGGING] != 0.0:
        torque -= fx[COGGING] * np.sin(fx[COGGING_CYCLES] * wheel + fx[COGGING_PHASE])
    if fx[COGGING_2] != 0.0:
        torque -= fx[COGGING_2] * np.sin(fx[COGGING_2_CYCLES] * wheel + fx[COGGING_2_PHASE])
    if fx[COGGING_3] != 0.0:
        torque -= fx[COGGING_3] * np.sin(fx[COGGING_3_CYCLES] * wheel + fx[COGGING_3_PHASE])
    return torque


@njit(error_model="numpy", inline="always")
def constant_factor(fx, wheel, case_rise, winding_rise):
    """Factor on k_t and k_e alike: ripple over the motor's angle, weaker warm magnets.

    Magnets follow the case, those of a rotor the winding too. Both constants change together, so
    that no energy is made.
    """
    factor = 1.0 - fx[CONSTANT_FALL] * case_rise - fx[CONSTANT_FALL_WINDING] * winding_rise
    if fx[RIPPLE] != 0.0:
        factor *= 1.0 + fx[RIPPLE] * np.sin(fx[RIPPLE_CYCLES] * wheel + fx[RIPPLE_PHASE])
    return factor


@njit(error_model="numpy", inline="always")
def position_torque(fx, angle):
    """A torque over the load's angle [Nm]: a smooth table, zero two nodes outside."""
    u = (angle - fx[POSITION_FIRST]) / fx[POSITION_STEP]
    return uniform_spline(fx, POSITION_TORQUE, N_POSITIONS, u)


@njit(error_model="numpy", inline="always")
def load_torque(fx, angle, speed, pulse):
    """What smooth terms add to the torque on the load [Nm], and what of it is drag.

    `pulse` is the share of the disturbance that acts.
    """
    drag = fx[DRAG] * speed * abs(speed)
    torque = -drag - fx[PARALLEL] * (angle - fx[PARALLEL_REST])
    if fx[UNBALANCE] != 0.0:
        torque -= fx[UNBALANCE] * np.sin(angle + fx[UNBALANCE_ANGLE])
    if fx[POSITION_STEP] != 0.0:
        torque += position_torque(fx, angle)
    return torque + pulse * fx[PULSE], drag


@njit(error_model="numpy", inline="always")
def contact_torque(fx, stiffness, depth, speed):
    """Elastic and lossy torque [Nm] of a contact by power law and Hunt-Crossley damping."""
    if depth <= 0.0:
        return 0.0, 0.0
    reference = fx[DEPTH]
    elastic = stiffness * reference * (depth / reference) ** fx[EXPONENT]
    return elastic, elastic * max(fx[LOSS_FACTOR] * speed, -1.0)


@njit(error_model="numpy")
def position_stiffness(fx):
    """Bound of the slope of the position torque [Nm/rad]."""
    if fx[POSITION_STEP] == 0.0:
        return 0.0
    return steepest(fx, POSITION_TORQUE, N_POSITIONS) / fx[POSITION_STEP]
