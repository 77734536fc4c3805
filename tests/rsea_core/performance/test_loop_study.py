"""The port impedance and the limit cycles of a loop study are those that simulated runs show."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core import ActuatorModel, Load, Rig
from rsea_core.control.closed_loop import rows_per_sample
from rsea_core.control.laws.fuzzy_torque import FuzzyTorque
from rsea_core.control.laws.pid import PidTorque
from rsea_core.control.stability.margins import port_impedance
from rsea_core.performance.loop_study import loop_study
from rsea_core.simulation.simulate import run_sampled

EXACT = replace(
    Rig.preset("rsea-bench"), motor_encoder_counts_per_rev=None, load_encoder_counts_per_rev=None
)
MODEL = ActuatorModel(EXACT)
PID = PidTorque(kp=6.0, ki=10.0, sample_time_s=1e-3, delay_samples=1)


def simulated_port(controller, frequency_Hz, amplitude_rad=1e-3, periods=20):
    """-tau_s over the load's speed: first harmonics of the second half of a run."""
    load = Load(kind="imposed")
    compiled = controller.compile(MODEL, load)
    _, row = rows_per_sample(controller.sample_time_s, None)
    time = np.arange(round(periods / frequency_Hz / row) + 1) * row
    run = run_sampled(
        MODEL, command_name=compiled.command_name, load=load, time_s=time,
        controller=compiled.function, parameters=compiled.parameters, state=compiled.state,
        reference=np.zeros((time.size, 3)), reference_name=controller.reference_name,
        load_angle_rad=amplitude_rad * np.sin(2.0 * np.pi * frequency_Hz * time),
        delay_samples=controller.delay_samples, command_limit=compiled.command_limit,
    )  # fmt: skip
    rows = time > 0.5 * time[-1]
    turn = np.exp(2j * np.pi * frequency_Hz * time[rows])
    torque, angle = (
        np.linalg.lstsq(np.column_stack((turn.real, -turn.imag)), values[rows], rcond=None)[0]
        @ np.array([1.0, 1j])
        for values in (run.torque_Nm, run.load_angle_rad)
    )
    return -torque / (2j * np.pi * frequency_Hz * angle)


@pytest.mark.parametrize("frequency_Hz", [0.5, 5.0, 20.0])
@pytest.mark.parametrize(
    "law",
    [
        PID,
        replace(PID, ideal_sensors=True),
        replace(PID, ideal_sensors=True, load_feedforward="acceleration", load_filter_s=0.01),
    ],
    ids=["read", "ideal", "ideal, acceleration"],
)
def test_the_port_impedance_is_that_of_a_run_with_the_load_swung(law, frequency_Hz):
    linear = port_impedance(MODEL, law, np.array([frequency_Hz]))[0]
    assert abs(simulated_port(law, frequency_Hz) - linear) < 2e-3 * abs(linear)


def test_an_unstable_loop_has_no_port_impedance():
    unstable = replace(PID, kp=900.0, ki=500.0, kd=20.0)
    assert port_impedance(MODEL, unstable, np.array([1.0])) is None


def test_a_fuzzy_loop_swings_with_the_amplitude_that_its_describing_function_states():
    study = loop_study("fuzzy", MODEL, FuzzyTorque(sample_time_s=1e-3, delay_samples=1),
                       Load(kind="locked"), 5.0)  # fmt: skip
    sizes = np.log([c.amplitude for c in study.predicted])
    delays = [c.delay_s for c in study.predicted]
    checked = [c for c in study.bare if c.amplitude < 5.0]  # beyond, the current is limited
    assert len(checked) >= 3
    for cycle in checked:
        amplitude = np.exp(np.interp(cycle.delay_s, delays, sizes))
        assert cycle.amplitude == pytest.approx(amplitude, rel=0.15)
    assert study.surface[2].shape == (41, 41)


def test_a_study_states_signed_margins_and_the_step_of_half_the_amplitude():
    study = loop_study("PID", MODEL, replace(PID, kp=60.0), Load(kind="locked"), 5.0)
    assert study.margins.phase_margin_deg > 0.0
    time, torque, _ = study.step
    assert torque[time > 1.0].mean() == pytest.approx(study.step_height, rel=0.02)
    assert study.whole == ()  # the machine has no effects to leave out
