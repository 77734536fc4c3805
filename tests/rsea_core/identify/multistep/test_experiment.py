"""What is free in a case's experiments, and where a locked load stands."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.identify.multistep.experiment import DAMPED, MultistepProblem
from rsea_core.identify.window_diagnosis import diagnose_windows
from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from tests.cases.one_axis import ROW_s, axis_case, axis_recording, axis_rig

RATIO, CONSTANT, OHM = 70.0, 0.008, 3.0
DAMPING = 1.0  # Nms/rad of the overdamped axis: its inertia stops in a fiftieth of a second
SERVO = Rig(
    name="servo", parts=("drive", "gear", "load"), supply_voltage_V=15.0,
    torque_constant_Nm_per_A=CONSTANT, back_emf_constant_Vs_per_rad=CONSTANT,
    terminal_resistance_ohm=OHM, motor_inertia_kgm2=5e-7, motor_viscous_Nms_per_rad=1e-7,
    gear_ratio=RATIO, load_inertia_kgm2=1e-3,
)  # fmt: skip


def load_damping(folder, rig: Rig, command: str) -> float:
    """One deviation of the damping that the file leaves out, of a log by this command."""
    given = axis_recording(seed=1)
    columns = {name: v for name, v in given.columns.items() if name != "current_command_A"}
    columns[command] = given["current_command_A"]
    case = axis_case(folder, replace(given, columns=columns), rig=rig)
    return next(
        n.tolerance for n in MultistepProblem(case).nominals
        if n.key == "load_viscous_Nms_per_rad"
    )  # fmt: skip


def test_a_damping_left_out_may_be_as_large_as_that_of_the_back_emf_on_the_same_body(tmp_path):
    by_volts = load_damping(tmp_path, SERVO, "voltage_V")
    by_current = load_damping(tmp_path, SERVO, "current_command_A")
    electric = CONSTANT**2 / OHM * RATIO**2
    assert by_volts - by_current == pytest.approx(DAMPED * electric)
    # of one body the inertia is that of motor and load: at most the fastest motion that rows show
    whole = 1e-3 + 5e-7 * RATIO**2
    assert 0.0 < by_current < DAMPED * whole * np.pi / ROW_s
    stiff = replace(SERVO, motor_inertia_kgm2=5e-5)
    ratio = load_damping(tmp_path, stiff, "current_command_A") / by_current
    assert ratio == pytest.approx((1e-3 + 5e-5 * RATIO**2) / whole)


def test_damping_that_no_file_states_may_take_all_of_the_drives_torque(tmp_path):
    """An overdamped axis whose file states no damping: a value, not missing physics."""
    damped = replace(axis_rig(), load_viscous_Nms_per_rad=DAMPING)
    unstated = replace(damped, load_viscous_Nms_per_rad=None)
    case = axis_case(tmp_path, axis_recording(seed=8, rig=damped), rig=unstated)
    scale = {n.key: n.tolerance for n in MultistepProblem(case).nominals}
    zero = replace(case, rig=replace(unstated, load_viscous_Nms_per_rad=0.0))
    as_zero = {n.key: n.tolerance for n in MultistepProblem(zero).nominals}
    assert as_zero["load_viscous_Nms_per_rad"] == scale["load_viscous_Nms_per_rad"]
    recording = case.identification[0]
    torque = 0.5 * np.std(recording["current_command_A"])
    speed = np.std(np.diff(recording["motor_angle_rad"])) / ROW_s
    assert scale["load_viscous_Nms_per_rad"] == pytest.approx(torque / speed, rel=0.2)
    found = diagnose_windows(case, quick=True)
    assert found.document["effects"] == []
    values = found.conclusion.nominal
    total = sum(value for key, value in values.items() if key.endswith("viscous_Nms_per_rad"))
    assert total == pytest.approx(DAMPING, rel=0.05)


def test_a_locked_load_stands_at_the_mean_of_its_readings(tmp_path):
    plain = axis_recording(seed=6)
    noise = np.random.default_rng(7).normal(0.0, 2e-3, plain.rows)
    columns = {**plain.columns, "load_angle_rad": 0.3 + noise}
    locked = replace(plain, columns=columns, load=Load(kind="locked"))
    assert locked.held_angle_rad() == pytest.approx(0.3, abs=4.0 * 2e-3 / plain.rows**0.5)
    free = replace(locked, load=Load(kind="free"))
    assert free.held_angle_rad() == columns["load_angle_rad"][0]
    (found,) = MultistepProblem(axis_case(tmp_path, locked, rig=axis_rig())).fitted
    run = found.replay.run(ActuatorModel(axis_rig()))
    assert run[:, 1] == pytest.approx(locked.held_angle_rad(), abs=1e-12)
