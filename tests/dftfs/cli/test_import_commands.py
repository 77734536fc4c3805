"""A stranger's log becomes a case, is looked at and goes out again, all from the command line."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from dftfs.cli.main import main
from rsea_core.files.csv_columns import write_columns
from rsea_core.recordings.case import read_case
from tests.rsea_core.recordings.test_consistency_checks import RIG, recorded


@pytest.fixture
def bench(tmp_path) -> Path:
    """A rig file and a log in percent, degrees and milliseconds."""
    r = recorded()
    (tmp_path / "rig.toml").write_text(RIG.to_toml())
    data = {
        "Time": 1e3 * r["time_s"], "PWM": 100.0 * r["duty"],
        "theta_m": np.degrees(r["motor_angle_rad"]), "theta_l": -np.degrees(r["load_angle_rad"]),
        "iq_mA": 1e3 * r["current_A"], "loadcell": r["torque_Nm"], "goal_deg": r["time_s"],
    }  # fmt: skip
    write_columns(tmp_path / "log.csv", data)
    return tmp_path


def imported(folder: Path, *more: str) -> int:
    own = ["import", str(folder / "log.csv"), "--out", str(folder / "case")]
    return main([*own, "--rig", str(folder / "rig.toml"), *more])


def test_a_log_in_other_units_is_imported_as_the_recording_that_it_is(bench, capsys):
    assert imported(bench) == 0
    r = read_case(bench / "case").recordings[0]
    for name, values in recorded().columns.items():
        assert np.allclose(r[name], values, rtol=1e-9, atol=1e-9), name
    assert list(r.references) == ["goal_deg"]
    assert "<svg" in (bench / "case" / "preview.html").read_text(encoding="utf-8")
    assert "reference, not fitted: goal_deg" in capsys.readouterr().out


def test_the_next_log_takes_the_map_that_is_there(bench):
    imported(bench)
    (bench / "second.csv").write_text((bench / "log.csv").read_text())
    assert main(["import", str(bench / "second.csv"), "--out", str(bench / "case")]) == 0
    assert [r.file for r in read_case(bench / "case").recordings] == ["log.csv", "second.csv"]


def test_a_next_log_whose_load_stands_still_is_listed_as_held(bench):
    imported(bench)
    table = np.genfromtxt(bench / "log.csv", delimiter=",", names=True)
    held = {n: table[n] * (n != "theta_l") for n in table.dtype.names}
    write_columns(bench / "second.csv", held)
    assert main(["import", str(bench / "second.csv"), "--out", str(bench / "case")]) == 0
    assert [r.load.kind for r in read_case(bench / "case").recordings] == ["pendulum", "locked"]


def test_a_next_log_is_listed_with_the_load_that_the_others_have_unless_it_moves(bench):
    imported(bench, "--load", "locked")
    (bench / "second.csv").write_text((bench / "log.csv").read_text())
    table = np.genfromtxt(bench / "log.csv", delimiter=",", names=True)
    held = {n: table[n] * (n != "theta_l") for n in table.dtype.names}
    write_columns(bench / "third.csv", held)
    for name in ("second.csv", "third.csv"):
        assert main(["import", str(bench / name), "--out", str(bench / "case")]) == 0
    loads = [r.load.kind for r in read_case(bench / "case").recordings]
    assert loads == ["locked", "pendulum", "locked"]


def test_a_first_import_without_a_rig_file_writes_one_with_what_is_open(bench, capsys):
    text = (bench / "log.csv").read_text().replace("loadcell", "ch7")
    (bench / "log.csv").write_text(text)
    assert main(["import", str(bench / "log.csv"), "--out", str(bench / "first")]) == 0
    assert "not decided yet: column 'ch7'" in capsys.readouterr().out
    assert "# gear_ratio = ..." in (bench / "first" / "rig.toml").read_text()


def test_a_robot_model_fills_in_what_the_rig_file_lacks(bench):
    rig = (bench / "rig.toml").read_text().splitlines()
    kept = [line for line in rig if not line.startswith("load_inertia")]
    (bench / "rig.toml").write_text("\n".join(kept))
    inertia = "<inertial pos='0 0 0.1' mass='9' diaginertia='0.03 0.03 0.03'/>"
    joint = f"<joint name='elbow' axis='0 0 1'/>{inertia}"
    body = f"<mujoco><worldbody><body>{joint}</body></worldbody></mujoco>"
    (bench / "robot.xml").write_text(body)
    assert imported(bench, "--model", str(bench / "robot.xml")) == 0
    found = read_case(bench / "case").rig
    assert found.load_inertia_kgm2 == 0.03
    assert found.load_mass_kg == RIG.load_mass_kg


def test_physics_that_the_rigs_file_states_is_carried_to_the_case(bench):
    stated = '[[term]]\neffect = "gear-friction"\ncoulomb_Nm = 0.012\ntolerance = 0.25\n'
    (bench / "rig.toml").write_text(RIG.to_toml() + stated)
    assert imported(bench) == 0
    assert stated in (bench / "case" / "rig.toml").read_text()
    (known,) = read_case(bench / "case").known
    assert (known.term.coulomb_Nm, known.tolerance) == (0.012, 0.25)


def test_a_rig_file_to_fill_in_says_how_dry_friction_is_stated(bench):
    assert main(["import", str(bench / "log.csv"), "--out", str(bench / "f"), "--yes"]) == 0
    text = (bench / "f" / "rig.toml").read_text()
    hint = next(part for part in text.split("\n\n") if "Known dry friction" in part)
    lines = [line.removeprefix("# ") for line in hint.splitlines()[1:]]
    assert lines == ["[[term]]", 'effect = "gear-friction"', "coulomb_Nm = ..."]


@pytest.mark.parametrize("command", ["import", "doctor", "diagnose"])
def test_a_term_that_cannot_be_used_is_one_line_and_status_2(command, bench, capsys):
    imported(bench)
    capsys.readouterr()
    bad = '[[term]]\neffect = "gear-friction"\ncoulomb = 0.012\n'
    if command == "import":
        (bench / "rig.toml").write_text(RIG.to_toml() + bad)
        assert imported(bench, "--force") == 2
    else:
        path = bench / "case" / "rig.toml"
        path.write_text(path.read_text().replace("[[recording]]", bad + "[[recording]]"))
        assert main([command, str(bench / "case"), "--out", str(bench / "found")]) == 2
    printed = capsys.readouterr().err.strip().splitlines()
    assert len(printed) == 1
    assert "rig.toml: term 1 (gear-friction): unknown key 'coulomb'; the nearest" in printed[0]


def test_a_spring_of_the_library_gives_its_stiffness(bench):
    assert main(["import", str(bench / "log.csv"), "--out", str(bench / "f"), "--yes",
                 "--spring", "al1"]) == 0  # fmt: skip
    text = (bench / "f" / "rig.toml").read_text()
    value = re.search(r"^spring_stiffness_Nm_per_rad = (.*)  # design al1, rod model$", text, re.M)
    assert 65.5 < float(value[1]) < 66.5


def test_what_a_first_import_lacks_is_reported_of_the_file_that_was_written(
    bench, capsys, monkeypatch
):
    monkeypatch.chdir(bench)
    assert main(["import", "log.csv", "--out", "first", "--yes"]) == 0
    assert "not complete yet: first/rig.toml: rig 'first'" in capsys.readouterr().out


def test_questions_are_a_line_each_and_write_nothing_until_they_are_answered(bench, capsys):
    text = (bench / "log.csv").read_text().replace("loadcell", "ch7")
    (bench / "log.csv").write_text(text)
    assert imported(bench) == 2
    assert "column 'ch7': what is it?" in capsys.readouterr().err
    assert not (bench / "case").exists()
    assert imported(bench, "--yes") == 0


def test_a_log_without_times_needs_a_rate(bench, capsys):
    rows = [line.partition(",")[2] for line in (bench / "log.csv").read_text().splitlines()]
    (bench / "log.csv").write_text("\n".join(rows))
    assert imported(bench) == 2
    assert "--rate-hz" in capsys.readouterr().err
    assert imported(bench, "--rate-hz", "1000") == 0
    assert read_case(bench / "case").recordings[0].sample_time_s == pytest.approx(1e-3)


def test_doctor_reports_health_and_without_a_case_the_machine(bench, capsys):
    imported(bench)
    capsys.readouterr()
    assert main(["doctor", str(bench / "case"), "--no-slips", "--out", str(bench / "page")]) == 0
    assert "1000 Hz" in capsys.readouterr().out
    assert (bench / "page" / "doctor.html").exists()
    assert main(["doctor", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert "numpy" in found["versions"]
    assert {"linear solver", "compiled kernels", "fe"} <= {c["name"] for c in found["checks"]}
    assert {c["state"] for c in found["checks"]} <= {"good", "slow", "missing"}


@pytest.mark.parametrize("kind", ["parquet", "mcap"])
def test_an_exported_recording_reads_back_bit_for_bit(kind, bench):
    pytest.importorskip("pyarrow" if kind == "parquet" else "mcap")
    imported(bench)
    assert (
        main(["export-log", str(bench / "case"), "--out", str(bench / kind), "--format", kind]) == 0
    )
    rig = RIG.to_toml() + f'\n[[recording]]\nfile = "log.{kind}"\n'
    if kind == "mcap":
        rig = rig.replace("[[rec", '[columns]\ntime_s = "time_s"\n' + "".join(
            f'{n} = "{n}"\n' for n in recorded().columns if n != "time_s") + "\n[[rec")  # fmt: skip
    (bench / kind / "rig.toml").write_text(rig)
    own, back = (read_case(bench / n).recordings[0] for n in ("case", kind))
    assert all(np.array_equal(own[n], back[n]) for n in own.columns)


def test_a_machine_goes_out_as_urdf_with_what_that_cannot_hold(bench, capsys):
    assert main(["export-log", str(bench / "rig.toml"), "--out", str(bench / "u")]) == 0
    assert "URDF cannot hold the spring" in capsys.readouterr().out
    assert "<robot" in (bench / "u" / "rig.urdf").read_text()


def test_a_machine_goes_out_as_mjcf_and_a_case_does_not(bench, capsys):
    given = ["--out", str(bench / "m"), "--format", "mjcf"]
    assert main(["export-log", str(bench / "rig.toml"), *given]) == 0
    assert "<mujoco" in (bench / "m" / "rig.xml").read_text()
    assert main(["export-log", str(bench / "rig.toml"), *given[:-1], "mcap", "--force"]) == 2
    assert "--format mcap is of recordings" in capsys.readouterr().err


def test_columns_of_text_are_named_and_a_broken_clock_says_where(bench, capsys):
    head, *rows = (bench / "log.csv").read_text().splitlines()
    text = [f"{head},state", *(f"{row},run{k}" for k, row in enumerate(rows))]
    (bench / "log.csv").write_text("\n".join(text))
    assert imported(bench) == 0
    assert "note: text, not read: state" in capsys.readouterr().out
    swapped = [head, *rows[:-100], rows[-200], *rows[-100:]]
    (bench / "log.csv").write_text("\n".join(swapped))
    assert imported(bench, "--force") == 2
    assert "column 'Time' goes back in row" in capsys.readouterr().err


def test_a_map_of_the_rig_file_is_used_unless_it_was_only_proposed(bench, capsys):
    rig = (bench / "rig.toml").read_text()
    own = 'current_A = { name = "loadcell" }\nreference = ["theta_l"]\nignore = ["*"]\n'
    (bench / "rig.toml").write_text(f"{rig}\n[columns]\n{own}")
    assert imported(bench, "--yes", "--column", "ignore=goal_deg") == 0
    r = read_case(bench / "case").recordings[0]
    assert np.allclose(r["current_A"], recorded()["torque_Nm"])
    assert "theta_l" in r.references
    assert "goal_deg" not in r.references
    (bench / "rig.toml").write_text(f"{rig}\n[columns]\nproposed = true\n{own}")
    assert imported(bench, "--force") == 0
    assert "was proposed without values of the machine" in capsys.readouterr().out
    assert "torque_Nm" in read_case(bench / "case").recordings[0]


def test_a_gap_is_split_where_it_is_refused_and_a_scaled_counter_is_a_clock(bench, capsys):
    head, *rows = (bench / "log.csv").read_text().splitlines()
    kept = rows[:1000] + rows[1001:2000] + rows[2004:]
    text = [f"seq,{head.partition(',')[2]}"]
    text += [f"{k + 7},{row.partition(',')[2]}" for k, row in enumerate(rows) if row in kept]
    (bench / "log.csv").write_text("\n".join(text))
    clock = ("--column", 'time_s={ name = "seq", scale = 0.001 }')
    assert imported(bench, *clock) == 2
    assert "split the recording there (dftfs import --split)" in capsys.readouterr().err
    assert imported(bench, *clock, "--split") == 0
    assert [r.rows for r in read_case(bench / "case").recordings] == [2000, 1996]
    assert "1 of 2000 rows were lost" in capsys.readouterr().out


def test_the_preview_shows_a_recording_that_is_added(bench):
    imported(bench)
    (bench / "second.csv").write_text((bench / "log.csv").read_text())
    assert main(["import", str(bench / "second.csv"), "--out", str(bench / "case")]) == 0
    assert "second.csv" in (bench / "case" / "preview.html").read_text(encoding="utf-8")


def test_a_rate_that_the_file_holds_is_the_clock(bench, capsys):
    table = np.genfromtxt(bench / "log.csv", delimiter=",", names=True)
    columns = {n: table[n] for n in table.dtype.names if n != "Time"}
    np.savez(bench / "log.npz", **columns, fs=1000.0)
    own = ["import", str(bench / "log.npz"), "--out", str(bench / "case")]
    assert main([*own, "--rig", str(bench / "rig.toml")]) == 0
    assert read_case(bench / "case").recordings[0].sample_time_s == pytest.approx(1e-3)
    out = capsys.readouterr().out
    assert "fs of the file gives 1000 rows per second" in out
    assert out.count("missing in [rig]") <= 1
