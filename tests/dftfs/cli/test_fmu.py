"""`dftfs fmu` writes an FMU 3.0 that fmpy accepts and that repeats the simulation to 1e-6."""

import json
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

from dftfs.cli.fmu import FLAGS, compiled
from dftfs.cli.main import main
from rsea_core import ActuatorModel, Inputs, Load, Rig, simulate
from rsea_core.effects import (
    GearBacklash,
    GearFriction,
    LoadFriction,
    SpringHardening,
)
from rsea_core.errors import SimulationError
from rsea_core.interop.fmu import fmu_source
from rsea_core.interop.fmu_check import BOUND, checked
from tests.dftfs.cli.test_deploy import SCENARIO

COMPILER = shutil.which("cc") or shutil.which("gcc")
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler (cc or gcc)")
TIME = np.arange(1001) * 1e-3
WAVE = np.sin(2 * np.pi * 1.3 * TIME) + 0.4 * np.sin(2 * np.pi * 4.1 * TIME)
BENCH = Rig.preset("rsea-bench")
HEAVY = replace(BENCH, load_mass_kg=1.0, load_inertia_kgm2=0.12, gravity_angle_offset_rad=0.1)
DRY = (GearFriction(coulomb_Nm=0.03), LoadFriction(coulomb_Nm=0.2))
WALL = Load(kind="contact", contact_stiffness_Nm_per_rad=200.0, contact_angle_rad=0.02,
            contact_damping_Nms_per_rad=0.5)  # fmt: skip

HARDER = SpringHardening(stiffness_ratio_at_0p15rad=2.0)
PUSHED = Load(kind="constant-torque", load_torque_Nm=0.5)


@needs_compiler
def test_the_fmu_of_a_scenario_is_valid_and_repeats_its_closed_loop(tmp_path, capsys):
    pytest.importorskip("fmpy")
    path = tmp_path / "scenario.toml"
    path.write_text(SCENARIO, encoding="utf-8")
    assert main(["fmu", str(path), "--out", str(tmp_path / "out"), "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["passed"] is True
    assert record["problems"] == []
    assert max(record["difference"].values()) < BOUND
    assert (tmp_path / "out" / "my_bench.fmu").is_file()


@needs_compiler
@pytest.mark.parametrize(
    ("rig", "terms", "load", "command"),
    [
        (HEAVY, (), Load(), {"duty": 0.4 * WAVE}),
        (HEAVY, DRY, Load(), {"duty": 0.5 * WAVE}),
        (HEAVY, DRY, WALL, {"duty": 0.4 * WAVE}),
        (replace(HEAVY, current_limit_A=0.1), DRY, Load(), {"voltage_V": 6.0 * WAVE}),
        (replace(HEAVY, terminal_inductance_H=0.0), DRY, Load(), {"duty": 0.5 * WAVE}),
        (HEAVY, DRY, Load(kind="locked"), {"current_command_A": 0.15 * WAVE}),
        (HEAVY, (HARDER, *DRY), Load(), {"duty": 0.4 * WAVE}),
        (HEAVY, (), PUSHED, {"motor_torque_Nm": 5e-3 * WAVE}),
    ],
    ids=["linear", "friction", "contact", "current-limit", "no-inductance", "current", "cubic",
         "torque"],
)  # fmt: skip
def test_the_fmu_repeats_open_loops_with_events(rig, terms, load, command):
    pytest.importorskip("fmpy")
    run = simulate(ActuatorModel(rig, terms), Inputs(time_s=TIME, load=load, **command))
    record = checked(compiled(fmu_source(run, name="machine")), run)
    assert record["problems"] == []
    assert max(record["difference"].values()) < BOUND, record


@needs_compiler
def test_the_c_of_the_fmu_compiles_without_a_warning(tmp_path):
    run = simulate(ActuatorModel(HEAVY, DRY), Inputs(time_s=TIME[:50], duty=WAVE[:50]))
    for name, text in fmu_source(run, name="machine").files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    strict = [COMPILER, *FLAGS, "-Werror", "-Wpedantic", "fmu.c", "-o", "library"]
    done = subprocess.run(strict, cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("terms", "says"),
    [
        ((GearBacklash(width_rad=1e-3, wheel_inertia_kgm2=1e-3),), "internal_states, backlash"),
        ((GearFriction(coulomb_Nm=0.03, stribeck_rise=0.5),),
         "effects: gear_stribeck_rise"),
    ],
)  # fmt: skip
def test_what_the_c_does_not_have_is_refused_by_name(terms, says):
    run = simulate(ActuatorModel(HEAVY, terms), Inputs(time_s=TIME[:50], duty=WAVE[:50]))
    with pytest.raises(SimulationError, match=says):
        fmu_source(run, name="machine")
