"""What `compare`, `tune` and `simulate` write: one file a controller, inside --out."""

import json

import numpy as np
import pytest

from dftfs.cli.main import main
from dftfs.files import file_stem
from rsea_core.scenarios.comparison_file import read_comparison
from tests.dftfs.cli.test_control_commands import TASK

TWO = TASK.replace('name = "tuned"', 'name = "A+B"') + (
    '[[controller]]\nname = "A-B"\nkind = "pid-torque"\ntune = { kp = [5.0, 90.0] }\n'
)
SCENARIO = """
name = "angle"
rig = "rsea-bench"
[load]
kind = "free"
[reference]
kind = "ramp"
amplitude_rad = 0.1
rise_s = 0.5
[controller]
kind = "impedance"
selection = 1.0
kp = 0.1
kv = 0.01
[simulation]
duration_s = 1.0
"""


def written(tmp_path, text, name="small.toml"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def test_controllers_with_similar_names_have_files_of_their_own(tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["tune", str(written(tmp_path, TWO)), "--out", str(out), "--seeds", "1"]) == 0
    assert {"A+B.toml", "A-B.toml", "A+B.h", "A-B.h"} <= {p.name for p in out.iterdir()}
    assert "at its bound" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("name", "taken", "stem"),
    [
        ("A B", ("A-B",), "A-B-2"),
        ("../../etc/passwd", (), "etc-passwd"),
        ("...", (), "unnamed"),
        ("LQG, medium", (), "LQG-medium"),
    ],
)
def test_a_files_name_stands_for_any_name_and_leaves_no_folder(name, taken, stem):
    assert file_stem(name, taken) == stem


@pytest.mark.parametrize("command", ["compare", "tune", "simulate"])
def test_a_name_with_a_folder_is_refused_in_one_line(tmp_path, capsys, command):
    text = SCENARIO if command == "simulate" else TASK
    old = '"angle"' if command == "simulate" else '"small"'
    path = written(tmp_path, text.replace(f"name = {old}", 'name = "../outside"', 1))
    assert main([command, str(path), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert "name = '../outside' names the result files" in error


def test_finished_searches_stay_where_tune_refuses_to_overwrite(tmp_path, capsys):
    path, out = written(tmp_path, TASK), tmp_path / "out"
    assert main(["tune", str(path), "--out", str(out), "--seeds", "1"]) == 0
    log = (out / "small.searches.jsonl").read_text(encoding="utf-8")
    assert main(["tune", str(path), "--out", str(out), "--seeds", "1"]) == 2
    assert "exists; use --force" in capsys.readouterr().err
    assert (out / "small.searches.jsonl").read_text(encoding="utf-8") == log


def test_a_search_of_other_inputs_is_not_resumed(tmp_path, capsys):
    path, out = written(tmp_path, TASK), str(tmp_path / "out")
    assert main(["tune", str(path), "--out", out, "--seeds", "1"]) == 0
    written(tmp_path, TASK.replace("amplitude_Nm = 2.0", "amplitude_Nm = 2.5"))
    capsys.readouterr()
    assert main(["tune", str(path), "--out", out, "--seeds", "1", "--resume", "--force"]) == 0
    assert "seed 0" in capsys.readouterr().err


def test_an_angle_is_followed_by_simulate(tmp_path, capsys):
    path, out = written(tmp_path, SCENARIO), tmp_path / "out"
    assert main(["simulate", str(path), "--out", str(out), "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    rows = np.genfromtxt(out / "angle.csv", delimiter=",", names=True)
    error = rows["reference_angle_rad"] - rows["load_angle_rad"]
    assert record["metrics"]["rmse_rad"] == pytest.approx(np.sqrt((error**2).mean()), rel=1e-9)
    assert record["limits"]["binding"] in ("angle", "voltage")
    page = (out / "angle.html").read_text(encoding="utf-8")
    assert "load angle" in page


def test_a_controller_is_designed_on_the_known_machine_and_judged_on_the_plant(tmp_path):
    known = (
        '[known.rig_values]\nmotor_inertia_kgm2 = 1e-5\n[tolerances]\n"motor_inertia_kgm2" = 0.2\n'
    )
    task = read_comparison(written(tmp_path, TASK + known))
    assert task.task.known_model.rig.motor_inertia_kgm2 == 1e-5
    assert task.task.model.rig.motor_inertia_kgm2 != 1e-5
    assert task.tolerances == {"motor_inertia_kgm2": 0.2}


def test_a_spring_design_is_solved_where_a_comparison_names_one(tmp_path):
    asked = []
    path = written(tmp_path, TASK + '[spring]\ndesign = "al1"\n')

    def solve(name):
        asked.append(name)
        raise RuntimeError("solved")

    with pytest.raises(RuntimeError, match="solved"):
        read_comparison(path, solve)
    assert asked == ["al1"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('name = "tuned"', "name = [1]", "must be a word"),
        ('kind = "lqg-torque"', 'kind = ["lqg-torque"]', "must be a word in quotes"),
        ('kind = "lqg-torque"', 'kind = "nowhere:Law"', "cannot be loaded"),
        ("perturbed = 2", 'method = ["x"]', "must be a word"),
        ("frequency_Hz = 2.0", "frequency_Hz = 1e300", "not below half the sampling rate"),
        ('kind = "lqg-torque"', 'kind = "pid-torque"\nfriction_smoothing_rad_per_s = 1e30', "1e12"),
        ("duration_s = 0.5", "duration_s = 1e12", "rows"),
        ("frequency_Hz = 2.0", "frequency_Hz = 500.0", "not below half the sampling rate"),
        ("frequency_Hz = 2.0", "frequency_Hz = 700.0", "not below half the sampling rate"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(tmp_path, capsys, old, new, message):
    assert main(["compare", str(written(tmp_path, TASK.replace(old, new)))]) == 2
    lines = [
        line for line in capsys.readouterr().err.splitlines() if line.startswith("dftfs compare:")
    ]
    assert len(lines) == 1
    assert message in lines[0]
