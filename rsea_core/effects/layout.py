"""The numbers of all effects in one array, and their laws, as engines read them.

A model's effects fill one array of `N_EFFECTS` numbers, everything on the output side of the
gear; zero means absent. Each effect's file claims its numbers and has its laws; here they stand
together for the engines, with the ports folded over all effects (`hooks`).
"""

from numba import njit

from rsea_core.effects.contact_nonlinear import (  # noqa: F401
    DEPTH,
    EXPONENT,
    LOSS_FACTOR,
    DEEP_rad,
    contact_torque,
)
from rsea_core.effects.drive_dead_zone import (  # noqa: F401
    DEAD_TIME,
    DEAD_TIME_CURRENT,
    DEAD_ZONE,
    GOAL_DEAD_BAND,
    ROUNDED_ZONE,
    dead_time_current,
    dead_time_volts,
    servo_torque,
)
from rsea_core.effects.drive_delay import COMMAND_DELAY  # noqa: F401
from rsea_core.effects.drive_offset import (  # noqa: F401
    COMMAND_DRIFT,
    COMMAND_OFFSET,
    acting_command,
)
from rsea_core.effects.drive_saturation import (  # noqa: F401
    SOURCE_ONE_DIRECTION,
    SOURCE_RESISTANCE,
    SOURCE_RIPPLES,
    source_ohm,
)
from rsea_core.effects.drive_thermal import (  # noqa: F401
    CASE_CAPACITY,
    CASE_TO_AMBIENT,
    CONSTANT_FALL,
    CONSTANT_FALL_WINDING,
    RESISTANCE_RISE,
    START_CASE,
    START_WINDING,
    WINDING_CAPACITY,
    WINDING_TO_CASE,
    magnet_factor,
)
from rsea_core.effects.gear_backlash import (  # noqa: F401
    BACKLASH,
    BACKLASH_DAMPING,
    BACKLASH_INERTIA,
    BACKLASH_RESTITUTION,
)
from rsea_core.effects.gear_friction import (  # noqa: F401
    ATAN_LEVEL,
    ATAN_VELOCITY,
    GEAR_BACKWARD,
    GEAR_BRISTLE,
    GEAR_BRISTLE_DAMPING,
    GEAR_FORWARD,
    GEAR_OFFSET,
    GEAR_PRESLIDING,
    GEAR_RISE,
    GEAR_STRIBECK,
    GEAR_VISCOUS,
    STRIBECK_SHAPE,
    VISCOUS_SKEW,
    WHEEL_DRY,
    gear_coulomb,
    gear_slip,
    gear_smooth_friction,
)
from rsea_core.effects.gear_load_friction import (  # noqa: F401
    GEAR_BACKDRIVE_LOSS,
    GEAR_DRIVE_LOSS,
    gear_friction,
    rigid_share,
)
from rsea_core.effects.gear_transmission_error import (  # noqa: F401
    ERROR_AT_ZERO,
    WHEEL_CYCLES,
    WHEEL_ERROR,
    WHEEL_ERROR_2,
    WHEEL_PHASE,
    WHEEL_PHASE_2,
    WORM_ERROR,
    WORM_ERROR_2,
    WORM_ERROR_3,
    WORM_PHASE,
    WORM_PHASE_2,
    WORM_PHASE_3,
)
from rsea_core.effects.hooks import OUTSIDE, OUTSIDE_HOOKS, USER, folded  # noqa: F401
from rsea_core.effects.load_disturbance import (  # noqa: F401
    PULSE,
    PULSE_END,
    PULSE_RISE,
    PULSE_START,
    PULSE_TAPER,
)
from rsea_core.effects.load_drag import DRAG, drag_damping, drag_torque  # noqa: F401
from rsea_core.effects.load_flexibility import LINK_DAMPING, LINK_INERTIA, LINK_STIFFNESS  # noqa: F401
from rsea_core.effects.load_friction import (  # noqa: F401
    LOAD_BRISTLE,
    LOAD_BRISTLE_DAMPING,
    LOAD_COULOMB,
    LOAD_DRY,
    LOAD_PRESLIDING,
    LOAD_RISE,
    LOAD_STRIBECK,
    MASS_LEVER,
    NORMAL_FRICTION,
    WEIGHT,
    load_coulomb,
)
from rsea_core.effects.load_inertia_variation import (  # noqa: F401
    INERTIA_COSINE,
    INERTIA_CYCLES,
    INERTIA_SINE,
    inertia_factor,
    least_inertia_factor,
)
from rsea_core.effects.load_position_torque import (  # noqa: F401
    N_POSITIONS,
    POSITION_FIRST,
    POSITION_STEP,
    POSITION_TORQUE,
    position_stiffness,
)
from rsea_core.effects.load_unbalance import UNBALANCE, UNBALANCE_ANGLE  # noqa: F401
from rsea_core.effects.motor_cogging import (  # noqa: F401
    COGGING,
    COGGING_2,
    COGGING_2_CYCLES,
    COGGING_2_PHASE,
    COGGING_3,
    COGGING_3_CYCLES,
    COGGING_3_PHASE,
    COGGING_CYCLES,
    COGGING_HARMONICS,
    COGGING_PHASE,
)
from rsea_core.effects.motor_torque_ripple import RIPPLE, RIPPLE_CYCLES, RIPPLE_PHASE, ripple_factor  # noqa: F401
from rsea_core.effects.registry import LAWS  # noqa: F401  all effects have claimed their numbers
from rsea_core.effects.slots import ANY, INTERNAL_STATES, close, names  # noqa: F401
from rsea_core.effects.spring_base import KNEE  # noqa: F401
from rsea_core.effects.spring_hysteresis import (  # noqa: F401
    BOUC_WEN,
    BOUC_WEN_EXPONENT,
    BOUC_WEN_SHAPE,
    BOUC_WEN_YIELD,
    N_SLIPS,
    SLIP_STIFFNESS,
    SLIP_YIELD,
)
from rsea_core.effects.spring_parallel import (  # noqa: F401
    PARALLEL,
    PARALLEL_REST,
    largest_parallel_stiffness,
    parallel_energy_J,
)
from rsea_core.effects.spring_viscoelastic import (  # noqa: F401
    BRANCH_STIFFNESS,
    BRANCH_TIME,
    N_BRANCHES,
    SPRING_DAMPING,
)

close(USER)
EFFECTS = names()
N_EFFECTS = len(EFFECTS)

output_torque_by_angle = folded("output_torque")
load_torque_by_angle = folded("load_torque")
load_friction_level = folded("load_friction")


@njit(error_model="numpy", inline="always")
def wheel_torque(fx, wheel, speed):
    """What terms of the motor's angle and speed add to the torque on the wheel [Nm]."""
    return output_torque_by_angle(fx, wheel, speed, 0.0)


@njit(error_model="numpy", inline="always")
def load_torque(fx, angle, speed, pulse):
    """What smooth terms add to the torque on the load [Nm], and what of it is drag.

    `pulse` is the share of the disturbance that acts.
    """
    drag = drag_torque(fx, speed)
    return load_torque_by_angle(fx, angle, speed, -drag) + pulse * fx[PULSE], drag


@njit(error_model="numpy", inline="always")
def load_friction(fx, speed, hanging):
    """Magnitude of the set-valued friction [Nm] of the load's joint.

    `hanging` is the load's angle from where it hangs.
    """
    level = load_coulomb(fx, speed) if fx[LOAD_PRESLIDING] == 0.0 else 0.0
    return load_friction_level(fx, hanging, speed, level)


@njit(error_model="numpy", inline="always")
def constant_factor(fx, wheel, case_rise, winding_rise):
    """Factor on k_t and k_e alike: ripple over the motor's angle, weaker warm magnets.

    Both constants change together, so that no energy is made.
    """
    factor = magnet_factor(fx, case_rise, winding_rise)
    if fx[RIPPLE] != 0.0:
        factor *= ripple_factor(fx, wheel)
    return factor
