"""A case is read as the contract says, and every violation gets one line with its place."""

import numpy as np
import pytest

from rsea_core.effects.gear_friction import GearFriction
from rsea_core.errors import RecordingError, RseaError
from rsea_core.machine.rig import Rig
from rsea_core.recordings.bench_log import TICK_s
from rsea_core.recordings.case import apparent_noise, noise_floor, read_case, read_test
from rsea_core.recordings.recording import read_recording

RIG = """
[rig]
name = "bench"
supply_voltage_V = 48.0
terminal_resistance_ohm = 3.8
torque_constant_Nm_per_A = 0.3056
back_emf_constant_Vs_per_rad = 0.3056
motor_inertia_kgm2 = 3.2e-4
gear_ratio = 60.0
spring_stiffness_Nm_per_rad = 65.8
load_mass_kg = 0.3
load_distance_m = 0.3
load_inertia_kgm2 = 0.03
motor_encoder_counts_per_rev = 8192
torque_sensor_noise_Nm = 0.02
"""
CONSTANTS = ("torque_constant_Nm_per_A", "back_emf_constant_Vs_per_rad")
ROWS = 40


def csv(columns: dict[str, np.ndarray]) -> str:
    rows = zip(*(v.tolist() for v in columns.values()), strict=True)
    return "\n".join([",".join(columns), *(",".join(f"{x:.9g}" for x in row) for row in rows), ""])


def columns(**changes) -> dict[str, np.ndarray]:
    time = 0.002 * np.arange(ROWS)
    found = {
        "time_s": time,
        "duty": 0.1 * np.sin(40.0 * time),
        "motor_angle_rad": 2.0 * time,
        "torque_Nm": 0.3 * np.cos(9.0 * time),
    }
    return {k: v for k, v in (found | changes).items() if v is not None}


def case(folder, rig: str = RIG, listed: str = 'file = "a.csv"', **changes):
    (folder / "rig.toml").write_text(f"{rig}\n[[recording]]\n{listed}\n", encoding="utf-8")
    (folder / "a.csv").write_text(csv(columns(**changes)), encoding="utf-8")
    return folder


def test_a_case_is_read_with_roles_loads_and_responses(tmp_path):
    listed = (
        'file = "a.csv"\nrole = "identification"\nload = "contact"\n'
        "contact_stiffness_Nm_per_rad = 150.0\ncontact_angle_rad = 0.1\n"
        'description = "press"\n'
    )
    found = read_case(case(tmp_path, listed=listed))
    (r,) = found.recordings
    assert found.identification == (r,)
    assert found.validation == ()
    assert r.load.kind == "contact"
    assert r.load.contact_damping_Nms_per_rad == 0.0
    assert r.command_name == "duty"
    assert r.responses == ("motor_angle_rad", "torque_Nm")
    assert r.sample_time_s == pytest.approx(0.002)
    assert r.notes == ()


def test_only_a_machine_driven_by_current_or_voltage_needs_its_torque_constant(tmp_path):
    without = RIG
    for constant in CONSTANTS:
        without = without.replace(f"{constant} = 0.3056\n", "")
    with pytest.raises(RseaError, match=r"a\.csv.* duty.* needs torque_constant_Nm_per_A"):
        read_case(case(tmp_path, without))
    torque = np.sin(np.arange(ROWS))
    found = read_case(case(tmp_path, without, duty=None, motor_torque_Nm=torque))
    assert found.rig.torque_constant_Nm_per_A is None
    assert found.recordings[0].command_name == "motor_torque_Nm"


@pytest.mark.parametrize("left_out", CONSTANTS)
def test_of_torque_and_back_emf_constant_one_is_enough_for_a_winding(tmp_path, left_out):
    found = read_case(case(tmp_path, RIG.replace(f"{left_out} = 0.3056\n", ""))).rig
    assert [getattr(found, constant) for constant in CONSTANTS] == [0.3056, 0.3056]


def test_the_noise_floor_is_the_count_or_the_stated_noise(tmp_path):
    found = read_case(case(tmp_path))
    floors = noise_floor(found.rig, found.recordings[0])
    assert floors["motor_angle_rad"] == pytest.approx(2 * np.pi / 8192 / np.sqrt(12))
    assert floors["torque_Nm"] == 0.02


def jump(at: int, by: float) -> np.ndarray:
    time = 0.002 * np.arange(ROWS)
    time[at:] += by
    return time


BAD = {
    "unknown column": ({"motor_angle_deg": np.zeros(ROWS)}, "motor_angle_deg.*motor_angle_rad"),
    "repeated time": ({"time_s": jump(7, -0.002)}, "time_s, row 9.*repeats"),
    "backward time": ({"time_s": jump(7, -0.01)}, "time_s, row 9.*goes back"),
    "gap": ({"time_s": jump(20, 0.03)}, "time_s, row 22.*gap of 0.032"),
    "duty out of range": ({"duty": np.linspace(0, 1.2, ROWS)}, "column duty, row 35.*-1..1"),
    "two inputs": ({"voltage_V": np.zeros(ROWS)}, "duty and voltage_V"),
    "no input": ({"duty": None}, "needs one of the columns duty"),
    "no response": ({"motor_angle_rad": None, "torque_Nm": None}, "needs a response column"),
    "enabled": ({"drive_enabled": np.full(ROWS, 0.5)}, "drive_enabled, row 2.*0 or 1"),
    "no time": ({"time_s": None}, "time_s"),
    "supply": ({"supply_V": np.zeros(ROWS)}, "supply_V, row 2.*above 0"),
    "percent": ({"duty": np.linspace(0, 80, ROWS)}, "column duty, row 3.*is 80: percent"),
    "cold": ({"temperature_C": np.full(ROWS, -300.0)}, "temperature_C, row 2.*-273.15"),
    "beyond": ({"torque_Nm": np.full(ROWS, 1e300)}, "torque_Nm, row 2.*beyond 1e"),
    "milliseconds": ({"time_s": 2.0 * np.arange(ROWS)}, "rows are 2 s apart.*milliseconds"),
    "kiloseconds": ({"time_s": 1e-6 * np.arange(ROWS)}, "rows are 1e-06 s apart, closer"),
    "microseconds": ({"time_s": 2000.0 * np.arange(ROWS)}, "2000 s apart.*microseconds"),
}


@pytest.mark.parametrize("what", BAD)
def test_a_violation_in_a_recording_names_file_column_and_row(tmp_path, what):
    changes, message = BAD[what]
    with pytest.raises(RecordingError, match=rf"a\.csv.*{message}") as caught:
        read_case(case(tmp_path, **changes))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time_s,duty,torque_Nm\n0,0,nan\n1,0,1\n2,0,1\n", "torque_Nm, row 2.*finite"),
        ("time_s,duty,torque_Nm\n0,0,x\n1,0,1\n2,0,1\n", "torque_Nm, row 2.*not a number"),
        ("time_s,duty,torque_Nm\n0,0\n1,0,1\n2,0,1\n", "row 2 has 2 values"),
        ("", "is empty"),
        ("time_s,duty,torque_Nm\n0,0,1\n", "has 1 rows"),
        ("time_s,duty,duty\n0,0,1\n", "duty is there twice"),
        ("time_s;duty;torque_Nm\n0;0;1\n", "row 1: columns stand apart by semicolons"),
        ("time_s\tduty\ttorque_Nm\n0\t0\t1\n", "row 1: columns stand apart by tabs"),
        ("time_s,duty,torque_Nm\n0,0,0,1,1\n", "row 2 has 5 values.*a point, not a comma"),
        ("# rig 7\ntime_s,duty,torque_Nm\n0,0,1\n", "row 1 is a comment"),
        ("time_s,duty,torque_Nm\n0,0,1\n# pause\n1,0,1\n", "row 3 has 1 values"),
        ("0,0,1\n1,0,1\n2,0,1\n", "row 1 is numbers"),
        ("time_s,duty,torque_Nm,\n0,0,1,\n", "row 1: column 4 has no name"),
        ("\ntime_s,duty,torque_Nm\n0,0,1\n", "row 1 is empty"),
    ],
)
def test_broken_text_is_named_with_its_row(tmp_path, text, message):
    path = tmp_path / "a.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RecordingError, match=message):
        read_recording(path)


def test_what_a_spreadsheet_adds_to_a_file_is_no_part_of_its_columns(tmp_path):
    plain, marked = tmp_path / "a.csv", tmp_path / "b.csv"
    text = csv(columns())
    plain.write_text(text, encoding="utf-8")
    names, rest = text.split("\n", 1)
    quoted = ",".join(f'"{name}"' for name in names.split(","))
    marked.write_bytes(b"\xef\xbb\xbf" + f"{quoted}\n{rest}".replace("\n", "\r\n").encode())
    a, b = read_recording(plain), read_recording(marked)
    assert list(a.columns) == list(b.columns)
    assert all(np.array_equal(a[name], b[name]) for name in a.columns)


def test_a_file_listed_twice_is_refused(tmp_path):
    with pytest.raises(RecordingError, match=r"recording 2: a\.csv is listed already"):
        read_case(case(tmp_path, listed='file = "a.csv"\n[[recording]]\nfile = "a.csv"'))


def test_a_map_needs_no_clock(tmp_path):
    listed = 'file = "a.csv"\nquasi_static = true'
    assert read_case(case(tmp_path, listed=listed, time_s=1.0 * np.arange(ROWS))).recordings


LISTED = {
    "role": ('file = "a.csv"\nrole = "test"', "role 'test'"),
    "load": ('file = "a.csv"\nload = "lockd"', "lockd.*'locked'"),
    "key": ('file = "a.csv"\nlod = "locked"', "unknown key 'lod'.*'load'"),
    "contact": ('file = "a.csv"\nload = "contact"', "needs contact_stiffness"),
    "flag": ('file = "a.csv"\nquasi_static = 1', "quasi_static = 1 must be true or false"),
    "missing": ('file = "b.csv"', "b.csv: cannot be read"),
    "only validation": ('file = "a.csv"\nrole = "validation"', "no recording has the role"),
}


@pytest.mark.parametrize("what", LISTED)
def test_a_violation_in_the_list_of_recordings_is_one_line(tmp_path, what):
    listed, message = LISTED[what]
    with pytest.raises(RseaError, match=message):
        read_case(case(tmp_path, listed=listed))


def test_jitter_is_resampled_and_reported(tmp_path):
    rng = np.random.default_rng(1)
    time = np.cumsum(0.002 * (1.0 + 0.3 * rng.random(ROWS)))
    found = read_case(case(tmp_path, time_s=time, motor_angle_rad=3.0 * time))
    (r,) = found.recordings
    assert np.ptp(np.diff(r.time_s)) < 1e-9
    # a straight line stays one, and the input is never mixed from two rows
    assert r["motor_angle_rad"] == pytest.approx(3.0 * r.time_s)
    assert set(r["duty"]) <= {float(f"{v:.9g}") for v in columns()["duty"]}
    assert "resampled" in r.notes[0].text


def bench_log(folder, *, ratio: float, derived: bool = True):
    rows = 200
    load = 10.0 * np.sin(0.05 * np.arange(rows))
    wheel = load + 2.0 * np.cos(0.11 * np.arange(rows))
    motor = wheel * ratio
    torque = 1.15 * (motor - load) if derived else np.random.default_rng(0).normal(size=rows)
    data = {
        "Time": np.arange(rows),
        "Motor Angle": motor,
        "Motor Velocity": np.zeros(rows),
        "Error Angle": motor - load,
        "PWM out": 50.0 + 10.0 * np.sin(0.1 * np.arange(rows)),
        "Frequency": np.full(rows, 1.0),
        "Load torque": torque,
    }
    path = folder / "log.csv"
    path.write_text(csv(data), encoding="utf-8")
    return path, np.deg2rad(load), np.deg2rad(wheel)


@pytest.mark.parametrize("ratio", [1.0, 60.0])
def test_a_bench_log_is_read_on_whichever_side_its_angle_is(tmp_path, ratio):
    path, load, wheel = bench_log(tmp_path, ratio=ratio)
    r = read_recording(path, gear_ratio=60.0)
    assert r.sample_time_s == pytest.approx(TICK_s)
    assert r["load_angle_rad"] == pytest.approx(load, abs=1e-6)
    assert r["motor_angle_rad"] == pytest.approx(60.0 * wheel, rel=1e-5, abs=1e-4)
    assert np.abs(r["duty"]).max() == pytest.approx(0.2, rel=1e-3)
    assert "torque_Nm" not in r.responses
    assert "torque_Nm" in r.derived
    assert any("computed, not sensed" in note.text for note in r.notes)
    assert any("not trusted" in note.text for note in r.notes)


def test_a_bench_log_with_impossible_pwm_names_the_row(tmp_path):
    path, _, _ = bench_log(tmp_path, ratio=1.0)
    text = path.read_text(encoding="utf-8").replace(",50,", ",150,", 1)
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RecordingError, match="PWM out, row 2"):
        read_recording(path, gear_ratio=60.0)


def test_test_inputs_start_at_the_stated_time(tmp_path):
    (tmp_path / "test.toml").write_text(
        '[[recording]]\nfile = "input.csv"\nload = "locked"\ninitial_motor_angle_rad = 0.3\n'
        "initial_temperature_C = 31.5\n",
        encoding="utf-8",
    )
    (tmp_path / "input.csv").write_text("time_s,duty\n0,0\n0.001,0.1\n", encoding="utf-8")
    (found,) = read_test(tmp_path, Rig.preset("rsea-bench"))
    assert found.inputs.initial_motor_angle_rad == 0.3
    assert found.inputs.load.kind == "locked"
    assert found.initial_temperature_C == 31.5


@pytest.mark.parametrize("rounded", [9, 6])
def test_the_noise_floor_of_an_encoder_whose_counts_are_not_stated(tmp_path, rounded):
    rows, lsb = 2000, 2 * np.pi / 4096
    t = 0.005 * np.arange(rows)
    angle = np.where(t < 6.0, 0.0, 0.5 * (1.0 - np.cos(2.0 * (t - 6.0))))  # rests most of the time
    jittered = t + 1e-4 * np.sin(50.0 * t)
    count = np.round(np.floor(angle / lsb) * lsb, rounded)
    resampled = np.interp(t, jittered, count)
    changes = {"time_s": t, "duty": 0.0 * t, "motor_angle_rad": resampled, "torque_Nm": 0.1 * t}
    (tmp_path / "rig.toml").write_text(
        RIG.replace("motor_encoder_counts_per_rev = 8192\n", "")
        + '\n[[recording]]\nfile = "a.csv"\n',
        encoding="utf-8",
    )
    (tmp_path / "a.csv").write_text(csv(changes), encoding="utf-8")
    found = read_case(tmp_path)
    floor = noise_floor(found.rig, found.recordings[0])["motor_angle_rad"]
    assert 0.5 < floor / (lsb / np.sqrt(12.0)) < 2.5


@pytest.mark.parametrize("order", [2, 3, 4])
def test_the_noise_of_a_motion_that_is_read_at_uneven_times_is_that_of_its_readings(order):
    """A time that is 4 % of a row off moves a fast reading by far more than its noise."""
    rng = np.random.default_rng(4)
    time = 0.01 * np.arange(3000) + 4e-4 * rng.standard_normal(3000)
    readings = 60.0 * np.sin(0.2 * time) + 1e-3 * rng.standard_normal(3000)
    assert apparent_noise(readings, time, order) == pytest.approx(1e-3, rel=0.1)
    assert apparent_noise(readings, None, order) > 2e-3


def test_a_case_has_the_physics_that_its_rig_file_states(tmp_path):
    term = '[[term]]\neffect = "gear-friction"\ncoulomb_Nm = 0.012\ntolerance = 0.3\n'
    (known,) = read_case(case(tmp_path, RIG + term)).known
    assert known.term == GearFriction(coulomb_Nm=0.012)
    assert (known.stated, known.tolerance) == (("coulomb_Nm",), 0.3)
    assert read_case(case(tmp_path)).known == ()


def test_a_term_that_cannot_be_used_is_one_line_of_the_rig_file(tmp_path):
    term = '[[term]]\neffect = "gear-friction"\ncoulomb_nm = 0.012\n'
    with pytest.raises(RseaError, match=r"rig\.toml: term 1 \(gear-friction\): unknown key"):
        read_case(case(tmp_path, RIG + term))
