"""`dftfs compare` and `dftfs tune` write their files, resume a search and refuse in one line."""

import json

import pytest

from dftfs.cli.main import main
from rsea_core.control.c_header import LAWS
from rsea_core.errors import ScenarioError
from rsea_core.files.toml_tables import read_toml
from rsea_core.scenarios.scenario import controller_from_table

TASK = """
name = "small"
rig = "rsea-bench"
[load]
kind = "locked"
[reference]
kind = "sine"
amplitude_Nm = 2.0
frequency_Hz = 2.0
[task]
duration_s = 0.5
from_s = 0.1
[budget]
seeds = 2
population = 5
generations = 3
perturbed = 2
[[controller]]
name = "tuned"
kind = "pid-torque"
tune = { kp = [5.0, 90.0], ki = [0.0, 50.0] }
[[controller]]
name = "LQG"
kind = "lqg-torque"
"""


@pytest.fixture
def task(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(TASK, encoding="utf-8")
    return path


def test_a_comparison_writes_one_page_and_the_same_figures_again(task, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["compare", str(task), "--out", str(out), "--json"]) == 0
    first = json.loads(capsys.readouterr().out)
    page = (out / "small.html").read_text(encoding="utf-8")
    assert page.count("<svg") == 9
    assert "tuned" in page
    assert "LQG" in page
    assert main(["report", str(out), "--out", str(tmp_path / "again")]) == 0
    assert (tmp_path / "again" / "small.html").read_text(encoding="utf-8") == page
    capsys.readouterr()
    rows = {row["controller"]: row for row in first["rows"]}
    assert 0.0 < rows["tuned"]["rmse"] < 0.1
    assert rows["tuned"]["seeds_failed_share"] is not None
    assert main(["compare", str(task), "--out", str(out), "--json", "--force", "--resume"]) == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out)["rows"] == first["rows"]
    assert "seed" not in captured.err  # nothing was searched again


def test_an_interrupted_search_continues_from_its_checkpoint(task, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["tune", str(task), "--out", str(out), "--json"]) == 0
    whole = json.loads(capsys.readouterr().out)
    log = out / "small.searches.jsonl"
    lines = log.read_text(encoding="utf-8").splitlines()
    log.write_text(lines[0] + "\n" + lines[1][:40], encoding="utf-8")  # killed while writing
    assert main(["tune", str(task), "--out", str(out), "--json", "--force", "--resume"]) == 0
    captured = capsys.readouterr()
    assert json.loads(captured.out) == whole
    assert "seed 1" in captured.err
    assert "seed 0" not in captured.err


def test_a_tuned_controller_can_be_used_by_a_scenario_and_has_a_header(task, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["tune", str(task), "--out", str(out), "--seeds", "1"]) == 0
    assert "tuned" in capsys.readouterr().out
    entries = read_toml(out / "tuned.toml", ScenarioError)["controller"]
    controller = controller_from_table(entries)
    assert controller.kind in LAWS
    assert 0.0 <= controller.kp <= 360.0  # the bounds may grow
    assert "tuned_step" in (out / "tuned.h").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("kp = [5.0, 90.0]", "kq = [5.0, 90.0]", "tune 'kq' is no number; the nearest known one"),
        ("kp = [5.0, 90.0]", "kp = [90.0, 5.0]", "bounds of kp: 90 must be below 5"),
        ("kp = [5.0, 90.0]", "kp = 5.0", r"must be [lowest, highest]"),
        ('kind = "lqg-torque"', 'kind = "lqr"', "[[controller]] LQG: [controller] kind 'lqr'"),
        ("duration_s = 0.5", "duration_ms = 0.5", "[task]: unknown key 'duration_ms'"),
        ("seeds = 2", "seeds = 0", "[budget] seeds = 0 must be a count"),
        ("seeds = 2", 'method = "annealing"', "[budget] method 'annealing' is unknown"),
    ],
)
def test_a_comparison_that_cannot_be_used_is_one_line(task, capsys, old, new, message):
    task.write_text(TASK.replace(old, new), encoding="utf-8")
    assert main(["compare", str(task)]) == 2
    error = capsys.readouterr().err.splitlines()
    assert len([line for line in error if line.startswith("dftfs compare:")]) == 1
    assert message in error[-1]


def test_the_impedance_controllers_are_judged_under_pulses_and_ramps(tmp_path, capsys):
    assert main(["compare", "compare-impedance-disturbed", "--out", str(tmp_path), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert [row["controller"] for row in rows] == ["HIC", "FHIC, medium", "AFHIC"]
    for row in rows:
        assert row["monte_carlo_rmse_std"] > 0.0
        for shape in ("pulse", "ramp"):
            peaks = [row[f"{shape} {peak:g} Nm: peak"] for peak in (6.0, 7.0, 7.5)]
            assert 0.0 < peaks[0] < peaks[1] < peaks[2]
    page = (tmp_path / "impedance-disturbed.html").read_text(encoding="utf-8")
    assert "ramp 7.5 Nm" in page


def test_a_disturbance_without_its_peak_is_refused_in_a_line(task, capsys):
    task.write_text(TASK + "[[disturbances]]\nstart_s = 0.1\nend_s = 0.2\n", encoding="utf-8")
    assert main(["compare", str(task)]) == 2
    error = capsys.readouterr().err
    assert "[[disturbances]] number 1: peak_Nm is missing" in error
