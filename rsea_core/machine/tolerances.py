"""How well a rig file's values are known where the file does not say."""

TOLERANCES = {
    "supply_voltage_V": 0.02,
    "terminal_resistance_ohm": 0.15,
    "terminal_inductance_H": 0.1,
    "torque_constant_Nm_per_A": 0.08,
    "back_emf_constant_Vs_per_rad": 0.08,
    "servo_proportional_Nm_per_rad": 0.1,
    "servo_derivative_Nms_per_rad": 0.2,
    "servo_torque_limit_Nm": 0.1,
    "servo_dead_band_rad": 0.3,
    "servo_delay_s": 0.3,
    "motor_inertia_kgm2": 0.15,
    "motor_viscous_Nms_per_rad": 0.7,
    "output_inertia_kgm2": 0.2,
    "output_viscous_Nms_per_rad": 0.7,
    "spring_stiffness_Nm_per_rad": 0.15,
    "load_mass_kg": 0.03,
    "load_inertia_kgm2": 0.05,
    "load_viscous_Nms_per_rad": 0.7,
    "gravity_angle_offset_rad": 0.015,
    "contact_stiffness_Nm_per_rad": 0.1,
    "contact_damping_Nms_per_rad": 0.4,
    "contact_angle_rad": 0.005,
}
"""Relative standard deviations (of the logarithm) where a rig file states none; angles in rad."""
