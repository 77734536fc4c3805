"""MuJoCo on the exported MJCF agrees with the product's own open-loop simulation."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core import ActuatorModel, Inputs, Load, Rig, simulate
from rsea_core.effects import GearFriction, GearLoadFriction, LoadFriction, SpringParallel
from rsea_core.errors import SimulationError
from rsea_core.interop.mjcf import to_mjcf

STEP_s = 1e-3
TIME = np.arange(3001) * STEP_s
DUTY = 0.35 * np.sin(2 * np.pi * 1.0 * TIME) + 0.15 * np.sin(2 * np.pi * 3.3 * TIME)
BENCH = replace(Rig.preset("rsea-bench"), current_limit_A=None)
HEAVY = replace(BENCH, load_mass_kg=1.0, load_inertia_kgm2=0.12, gravity_angle_offset_rad=0.1)


def mujoco_run(exported, command):
    mujoco = pytest.importorskip("mujoco")
    machine = mujoco.MjModel.from_xml_string(exported.text)
    data = mujoco.MjData(machine)
    angles = np.zeros((command.size, machine.nq))
    for row, value in enumerate(command):
        angles[row] = data.qpos
        data.ctrl[0] = exported.control_per_command * value
        mujoco.mj_step(machine, data)
    return angles


@pytest.mark.parametrize(
    ("rig", "terms", "load"),
    [
        (BENCH, (), Load()),
        (HEAVY, (SpringParallel(stiffness_Nm_per_rad=3.0),), Load()),
        (HEAVY, (), Load(kind="locked")),
        (HEAVY, (GearFriction(coulomb_Nm=2.5 / 60),), Load()),
        (HEAVY, (GearFriction(coulomb_Nm=0.03), LoadFriction(coulomb_Nm=0.2)), Load()),
    ],
    ids=["bench", "heavy", "locked", "gear-friction", "both-joints-dry"],
)
def test_mujoco_of_the_exported_text_agrees_within_half_a_percent_of_the_swing(rig, terms, load):
    """rms over 3 s at MuJoCo's 1 ms step, which is of first order."""
    model = ActuatorModel(rig, terms)
    ours = simulate(model, Inputs(time_s=TIME, duty=DUTY, load=load))
    angles = mujoco_run(to_mjcf(model, load, step_s=STEP_s), DUTY)
    load_angle = angles[:, 1] if load.kind != "locked" else 0.0
    torque = BENCH.spring_stiffness_Nm_per_rad * (angles[:, 0] - load_angle)
    error = np.sqrt(np.mean((torque - ours.torque_Nm) ** 2))
    assert error < 5e-3 * np.ptp(ours.torque_Nm)
    assert np.sqrt(np.mean((angles[:, 0] - ours.wheel_angle_rad) ** 2)) < 5e-4


def test_a_shorter_step_of_mujoco_comes_closer_to_the_exact_simulation():
    model = ActuatorModel(HEAVY, (GearFriction(coulomb_Nm=2.5 / 60),))
    ours = simulate(model, Inputs(time_s=TIME, duty=DUTY, load=Load()))

    def error(parts):
        exported = to_mjcf(model, step_s=STEP_s / parts)
        angles = mujoco_run(exported, np.repeat(DUTY, parts))[::parts]
        return np.sqrt(np.mean((angles[:, 0] - ours.wheel_angle_rad) ** 2))

    # what its soft friction leaves does not go away with the step
    assert error(4) < 0.6 * error(1)


def test_what_mjcf_cannot_carry_is_listed():
    terms = (GearFriction(coulomb_Nm=0.03, asymmetry=0.1, stribeck_rise=0.5),)
    worm = GearLoadFriction(lead_angle_rad=0.08, friction_coefficient=0.05)
    contact = Load(
        kind="contact",
        contact_stiffness_Nm_per_rad=30.0,
        contact_angle_rad=0.1,
        contact_damping_Nms_per_rad=0.0,
    )
    model = ActuatorModel(Rig.preset("rsea-bench"), (*terms, worm))
    reported = " ".join(to_mjcf(model, contact).left_out)
    for word in ("gear_stribeck_rise", "gear_drive_loss", "direction", "sticking", "6.06 A"):
        assert word in reported
    assert "contact" in reported
    exact = replace(BENCH, motor_encoder_counts_per_rev=None, load_encoder_counts_per_rev=None)
    assert not to_mjcf(ActuatorModel(exact)).left_out


def test_a_machine_without_a_spring_is_refused():
    rigid = replace(BENCH, parts=("drive", "gear", "load"), spring_stiffness_Nm_per_rad=None)
    with pytest.raises(SimulationError, match="needs a spring"):
        to_mjcf(ActuatorModel(rigid))
