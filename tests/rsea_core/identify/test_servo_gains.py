"""Planted servos (P and PD, late, with dry friction) are read with gains unknown, in any unit.

A sound servo has no effect; what goals and angles cannot separate is said.
"""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.effects.registry import LoadFriction
from rsea_core.errors import RecordingError
from rsea_core.identify.result.corrected_model import FoundModel
from rsea_core.identify.servo_gains import with_servo_gains
from rsea_core.identify.window_diagnosis import diagnose_windows
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import read_case
from rsea_core.simulation.simulate_fast import simulate_stepping

ROW_s, ROWS = 0.01, 900
PD = Rig(
    name="servo", parts=("drive", "load"), servo="angle", servo_proportional_Nm_per_rad=20.0,
    servo_derivative_Nms_per_rad=1.0, load_inertia_kgm2=0.04, load_viscous_Nms_per_rad=0.0,
)  # fmt: skip


def scaled(rig: Rig, torque: float) -> Rig:
    keys = ("servo_proportional_Nm_per_rad", "servo_derivative_Nms_per_rad", "load_inertia_kgm2")
    return replace(rig, **{key: torque * getattr(rig, key) for key in keys})


def goals(seed: int) -> np.ndarray:
    """Steps, and a sum of sines."""
    random, time = np.random.default_rng(seed), np.arange(ROWS) * ROW_s
    steps = np.repeat(random.uniform(-0.4, 0.4, ROWS // 75), 75)
    sines = sum(0.15 * np.sin(2 * np.pi * f * time + random.uniform(0, 6)) for f in (0.3, 0.9, 2.1))
    return np.where(np.arange(ROWS) < ROWS // 2, steps, sines)


def planted(folder, rig: Rig, *terms, torque: float = 1.0):
    """A case of two recordings of a servo whose rig file leaves its gains out."""
    rig, text = scaled(rig, torque), ""
    for seed in (1, 2):
        inputs = Inputs(
            time_s=np.arange(ROWS) * ROW_s, position_command_rad=goals(seed), load=Load(kind="free")
        )
        run = simulate_stepping(ActuatorModel(rig, terms), inputs, step_s=1e-3)
        noise = np.random.default_rng(seed + 10).normal(0.0, 2e-4, ROWS)
        table = [run.time_s, inputs.position_command_rad, run.load_angle_rad + noise]
        header = "time_s,position_command_rad,load_angle_rad"
        np.savetxt(folder / f"r{seed}.csv", np.stack(table, 1), delimiter=",", header=header,
                   comments="")  # fmt: skip
        text += f'\n[[recording]]\nfile = "r{seed}.csv"\nload = "free"\n'
    rig = replace(
        rig, servo_proportional_Nm_per_rad=None, servo_derivative_Nms_per_rad=None,
        servo_delay_s=None,
    )  # fmt: skip
    (folder / "rig.toml").write_text(rig.to_toml() + text, encoding="utf-8")
    return read_case(folder)


@pytest.mark.parametrize("torque", [1.0, 1e-4], ids=["newton-metres", "small"])
def test_a_sound_late_pd_servo_has_no_effect_and_its_gains_are_found(tmp_path, torque):
    found = diagnose_windows(
        planted(tmp_path, replace(PD, servo_delay_s=0.023), torque=torque), quick=True
    )
    assert not found.document["effects"]
    rig, laws = found.model.rig, {law.effect: v for law, v in found.model.laws}
    scale = rig.load_inertia_kgm2 / 0.04
    assert rig.servo_proportional_Nm_per_rad / scale == pytest.approx(20.0, rel=0.02)
    damping = rig.servo_derivative_Nms_per_rad + rig.load_viscous_Nms_per_rad
    assert damping / scale == pytest.approx(1.0, rel=0.03)
    assert laws["drive-delay"]["delay_s"] == pytest.approx(0.023, abs=0.002)
    assert any("scale is that of the rig's inertia" in f for f in found.document["findings"])
    path = tmp_path / "model.toml"
    path.write_text(found.model.to_toml(), encoding="utf-8")
    again = FoundModel.from_toml(path)
    assert again.rig == rig
    assert {law.effect for law, _ in again.laws} >= {"drive-delay"}


def test_dry_friction_of_a_p_servo_is_named_with_its_level(tmp_path):
    torque = 1e-4
    rig = replace(PD, servo_derivative_Nms_per_rad=0.0, load_viscous_Nms_per_rad=0.5 * torque)
    friction = LoadFriction(coulomb_Nm=0.4 * torque)
    case = planted(tmp_path, rig, friction, torque=torque)
    found = diagnose_windows(case, quick=True)
    first = found.document["effects"][0]
    assert first["name"] == "load-friction"
    assert first["confidence"] >= 0.5
    level = first["parameters"]["coulomb_Nm"]["value"]
    scale = found.model.rig.load_inertia_kgm2 / 0.04
    assert level / scale == pytest.approx(0.4, rel=0.1)


def test_gains_that_are_stated_stay_and_missing_ones_begin_near_the_truth(tmp_path):
    case = planted(tmp_path, PD)
    filled, names = with_servo_gains(case)
    assert len(names) == 2
    assert filled.rig.servo_proportional_Nm_per_rad == pytest.approx(20.0, rel=0.5)
    stated = replace(case, rig=replace(case.rig, servo_proportional_Nm_per_rad=20.0))
    filled, names = with_servo_gains(stated)
    assert names == ("servo_derivative_Nms_per_rad",)
    assert filled.rig.servo_derivative_Nms_per_rad == pytest.approx(1.0, rel=0.5)


def test_gains_without_an_inertia_are_refused_in_one_line(tmp_path):
    case = planted(tmp_path, PD)
    rig = replace(case.rig, load_inertia_kgm2=None)
    with pytest.raises(RecordingError, match="need an inertia in"):
        with_servo_gains(replace(case, rig=rig))
