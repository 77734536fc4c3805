"""Every controller agrees with a second evaluation of its law, or with a value it must give."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import gamma

from rsea_core import ActuatorModel, Load, Reference, Rig, tracking_metrics
from rsea_core.control import (
    AdaptiveImpedance,
    DisturbanceObserverTorque,
    FractionalPidTorque,
    FuzzyTorque,
    HybridImpedance,
    LqgTorque,
    PidTorque,
    loop_margins,
    simulate_closed_loop,
)
from rsea_core.control.laws.adaptive_impedance import scheduled
from rsea_core.control.laws.fractional import chain, grunwald_letnikov, oustaloup
from rsea_core.control.laws.signed_power import describing_function, gain_per_radian, spow
from rsea_core.control.tuning.figures_of_merit import swung
from rsea_core.effects import GearFriction, GearLoadFriction
from rsea_core.errors import ControllerError
from rsea_core.simulation.reference import AngleReference

BENCH = Rig.preset("rsea-bench")
LOCKED = Load(kind="locked")
SINE = Reference(kind="sine", amplitude_Nm=5.0, frequency_Hz=1.0)
WORM = GearLoadFriction(lead_angle_rad=math.radians(4.0), friction_coefficient=0.075)


def listing(motor_rad, load_rad, set_point_deg, c: HybridImpedance):
    """Appendix A's OnTimer, statement by statement; encoder counts per tick in, duty out.

    Corrected as errata R5 asks (the motor's count divided by the ratio) and nothing else.
    """
    tick, per_degree = 0.016, 1.150
    enc2 = vel2 = vel2_old = 0.0
    st_old = st_vel_old = 0.0
    out = []
    for motor, load, st in zip(motor_rad, load_rad, set_point_deg, strict=True):
        m_motr_en = math.degrees(motor) / 60.0
        enc2, enc2_old = math.degrees(load), enc2
        vel2_old_old, vel2_old = vel2_old, vel2
        vel2 = (enc2 - enc2_old) / tick
        vel2 = (vel2 + vel2_old + vel2_old_old) / 3.0
        encs_er = m_motr_en - enc2
        m_lod_trq = encs_er * per_degree
        xr = st
        xr_d = (st - st_old) / tick
        st_old = st
        xr_dd = (xr_d - st_vel_old) / tick
        st_vel_old = xr_d
        x, x_d, sel = enc2, vel2, c.selection

        def power(value, exponent):
            return -math.pow(-value, exponent) if value < 0 else math.pow(value, exponent)

        trm1 = power(sel * xr_dd, c.alpha)
        trm2 = power(sel * xr_d - x_d, c.beta)
        trm3 = power(sel * xr - x, c.gamma)
        trm4 = power(1.0 - sel, c.delta)
        fe = m_lod_trq * 4.0
        fhic = trm1 + (1.0 / 1.0) * (
            c.kv * 1.0 * trm2 + c.kp * per_degree * trm3 - trm4 * c.force_N - fe
        )
        pwm = min(max(50.0 + fhic, 1.0), 99.0)
        out.append((pwm - 50.0) / 50.0)
    return np.array(out)


@pytest.mark.parametrize(
    "exponents",
    [(1.0, 1.0, 1.0, 1.0), (0.5, 0.5, 0.5, 0.5), (0.0, 1.0, 0.0, 0.0), (0.38, 0.75, 0.8, 0.7)],
)
@pytest.mark.parametrize("selection", [0.0, 0.5, 1.0])
def test_the_bench_code_equals_its_listing_evaluated_step_by_step(exponents, selection):
    """Cases of Table 5.12 among them (selection 1 with delta 0: pow(0, 0) = 1)."""
    names = ("alpha", "beta", "gamma", "delta")
    controller = replace(
        HybridImpedance.preset("seed-code"),
        selection=selection,
        force_N=-8.0,
        **dict(zip(names, exponents, strict=True)),
    )
    rig = replace(BENCH, spring_stiffness_Nm_per_rad=1.150 * math.degrees(1.0))
    reference = AngleReference(kind="sine", amplitude_rad=math.radians(12.0), frequency_Hz=0.7)
    ran = simulate_closed_loop(
        ActuatorModel(rig), controller, reference, Load(), duration_s=2.0, refuse_unstable=False
    )
    ticks = slice(0, None, 16)
    expected = listing(
        ran.encoder_motor_angle_rad[ticks],
        ran.encoder_load_angle_rad[ticks],
        np.degrees(reference.sample(ran.time_s)[ticks, 0]),
        controller,
    )
    assert np.abs(expected).max() > 0.02
    np.testing.assert_allclose(ran.command[ticks], expected, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("power", [0.0, 0.3, 0.75, 1.0])
@pytest.mark.parametrize("amplitude", [0.02, 1.0, 7.0])
def test_describing_function_equals_the_first_harmonic(power, amplitude):
    def weighted(t: float) -> float:
        return spow(amplitude * math.sin(t), power) * math.sin(t)

    harmonic = 4.0 / math.pi * quad(weighted, 0.0, 0.5 * math.pi, epsabs=1e-13)[0]
    assert describing_function(power, amplitude) == pytest.approx(harmonic / amplitude, rel=1e-7)


def test_gains_of_powers_convert_between_degrees_and_radians():
    x = 0.123
    for power in (0.0, 0.4, 1.0):
        per_degree = 2.5 * spow(math.degrees(x), power)
        assert gain_per_radian(2.5, power) * spow(x, power) == pytest.approx(per_degree, rel=1e-12)


def test_grunwald_letnikov_half_derivative_of_a_ramp():
    """D^1/2 t = 2 sqrt(t / pi) (Podlubny 1999, 2.7.3); first order in the step."""
    errors = []
    for step in (1e-2, 5e-3):
        t = np.arange(0.0, 1.0 + 0.5 * step, step)
        found = grunwald_letnikov(t, 0.5, step)
        errors.append(abs(found[-1] - 2.0 / math.sqrt(math.pi)))
    assert errors[0] < 2e-3
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.05)


@pytest.mark.parametrize("order", [-0.6, 0.3, 0.5])
def test_grunwald_letnikov_of_a_power(order):
    """D^q t^2 = Gamma(3) / Gamma(3 - q) t^(2 - q)."""
    t = np.arange(0.0, 1.0001, 1e-3)
    found = grunwald_letnikov(t**2, order, 1e-3)[-1]
    assert found == pytest.approx(gamma(3.0) / gamma(3.0 - order), rel=2e-3)


@pytest.mark.parametrize("order", [-0.5, 0.2, 0.8])
def test_oustaloup_sections_have_the_gain_and_phase_of_the_power_of_s(order):
    gain, zeros, poles = oustaloup(order, 0.1, 1e4)
    s = 1j * np.geomspace(5.0, 200.0, 13)  # a decade and a half from the ends of the band
    response = gain * np.prod((s[:, None] + zeros) / (s[:, None] + poles), axis=1)
    assert np.abs(np.abs(response / s**order) - 1.0).max() < 0.05
    assert np.degrees(np.abs(np.angle(response / s**order))).max() < 3.0


@pytest.mark.parametrize("order", [-0.8, -0.5, 0.2, 0.5, 0.8])
@pytest.mark.parametrize("low", [0.1, 1.0, 10.0])
def test_the_sampled_chain_is_the_power_of_s_within_its_stated_band(order, low):
    """From the lowest frequency asked for to a tenth of the sampling rate: 3 % and 5 degrees."""
    T = 1e-3
    w = np.geomspace(low, 0.2 * math.pi / T, 60)
    error = sampled(order, low, w, T) / (1j * w) ** order
    assert np.abs(np.abs(error) - 1.0).max() < 0.03
    assert np.degrees(np.abs(np.angle(error))).max() < 5.0


def test_beyond_its_band_the_sampled_chain_is_as_wrong_as_it_says():
    T = 1e-3
    w = np.array([0.8 * math.pi / T])
    error = sampled(0.5, 0.1, w, T) / (1j * w) ** 0.5
    assert np.abs(error[0]) == pytest.approx(1.23, abs=0.01)
    assert np.degrees(np.angle(error[0])) == pytest.approx(-29.0, abs=0.5)


def sampled(order, low, w, T):
    numbers = chain(order, low, 0.8 * math.pi / T, T)
    z = np.exp(1j * w * T)[:, None]
    return numbers[0] * np.prod((z - numbers[1::2]) / (z - numbers[2::2]), axis=1)


FRICTION = (GearFriction(coulomb_Nm=0.005), WORM)


def worm_error(controller, terms=FRICTION) -> float:
    model = ActuatorModel(BENCH, terms)
    ran = simulate_closed_loop(model, controller, SINE, LOCKED, duration_s=3.0)
    return tracking_metrics(ran, SINE, from_s=1.0).rmse_Nm


@pytest.mark.parametrize("law", [PidTorque, FuzzyTorque, LqgTorque, FractionalPidTorque])
def test_friction_compensation_takes_out_most_of_a_self_locking_worm(law):
    assert worm_error(law(friction_compensation=1.0)) < 0.35 * worm_error(law())


def test_a_disturbance_observer_halves_the_error_without_knowing_the_friction():
    assert worm_error(DisturbanceObserverTorque()) < 0.5 * worm_error(PidTorque())


def test_what_is_compensated_already_is_not_taken_out_twice_by_the_observer():
    full = DisturbanceObserverTorque(friction_compensation=1.0)
    assert worm_error(full) < worm_error(DisturbanceObserverTorque())


def test_lqg_regulates_with_margins_and_follows_better_than_pid():
    model = ActuatorModel(BENCH)
    margins = loop_margins(model, LqgTorque(), LOCKED)
    assert margins.pole_radius < 0.99
    assert margins.gain_margin_dB > 6.0
    assert margins.phase_margin_deg > 40.0
    assert worm_error(LqgTorque(), ()) < 0.5 * worm_error(PidTorque(), ())


def test_lqg_gain_is_that_of_python_control():
    control = pytest.importorskip("control", reason="python-control is the oracle here")
    from rsea_core.control.laws.state_feedback import regulator_gain

    A = np.array([[0.9, 0.02, 0.0], [-0.3, 0.95, 0.0], [0.01, 0.0, 0.8]])
    b, row = np.array([0.1, 0.4, 0.0]), np.array([60.0, 0.0, 1.0])
    law = LqgTorque(delay_samples=0)
    found = regulator_gain(A, b, row, 1.0, law)
    big = np.zeros((4, 4))
    big[:3, :3], big[3, :3], big[3, 3] = A, -1e-3 * row, 1.0
    Q = np.zeros((4, 4))
    Q[:3, :3], Q[3, 3] = law.torque_weight * np.outer(row, row), law.integral_weight
    gain, _, _ = control.dlqr(big, np.append(b, 0.0)[:, None], Q, [[law.command_weight]])
    np.testing.assert_allclose(found[[0, 1, 2, 4]], np.ravel(gain), rtol=1e-6)


CONTACTS = {
    "soft": (10.0, 0.3821, 0.7508, 0.7958, 0.6824),
    "medium": (25.0, 0.4249, 0.7939, 0.7944, 0.7079),
    "hard": (50.0, 0.4650, 0.8142, 0.7891, 0.7031),
}


def contact(stiffness: float) -> Load:
    return Load(
        kind="contact",
        contact_stiffness_Nm_per_rad=stiffness,
        contact_angle_rad=math.radians(5.0),
        contact_damping_Nms_per_rad=0.3,
    )


def settling(time, values) -> float:
    final = values[-800:].mean()
    outside = np.flatnonzero(np.abs(values - final) > 0.02 * abs(final))
    return float(time[outside[-1]])


def test_fhic_settles_slower_on_softer_ground_with_the_gains_of_table_5_12():
    """Exponents of Table 4.5, gains 2.175 and 0.251; published 0.965, 0.937 and 0.621 s."""
    rig = replace(BENCH, load_inertia_kgm2=0.1, load_viscous_Nms_per_rad=0.5)
    angle, force = [], []
    for stiffness, alpha, beta, gam, delta in CONTACTS.values():
        law = HybridImpedance(alpha=alpha, beta=beta, gamma=gam, delta=delta, force_N=20.0)
        ran = simulate_closed_loop(
            ActuatorModel(rig),
            law,
            AngleReference(kind="step", amplitude_rad=math.radians(20.0)),
            contact(stiffness),
            duration_s=4.0,
        )
        angle.append(settling(ran.time_s, ran.load_angle_rad))
        force.append(settling(ran.time_s, ran.torque_Nm))
    assert angle[0] > angle[1] > angle[2]
    assert force[0] > force[1] > force[2]


def test_subspace_weighting_makes_true_force_control_and_the_thesis_weighting_does_not():
    rig = replace(BENCH, load_inertia_kgm2=0.1, load_viscous_Nms_per_rad=0.5)
    ends = {}
    for weighting in ("subspace", "thesis"):
        law = HybridImpedance(selection=0.0, force_N=20.0, weighting=weighting)
        ran = simulate_closed_loop(
            ActuatorModel(rig),
            law,
            AngleReference(kind="step", amplitude_rad=math.radians(20.0)),
            contact(25.0),
            duration_s=4.0,
        )
        ends[weighting] = 4.0 * ran.torque_Nm[-500:].mean()
    # the voltage that holds 5 Nm is u's rest: R i / V of 2 % of PWM, 1.1 N
    assert ends["subspace"] == pytest.approx(20.0, abs=1.5)
    assert ends["thesis"] < 12.0


def test_the_schedule_goes_from_soft_to_hard_with_stiffness_and_its_rate():
    stiff = [scheduled(x, 0.0) for x in np.linspace(0.0, 50.0, 21)]
    assert (np.diff(stiff) > -1e-3).all()
    assert stiff[-1] - stiff[0] > 0.4
    assert scheduled(50.0, 100.0) > scheduled(50.0, -100.0)
    assert 0.0 <= scheduled(-5.0, -1e9) < scheduled(1e9, 1e9) <= 1.0


def test_the_adaptive_law_knows_a_contact_on_either_side():
    """The load swung to the other side first asks for the opposite command."""
    exact = replace(BENCH, motor_encoder_counts_per_rev=None, load_encoder_counts_per_rev=None)
    one, other = (
        swung(ActuatorModel(exact), AdaptiveImpedance(), side * 0.05, 1.0, 3) for side in (1, -1)
    )
    assert np.abs(one.command).max() > 0.02
    np.testing.assert_allclose(one.command, -other.command, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(("name", "value"), [("selection", 1.2), ("soft", (0.1, 0.2))])
def test_unusable_values_of_the_adaptive_law_are_refused(name, value):
    with pytest.raises(ControllerError, match=name):
        AdaptiveImpedance(**{name: value})


def test_an_angle_controller_does_not_take_a_torque_reference():
    with pytest.raises(ControllerError, match="follows reference_angle_rad, not a reference in Nm"):
        simulate_closed_loop(ActuatorModel(BENCH), HybridImpedance(), SINE, Load(), duration_s=1.0)


def test_findings_of_the_printed_impedance_law_name_its_traps():
    text = " ".join(HybridImpedance.preset("seed-printed").findings())
    assert "follows 0.5 times the reference" in text
    assert "pulls the joint to zero angle" in text
    assert "minus" in " ".join(HybridImpedance.preset("seed-code").findings())
