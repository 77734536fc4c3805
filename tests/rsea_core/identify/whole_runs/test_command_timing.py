"""Another timing of the commands is tried before a delayed reading is claimed.

Without winding inductance a held command changes the current at once: if it is assumed to be linear
between rows, the current seems delayed.
"""

from dataclasses import replace

import numpy as np

from rsea_core.effects.drive_delay import DriveDelay
from rsea_core.effects.load_friction import LoadFriction
from rsea_core.engines.fixed_step.replay import CHANNELS, Replay
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.law_search.search import begun, laws_of
from rsea_core.identify.multistep.command_timing import CommandTiming
from rsea_core.identify.multistep.tracks import prepared
from rsea_core.identify.whole_runs import complete
from rsea_core.identify.whole_runs.complete import with_whole_runs
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.recording import Recording
from tests.cases.one_axis import ROW_s, axis_case, axis_rig

DELAY_ROWS = 1.23
FRICTION_Nm = 0.06
NOISE = {"motor_angle_rad": 1e-4, "current_A": 2e-3}


def held_voltage_recording(rig, seed: int) -> Recording:
    """Eight seconds of a voltage-driven axis with friction, its angle and its current."""
    rng = np.random.default_rng(seed)
    time = ROW_s * np.arange(800)
    voltage = sum(2.0 * np.sin(2.0 * np.pi * f * time + rng.uniform(0.0, 6.0))
                  for f in (0.4, 1.1, 3.1))  # fmt: skip
    inputs = Inputs(time_s=time, voltage_V=voltage, load=Load(kind="free"))
    terms = (LoadFriction(coulomb_Nm=FRICTION_Nm), DriveDelay(delay_s=DELAY_ROWS * ROW_s))
    out = Replay.of(inputs, step_s=1e-3).run(ActuatorModel(rig, terms))
    columns = {"time_s": time, "voltage_V": voltage}
    for name, noise in NOISE.items():
        columns[name] = out[:, CHANNELS.index(name)] + noise * rng.standard_normal(len(time))
    return Recording(file=f"axis{seed}.csv", load=Load(kind="free"), columns=columns,
                     sample_time_s=ROW_s)  # fmt: skip


def in_true_noise(found: Found) -> Found:
    """What was found, with the noise that the readings have: an estimate contains errors."""
    tracks = []
    for t in found.base_estimator.tracks:
        size = [NOISE[name] / t.block**0.5 for name in t.experiment.channels]
        tracks.append(prepared(t, noise=replace(t.noise, readings=np.array(size))))
    return replace(found, base_estimator=found.base_estimator.having(tracks))


def test_a_held_command_is_found_before_a_delayed_current_is_claimed(tmp_path, monkeypatch):
    """Among dry friction and the errors of readings alone, which suffices and takes less time."""
    monkeypatch.setattr(complete, "laws_of", lambda found: [
        law for law in laws_of(found) if law.sensor or law.effect == LoadFriction.effect
    ])  # fmt: skip
    rig = replace(
        axis_rig(), terminal_resistance_ohm=2.0, back_emf_constant_Vs_per_rad=0.5,
        supply_voltage_V=24.0, current_sensor_noise_A=NOISE["current_A"],
    )  # fmt: skip
    case = axis_case(tmp_path, held_voltage_recording(rig, 1), rig=rig)
    lines = []
    begin = in_true_noise(begun(case, CommandTiming(linear=True), lines.append))
    found, nearly = with_whole_runs(begin, lines.append)
    found = nearly or found
    assert [step.law.sensor for step in found.steps] == [None], lines
    assert not found.problem.timing.linear
    _, laws = found.problem.values(found.best.hypothesis, found.best.x)
    (delay_s,) = [v["delay_s"] for v in laws if "delay_s" in v]
    assert abs(delay_s - DELAY_ROWS * ROW_s) < 0.05 * ROW_s
