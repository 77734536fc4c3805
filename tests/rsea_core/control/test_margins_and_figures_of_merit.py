"""Margins, limit cycles and figures of merit agree with closed forms and python-control."""

import math

import numpy as np
import pytest

from rsea_core import ActuatorModel, Load, Rig
from rsea_core.control import (
    FuzzyTorque,
    HybridImpedance,
    LqgTorque,
    PidTorque,
    loop_margins,
    simulate_closed_loop,
)
from rsea_core.control.laws.signed_power import describing_function
from rsea_core.control.stability.describing_functions import (
    amplitude_margins,
    harmonic_loop,
    predicted_limit_cycle,
)
from rsea_core.control.stability.margins import open_loop_response
from rsea_core.control.tuning.figures_of_merit import (
    following,
    limit_cycle,
    port_energy,
)
from rsea_core.errors import InputError
from rsea_core.simulation.reference import AngleReference
from rsea_core.simulation.step_response import step_shape

MODEL = ActuatorModel(Rig.preset("rsea-bench"))
LOCKED = Load(kind="locked")


@pytest.mark.parametrize("controller", [PidTorque(), LqgTorque(), FuzzyTorque(table="printed")])
def test_margins_agree_with_python_control(controller):
    control = pytest.importorskip("control", reason="python-control is the oracle here")
    found = loop_margins(MODEL, controller, LOCKED)
    f = np.geomspace(0.01, 499.0, 4000)
    loop = open_loop_response(MODEL, controller, LOCKED, f)
    phase = np.degrees(np.unwrap(np.angle(loop)))
    gm, pm, sm, _, wc, _ = control.stability_margins((np.abs(loop), phase, 2.0 * np.pi * f))
    assert found.modulus_margin == pytest.approx(sm, rel=2e-3)
    if found.is_stable:
        assert found.gain_margin_dB == pytest.approx(20.0 * math.log10(gm), abs=0.05)
        assert found.phase_margin_deg == pytest.approx(pm, abs=0.1)
        assert found.delay_margin_s == pytest.approx(math.radians(pm) / wc, rel=5e-3)


def test_a_loop_is_stable_up_to_its_delay_margin():
    """At 16 ms and gain 10 the delay margin lies below one more sample, or above, as it says."""
    for kp, stable in ((10.0, True), (200.0, False)):
        plain = PidTorque(kp=kp, ki=0.0, sample_time_s=0.01, delay_samples=0)
        late = PidTorque(kp=kp, ki=0.0, sample_time_s=0.01, delay_samples=1)
        margin = loop_margins(MODEL, plain, LOCKED).delay_margin_s
        assert (margin > 0.01) == stable
        assert loop_margins(MODEL, late, LOCKED).is_stable == stable


@pytest.mark.parametrize("amplitude", [0.01, 1.0])
def test_the_describing_function_of_a_linear_law_gives_the_linear_margins(amplitude):
    linear = loop_margins(MODEL, PidTorque(), LOCKED)
    found = amplitude_margins(PidTorque(), MODEL, LOCKED, amplitude=amplitude)
    assert found.gain_margin_dB == pytest.approx(linear.gain_margin_dB, abs=0.05)
    assert found.phase_margin_deg == pytest.approx(linear.phase_margin_deg, abs=0.1)


def test_the_loop_of_a_power_law_has_its_describing_function_for_a_gain():
    """Angle part alone: gain K_p K_d N(A) of the power, in degrees, per cent of PWM."""
    free, f = Load(kind="free"), np.array([0.5, 1.0])
    amplitude = math.radians(3.0)
    power, linear = (
        harmonic_loop(
            HybridImpedance(selection=1.0, kv=0.0, gamma=gamma, force_per_torque_per_m=0.0),
            MODEL,
            free,
            amplitude=amplitude,
            frequencies_Hz=f,
        )
        for gamma in (0.6, 1.0)
    )
    np.testing.assert_allclose(power / linear, describing_function(0.6, 3.0), rtol=2e-3)


@pytest.mark.parametrize("selection", [0.5, 1.0])
def test_the_limit_cycle_of_a_power_law_has_the_predicted_size_and_frequency(selection):
    """Gains of Table 5.12 on a free joint: a third of a degree for S = 0.5, three for S = 1."""
    law, free = HybridImpedance(selection=selection, beta=0.75, gamma=0.8), Load(kind="free")
    small, large = math.radians(0.1), math.radians(20.0)
    amplitude, frequency = predicted_limit_cycle(law, MODEL, free, smallest=small, largest=large)
    step = AngleReference(kind="step", amplitude_rad=math.radians(20.0))
    ran = simulate_closed_loop(MODEL, law, step, free, duration_s=6.0)
    cycle = limit_cycle(ran.time_s, ran.load_angle_rad, smallest=1e-3)
    assert cycle.frequency_Hz == pytest.approx(frequency, rel=0.03)
    assert cycle.amplitude == pytest.approx(amplitude, rel=0.15)


def test_the_gains_of_table_4_5_cycle_at_8_Hz_and_have_no_phase_margin_at_any_amplitude():
    """Specification, actuator.md 5: a limit cycle of 8 Hz, phase margin -37 to -61 degrees."""
    law = HybridImpedance(kp=11.1753, kv=2.4681, alpha=0.4249, beta=0.7939, gamma=0.7944)
    free = Load(kind="free")
    margins = [
        amplitude_margins(law, MODEL, free, amplitude=math.radians(a)) for a in (1.0, 5.0, 20.0)
    ]
    assert max(m.phase_margin_deg for m in margins) < -37.0
    step = AngleReference(kind="step", amplitude_rad=math.radians(20.0))
    ran = simulate_closed_loop(MODEL, law, step, free, duration_s=4.0)
    cycle = limit_cycle(ran.time_s, ran.load_angle_rad, smallest=1e-3)
    assert cycle.frequency_Hz == pytest.approx(8.0, abs=0.6)


def test_a_settled_loop_has_no_limit_cycle_and_a_ringing_one_is_measured():
    t = np.arange(0.0, 4.0, 1e-3)
    decays = np.exp(-3.0 * t) * np.sin(2.0 * np.pi * 8.0 * t)
    assert limit_cycle(t, decays, smallest=1e-3) is None
    found = limit_cycle(t, 0.3 + 0.2 * np.sin(2.0 * np.pi * 8.0 * t), smallest=1e-3)
    assert found.frequency_Hz == pytest.approx(8.0, rel=0.01)
    assert found.amplitude == pytest.approx(0.2, rel=0.01)


def test_integral_criteria_of_a_known_error():
    """e = exp(-t): ISE 1/2, IAE 1, ITAE 1, ITSE 1/4 over all time."""
    t = np.linspace(0.0, 30.0, 300_001)
    found = following(t, np.exp(-t), np.zeros(t.size))
    assert (found.ise, found.iae, found.itae, found.itse) == pytest.approx(
        (0.5, 1.0, 1.0, 0.25), rel=1e-6
    )
    with pytest.raises(InputError, match="too few"):
        following(t[:4], t[:4], t[:4])


def test_step_figures_of_a_second_order_system():
    """Damping 0.5: overshoot exp(-pi z / sqrt(1 - z^2)) = 16.3 % (Ogata, section 5-3)."""
    z, w = 0.5, 10.0
    t = np.linspace(0.0, 5.0, 50_001)
    wd = w * math.sqrt(1.0 - z * z)
    y = 1.0 - np.exp(-z * w * t) * (np.cos(wd * t) + z * w / wd * np.sin(wd * t))
    found = step_shape(t, y, followed=1.0)
    assert found.overshoot_percent == pytest.approx(
        100.0 * math.exp(-math.pi * z / math.sqrt(1.0 - z * z)), rel=1e-3
    )
    assert found.settling_s == pytest.approx(0.81, abs=0.01)
    assert found.final == pytest.approx(1.0, abs=1e-3)
    assert found.settling_to_final_s == pytest.approx(found.settling_s, abs=0.01)
    swings = step_shape(t, y + 0.05 * np.sin(20.0 * t), followed=1.0, height=1.0)
    assert swings.settling_s is None


def test_the_motors_own_damping_takes_up_energy_and_a_fast_torque_loop_gives_some():
    passive = port_energy(
        MODEL,
        PidTorque(kp=0.0, ki=0.0, feedforward=False, back_emf="none"),
        load_amplitude_rad=0.05,
        frequencies_Hz=(0.5, 2.0),
    )
    assert passive.is_passive
    assert passive.absorbed_J.min() > 0.0
    driven = port_energy(MODEL, LqgTorque(), load_amplitude_rad=0.1, frequencies_Hz=(2.0,))
    assert not driven.is_passive
