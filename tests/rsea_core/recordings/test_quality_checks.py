"""Recordings in good files with bad content are reported, each fault in a sentence."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rsea_core.effects.known_variants import laws_by_key
from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig
from rsea_core.recordings.case import Case
from rsea_core.recordings.finding import sentences
from rsea_core.recordings.quality_checks import data_errors, data_warnings
from rsea_core.recordings.recording import Recording

RIG = Rig(
    name="r",
    supply_voltage_V=48.0,
    torque_constant_Nm_per_A=0.3,
    back_emf_constant_Vs_per_rad=0.3,
    gear_ratio=60.0,
    motor_encoder_counts_per_rev=8192,
    load_encoder_counts_per_rev=8192,
    torque_sensor_noise_Nm=0.02,
)


def reported(rig: Rig = RIG, *, rows: int = 2000, row_s: float = 0.001, **columns) -> str:
    t = row_s * np.arange(rows)
    rng = np.random.default_rng(3)
    motor = 5.0 * (1.0 - np.cos(2 * np.pi * 0.5 * t / (row_s * 1000)))
    torque = 4.0 * np.sin(2 * np.pi * 0.5 * t / (row_s * 1000) + 0.3)
    data = {
        "time_s": t,
        "duty": 0.1 * np.sin(3.0 * t),
        "motor_angle_rad": motor,
        "load_angle_rad": np.zeros(rows),
        "torque_Nm": torque + 0.02 * rng.standard_normal(rows),
    }
    data |= columns
    r = Recording(file="a.csv", load=Load(kind="locked"), columns=data, sample_time_s=row_s)
    case = Case(name="c", folder=Path(), rig=rig, recordings=(r,))
    return " ".join(sentences(data_warnings(case)))


def test_a_good_recording_gives_no_findings():
    assert reported() == ""


def test_a_silent_recording_is_reported():
    noise = 0.02 * np.random.default_rng(1).standard_normal(2000)
    assert "silent" in reported(motor_angle_rad=np.zeros(2000), torque_Nm=noise)


def test_a_short_recording_is_reported():
    assert "too short: 100 rows in 0.099 s" in reported(rows=100)


def test_a_clipped_torque_is_reported():
    t = 0.001 * np.arange(2000)
    noise = 0.02 * np.random.default_rng(1).standard_normal(2000)
    torque = np.clip(4.0 * np.sin(2 * np.pi * 0.5 * t + 0.3) + noise, -3.0, 3.0)
    assert "torque_Nm is clipped at 3" in reported(torque_Nm=torque)


def test_a_torque_clipped_on_one_side_is_reported():
    t = 0.001 * np.arange(2000)
    noise = 0.02 * np.random.default_rng(1).standard_normal(2000)
    torque = np.minimum(4.0 * np.sin(2 * np.pi * 0.5 * t + 0.3) + noise, 2.0)
    assert "torque_Nm is clipped at 2" in reported(torque_Nm=torque)


def test_a_velocity_is_clipped_only_where_its_angle_passes_faster():
    """That of a triangle rests at its extreme, to a count, and that of a limited register too."""
    t = 0.001 * np.arange(2000)
    rng = np.random.default_rng(1)
    triangle, sine = np.abs((t + 0.5) % 2.0 - 1.0), 1.0 - np.cos(np.pi * t)
    for angle, most, clipped in ((triangle, 1.0, False), (sine, 2.0, True)):
        speed = np.gradient(angle, t)
        noisy = np.where((np.arange(2000) // 30) % 3 > 0, 0.01 * rng.random(2000), 0.0)
        logged = np.sign(speed) * np.minimum(np.abs(speed), most - noisy)
        logged += 1e-3 * rng.standard_normal(2000) * (np.abs(speed) < 0.95 * most)
        found = reported(motor_angle_rad=angle, motor_velocity_rad_per_s=logged)
        assert ("motor_velocity_rad_per_s is clipped" in found) is clipped, found


def test_a_sensor_whose_noise_stops_is_reported():
    rng = np.random.default_rng(1)
    torque = 4.0 * np.sin(0.5 * np.arange(2000) * 0.001) + 0.02 * rng.standard_normal(2000)
    torque[1200:] = 0.7
    assert "torque_Nm repeats 0.7 from 1.2 to 1.999 s without any noise" in reported(
        torque_Nm=torque
    )


def test_rows_too_far_apart_for_a_motion_are_reported():
    assert "rows are 0.2 s apart" in reported(row_s=0.2)


def test_a_clock_in_milliseconds_read_as_seconds_is_reported():
    assert "clock or encoder wrong" in reported(row_s=1e-6 * 1.0)


def test_a_supply_in_millivolts_is_reported_and_a_lower_one_is_a_choice():
    assert "1000 times rig.toml's supply_voltage_V = 48: mV?" in reported(
        supply_V=np.full(2000, 48e3)
    )
    assert reported(supply_V=np.full(2000, 12.0)) == ""


@pytest.mark.parametrize("stiffness", [65.0, -65.0])
def test_a_torque_computed_from_the_deflection_is_reported(stiffness):
    t = 0.001 * np.arange(2000)
    motor = 5.0 * np.sin(2 * np.pi * 0.5 * t)
    message = reported(motor_angle_rad=motor, torque_Nm=stiffness * motor / 60.0)
    assert f"{stiffness:g} Nm/rad times the deflection" in message


def test_a_resolution_that_the_readings_do_not_have_is_reported():
    t = 0.001 * np.arange(2000)
    count = 2.0 * np.pi / 8192
    motor = count * np.round(0.05 * (1.0 - np.cos(np.pi * t)) / count)
    assert reported(motor_angle_rad=motor) == ""
    fine = replace(RIG, motor_encoder_counts_per_rev=10**9)
    assert "motor_angle_rad moves in steps of 0.000767 rad" in reported(fine, motor_angle_rad=motor)
    quiet = replace(RIG, torque_sensor_noise_Nm=1e-12)
    assert "torque_Nm scatters by 0.02" in reported(quiet)


def test_motor_constants_that_no_motor_has_are_the_first_error():
    rig = replace(RIG, torque_constant_Nm_per_A=3.0)
    t = 0.001 * np.arange(300)
    r = Recording(
        file="a.csv", load=Load(kind="locked"), sample_time_s=0.001,
        columns={"time_s": t, "duty": 0.1 * np.sin(30.0 * t), "motor_angle_rad": np.sin(t)},
    )  # fmt: skip
    case = Case(name="c", folder=Path(), rig=rig, recordings=(r,))
    assert "torque_constant_Nm_per_A is 10 times back_emf" in data_errors(case)[0].text


def test_laws_that_act_in_both_directions_are_signed():
    laws = laws_by_key()
    for key in ("sensor-drift/in each recording@torque_Nm", "sensor-scale/factor@torque_Nm"):
        assert laws[key].signed
    for key in ("gear-friction/coulomb", "gear-load-friction/efficiencies"):
        assert not laws[key].signed
    assert laws["sensor-scale/factor@torque_Nm"].scaled((1.02,), -1.5) == pytest.approx((0.97,))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"terminal_inductance_H": 4.56, "terminal_resistance_ohm": 3.78}, "mH or mohm"),
        ({"load_mass_kg": 300.0, "load_distance_m": 0.3, "load_inertia_kgm2": 0.03}, "g, mm or"),
        ({"load_mass_kg": 0.3, "load_distance_m": 300.0, "load_inertia_kgm2": 0.03}, "g, mm or"),
    ],
)
def test_values_of_a_rig_file_that_cannot_be_true_together_are_reported(values, message):
    case = Case(name="c", folder=Path(), rig=replace(RIG, **values), recordings=())
    (found,) = data_warnings(case)
    assert message in found.text
    bench = replace(case, rig=Rig.preset("rsea-bench"))
    assert data_warnings(bench) == ()


def driven(file: str, sign: float, column: str) -> Recording:
    """A motor that turns there and back against friction, or is turned against its command."""
    t = 0.001 * np.arange(4000)
    angle = 3.0 * (1.0 - np.cos(2.0 * np.pi * 0.5 * t))
    columns = {"time_s": t, column: sign * np.sin(2.0 * np.pi * 0.5 * t), "motor_angle_rad": angle}
    return Recording(file=file, columns=columns, sample_time_s=0.001, load=Load(kind="free"))


def case_of(*signs: float, column: str = "current_A") -> Case:
    recordings = tuple(driven(f"{k}.csv", s, column) for k, s in enumerate(signs))
    rig = replace(RIG, parts=("drive", "gear", "load"), supply_voltage_V=None)
    return Case(name="c", folder=Path(), rig=rig, recordings=recordings)


def test_a_current_against_its_motion_has_the_wrong_sign():
    for column in ("current_A", "current_command_A"):
        found = sentences(data_warnings(case_of(-1.0, column=column)))
        assert any(f"moves against {column}" in text and "wrong sign" in text for text in found)


def test_one_recording_that_disagrees_with_the_others_is_no_wrong_sign():
    case = case_of(1.0, 1.0, -1.0)
    found = sentences(data_warnings(case))
    assert not any("wrong sign" in text for text in found)
    assert any("does something else push here?" in text for text in found)
    assert not any("moves against" in text for text in sentences(data_errors(case)))
