"""Noise that was estimated without a law is estimated again with it, and shows which law is right.

A mirror on a torsion spring swings by 0.1 rad, where a spring and an eccentric mass differ by a
thousandth of the torque. Without either no value predicts its resonance, and what windows then take
for noise may be many times that difference.
"""

from dataclasses import replace

import numpy as np

from rsea_core.effects.registry import LoadUnbalance, SpringParallel
from rsea_core.engines.fixed_step.replay import Replay
from rsea_core.identify.law_search.search import begun, laws_of
from rsea_core.identify.multistep.tracks import prepared
from rsea_core.identify.whole_runs import complete
from rsea_core.identify.whole_runs.complete import laws_added
from rsea_core.identify.whole_runs.sensor_noise import in_sensor_noise
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.recording import Recording
from tests.cases.one_axis import axis_case, axis_rig

ROW_s, NOISE_rad = 2e-3, 2e-5
RIG = replace(
    axis_rig(counts=2**18), load_inertia_kgm2=1e-4, motor_inertia_kgm2=5e-5,
    load_viscous_Nms_per_rad=4e-4, torque_constant_Nm_per_A=0.05,
)  # fmt: skip
STIFFNESS_Nm_per_rad, OVERSTATED = 0.5, 100.0


def mirror_recording(seed: int) -> Recording:
    """A chirp through the resonance at 9 Hz."""
    time = ROW_s * np.arange(1500)
    current = 0.25 * np.sin(2.0 * np.pi * (2.0 + 4.0 * seed + 2.0 * time) * time)
    inputs = Inputs(time_s=time, current_command_A=current, load=Load(kind="free"))
    model = ActuatorModel(RIG, (SpringParallel(stiffness_Nm_per_rad=STIFFNESS_Nm_per_rad),))
    angle = Replay.of(inputs, step_s=2e-4).run(model)[:, 0]
    angle = angle + NOISE_rad * np.random.default_rng(seed).standard_normal(time.size)
    columns = {"time_s": time, "current_command_A": current, "motor_angle_rad": angle}
    return Recording(file=f"mirror{seed}.csv", load=Load(kind="free"), columns=columns,
                     sample_time_s=ROW_s)  # fmt: skip


def in_overstated_noise(*given):
    """Whole recordings in a noise of the readings that is far too large."""
    own = in_sensor_noise(*given)
    return own.having([
        prepared(t, noise=replace(t.noise, readings=OVERSTATED * t.noise.readings))
        for t in own.tracks
    ])  # fmt: skip


def test_a_spring_is_no_eccentric_mass_in_the_noise_that_it_leaves(tmp_path, monkeypatch):
    both = (LoadUnbalance.effect, SpringParallel.effect)
    monkeypatch.setattr(
        complete, "laws_of", lambda found: [w for w in laws_of(found) if w.effect in both]
    )
    monkeypatch.setattr(complete, "in_sensor_noise", in_overstated_noise)
    case = axis_case(tmp_path, mirror_recording(0), mirror_recording(1), rig=RIG)
    lines = []
    _, search = laws_added(begun(case, None, lines.append), lines.append)
    assert [law.effect for law in search.taken] == [SpringParallel.effect], lines
    assert any("again in the noise that they leave" in line for line in lines), lines
    nominal, values = search.own.problem.values(search.fit.hypothesis, search.fit.x)
    (stiffness,) = [v["stiffness_Nm_per_rad"] for v in values if "stiffness_Nm_per_rad" in v]
    per_ampere = stiffness / nominal["torque_constant_Nm_per_A"]  # no reading states a torque
    expected = STIFFNESS_Nm_per_rad / RIG.torque_constant_Nm_per_A
    assert abs(per_ampere / expected - 1.0) < 0.01
