"""The compiled torque loop, its margins and limits agree with independent evaluations."""

from dataclasses import replace

import numpy as np
import pytest
from numba import njit

import rsea_core.engines.event_driven.states as k
from rsea_core import (
    ActuatorModel,
    Load,
    PidTorque,
    Reference,
    Rig,
    loop_margins,
    simulate_closed_loop,
    tracking_metrics,
)
from rsea_core.control import require_stable
from rsea_core.control.stability.margins import linear_tracking
from rsea_core.effects import SpringCurve
from rsea_core.errors import ControllerError
from rsea_core.performance.limits import tracking_limits

LOCKED = Load(kind="locked")


@pytest.fixture(scope="module")
def bench():
    return Rig.preset("rsea-bench")


@pytest.fixture(scope="module")
def model(bench):
    return ActuatorModel(bench)


@pytest.fixture(scope="module")
def curve():
    d = np.linspace(-0.25, 0.3, 15)
    return SpringCurve(
        deflection_rad=d, torque_Nm=62.0 * d + 90.0 * d**3, tangent_Nm_per_rad=62.0 + 270.0 * d**2
    )


@njit
def act(function, parameters, state, signals, command):
    function(parameters, state, signals, command)


@pytest.mark.parametrize("back_emf", ["none", "reference", "measured"])
@pytest.mark.parametrize("load_feedforward", ["none", "velocity", "acceleration"])
def test_compiled_pid_equals_its_law_evaluated_step_by_step(
    model, curve, back_emf, load_feedforward
):
    """The docstring's law, written out with filters and anti-windup, on random readings."""
    T, tf, tl, kp, ki, kd = 2e-3, 5e-3, 0.03, 3.1, 40.0, 0.2
    controller = PidTorque(
        kp=kp,
        ki=ki,
        kd=kd,
        sample_time_s=T,
        derivative_filter_s=tf,
        load_filter_s=tl,
        back_emf=back_emf,
        load_feedforward=load_feedforward,
    )
    compiled = controller.compile(model.with_terms(curve), Load())
    state, command = compiled.state.copy(), np.zeros(k.N_COMMANDS)
    random = np.random.default_rng(7)
    inertia, damping = 60.0**2 * 3.2e-4 + 2e-3, 60.0**2 * 1e-4 + 0.02
    integral = slope = load_w = load_a = motor_w = 0.0
    last = None
    saturated = 0
    for _ in range(400):
        reference = random.normal(0.0, [6.0, 40.0, 300.0])
        motor, load = 60.0 * random.normal(0.0, 0.1), random.normal(0.0, 0.05)
        signals = np.zeros(k.N_SIGNALS)
        signals[:3] = reference
        signals[k.READ_MOTOR_ANGLE], signals[k.READ_LOAD_ANGLE] = motor, load
        act(compiled.function, compiled.parameters, state, signals, command)

        target, rate, second_rate = reference
        error = target - curve_torque(motor / 60.0 - load)
        last = last or (error, load, motor)
        slope = (tf * slope + (error - last[0])) / (tf + T)
        new_w = (tl * load_w + (load - last[1])) / (tl + T)
        load_a = (tl * load_a + (new_w - load_w)) / (tl + T)
        load_w = new_w
        motor_w = (tf * motor_w + (motor - last[2])) / (tf + T)
        last = (error, load, motor)
        wanted = deflection_at(target)
        tangent = 62.0 + 270.0 * wanted**2
        w = rate / tangent + (load_w if load_feedforward != "none" else 0.0)
        a = second_rate / tangent + (load_a if load_feedforward == "acceleration" else 0.0)
        u = target + inertia * a + damping * w + kp * error + kd * slope
        compensated = {"none": 0.0, "reference": w, "measured": motor_w / 60.0}[back_emf]
        free = u * 3.78 / (60.0 * 0.3056 * 48.0) + 0.3056 * 60.0 * compensated / 48.0
        grown = integral + ki * T * error
        asked = free + grown * 3.78 / (60.0 * 0.3056 * 48.0)
        if abs(asked) > 1.0 and asked * error > 0.0:
            asked = free + integral * 3.78 / (60.0 * 0.3056 * 48.0)
            saturated += 1
        else:
            integral = grown
        assert command[k.UNSATURATED] == pytest.approx(asked, rel=1e-10, abs=1e-12)
        assert command[k.COMMAND] == pytest.approx(np.clip(asked, -1.0, 1.0), rel=1e-10)
    assert saturated > 20


def curve_torque(d):
    """The cubic of the fixture: its Hermite interpolation is itself; straight outside."""
    inside = np.clip(d, -0.25, 0.3)
    return 62.0 * inside + 90.0 * inside**3 + (62.0 + 270.0 * inside**2) * (d - inside)


def deflection_at(torque):
    low, high = -1.0, 1.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if curve_torque(middle) < torque else (low, middle)
    return float(np.clip(middle, -0.25, 0.3))


@pytest.mark.parametrize("delay", [0, 1])
@pytest.mark.parametrize(("kp", "ki", "kd"), [(60.0, 10.0, 0.0), (4.0, 2.0, 3.0)])
def test_gain_margin_is_where_the_simulated_loop_turns_unstable(model, kp, ki, kd, delay):
    """Gains times the margin, 3 % less: a disturbance dies out; 3 % more: it grows."""
    controller = PidTorque(
        kp=kp, ki=ki, kd=kd, delay_samples=delay, feedforward=False, back_emf="none",
        ideal_sensors=True,
    )  # fmt: skip
    factor = 10.0 ** (loop_margins(model, controller, LOCKED).gain_margin_dB / 20.0)
    assert factor > 1.5

    def growth(times):
        scaled = replace(controller, kp=kp * times, ki=ki * times, kd=kd * times)
        result = simulate_closed_loop(
            model, scaled, Reference(kind="step", amplitude_Nm=1e-6), LOCKED, duration_s=3.0,
            refuse_unstable=False,
        )  # fmt: skip
        thirds = np.array_split(np.abs(np.diff(result.command, 2)), 3)  # the slow tail drops out
        return thirds[2].max() / thirds[1].max()

    assert growth(0.97 * factor) < 1.0 < growth(1.03 * factor)


def test_phase_margin_is_the_delay_that_the_loop_can_take(model):
    """At 10 us sampling one more sample is a small, known lag at the crossover."""
    controller = PidTorque(
        kp=60.0, ki=10.0, sample_time_s=1e-4, delay_samples=0, feedforward=False, back_emf="none"
    )
    without = loop_margins(model, controller, LOCKED)
    delayed = loop_margins(model, replace(controller, delay_samples=1), LOCKED)

    lag = 360.0 * without.crossover_Hz * 1e-4
    assert without.phase_margin_deg - delayed.phase_margin_deg == pytest.approx(lag, rel=1e-3)


def test_slow_sampling_is_refused_with_the_number_that_matters(model):
    controller = PidTorque(sample_time_s=0.016, delay_samples=1)
    with pytest.raises(ControllerError) as caught:
        require_stable(model, replace(controller, kp=200.0), LOCKED)

    text = str(caught.value)
    assert "sample time of 0.016 s" in text
    factor = float(text.split("times less than ")[1].split(" ")[0])
    scaled = replace(
        controller, kp=200.0 * factor * 0.98, ki=10.0 * factor * 0.98, feedforward=False
    )
    assert require_stable(model, scaled, LOCKED).is_stable


def test_default_gains_leave_the_documented_margins(model):
    margins = loop_margins(model, PidTorque(), LOCKED)

    assert margins.pole_radius < 1.0
    assert margins.gain_margin_dB == pytest.approx(18.6, abs=0.05)
    assert margins.gain_margin_Hz == pytest.approx(26.7, abs=0.1)
    assert margins.phase_margin_deg == pytest.approx(59.1, abs=0.1)
    assert margins.crossover_Hz == pytest.approx(6.4, abs=0.05)


@pytest.mark.parametrize(
    "load",
    [
        Load(),
        Load(kind="free"),
        Load(
            kind="contact",
            contact_stiffness_Nm_per_rad=50.0,
            contact_angle_rad=0.1,
            contact_damping_Nms_per_rad=0.5,
        ),
    ],
    ids=lambda load: load.kind,
)
def test_default_gains_are_stable_on_every_moving_load(model, load):
    assert require_stable(model, PidTorque(), load).is_stable


@pytest.mark.parametrize("frequency", [0.5, 2.0, 4.0])
def test_linear_tracking_predicts_amplitude_and_phase_of_the_simulation(model, frequency):
    controller = PidTorque(ideal_sensors=True, kp=20.0)
    reference = Reference(kind="sine", amplitude_Nm=2.0, frequency_Hz=frequency)
    result = simulate_closed_loop(model, controller, reference, LOCKED, duration_s=12.0)
    metrics = tracking_metrics(result, reference, from_s=8.0)

    predicted = linear_tracking(model, controller, LOCKED, frequency)

    assert metrics.amplitude_ratio == pytest.approx(abs(predicted), rel=1e-5)
    assert metrics.phase_deg == pytest.approx(np.rad2deg(np.angle(predicted)), abs=1e-3)


def test_integral_action_removes_the_error_of_a_wrong_stiffness_free_step(model):
    """A step on a locked output without feedforward: no steady error, finite overshoot."""
    controller = PidTorque(kp=30.0, ki=60.0, feedforward=False, ideal_sensors=True)
    reference = Reference(kind="step", amplitude_Nm=3.0, start_s=0.1)
    result = simulate_closed_loop(model, controller, reference, LOCKED, duration_s=12.0)
    metrics = tracking_metrics(result, reference)

    assert abs(result.torque_Nm[-1] - 3.0) < 1e-6
    assert 0.0 < metrics.overshoot_percent < 40.0
    assert metrics.overshoot_percent == pytest.approx(
        100.0 * (result.torque_Nm.max() - 3.0) / 3.0, rel=1e-12
    )


def test_anti_windup_shortens_the_recovery_from_saturation(model):
    """A step far beyond the supply: the integral does not grow while the duty is full."""
    controller = PidTorque(kp=60.0, ki=400.0, ideal_sensors=True)
    reference = Reference(kind="step", amplitude_Nm=14.0)
    result = simulate_closed_loop(model, controller, reference, LOCKED, duration_s=4.0)

    assert result.command_limited.mean() > 0.01
    assert np.abs(result.command).max() == 1.0
    metrics = tracking_metrics(result, reference)
    assert metrics.overshoot_percent < 15.0
    assert abs(result.torque_Nm[-1] - 14.0) < 0.05


def test_speed_limit_is_no_load_speed_times_stiffness(model):
    """f = w_nl K_s / (2 pi T) = 27.4 Nm Hz / T at 48 V: the thesis' plant, section 6."""
    controller = PidTorque()
    reference = Reference(kind="sine", amplitude_Nm=12.0, frequency_Hz=4.0)
    result = simulate_closed_loop(model, controller, reference, LOCKED, duration_s=3.0)
    metrics = tracking_metrics(result, reference, from_s=1.0)

    limits = tracking_limits(model, controller, reference, result, metrics)

    assert limits.torque_rate_available_Nm_per_s / (2 * np.pi) == pytest.approx(27.4, abs=0.05)
    assert limits.torque_rate_needed_Nm_per_s == pytest.approx(2 * np.pi * 4.0 * 12.0, rel=1e-3)
    assert limits.binding in ("speed", "current")
    assert limits.share_command_limited > 0.3


@pytest.mark.parametrize("kind", ["locked", "pendulum"])
def test_largest_amplitude_is_where_the_duty_saturates(model, kind):
    """2 % below it the command stays within its limits, 5 % above it does not."""
    load, controller = Load(kind=kind), PidTorque(ideal_sensors=True)

    def run(amplitude):
        reference = Reference(kind="sine", amplitude_Nm=amplitude, frequency_Hz=3.0)
        result = simulate_closed_loop(model, controller, reference, load, duration_s=8.0)
        metrics = tracking_metrics(result, reference, from_s=5.0)
        return tracking_limits(model, controller, reference, result, metrics), metrics

    largest = run(0.01)[0].largest_amplitude_Nm
    below, metrics = run(0.98 * largest / abs(linear_tracking(model, controller, load, 3.0)))
    above, _ = run(1.05 * largest / abs(linear_tracking(model, controller, load, 3.0)))
    assert 0.93 < metrics.command_peak <= 1.0
    assert below.share_command_limited == 0.0 < above.share_command_limited


def test_limits_name_encoder_loop_and_spring_range(model, curve):
    short = replace(curve, contact_onset_rad=(-0.05, 0.05))
    slow = Reference(kind="sine", amplitude_Nm=5.0, frequency_Hz=1.0)

    def limits_of(machine, controller):
        result = simulate_closed_loop(machine, controller, slow, LOCKED, duration_s=3.0)
        metrics = tracking_metrics(result, slow, from_s=1.0)
        return tracking_limits(machine, controller, slow, result, metrics)

    assert limits_of(model, PidTorque()).binding == "loop"
    coarse = ActuatorModel(replace(model.rig, motor_encoder_counts_per_rev=24))
    assert limits_of(coarse, PidTorque(kp=200.0)).binding == "encoder"
    left = limits_of(model.with_terms(short), PidTorque())
    assert left.binding == "spring range"
    assert "first at" in left.sentence
    assert left.largest_by_spring_Nm == pytest.approx(curve_torque(0.05), rel=1e-9)
    # the thesis' "torque resolution 0.05 Nm" is one load-encoder count
    assert limits_of(model, PidTorque()).encoder_step_Nm == pytest.approx(0.0505, abs=5e-5)


@pytest.mark.parametrize("command", ["voltage_V", "current_command_A", "motor_torque_Nm"])
def test_loop_tracks_through_every_kind_of_drive(model, command):
    """Drives without back-EMF damping need the derivative; all follow within 2 %."""
    damped = {} if command == "voltage_V" else {"kp": 2.0, "kd": 0.3, "back_emf": "none"}
    controller = PidTorque(command_name=command, ideal_sensors=True, **damped)
    reference = Reference(kind="sine", amplitude_Nm=4.0, frequency_Hz=1.5)

    result = simulate_closed_loop(model, controller, reference, LOCKED, duration_s=5.0)

    assert result.command_name == command
    assert tracking_metrics(result, reference, from_s=3.0).rmse_Nm < 0.02 * 4.0


def test_controller_acts_at_its_own_sample_time_between_rows(model):
    controller = PidTorque(sample_time_s=0.008, kp=12.0)
    reference = Reference(kind="sine", amplitude_Nm=3.0, frequency_Hz=1.0)

    result = simulate_closed_loop(model, controller, reference, LOCKED, duration_s=1.0, row_s=1e-3)

    changes = np.flatnonzero(np.diff(result.command)) + 1
    assert np.all(changes % 8 == 0)
    assert changes.size > 100
    assert np.all(result.command[:8] == 0.0)  # one sample of delay
