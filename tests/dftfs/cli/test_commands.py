"""Commands print results on stdout, one line on an error, and end with the documented status."""

import json
import os
import subprocess
import sys

import pytest

from dftfs.analysis.torsion import contact_path as contact_path
from dftfs.cli.main import main
from dftfs.fem import newton

SCENARIO = """
rig = "rsea-bench"
[spring]
stiffness_Nm_per_rad = 65.8
[load]
kind = "locked"
[reference]
kind = "sine"
amplitude_Nm = 2.0
frequency_Hz = 1.0
[controller]
kind = "pid-torque"
kp = 60.0
ki = 10.0
sample_time_s = 0.001
[simulation]
duration_s = 1.5
"""


@pytest.fixture
def run(capsys):
    def run(*arguments):
        try:
            status = main(list(arguments))
        except SystemExit as end:
            status = end.code
        captured = capsys.readouterr()
        return status, captured.out, captured.err

    return run


def test_design_prints_what_the_contract_names_as_json(run):
    status, out, _ = run("design", "ref", "--json")
    record = json.loads(out)
    assert status == 0
    assert {
        "stiffness_Nm_per_rad",
        "eq_2_1_Nm_per_rad",
        "min_clearance_m",
        "contact_onset",
        "arm_length_m",
        "mass_kg",
        "checks",
    } <= record.keys()
    assert record["stiffness_Nm_per_rad"] == pytest.approx(65.43, rel=0.01)
    assert record["contact_onset"]["unwinding"]["torque_Nm"] == pytest.approx(-10.2, rel=0.02)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("diagnose", "case", "--out", "a", "--out", "b"), "dftfs diagnose: argument --out: given"),
        (("prove", "score", "x", "--name", "a", "--name", "b"), "--name: given twice"),
        (
            ("diagnose", "case", "--quik"),
            "dftfs diagnose: unrecognized arguments: --quik; did you mean --quick?",
        ),
        (
            ("design", "al1", "al2"),
            "dftfs design: unrecognized arguments: al2; for example dftfs design al1",
        ),
    ],
)
def test_a_slip_in_the_options_is_one_line_that_names_the_command(run, arguments, reason):
    status, out, err = run(*arguments)
    assert (status, out) == (2, "")
    assert reason in err
    assert err.count("\n") == 1


def test_a_failed_requirement_is_exit_status_1_and_named(run):
    status, out, _ = run("design", "al1")
    assert status == 1
    assert "FAIL  contact-free torque, unwinding" in out
    status, out, _ = run("design", "al1", "--set", "contact_free_torque_Nm=12")
    assert status == 0
    assert "FAIL" not in out


def test_a_thin_neck_is_advice_and_no_failure(run):
    arguments = ["--set", "n_arms=3", "--set", "turns=1.2", "--set", "thickness_mm=6"]
    status, out, _ = run("design", "ref", *arguments, "--set", "fillet_radius_mm=0.5")
    assert status == 0
    assert "open  neck between slit and tip: 1.912 mm" in out


def test_verify_prints_what_the_contract_names_and_writes_it(run, tmp_path):
    arguments = ["verify", "ref", "--plane", "--states", "3", "--no-mesh-error", "--at-rad", "0.1"]
    status, out, err = run(*arguments, "--json", "--out", str(tmp_path))
    record = json.loads(out)
    assert status == 0
    assert "first contact" in err
    assert {"stiffness_Nm_per_rad", "curve", "contact_onset", "mesh", "mesh_error", "wall_s"} <= (
        record.keys()
    )
    state = next(s for s in record["curve"] if s["deflection_rad"] == 0.1)
    assert {"torque_Nm", "peak_von_mises_Pa", "min_clearance_m"} <= state.keys()
    assert {s["torque_Nm"] > 0 for s in record["curve"]} == {True, False}
    assert set(record["contact_onset"]) == {"winding", "unwinding"}
    assert {"nodes", "elements"} <= record["mesh"].keys()
    assert json.loads((tmp_path / "verify-ref.json").read_text()) == record
    status, _, err = run(*arguments, "--out", str(tmp_path))
    assert (status, err.count("\n")) == (2, 1)
    assert "--force" in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--load", "5", "1", "10"], "low must not be above"),
        (["--load", "-5", "5", "0"], "cycles = 0.0 must be above 0"),
        (["--beyond", "0.5"], "beyond = 0.5 must be 1 to 3"),
        (["--overload-rad", "nan"], "overload-rad"),
    ],
)
def test_verify_refuses_a_bad_load_in_one_line(run, arguments, message):
    status, _, err = run("verify", "ref", "--plane", "--no-mesh-error", *arguments)
    assert status == 2
    assert message in err.splitlines()[-1]


@pytest.mark.needs_cad
def test_export_writes_the_four_files_and_says_what_it_measured(run, tmp_path):
    status, out, _ = run("export", "al1", "--out", str(tmp_path / "new"), "--json")
    record = json.loads(out)
    assert status == 0
    names = {"al1.step", "al1.stl", "al1.dxf", "al1-polyline.dxf"}
    assert {p.name for p in (tmp_path / "new").iterdir()} == names
    assert record["bounding_box_m"] == pytest.approx([0.17324, 0.17324, 0.00734])
    assert record["mass_kg"] == pytest.approx(record["volume_m3"] * 2700)


@pytest.mark.needs_cad
def test_a_refused_export_leaves_no_folder_behind(run, tmp_path):
    arguments = ["export", "al1", "--stl-tolerance-mm", "-1", "--out", str(tmp_path / "new")]
    status, _, err = run(*arguments)
    assert (status, err.count("\n")) == (2, 1)
    assert not (tmp_path / "new").exists()


def test_simulate_runs_a_scenario_file(run, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(SCENARIO)
    status, out, _ = run("simulate", str(path), "--json", "--out", str(tmp_path / "o"))
    record = json.loads(out)
    assert status == 0
    assert 0 < record["metrics"]["rmse_Nm"] < 0.1
    header = (tmp_path / "o" / "mine.csv").read_text().splitlines()[0].split(",")
    assert {"time_s", "motor_angle_rad", "load_angle_rad", "torque_Nm", "current_A"} <= set(header)


def test_materials_lists_all_and_shows_sources(run):
    status, out, _ = run("materials")
    assert status == 0
    assert all(
        name in out for name in ("al-6061-t6", "titanium-6al-4v", "spring-steel-1095", "pla")
    )
    status, out, _ = run("materials", "7075-T6", "--json")
    values = json.loads(out)["values"]
    assert values["youngs_modulus_GPa"]["value"] == pytest.approx(71.7)
    assert all(entry["source"] for entry in values.values())


BAD = [
    (["design", "al9"], 2, "neither a file nor one of"),
    (["design", "al1", "--set", "width_mm=-3"], 2, "width_mm = -3 must be positive"),
    (["design", "al1", "--set", "width=3"], 2, "'width_mm'"),
    (["design", "al1", "--set", "width_mm"], 2, "write FIELD=VALUE"),
    (["design", "al1", "--set", "turns=4"], 2, "overlap"),
    (["design", "al1", "--set", "rim_inner_radius_mm=85"], 2, "does not close"),
    (["design", "al1", "--set", "inner_radius_mm=0.018"], 2, "looks like metres"),
    (["design", "al1", "--set", "material=unobtainium"], 2, "unobtainium"),
    (["verify", "al1", "--plane", "--out", "/proc/nowhere"], 2, "cannot be written"),
    (["verify", "ref", "--plane", "--at-rad", "-0.3", "--no-mesh-error"], 2, "-0.3 rad"),
    (["verify", "al1", "--states", "0"], 2, "states"),
    (["verify", "al1", "--plane", "--at-rad", "nan"], 2, "must be numbers"),
    (["design", "al1", "--set", "width_mm=1e9"], 2, "width_mm = 1e+09 is over 2000 mm"),
    (["simulate", "nowhere.toml"], 2, "nowhere.toml"),
    (["materials", "al-6061-t7"], 2, "al-6061-t6"),
    (["conquer"], 2, "unknown command 'conquer'"),
    (["studdy"], 2, "did you mean study?"),
]


def test_shape_and_doctor_refuse_an_output_folder_before_their_work(run, monkeypatch):
    def work(*_, **__):
        raise AssertionError("works before its output folder is checked")

    monkeypatch.setattr("dftfs.analysis.shape.compare.compared", work)
    monkeypatch.setattr("rsea_core.recordings.case.read_case", work)
    for command in (["shape", "al1"], ["doctor", "case"]):
        status, _, error = run(*command, "--out", "/proc/nowhere")
        assert status == 2
        assert "cannot be written" in error


BAD_OF_CAD = [
    (["export", "al1", "--formats", "igs", "--out", "x"], 2, "known are step, stl, dxf"),
    (["export", "al1", "--out", "/proc/nowhere"], 2, "cannot be written"),
    (["study", "al1", "--out", "/proc/nowhere"], 2, "cannot be written"),
]


@pytest.mark.needs_cad
def test_a_study_with_a_wrong_mesh_leaves_no_folder(run, tmp_path):
    status, _, error = run("study", "al1", "--layers", "0", "--out", str(tmp_path / "s"))
    assert status == 2
    assert "layers = 0 must be 1 to 32" in error
    assert not (tmp_path / "s").exists()


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [*BAD, *(pytest.param(*row, marks=pytest.mark.needs_cad) for row in BAD_OF_CAD)],
    ids=[" ".join(arguments) for arguments, _, _ in (*BAD, *BAD_OF_CAD)],
)
def test_wrong_input_is_one_line_with_its_exit_status(run, arguments, status, message):
    found, out, err = run(*arguments)
    assert found == status
    assert message in err
    assert err.strip().splitlines()[-1].startswith("dftfs")
    assert "Traceback" not in err
    assert out == ""


def test_misspelt_scenario_key_names_the_nearest(run, tmp_path):
    path = tmp_path / "s.toml"
    path.write_text(SCENARIO.replace("amplitude_Nm", "amplitud_Nm"))
    status, _, err = run("simulate", str(path))
    assert (status, err.count("\n")) == (2, 1)
    assert "amplitude_Nm" in err


def test_a_mesh_that_cannot_be_made_is_exit_status_3(run):
    short = ["n_arms=3", "turns=0.25", "thickness_mm=6"]
    changes = [word for change in short for word in ("--set", change)]
    status, out, err = run("verify", "al1", "--plane", "--no-mesh-error", *changes)
    assert status == 3
    assert out == ""
    assert "more turns would work" in err.strip().splitlines()[-1]


def test_a_solve_that_finds_no_equilibrium_is_exit_status_3_in_one_line(run, monkeypatch):
    """The engine is given no increments to spend: what it says must reach the user whole."""
    real = newton.solve_path

    def impatient(problem, targets, **options):
        return real(problem, targets, max_iterations=1, **options)

    monkeypatch.setattr(contact_path, "solve_path", impatient)
    status, out, err = run("verify", "al1", "--plane", "--no-mesh-error")
    assert status == 3
    assert out == ""
    last = err.strip().splitlines()[-1]
    assert last.startswith("dftfs verify: no equilibrium")
    assert "would help" in last


def test_program_is_installed_and_answers_without_a_traceback(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "dftfs", "design", "missing.toml"],
        capture_output=True,
        text=True,
        cwd=os.getcwd(),
    )
    assert done.returncode == 2
    assert done.stderr.startswith("dftfs design: missing.toml: cannot be read")
    assert done.stdout == ""
