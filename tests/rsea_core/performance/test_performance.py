"""Bandwidth, efficiency, step and impedance figures agree with closed forms and simulations."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rsea_core import (
    ActuatorModel,
    InputError,
    Inputs,
    Load,
    PidTorque,
    Reference,
    Rig,
    simulate,
    simulate_closed_loop,
)
from rsea_core.control import FuzzyTorque
from rsea_core.effects import SpringCurve
from rsea_core.errors import RigError
from rsea_core.machine.configurations import Configuration
from rsea_core.performance.bandwidth import (
    amplitude_limits,
    published_bandwidth_Hz,
    torque_bandwidth,
)
from rsea_core.performance.efficiency import CycleEfficiency, cycle_efficiency
from rsea_core.performance.frequency import output_impedance
from rsea_core.performance.limits import binding_limit
from rsea_core.performance.table_2_1 import performance_table
from rsea_core.performance.zero_impedance import (
    largest_followed_swing_rad,
    zero_impedance_torque_Nm,
)
from rsea_core.simulation.step_response import step_metrics
from rsea_core.simulation.tracking_metrics import phasor

BENCH = Rig.preset("rsea-bench")
MODEL = ActuatorModel(BENCH)
LIGHT = ActuatorModel(replace(BENCH, motor_inertia_kgm2=1.7e-5))
LOCKED = Load(kind="locked")
RATED_A = 1.73
DAMPED = ActuatorModel(replace(BENCH, load_viscous_Nms_per_rad=0.6))  # swings die out in 0.1 s
TITANIUM = ActuatorModel(
    replace(BENCH, motor_inertia_kgm2=1.7e-5, spring_stiffness_Nm_per_rad=88.3)
)


def test_amplitude_limits_are_the_closed_forms_of_the_locked_joint():
    """i = (J s^2 + B s + K) tau / (K N k_t),  u = (R + L s) i + k_e N s tau / K."""
    f, J, B, K, kt = 3.7, 1.154, 0.38, 65.8, 60 * 0.3056
    s = 2j * np.pi * f
    current = (J * s**2 + B * s + K) / (K * kt)
    volts = (3.78 + 4.56e-3 * s) * current + kt * s / K
    found = amplitude_limits(MODEL, f, continuous_current_A=RATED_A)
    assert found.current_Nm == pytest.approx(6.06 / abs(current), rel=1e-10)
    assert found.supply_Nm == pytest.approx(48.0 / abs(volts), rel=1e-10)
    assert found.heat_Nm == pytest.approx(np.sqrt(2) * RATED_A / abs(current), rel=1e-10)
    assert found.speed_Nm == pytest.approx(48.0 / kt * K / (2 * np.pi * f), rel=1e-10)
    assert found.contact_Nm == np.inf
    assert found.binding == "heat"


@pytest.mark.parametrize("model", [MODEL, LIGHT], ids=["J_m 3.2e-4", "J_m 1.7e-5"])
def test_45_Nm_at_5_Hz_is_out_of_reach(model):
    """Spec 6: the limit is 0.6 Hz, 0.77 Hz bang-bang, by the motor's speed."""
    found = torque_bandwidth(model, 45.0)
    assert found.frequency_Hz == pytest.approx(0.60, abs=0.01)
    assert found.square_wave_Hz == pytest.approx(0.77, abs=0.01)
    assert found.binding == "speed"
    hot = torque_bandwidth(model, 45.0, continuous_current_A=RATED_A)
    assert (hot.frequency_Hz, hot.binding) == (0.0, "heat")


def test_20_8_Nm_is_undistorted_up_to_1_3_Hz():
    """Spec 6: 1.3 Hz undistorted, 1.4 to 1.6 Hz as square-wave bound with losses."""
    found = torque_bandwidth(MODEL, 20.8)
    assert found.frequency_Hz == pytest.approx(1.3, abs=0.02)
    assert 1.4 < found.square_wave_Hz < 1.7


def test_bandwidth_falls_as_the_reciprocal_of_the_torque():
    """Spec 6: 27.4 / T by speed, 35.4 T^-1.006 switched; the published fit is half of it."""
    T = np.geomspace(3.5, 20.8, 8)
    found = [torque_bandwidth(LIGHT, amplitude) for amplitude in T]
    sine = np.array([f.frequency_Hz for f in found])
    slope, factor = np.polyfit(np.log(T), np.log(sine), 1)
    assert slope == pytest.approx(-1.0, abs=0.01)
    assert np.exp(factor) == pytest.approx(27.4, rel=0.01)
    slope, factor = np.polyfit(np.log(T), np.log([f.square_wave_Hz for f in found]), 1)
    assert slope == pytest.approx(-1.006, abs=0.01)
    assert np.exp(factor) == pytest.approx(35.4, rel=0.02)
    share = published_bandwidth_Hz(T) / sine
    assert np.all((share > 0.5) & (share < 0.62))
    assert published_bandwidth_Hz(20.8) == pytest.approx(0.68, abs=0.005)


def test_7_Nm_at_15_Hz_is_no_amplitude_of_any_spring():
    """Spec 6: at most 3.1 Nm (titanium) and 2.3 Nm (aluminium), bang-bang."""
    for model, largest in ((TITANIUM, 3.1), (LIGHT, 2.3)):
        found = amplitude_limits(model, 15.0)
        assert found.supply_Nm * 4 / np.pi == pytest.approx(largest, abs=0.05)
        assert found.binding == "speed"


def test_simulated_sine_at_the_bandwidth_has_the_amplitude_and_no_more():
    """Full duty at the bandwidth of 20.8 Nm: the phasor is 20.8 Nm, the current unlimited."""
    f = torque_bandwidth(MODEL, 20.8).frequency_Hz
    t = np.arange(16001) * 1e-3
    run = simulate(MODEL, Inputs(time_s=t, duty=np.sin(2 * np.pi * f * t), load=LOCKED))
    late = t > 16.0 - 6.0 / f
    amplitude = abs(phasor(t[late], run.torque_Nm[late], f))
    assert amplitude == pytest.approx(20.8, rel=2e-3)  # the held duty's first harmonic: -1e-5
    assert run.current_limited_s[-1] == 0.0


@pytest.mark.parametrize("parts", [("drive", "gear", "load"), ("spring", "load")])
def test_machine_without_gear_or_spring_has_no_torque_limits(parts):
    with pytest.raises(RigError, match="torque limits need a gear and a spring"):
        torque_bandwidth(ActuatorModel(replace(BENCH, parts=parts)), 7.0)
    with pytest.raises(RigError, match="configuration FSEA needs a gear and a spring"):
        Configuration.of_rig("FSEA", replace(BENCH, parts=parts))


@pytest.mark.parametrize(
    ("frequency", "current", "message"),
    [(0.0, None, "frequency_Hz = 0.0"), (2.0, -1.0, "continuous_current_A = -1.0")],
)
def test_limits_refuse_values_out_of_range(frequency, current, message):
    with pytest.raises(InputError, match=re.escape(f"{message} must be above 0")):
        amplitude_limits(MODEL, frequency, continuous_current_A=current)


@settings(max_examples=12, deadline=None)
@given(st.floats(1.0, 40.0), st.floats(1.02, 1.6))
def test_a_larger_torque_never_has_a_larger_bandwidth(amplitude, factor):
    small, large = torque_bandwidth(LIGHT, amplitude), torque_bandwidth(LIGHT, factor * amplitude)
    assert large.frequency_Hz < small.frequency_Hz
    assert small.frequency_Hz < small.square_wave_Hz


def test_contact_and_current_bind_where_they_are_met():
    d = np.linspace(-0.3, 0.3, 13)
    curve = SpringCurve(
        deflection_rad=d,
        torque_Nm=65.8 * d,
        tangent_Nm_per_rad=np.full(d.size, 65.8),
        contact_onset_rad=(-0.2, 0.25),
    )
    assert torque_bandwidth(MODEL.with_terms(curve), 14.0).binding == "contact"
    assert torque_bandwidth(MODEL.with_terms(curve), 14.0).frequency_Hz == 0.0
    assert torque_bandwidth(MODEL.with_terms(curve), 13.0).frequency_Hz > 1.0
    found = torque_bandwidth(MODEL, 3.5)
    assert found.binding == "current"
    assert amplitude_limits(MODEL, found.frequency_Hz).current_Nm == pytest.approx(3.5, rel=1e-6)


def test_supply_is_called_voltage_where_resistance_takes_it():
    """Without a current limit 200 Nm need 10.9 A: 41 of 48 V are lost in the winding."""
    found = torque_bandwidth(ActuatorModel(replace(BENCH, current_limit_A=None)), 200.0)
    assert found.binding == "voltage"
    at_rest = 48.0 * 60 * 0.3056 / 3.78
    assert torque_bandwidth(
        ActuatorModel(replace(BENCH, current_limit_A=None)), 1.001 * at_rest
    ).frequency_Hz == pytest.approx(0.0)


def shaped(torque, reference, time):
    """A trajectory whose torque and reference are given."""
    run = simulate(MODEL, Inputs(time_s=time, duty=np.zeros(time.size), load=LOCKED))
    followed = reference.sample(time)[:, 0]
    return replace(run, torque_Nm=torque, reference=followed, reference_name="reference_torque_Nm")


def test_step_metrics_of_a_second_order_answer_are_the_textbooks():
    """Ogata: overshoot exp(-pi z / sqrt(1 - z^2)); here with an offset, a start and an error."""
    t = np.arange(40001) * 2e-4
    ref = Reference(kind="step", amplitude_Nm=-4.0, offset_Nm=1.0, start_s=0.5)
    z, w = 0.35, 9.0
    wd, x = w * np.sqrt(1 - z**2), np.maximum(t - 0.5, 0.0)
    answer = 1 - np.exp(-z * w * x) * (np.cos(wd * x) + z / np.sqrt(1 - z**2) * np.sin(wd * x))
    found = step_metrics(shaped(1.0 - 4.0 * 0.97 * answer, ref, t), ref)
    expected = 97.0 * np.exp(-np.pi * z / np.sqrt(1 - z**2))
    assert found.overshoot_percent == pytest.approx(expected, rel=1e-4)
    assert found.steady_state_error_Nm == pytest.approx(-0.12, abs=1e-6)
    assert found.settling_s is None  # 3 % short of the reference for ever
    outside = np.flatnonzero(np.abs(0.97 * (answer - 1.0)) > 0.02)
    assert found.settling_to_final_s == pytest.approx(t[outside[-1] + 1] - 0.5, abs=1e-9)


def test_settling_of_a_first_order_answer_is_its_logarithm():
    t = np.arange(20001) * 5e-4
    ref = Reference(kind="step", amplitude_Nm=3.0)
    found = step_metrics(shaped(3.0 * (1 - np.exp(-t / 0.4)), ref, t), ref)
    assert found.settling_s == pytest.approx(0.4 * np.log(50.0), abs=5e-4)
    assert found.overshoot_percent == pytest.approx(0.0, abs=1e-6)


def test_step_metrics_need_a_step():
    t = np.arange(101) * 1e-2
    sine = Reference(kind="sine", amplitude_Nm=2.0, frequency_Hz=1.0)
    with pytest.raises(InputError, match="step metrics need a step reference, not a 'sine' one"):
        step_metrics(shaped(np.zeros(101), sine, t), sine)


def test_efficiency_of_steady_lifting_is_the_dc_motors():
    """tau_l w_l / (u i) with i = (T + B w) / (N k_t) and u = R i + N k_e w."""
    T, duty = 8.0, 0.55
    kt, both = 60 * 0.3056, 3600 * 1e-4 + 0.02 + 0.6  # the load's bearing turns with it
    w = (0.55 * 48.0 - 3.78 * T / kt) / (kt + 3.78 * both / kt)
    i = (T + both * w) / kt
    t = np.arange(6001) * 1e-3
    run = simulate(
        DAMPED,
        Inputs(
            time_s=t,
            duty=np.full(t.size, duty),
            load=Load(kind="constant-torque", load_torque_Nm=-T),
        ),
    )
    found = cycle_efficiency(run, from_s=5.0)
    assert found.forward == pytest.approx((T + 0.6 * w) * w / (duty * 48.0 * i), rel=1e-6)
    assert found.motor == pytest.approx(kt * i * w / (duty * 48.0 * i), rel=1e-6)
    assert 0.91 <= found.motor <= 0.94  # spec 1.1
    assert found.backward is None
    assert found.net == pytest.approx(found.forward, rel=1e-9)


def test_driven_machine_returns_energy_with_the_same_formula_inverted():
    """A falling weight drives the motor against a smaller voltage: u i < 0."""
    T, duty = 8.0, 0.35
    kt, both = 60 * 0.3056, 3600 * 1e-4 + 0.02 + 0.6
    w = (duty * 48.0 + 3.78 * T / kt) / (kt + 3.78 * both / kt)
    i = (both * w - T) / kt
    t = np.arange(6001) * 1e-3
    run = simulate(
        DAMPED,
        Inputs(
            time_s=t,
            duty=np.full(t.size, duty),
            load=Load(kind="constant-torque", load_torque_Nm=T),
        ),
    )
    found = cycle_efficiency(run, from_s=5.0)
    expected = -duty * 48.0 * i / ((T - 0.6 * w) * w)
    assert found.backward == pytest.approx(expected, rel=1e-6)
    assert 0.0 < found.backward < 1.0
    assert found.forward is None
    assert found.net is None


@settings(max_examples=8, deadline=None)
@given(st.floats(0.1, 0.9), st.floats(0.4, 3.0), st.sampled_from(["pendulum", "free"]))
def test_energies_of_a_span_balance_and_no_cycle_gives_more_than_it_takes(duty, frequency, kind):
    """Drawn less returned less delivered and absorbed is what was lost and stored."""
    t = np.arange(round(12.0 / frequency / 1e-3) + 1) * 1e-3
    run = simulate(
        MODEL,
        Inputs(time_s=t, duty=duty * np.sin(2 * np.pi * frequency * t), load=Load(kind=kind)),
    )
    start = 6.0 / frequency
    found = cycle_efficiency(run, from_s=start)
    net_in = found.drawn_J - found.returned_J
    net_out = found.delivered_J - found.absorbed_J
    rows = np.flatnonzero(t >= start)[[0, -1]]
    e = run.energy
    # energy beyond the spring is the load's: its bearing, gravity and motion are no loss here
    load_kinetic = 0.5 * 0.03 * run.load_velocity_rad_per_s**2
    inside = e.stored_J() - e.gravity_J - load_kinetic
    inner_loss = found.lost_J - np.diff(e.load_viscous_J[rows])[0]
    grown = np.diff(inside[rows])[0]
    scale = found.drawn_J + found.absorbed_J
    assert net_in - net_out == pytest.approx(inner_loss + grown, abs=1e-4 * scale)
    assert found.throughput <= 1.0 + (abs(grown) + 1e-4 * scale) / scale


def test_shaft_energy_is_torque_times_speed_while_the_current_rises():
    """The winding's own energy, L i^2 / 2 = 21 mJ at 3 A, is not the shaft's."""
    t = np.arange(1001) * 1e-5
    run = simulate(MODEL, Inputs(time_s=t, duty=np.full(t.size, 0.45), load=Load(kind="free")))
    power = 60 * 0.3056 * run.current_A * run.wheel_velocity_rad_per_s
    expected = np.sum(0.5 * (power[1:] + power[:-1]) * np.diff(t))
    assert cycle_efficiency(run).shaft_delivered_J == pytest.approx(expected, rel=1e-4)


def test_ratios_follow_the_net_direction_of_the_flow():
    energies = {"from_s": 0.0, "to_s": 1.0, "shaft_delivered_J": 1.5, "lost_J": 2.0}
    back = CycleEfficiency(drawn_J=2.0, returned_J=5.0, delivered_J=1.0, absorbed_J=6.0, **energies)
    assert (back.forward, back.backward, back.net) == (0.5, 3.0 / 5.0, None)
    assert back.throughput == 6.0 / 8.0
    ahead = CycleEfficiency(
        drawn_J=9.0, returned_J=2.0, delivered_J=6.0, absorbed_J=1.0, **energies
    )
    assert (ahead.forward, ahead.backward, ahead.net) == (6.0 / 9.0, None, 5.0 / 7.0)


def test_efficiency_is_refused_where_the_motor_creates_energy():
    rig = replace(BENCH, torque_constant_Nm_per_A=0.38)
    t = np.arange(1001) * 1e-3
    run = simulate(ActuatorModel(rig), Inputs(time_s=t, duty=np.full(t.size, 0.3)))
    with pytest.raises(InputError, match=r"k_t / k_e = 1\.243 is above 1\.02"):
        cycle_efficiency(run)
    torque = simulate(MODEL, Inputs(time_s=t, motor_torque_Nm=np.full(t.size, 0.01)))
    with pytest.raises(InputError, match="driven by duty or voltage_V"):
        cycle_efficiency(torque)


def test_torque_felt_at_a_sleeping_drive_is_its_impedance_times_the_swing():
    """All gains zero: the duty stays 0 and the winding is shorted."""
    asleep = PidTorque(kp=0.0, ki=0.0, feedforward=False, back_emf="none")
    felt = zero_impedance_torque_Nm(
        MODEL, asleep, load_amplitude_rad=0.07, frequency_Hz=1.7, periods=40
    )  # the slow pole is at 0.74 rad/s
    impedance = abs(output_impedance(MODEL, 1.7, command_name="duty")[0])
    assert felt == pytest.approx(2 * 0.07 * impedance, rel=2e-3)


def test_followed_swing_is_what_current_and_voltage_allow():
    f, J, B, kt = 15.0, 1.154, 0.38, 60 * 0.3056
    s = 2j * np.pi * f
    current = (J * s**2 + B * s) / kt
    assert largest_followed_swing_rad(MODEL, f) == pytest.approx(6.06 / abs(current), rel=1e-10)
    # a light motor meets the voltage first
    current = ((3600 * 1.7e-5 + 2e-3) * s**2 + B * s) / kt
    volts = (3.78 + 4.56e-3 * s) * current + kt * s
    assert largest_followed_swing_rad(LIGHT, f) == pytest.approx(48.0 / abs(volts), rel=1e-10)


def test_table_has_the_verdicts_of_the_specification():
    rows = {
        (r.name, r.thesis): r
        for r in performance_table(MODEL, continuous_current_A=RATED_A, gear_efficiency=0.5)
    }
    verdicts = {key: r.verdict for key, r in rows.items()}
    assert verdicts[("large torque bandwidth at 45 Nm", 5.0)] == "impossible"
    assert verdicts[("large torque bandwidth at 20.8 Nm", 0.1)] == "possible"
    assert verdicts[("torque amplitude at 15 Hz", 7.0)] == "impossible"
    assert verdicts[("peak-to-peak torque at 15 Hz", 7.0)] == "impossible"
    assert verdicts[("output speed", 1.2)] == "possible"
    assert verdicts[("peak torque", 20.0)] == "possible"
    assert verdicts[("continuous torque", 20.0)] == "impossible"
    assert verdicts[("zero-impedance torque", 0.3)] == "conditional"
    assert verdicts[("maximal mass", 3.5)] == "not checkable"
    assert rows[("torque resolution", 0.05)].value == pytest.approx(0.0505, abs=5e-5)
    assert rows[("continuous torque", 20.0)].value == pytest.approx(16.0, abs=0.2)
    assert rows[("output speed", 1.2)].value == pytest.approx(2.23, abs=0.05)
    assert rows[("zero-impedance torque", 0.3)].value == pytest.approx(0.101, abs=1e-3)
    titanium = {r.name: r.verdict for r in performance_table(TITANIUM)}
    assert titanium["torque amplitude at 15 Hz"] == "impossible"
    assert titanium["peak-to-peak torque at 15 Hz"] == "conditional"  # spec 6: at -3 dB only


def test_table_takes_step_cycle_and_controller():
    reference = Reference(kind="step", amplitude_Nm=5.0, start_s=0.1)
    run = simulate_closed_loop(MODEL, PidTorque(), reference, LOCKED, duration_s=1.0)
    t = np.arange(3001) * 1e-3
    lifting = simulate(
        MODEL,
        Inputs(
            time_s=t,
            duty=np.full(t.size, 0.5),
            load=Load(kind="constant-torque", load_torque_Nm=-6.0),
        ),
    )
    step, cycle = step_metrics(run, reference), cycle_efficiency(lifting, from_s=2.0)
    rows = {
        r.name: r for r in performance_table(MODEL, controller=PidTorque(), step=step, cycle=cycle)
    }
    assert rows["settling time"].value == step.settling_s
    assert rows["efficiency, driving"].value == 100.0 * cycle.forward
    assert rows["efficiency, driving"].thesis == 58.94
    assert rows["efficiency, driven"].value is None
    assert 0.1 < rows["zero-impedance torque"].value < 1.0
    assert "continuous torque" not in rows
    with pytest.raises(InputError, match=r"gear_efficiency = 1\.2 must be above 0"):
        performance_table(MODEL, gear_efficiency=1.2)


def test_a_law_whose_gain_varies_is_not_explained_by_its_linear_loop():
    found = {
        "share_outside_spring_range": 0.0, "share_current_limited": 0.0,
        "share_command_limited": 0.0, "loop_error_Nm": 0.1, "encoder_error_Nm": 0.0,
    }  # fmt: skip
    torque = SimpleNamespace(unit="Nm")
    metrics = SimpleNamespace(sentence="the tracking error is 0.003 Nm rms")
    binding, text = binding_limit(found, None, torque, FuzzyTorque(), metrics)
    assert binding == "loop"
    assert "this law's gain varies with its error" in text
    assert "linear loop alone" in binding_limit(found, None, torque, PidTorque(), metrics)[1]
