"""What is missing in [rig] is what the columns and loads of a case need."""

from rsea_core.importing.case_text import missing_values
from rsea_core.machine.rig import Rig

RIG = Rig(name="pan", parts=("drive", "load"), torque_constant_Nm_per_A=0.16)
BRUSHLESS = ("time_s", "current_command_A", "load_angle_rad")


def test_what_cannot_exist_is_not_missing():
    found = missing_values(RIG, BRUSHLESS, {"free"})
    assert found == ["current_limit_A", "load_inertia_kgm2", "load_encoder_counts_per_rev"]


def test_what_a_column_a_load_or_a_part_needs_is_missing():
    more = {*missing_values(RIG, ("duty", "torque_Nm", "current_A"), {"pendulum"})}
    assert {"supply_voltage_V", "terminal_resistance_ohm", "torque_sensor_noise_Nm",
            "current_sensor_noise_A", "load_mass_kg", "load_distance_m"} <= more  # fmt: skip
    assert "gear_ratio" in missing_values(None, ("duty", "motor_angle_rad"))
