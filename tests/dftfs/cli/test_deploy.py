"""`dftfs deploy` writes C whose bench repeats the simulation; its log is a case for `diagnose`."""

import json
import shutil

import numpy as np
import pytest

from dftfs.cli.main import main
from rsea_core.recordings.case import read_case

SCENARIO = """
name = "my bench"
rig = "rsea-bench"
[load]
kind = "locked"
[reference]
kind = "sine"
amplitude_Nm = 2.0
frequency_Hz = 2.0
[controller]
kind = "pid-torque"
kp = 6.0
ki = 10.0
sample_time_s = 0.001
delay_samples = 1
[simulation]
duration_s = 0.5
"""


@pytest.fixture
def scenario(tmp_path):
    path = tmp_path / "scenario.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    return path


@pytest.mark.parametrize(("real", "bound"), [("double", 1e-12), ("float", 1e-3)])
def test_the_bench_passes_and_its_log_is_a_recording_for_diagnose(scenario, real, bound, capsys):
    if shutil.which("cc") is None and shutil.which("gcc") is None:
        pytest.skip("no C compiler (cc or gcc) on this machine")
    out = scenario.parent / "out"
    assert main(["deploy", str(scenario), "--real", real, "--out", str(out), "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["bench_passed"] is True
    assert len([line for line in record["bench"] if line.startswith("pass")]) == 13
    assert record["bench"][0].endswith(f"(allowed {bound:.3g})")
    (recording,) = read_case(out).recordings
    replay = np.loadtxt(out / "replay.csv", delimiter=",", skiprows=1)
    late = recording.columns["duty"]
    np.testing.assert_allclose(late[1:], replay[:-1, 6], atol=max(bound, 1e-8), rtol=1e-6)
    np.testing.assert_allclose(recording.columns["load_angle_rad"], replay[:, 5], atol=1e-8)


@pytest.mark.parametrize(
    ("more", "says"),
    [
        (["--travel-rad", "1", "0"], "travel from 1 to 0 rad"),
        (["--rate-per-s", "nan"], "rate_per_s = nan must be finite and above 0"),
        (["--watchdog-s", "-1"], "watchdog_s = -1.0 must be finite and above 0"),
    ],
)
def test_limits_out_of_range_are_refused_in_one_line_and_nothing_is_written(
    scenario, more, says, capsys
):
    out = scenario.parent / "out"
    assert main(["deploy", str(scenario), *more, "--out", str(out)]) == 2
    assert says in capsys.readouterr().err
    assert not list(out.glob("*"))


def test_a_law_without_c_form_is_refused(scenario, capsys):
    text = SCENARIO.replace('"pid-torque"\nkp = 6.0\nki = 10.0', '"fo-pid"\nkp = 6.0\nki = 10.0')
    scenario.write_text(text, encoding="utf-8")
    assert main(["deploy", str(scenario), "--out", str(scenario.parent / "out")]) == 2
    assert "has no C form" in capsys.readouterr().err
