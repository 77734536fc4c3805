"""The true machine: its constants, and the numbers of every effect that it may have.

Named tuples, because the compiled integrator reads their fields by name. SI and radians; motor
side and output side as `recordings.md` says. A default value means "this effect is absent".
"""

from typing import NamedTuple

import numpy as np

PENDULUM, FREE, LOCKED, CONTACT = 0, 1, 2, 3
LOAD_MODES = {"pendulum": PENDULUM, "free": FREE, "locked": LOCKED, "contact": CONTACT}
AMBIENT_C = 22.0
COPPER_PER_K = 0.00393  # temperature coefficient of copper's resistance at 20 degrees


class Machine(NamedTuple):
    """The constants that a rig file names, with their true values."""

    supply_voltage_V: float
    terminal_resistance_ohm: float
    terminal_inductance_H: float
    torque_constant_Nm_per_A: float
    back_emf_constant_Vs_per_rad: float
    current_limit_A: float
    motor_inertia_kgm2: float
    motor_viscous_Nms_per_rad: float
    gear_ratio: float
    output_inertia_kgm2: float
    output_viscous_Nms_per_rad: float
    spring_stiffness_Nm_per_rad: float
    load_mass_kg: float
    load_distance_m: float
    load_inertia_kgm2: float
    load_viscous_Nms_per_rad: float
    gravity_angle_offset_rad: float
    contact_stiffness_Nm_per_rad: float
    contact_angle_rad: float
    contact_damping_Nms_per_rad: float


class Physics(NamedTuple):
    """What the machine has beyond the constants.

    Friction is a bristle (LuGre, Canudas de Wit 1995, with the bristle damping that fades with
    speed, Olsson 1996); the worm's is Coulomb friction on its thread; the spring's loop is
    Bouc-Wen's or, in `Series`, a Prandtl-Ishlinskii sum of stops.
    """

    # motor side dry friction
    gear_coulomb_plus_Nm: float = 0.0
    gear_coulomb_minus_Nm: float = 0.0
    gear_static_ratio: float = 1.0
    gear_stribeck_rad_per_s: float = 10.0
    gear_bristle_rad: float = 2e-3
    gear_bristle_damping_Nms_per_rad: float = 0.0
    # worm thread
    worm_lead_rad: float = 0.1
    worm_friction_rad: float = 0.0
    worm_bristle_rad: float = 4e-3
    # teeth between worm and gear output; 0 stiffness: rigid
    teeth_stiffness_Nm_per_rad: float = 0.0
    teeth_damping_Nms_per_rad: float = 0.0
    backlash_rad: float = 0.0
    # gear box on a soft mount; 0 inertia: rigid
    mount_inertia_kgm2: float = 0.0
    mount_stiffness_Nm_per_rad: float = 0.0
    mount_damping_Nms_per_rad: float = 0.0
    # a detent that grows with the load: share of the spring's torque, over the output angle
    detent_share: float = 0.0
    detent_cycles: float = 0.0
    # drive
    dead_zone_duty: float = 0.0
    source_resistance_ohm: float = 0.0
    delay_s: float = 0.0
    winding_capacity_J_per_K: float = 1e12
    case_capacity_J_per_K: float = 1e12
    winding_to_case_K_per_W: float = 1.0
    case_to_air_K_per_W: float = 1.0
    magnet_loss_per_K: float = 0.0
    # spring
    hardening_per_rad: float = 0.0
    coils_touch_rad: float = 1e9
    coils_touch_side: float = 0.0
    coils_touch_stiffness_Nm_per_rad: float = 0.0
    loop_torque_Nm: float = 0.0
    loop_yield_rad: float = 0.05
    loop_exponent: float = 1.0
    clamp_slip_Nm: float = 1e12
    # load
    parallel_stiffness_Nm_per_rad: float = 0.0
    magnet_Nm: float = 0.0  # a magnet beside the link: its largest torque, place and reach
    magnet_angle_rad: float = 0.0
    magnet_reach_rad: float = 1.0
    load_coulomb_Nm: float = 0.0
    load_static_ratio: float = 1.0
    load_stribeck_rad_per_s: float = 0.1
    load_bristle_rad: float = 3e-4
    load_bristle_damping_Nms_per_rad: float = 0.0
    drag_coefficient: float = 0.0
    drag_exponent: float = 2.0
    unbalance_Nm: float = 0.0
    unbalance_angle_rad: float = 0.0
    tip_share: float = 0.0
    link_stiffness_Nm_per_rad: float = 0.0
    link_damping_Nms_per_rad: float = 0.0
    # environment: the contact's law is linear where the exponent is 1
    contact_exponent: float = 1.0
    contact_power_stiffness: float = 0.0
    contact_power_damping: float = 0.0


class Series(NamedTuple):
    """The effects that are sums of like terms, one row a term.

    ``gear_error``: amplitude at the gear output in rad, cycles per motor radian, phase;
    ``cogging``: amplitude in Nm at the motor, cycles per motor radian, phase; ``stops``: stiffness
    in Nm/rad, yield torque in Nm; ``branches``: stiffness in Nm/rad, relaxation time in s.
    """

    gear_error: np.ndarray = np.zeros((0, 3))
    cogging: np.ndarray = np.zeros((0, 3))
    stops: np.ndarray = np.zeros((0, 2))
    branches: np.ndarray = np.zeros((0, 2))


class InternalStates(NamedTuple):
    """What one recording leaves behind for the next one; the encoders are zeroed every time."""

    winding_C: float = AMBIENT_C
    case_C: float = AMBIENT_C
