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
from rsea_core.effects import registry as r
from rsea_core.effects.registry import GearBacklash, GearFriction, LoadFriction, SpringHardening
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

DRIVE = (
    r.OffsetDeadZone(width_duty=0.03, offset_after=0.01),
    r.ThresholdDeadZone(width_duty=0.02),
    r.DriveOffset(offset=0.01),
    r.DriveNonlinearGain(by_sign=0.05, by_size=-0.1, by_square=0.2),
    r.DriveSaturation(source_resistance_ohm=1.0, returned_share=0.0, ripple_share=0.5),
    r.DriveThermal(
        winding_heat_capacity_J_per_K=0.5, winding_to_case_W_per_K=0.3,
        torque_constant_fall_per_K=1e-3, start_winding_rise_K=20.0,
    ),
    r.MotorCogging(amplitude_Nm=2e-3, cycles_per_rev=14.0, amplitude_2_Nm=1e-3),
    r.TorqueRipple(ripple_fraction=0.1, cycles_per_rev=12.0),
)  # fmt: skip
SWITCHED = (r.DriveDeadTime(width_duty=0.05), r.SpringContact(onset_rad=0.02, stiffness_ratio=2.0))
GEAR = (
    GearFriction(
        coulomb_Nm=0.01, stribeck_rise=0.5, stribeck_shape=1.3, asymmetry=0.1,
        viscous_Nms_per_rad=1e-5, viscous_skew_Nms_per_rad=1e-6, arctan_Nm=3e-3, offset_Nm=1e-3,
    ),
    r.GearEfficiency(drive_efficiency=0.8, backdrive_efficiency=0.6),
    r.GearTransmissionError(
        wheel_amplitude_rad=2e-3, wheel_cycles_per_rev=3.0, offset_rad=5e-4,
        worm_amplitude_rad=1e-3, worm_phase_rad=0.4,
        worm_third_amplitude_rad=1e-4,
    ),
    r.GearFormulaTorque(
        usual_speed_rad_per_s=1.0, coefficient_1_Nm=0.1, angle_function_1=21.0,
        speed_function_1=2.0,
    ),
)  # fmt: skip
LOAD = (
    LoadFriction(coulomb_Nm=0.1, stribeck_rise=0.4, normal_lever_m=5e-3),
    r.LoadFrictionAngle(coulomb_Nm=0.1, share=0.4, phase_rad=0.2),
    r.PowerDrag(torque_at_5_rad_per_s_Nm=0.5, exponent=2.4),
    r.LoadUnbalance(torque_amplitude_Nm=0.5, angle_rad=0.3),
    r.StiffeningParallel(
        stiffness_Nm_per_rad=2.0, rest_angle_rad=0.1, cubic_Nm_per_rad3=30.0, up_to_rad=0.1
    ),
    r.LoadPositionTorque(
        first_rad=-0.5, last_rad=0.5, node_Nm=tuple(0.3 * np.cos(2.0 * np.arange(32)))
    ),
    r.LoadFlexibility(link_stiffness_Nm_per_rad=100.0, outer_fraction=0.4),
    r.SpringViscoelastic(damping_Nms_per_rad=0.1, branch_stiffness_1_Nm_per_rad=5.0),
    r.ContactNonlinear(exponent=1.5, loss_factor_s_per_rad=0.5),
)  # fmt: skip
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
        (HEAVY, DRIVE, Load(), {"duty": 0.5 * WAVE}),
        (replace(HEAVY, terminal_inductance_H=0.0), SWITCHED, Load(), {"duty": 0.5 * WAVE}),
        (HEAVY, GEAR, Load(), {"duty": 0.5 * WAVE}),
        (HEAVY, LOAD, WALL, {"duty": 0.5 * WAVE}),
    ],
    ids=["linear", "friction", "contact", "current-limit", "no-inductance", "current", "cubic",
         "torque", "drive-effects", "switched-effects", "gear-effects", "load-effects"],
)  # fmt: skip
def test_the_fmu_repeats_open_loops_with_events(rig, terms, load, command):
    pytest.importorskip("fmpy")
    # the engines do not locate where a supply that takes no current back stops its current
    step_s = 5e-5 if terms is DRIVE else None
    given = Inputs(time_s=TIME, load=load, **command)
    run = simulate(ActuatorModel(rig, terms), given, step_s=step_s, engine="event-driven")
    record = checked(compiled(fmu_source(run, name="machine")), run)
    assert record["problems"] == []
    assert max(record["difference"].values()) < BOUND, record


@needs_compiler
def test_the_c_of_the_fmu_compiles_without_a_warning(tmp_path):
    model = ActuatorModel(HEAVY, (*DRIVE, *GEAR, *LOAD))
    run = simulate(model, Inputs(time_s=TIME[:50], load=WALL, duty=WAVE[:50]))
    for name, text in fmu_source(run, name="machine").files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    strict = [COMPILER, *FLAGS, "-Werror", "-Wpedantic", "fmu.c", "-o", "library"]
    done = subprocess.run(strict, cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize(
    ("terms", "says"),
    [
        ((GearBacklash(width_rad=1e-3, wheel_inertia_kgm2=1e-3),), r"gear-backlash \(backlash_"),
        ((GearFriction(coulomb_Nm=0.03, presliding_rad=0.1),),
         r"effects: gear-friction \(gear_presliding\)"),
        ((r.DriveDelay(delay_s=0.01),), r"effects: drive-delay \(command_delay\)"),
    ],
)  # fmt: skip
def test_what_the_c_does_not_have_is_refused_by_name(terms, says):
    run = simulate(ActuatorModel(HEAVY, terms), Inputs(time_s=TIME[:50], duty=WAVE[:50]))
    with pytest.raises(SimulationError, match=says):
        fmu_source(run, name="machine")
