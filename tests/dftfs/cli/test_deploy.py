"""`dftfs deploy` writes C whose bench repeats the simulation; its log is a case for `diagnose`."""

import json
import shutil
import subprocess

import numpy as np
import pytest

from dftfs.cli.deploy import FLAGS
from dftfs.cli.main import main
from rsea_core import Rig
from rsea_core.model.model_file import read_model_file
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
OWN = """
import rsea_core
@rsea_core.controller(sample_time_s=1e-3)
class Mine:
    kp: float = 0.02
    state = {"integral": 0.0}
    def step(self, y):
        self.integral += 1e-4 * (y.reference - y.torque_Nm)
        return self.kp * (y.reference - y.torque_Nm) + self.integral
"""
COMPILER = shutil.which("cc") or shutil.which("gcc")
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler (cc or gcc)")


@pytest.fixture
def scenario(tmp_path):
    path = tmp_path / "scenario.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    return path


@needs_compiler
@pytest.mark.parametrize(("real", "bound"), [("double", 1e-12), ("float", 1e-3)])
def test_the_bench_passes_and_its_log_is_a_recording_for_diagnose(scenario, real, bound, capsys):
    out = scenario.parent / "out"
    assert main(["deploy", str(scenario), "--real", real, "--out", str(out), "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["bench_passed"] is True
    assert len([line for line in record["bench"] if line.startswith("pass")]) == 15
    assert any("law, guard and machine in C within" in line for line in record["bench"])
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
        (["--continuous-A", "2"], "continuous_A and thermal_s belong together"),
    ],
)
def test_limits_out_of_range_are_refused_in_one_line_and_nothing_is_written(
    scenario, more, says, capsys
):
    out = scenario.parent / "out"
    assert main(["deploy", str(scenario), *more, "--out", str(out)]) == 2
    assert says in capsys.readouterr().err
    assert not list(out.glob("*"))


HEAT = """
#include <stdio.h>
#include "my_bench.h"
#include "my_bench_guard.h"
int main(void) {
    my_bench_guard g;
    my_bench_limits l = my_bench_default_limits;
    my_bench_input y = {0.0, 0.0, 0.0, 0.0, 0.0};
    int k;
    my_bench_guard_start(&g);
    g.running = 1;
    l.rate = 0.0; /* the command stays as it is: */
    g.given = 0.5;
    for (k = 0; k < 100000 && g.tripped == my_bench_good; ++k)
        my_bench_guarded(&g, &l, &y, 1e-3, (unsigned)k + 1u, 1);
    printf("%d %d %.17g\\n", k, g.tripped == my_bench_over_heat, g.heat);
    my_bench_guarded(&g, &l, &y, 1e-3, 0u, 0); /* not enabled: it cools and remembers */
    printf("%.17g\\n", g.heat);
    return 0;
}
"""


@needs_compiler
def test_the_guard_trips_when_the_filtered_square_of_the_current_says_so(scenario, capsys):
    out = scenario.parent / "out"
    limit = ["--continuous-A", "1.5", "--thermal-s", "0.5"]
    assert main(["deploy", str(scenario), *limit, "--out", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["limits"]["thermal_s"] == 0.5
    (out / "heat.c").write_text(HEAT, encoding="utf-8")
    subprocess.run(
        [COMPILER, *FLAGS, "-Werror", "heat.c", "-o", "heat", "-lm"], cwd=out, check=True
    )
    first, last = subprocess.run(["./heat"], cwd=out, capture_output=True, text=True).stdout.split(
        "\n"
    )[:2]
    samples, tripped, heat = (float(x) for x in first.split())
    rig = Rig.preset("rsea-bench")
    amps = 0.5 * rig.supply_voltage_V / rig.terminal_resistance_ohm
    amps = min(amps, rig.current_limit_A or np.inf)
    assert tripped == 1.0
    assert amps > 1.5
    # backward steps of a first order: within two samples of the exponential's time
    expected = -0.5 * np.log(1.0 - (1.5 / amps) ** 2) / 1e-3
    assert samples == pytest.approx(expected, abs=2.0)
    assert 0.99 * heat < float(last) < heat


FRICTION = SCENARIO.replace("amplitude_Nm = 2.0", "amplitude_Nm = 3.0").replace(
    "[controller]", '[[terms]]\neffect = "gear-friction"\ncoulomb_Nm = 0.02\n[controller]'
)


@needs_compiler
def test_design_deploy_record_diagnose_is_a_circle_that_finds_the_friction_put_in(scenario, capsys):
    scenario.write_text(FRICTION.replace("duration_s = 0.5", "duration_s = 3.0"), encoding="utf-8")
    deployed, found = scenario.parent / "deployed", scenario.parent / "found"
    assert main(["deploy", str(scenario), "--out", str(deployed)]) == 0
    assert main(["diagnose", str(deployed), "--out", str(found), "--json"]) == 0
    model = read_model_file(found / "model.toml").model
    (term,) = model.terms
    assert term.effect == "gear-friction"
    assert term.coulomb_Nm == pytest.approx(0.02, rel=0.02)
    follow_up = scenario.with_name("again.toml")  # the found machine takes the rig's place
    again_text = SCENARIO.replace('"rsea-bench"', '"found/model.toml"').replace(
        "= 2.0\nf", "= 3.0\nf"
    )
    follow_up.write_text(again_text.replace("= 0.5", "= 3.0"), encoding="utf-8")
    again = scenario.parent / "again"
    assert main(["deploy", str(follow_up), "--out", str(again), "--json"]) == 0
    first, second = (np.loadtxt(f / "replay.csv", delimiter=",", skiprows=1) for f in
                     (deployed, again))  # fmt: skip
    assert np.abs(second[:, 4] - first[:, 4]).max() < 0.01 * np.abs(first[:, 4]).max()


@needs_compiler
@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize("law", ["pid-torque", "my_law:Mine"])
def test_the_bench_compiles_without_a_warning(scenario, law, real, capsys):
    scenario.with_name("my_law.py").write_text(OWN, encoding="utf-8")
    text = SCENARIO.replace("pid-torque", law).replace("kp = 6.0\nki = 10.0\n", "")
    scenario.write_text(text, encoding="utf-8")
    out = scenario.parent / "out"
    assert main(["deploy", str(scenario), "--out", str(out), "--real", real, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["bench_passed"] is True
    strict = [COMPILER, *FLAGS, "-Werror", "-Wpedantic", "my_bench_bench.c", "-o", "bench", "-lm"]
    done = subprocess.run(strict, cwd=out, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_law_without_c_form_is_refused_in_one_line_and_nothing_is_written(scenario, capsys):
    own = OWN.replace("self.integral +=", "[self.kp]; self.integral +=")
    scenario.with_name("my_law.py").write_text(own, encoding="utf-8")
    text = SCENARIO.replace('"pid-torque"\nkp = 6.0\nki = 10.0', '"my_law:Mine"')
    scenario.write_text(text, encoding="utf-8")
    out = scenario.parent / "out"
    assert main(["deploy", str(scenario), "--out", str(out)]) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert line.endswith("my_law:Mine has no C form: line 8: '[p[0]]' cannot be translated")
    assert not list(out.glob("*"))
