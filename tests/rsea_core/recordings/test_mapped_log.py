"""A log with own names, units and signs becomes a recording of the contract through its map."""

import numpy as np
import pytest

from rsea_core.errors import RecordingError
from rsea_core.recordings.case import read_case
from rsea_core.recordings.units import to_si
from tests.cases.logs import COLUMNS, TIME, write_csv, write_format

RIG = """[rig]
name = "arm"
parts = ["drive", "gear", "load"]
torque_constant_Nm_per_A = 0.1
gear_ratio = 10.0

[columns]
{columns}
reference = [{reference}]
ignore = ["*"]

[[recording]]
file = "{file}"
load = "free"
{more}
"""
MAP = """time_s = { name = "t", unit = "ms" }
duty = { name = "cmd", unit = "percent", sign = -1 }
motor_angle_rad = { name = "pos", unit = "deg", zero = 30.0, side = "load" }"""


def read(folder, file, columns=MAP, more="", reference=""):
    text = RIG.format(columns=columns, file=file, more=more, reference=reference)
    (folder / "rig.toml").write_text(text)
    return read_case(folder).recordings[0]


def test_unit_sign_zero_and_side_of_the_gear_are_applied(tmp_path):
    r = read(tmp_path, write_csv(tmp_path / "log.csv", delimiter=";", decimal=",").name)
    assert np.allclose(r.time_s, TIME)
    assert np.allclose(r["duty"], -COLUMNS["cmd"] / 100.0)
    assert np.allclose(r["motor_angle_rad"], 10.0 * np.radians(COLUMNS["pos"] - 30.0))


@pytest.mark.parametrize("kind", ["mat", "npz"])
def test_a_recording_is_equal_from_any_format(kind, tmp_path):
    written = read(tmp_path, write_csv(tmp_path / "log.csv").name)
    other = read(tmp_path, write_format(tmp_path, kind).name)
    assert all(np.array_equal(other[n], written[n]) for n in written.columns)


def test_a_part_of_a_log_is_a_recording_and_references_are_kept(tmp_path):
    write_csv(tmp_path / "log.csv")
    r = read(tmp_path, "log.csv", more="start_s = 0.5\nend_s = 1.0", reference='"cmd"')
    assert r.file == "log.csv [0.5..1 s]"
    assert (r.rows, r.time_s[0]) == (101, 0.0)
    assert np.array_equal(r.references["cmd"], COLUMNS["cmd"][100:201])


def test_a_slower_stream_is_brought_to_the_angles_times_with_a_note(tmp_path):
    write_csv(tmp_path / "log.csv")
    lines = ["t,goal", *(f"{50.0 * k},{k}" for k in range(41))]
    (tmp_path / "slow.csv").write_text("\n".join(lines))
    columns = MAP.replace('name = "cmd"', 'name = "goal"')
    r = read(tmp_path, "log.csv", columns=columns, more='with_files = ["slow.csv"]')
    assert r["duty"][9] == 0.0
    assert r["duty"][10] == pytest.approx(-0.01)
    assert any("brought to those of motor_angle_rad, held" in n.text for n in r.notes)


def test_a_formula_adds_and_multiplies_columns_and_runs_nothing_else(tmp_path):
    write_csv(tmp_path / "log.csv")
    columns = MAP.replace('{ name = "cmd", unit', "{ formula = \"'cmd' * 2 - 'cmd'\", unit")
    r = read(tmp_path, "log.csv", columns=columns)
    assert np.allclose(r["duty"], -COLUMNS["cmd"] / 100.0)
    wrong = columns.replace("'cmd' * 2", "__import__('os').system('x')")
    with pytest.raises(RecordingError, match="only numbers, quoted columns"):
        read(tmp_path, "log.csv", columns=wrong)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"pos"', '"poss"', "no column 'poss'; nearest: 'pos'"),
        ('"deg"', '"degg"', 'unit "degg" is not known'),
        ('"deg"', '"mA"', 'unit "mA" is no unit of rad'),
        ('"deg"', '"count"', 'unit "count" needs counts_per_rev'),
        ('"load" }', '"left" }', "side 'left' is unknown"),
        ("sign = -1", "sign = 2", "sign = 2 must be 1 or -1"),
        ("time_s = ", "rate_Hz = 5\ntime_s = ", "a log has one clock"),
        ('time_s = { name = "t", unit = "ms" }', "", "a log without time"),
        ('name = "pos"', 'topic = "/x", name = "pos"', "topic '/x' is not there"),
    ],
)
def test_a_wrong_map_is_one_line_that_names_what_is_allowed(old, new, message, tmp_path):
    write_csv(tmp_path / "log.csv")
    with pytest.raises(RecordingError) as found:
        read(tmp_path, "log.csv", columns=MAP.replace(old, new))
    assert message in str(found.value)
    assert "\n" not in str(found.value)


@pytest.mark.parametrize(
    ("value", "unit", "target", "si"),
    [
        (1.0, "rpm", "rad/s", 2 * np.pi / 60), (1.0, "mNm", "N*m", 1e-3),
        (1.0, "°", "rad", np.pi / 180), (1.0, "rev", "rad", 2 * np.pi), (1.0, "µs", "s", 1e-6),
        (50.0, "degF", "degC", 10.0), (1.0, "kgf cm", "N*m", 0.0980665),
        (50.0, "%", "dimensionless", 0.5), (1.0, "oz-in", "N*m", 0.00706155181),
    ],
)  # fmt: skip
def test_units_as_loggers_write_them(value, unit, target, si):
    assert to_si(np.array([value]), unit, target)[0] == pytest.approx(si, rel=1e-8)


def test_a_reference_without_numbers_is_left_out_with_a_note(tmp_path):
    lines = write_csv(tmp_path / "log.csv").read_text().splitlines()
    rows = [lines[0] + ",goal", *(f"{line},nan" for line in lines[1:])]
    (tmp_path / "log.csv").write_text("\n".join(rows))
    r = read(tmp_path, "log.csv", reference='"goal"')
    assert not r.references
    assert any("'goal' holds no numbers: left out" in note.text for note in r.notes)
