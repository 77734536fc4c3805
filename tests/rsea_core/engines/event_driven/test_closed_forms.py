"""The simulated machine agrees with textbook solutions of its parts."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.special import ellipk

from rsea_core import ActuatorModel, Inputs, Load, Rig, linearise, simulate
from rsea_core.effects import SpringCurve
from rsea_core.machine.rig import QUANTITIES

G = 9.80665


@pytest.fixture
def bench():
    return Rig.preset("rsea-bench")


def without(rig, *keys):
    return replace(rig, **dict.fromkeys(keys))


def rows(duration_s, tick_s=1e-3):
    return np.arange(round(duration_s / tick_s) + 1) * tick_s


def test_torque_step_on_locked_output_rings_at_sqrt_k_over_j(bench):
    """Undamped: tau_s = N tau_m (1 - cos w t), w = sqrt(K / (N^2 J_m + J_o))."""
    rig = without(bench, "motor_viscous_Nms_per_rad", "output_viscous_Nms_per_rad")
    time = rows(3.0)
    w = np.sqrt(65.8 / (60.0**2 * 3.2e-4 + 2.0e-3))

    result = simulate(
        ActuatorModel(rig),
        Inputs(time_s=time, motor_torque_Nm=np.full(time.size, 0.04), load=Load(kind="locked")),
    )

    expected = 60.0 * 0.04 * (1.0 - np.cos(w * time))
    np.testing.assert_allclose(result.torque_Nm, expected, atol=1e-10)
    assert w / (2.0 * np.pi) == pytest.approx(1.20, abs=0.005)  # the thesis' 2.32, corrected


def test_locked_output_settles_at_n_kt_v_duty_over_r(bench):
    time = rows(12.0, 0.01)

    result = simulate(
        ActuatorModel(bench),
        Inputs(time_s=time, duty=np.full(time.size, 0.3), load=Load(kind="locked")),
    )

    assert result.current_A[-1] == pytest.approx(0.3 * 48.0 / 3.78, rel=1e-3)
    assert result.torque_Nm[-1] == pytest.approx(60.0 * 0.3056 * 0.3 * 48.0 / 3.78, rel=1e-3)


def test_voltage_driven_locked_torque_lags_by_stiffness_over_back_emf_damping(bench):
    """Without inertia the joint is K / (D s + K), D = N^2 k_t k_e / R + B: 0.74 rad/s."""
    damping = 60.0**2 * 0.3056**2 / 3.78
    assert damping == pytest.approx(89.0, abs=0.1)
    assert 65.8 / damping == pytest.approx(0.74, abs=0.001)
    total, inertia, stiffness = damping + 60.0**2 * 1e-4 + 0.02, 1.154, 65.8
    rig = without(bench, "terminal_inductance_H")
    time = rows(8.0, 0.01)

    result = simulate(
        ActuatorModel(rig),
        Inputs(time_s=time, duty=np.full(time.size, 0.2), load=Load(kind="locked")),
    )

    # both poles of J s^2 + D s + K are real: p1 p2 = K / J, p1 + p2 = D / J
    p1, p2 = np.sort(-np.roots([inertia, total, stiffness]).real)
    final = 60.0 * 0.3056 * 0.2 * 48.0 / 3.78
    shape = 1.0 - (p2 * np.exp(-p1 * time) - p1 * np.exp(-p2 * time)) / (p2 - p1)
    np.testing.assert_allclose(result.torque_Nm, final * shape, atol=1e-9)
    assert p1 == pytest.approx(0.74, rel=0.02)


def test_current_of_stalled_motor_rises_exponentially(bench):
    rig = replace(without(bench, "spring_stiffness_Nm_per_rad"), parts=("drive", "gear", "load"))
    time = rows(0.02, 2.5e-4)

    result = simulate(
        ActuatorModel(rig),
        Inputs(time_s=time, duty=np.full(time.size, 0.25), load=Load(kind="locked")),
    )

    expected = 0.25 * 48.0 / 3.78 * (1.0 - np.exp(-3.78 / 4.56e-3 * time))
    np.testing.assert_allclose(result.current_A, expected, atol=1e-10)
    np.testing.assert_allclose(result.torque_Nm, 60.0 * 0.3056 * expected, atol=1e-8)
    assert np.all(result.motor_angle_rad == 0.0)


def test_current_limit_is_met_and_left_at_the_exact_times(bench):
    """A free rotor at the limit speeds up evenly until u = R I + k_e N w."""
    rig = replace(
        without(bench, "motor_viscous_Nms_per_rad", "output_viscous_Nms_per_rad"),
        parts=("drive", "gear"),
        current_limit_A=2.0,
        terminal_inductance_H=0.0,
    )
    inertia, torque = 60.0**2 * 3.2e-4 + 2.0e-3, 60.0 * 0.3056 * 2.0
    speed_left = (0.7 * 48.0 - 3.78 * 2.0) / (0.3056 * 60.0)
    expected = speed_left * inertia / torque  # limited from the first moment on
    time = rows(0.2, 7e-3)

    result = simulate(
        ActuatorModel(rig),
        Inputs(time_s=time, duty=np.full(time.size, 0.7), load=Load(kind="free")),
    )

    assert result.current_limited_s[-1] == pytest.approx(expected, abs=1e-13)
    at_limit = time[1:] < expected
    assert np.all(result.current_A[1:][at_limit] == 2.0)
    assert np.all(result.current_A[1:][~at_limit] < 2.0)


def test_inductive_current_meets_its_limit_at_the_exact_time(bench):
    rig = replace(bench, parts=("drive", "gear", "load"), current_limit_A=3.0)
    time = rows(0.01)
    met = -4.56e-3 / 3.78 * np.log(1.0 - 3.0 * 3.78 / (0.5 * 48.0))

    result = simulate(
        ActuatorModel(rig),
        Inputs(time_s=time, duty=np.full(time.size, 0.5), load=Load(kind="locked")),
        step_s=1e-4,
    )

    assert result.current_limited_s[-1] == pytest.approx(0.01 - met, abs=1e-13)
    assert result.current_A.max() == 3.0


@pytest.mark.parametrize("start_rad", [0.01, 2.2])
def test_free_pendulum_has_the_period_of_the_elliptic_integral(start_rad):
    """T = 4 sqrt(J / (m g d)) K(sin^2(start / 2)); Landau & Lifshitz, Mechanics, section 11."""
    rig = Rig(
        name="pendulum",
        parts=("load",),
        load_mass_kg=0.3,
        load_distance_m=0.3,
        load_inertia_kgm2=0.041,
    )
    period = 4.0 * np.sqrt(0.041 / (0.3 * G * 0.3)) * ellipk(np.sin(start_rad / 2.0) ** 2)
    time = np.linspace(0.0, 3.0 * period, 61)

    result = simulate(ActuatorModel(rig), Inputs(time_s=time, initial_load_angle_rad=start_rad))

    np.testing.assert_allclose(result.load_angle_rad[::20], start_rad, rtol=1e-9)
    np.testing.assert_allclose(result.load_angle_rad[10::20], -start_rad, rtol=1e-9)
    np.testing.assert_allclose(result.load_angle_rad[5::10], 0.0, atol=1e-9 * start_rad)


def test_gravity_offset_turns_the_hanging_angle(bench):
    rig = replace(bench, parts=("load",), gravity_angle_offset_rad=0.4)
    time = rows(60.0, 0.05)

    result = simulate(ActuatorModel(rig), Inputs(time_s=time))

    assert result.load_angle_rad[-1] == pytest.approx(-0.4, abs=1e-6)


def test_lossless_contact_gives_back_what_it_took():
    """m g d (1 - cos a) = K_e x^2 / 2 + m g d (1 - cos x) at the deepest point x."""
    rig = Rig(
        name="pendulum",
        parts=("load",),
        load_mass_kg=0.5,
        load_distance_m=0.2,
        load_inertia_kgm2=0.03,
    )
    mgd, stiffness, start = 0.5 * G * 0.2, 40.0, -1.1
    load = Load(
        kind="contact",
        contact_stiffness_Nm_per_rad=stiffness,
        contact_angle_rad=0.0,
        contact_damping_Nms_per_rad=0.0,
    )
    time = rows(6.0)

    result = simulate(
        ActuatorModel(rig), Inputs(time_s=time, load=load, initial_load_angle_rad=start)
    )

    energy = result.energy
    deepest = result.load_angle_rad.max()
    taken = 0.5 * stiffness * deepest**2 + mgd * (1.0 - np.cos(deepest))
    assert taken == pytest.approx(mgd * (1.0 - np.cos(start)), rel=1e-4)  # deepest is a row
    assert np.abs(energy.imbalance_J()).max() < 1e-12
    returns = result.load_angle_rad[time > 0.5].min()
    assert returns == pytest.approx(start, abs=1e-5)
    assert 0.1 < result.contact_s[-1] < 2.0


def test_damped_contact_follows_the_contract_law_at_rest(bench):
    """Pushed by a constant motor torque the link comes to rest where all torques balance."""
    load = Load(
        kind="contact",
        contact_stiffness_Nm_per_rad=25.0,
        contact_angle_rad=0.12,
        contact_damping_Nms_per_rad=3.0,
    )
    rig = replace(bench, output_viscous_Nms_per_rad=8.0)
    time = rows(20.0, 0.01)

    result = simulate(
        ActuatorModel(rig),
        Inputs(time_s=time, motor_torque_Nm=np.full(time.size, 0.05), load=load),
    )

    angle = result.load_angle_rad[-1]
    resisting = 25.0 * (angle - 0.12) + 0.3 * G * 0.3 * np.sin(angle)
    assert angle > 0.15
    assert resisting == pytest.approx(60.0 * 0.05, rel=1e-6)
    assert result.torque_Nm[-1] == pytest.approx(60.0 * 0.05, rel=1e-6)


def test_constant_load_torque_on_a_free_joint_accelerates_it_evenly():
    rig = Rig(name="drum", parts=("load",), load_inertia_kgm2=0.05)
    time = rows(2.0, 0.1)

    result = simulate(
        ActuatorModel(rig),
        Inputs(time_s=time, load=Load(kind="constant-torque", load_torque_Nm=-0.4)),
    )

    np.testing.assert_allclose(result.load_angle_rad, -0.5 * 8.0 * time**2, atol=1e-12)


def test_gear_reflects_torque_by_n_and_inertia_and_damping_by_n_squared(bench):
    """A motor behind a gear of 60 moves the joint like a direct drive with reflected values."""
    direct = replace(
        bench,
        gear_ratio=1.0,
        motor_inertia_kgm2=60.0**2 * 3.2e-4,
        motor_viscous_Nms_per_rad=60.0**2 * 1e-4,
        torque_constant_Nm_per_A=60.0 * 0.3056,
        back_emf_constant_Vs_per_rad=60.0 * 0.3056,
    )
    time = rows(3.0)
    inputs = Inputs(time_s=time, duty=0.6 * np.sin(5.0 * time))

    geared, reflected = (simulate(ActuatorModel(rig), inputs) for rig in (bench, direct))

    for name in ("torque_Nm", "load_angle_rad", "current_A"):
        np.testing.assert_allclose(
            getattr(geared, name), getattr(reflected, name), rtol=1e-10, atol=1e-12
        )
    np.testing.assert_allclose(
        geared.motor_angle_rad, 60.0 * reflected.motor_angle_rad, rtol=1e-10, atol=1e-12
    )


def test_rigid_joint_is_the_limit_of_a_stiff_spring(bench):
    stiff = replace(bench, spring_stiffness_Nm_per_rad=1e5)
    rigid = replace(bench, parts=("drive", "gear", "load"))
    time = rows(1.0)
    inputs = Inputs(time_s=time, duty=0.3 * np.sin(9.0 * time))

    sprung, joined = (simulate(ActuatorModel(rig), inputs) for rig in (stiff, rigid))

    np.testing.assert_allclose(sprung.load_angle_rad, joined.load_angle_rad, atol=2e-5)
    inside = time > 0.1
    assert np.abs((sprung.torque_Nm - joined.torque_Nm)[inside]).max() < 0.02


def test_imposed_motion_drives_the_wheel_through_the_spring(bench):
    """An open drive: J x'' = -B x' - K (x - a sin^2(w t / 2)), solved in closed form."""
    rig = without(bench, "motor_viscous_Nms_per_rad", "output_viscous_Nms_per_rad")
    time, amplitude, w = rows(4.0), 0.05, 3.0
    natural2 = 65.8 / (60.0**2 * 3.2e-4 + 2.0e-3)
    load_angle = 0.5 * amplitude * (1.0 - np.cos(w * time))

    result = simulate(
        ActuatorModel(rig),
        Inputs(
            time_s=time,
            current_command_A=np.zeros(time.size),
            load=Load(kind="imposed"),
            load_angle_rad=load_angle,
        ),
    )

    forced = natural2 / (natural2 - w**2)
    natural = np.cos(np.sqrt(natural2) * time)
    expected = 0.5 * amplitude * (1.0 - natural - forced * (np.cos(w * time) - natural))
    np.testing.assert_allclose(result.motor_angle_rad / 60.0, expected, atol=2e-8)
    energy = result.energy
    assert np.abs(energy.imbalance_J()).max() < 1e-9 * np.abs(energy.load_work_J).max()


def test_unloaded_output_runs_to_the_no_load_speed(bench):
    rig = replace(
        without(bench, "motor_viscous_Nms_per_rad", "output_viscous_Nms_per_rad"),
        parts=("drive", "gear", "spring"),
    )
    time = rows(1.0)

    result = simulate(
        ActuatorModel(rig),
        Inputs(time_s=time, duty=np.full(time.size, 0.5), load=Load(kind="free")),
    )

    assert result.motor_velocity_rad_per_s[-1] == pytest.approx(24.0 / 0.3056, rel=1e-9)
    np.testing.assert_allclose(result.torque_Nm, 0.0, atol=1e-12)


def test_current_command_is_clipped_to_the_limit_without_dynamics(bench):
    time = rows(0.01)
    command = np.linspace(-9.0, 9.0, time.size)

    result = simulate(
        ActuatorModel(bench),
        Inputs(time_s=time, current_command_A=command, load=Load(kind="locked")),
    )

    # the reading at a row is what the row before commanded
    np.testing.assert_allclose(result.current_A[1:], np.clip(command[:-1], -6.06, 6.06))
    assert result.current_A[0] == 0.0
    beyond = np.abs(command[:-1]) > 6.06
    assert result.current_limited_s[-1] == pytest.approx(1e-3 * beyond.sum(), rel=1e-12)


def test_linear_model_matches_finite_differences_of_a_short_simulation(bench):
    """x(h) - x(0) for small h from every state, through the public simulation."""
    model = ActuatorModel(bench)
    linear = linearise(model, command_name="duty", load=Load())
    h = 1e-3
    held = np.block([[linear.A, linear.b[:, None]], [np.zeros((1, 6))]])
    transition = expm(2.0 * h * held)
    start = np.array([0.0, 2e-5, 0.0, -3e-5, 0.0, 1e-4])
    expected = (transition @ start)[:5]
    result = simulate(
        model,
        Inputs(
            time_s=np.array([0.0, h, 2 * h]),
            duty=np.full(3, 1e-4),
            initial_motor_angle_rad=60.0 * 2e-5,
            initial_load_angle_rad=-3e-5,
        ),
    )
    reached = np.array(
        [
            result.current_A[-1],
            result.motor_angle_rad[-1] / 60.0,
            result.motor_velocity_rad_per_s[-1] / 60.0,
            result.load_angle_rad[-1],
            result.load_velocity_rad_per_s[-1],
        ]
    )
    np.testing.assert_allclose(reached, expected, rtol=1e-7, atol=1e-14)


def test_spring_curve_simulates_like_the_stiffness_where_it_is_straight(bench):
    d = np.linspace(-0.3, 0.3, 7)
    curve = SpringCurve(deflection_rad=d, torque_Nm=65.8 * d, tangent_Nm_per_rad=np.full(7, 65.8))
    time = rows(2.0)
    inputs = Inputs(time_s=time, duty=0.4 * np.sin(6.0 * time))

    by_rig = simulate(ActuatorModel(bench), inputs)
    by_curve = simulate(ActuatorModel(bench).with_terms(curve), inputs)

    np.testing.assert_allclose(by_curve.torque_Nm, by_rig.torque_Nm, atol=1e-11)


def test_leaving_the_valid_range_is_flagged_with_time_and_share(bench):
    """Quasi-static ramp: the spring passes the first contact at 0.1 rad at a known time."""
    d = np.linspace(-0.3, 0.3, 13)
    curve = SpringCurve(deflection_rad=d, torque_Nm=65.8 * d, contact_onset_rad=(None, 0.1001))
    rig = replace(bench, output_viscous_Nms_per_rad=200.0)
    time = rows(20.0, 0.01)
    ramp = 65.8 * 0.2 / 60.0 * time / 20.0  # towards 0.2 rad

    result = simulate(
        ActuatorModel(rig, (curve,)),
        Inputs(time_s=time, motor_torque_Nm=ramp, load=Load(kind="locked")),
    )

    assert result.spring_valid_range_rad == (-0.3, 0.1001)
    passed = time[np.argmax(result.spring_deflection_rad > 0.1001)]
    assert result.left_valid_range_s == passed
    assert passed == pytest.approx(10.0 + (200.0 + 0.36) / 65.8, abs=0.1)  # lag B / K
    assert result.share_outside_valid_range == pytest.approx((20.0 - passed) / 20.0, abs=1e-3)


def test_every_rig_quantity_of_the_contract_is_a_field():
    """The keys of recordings.md, [rig]."""
    assert set(QUANTITIES) == {
        "supply_voltage_V", "terminal_resistance_ohm", "terminal_inductance_H",
        "torque_constant_Nm_per_A", "back_emf_constant_Vs_per_rad", "current_limit_A",
        "motor_inertia_kgm2", "motor_viscous_Nms_per_rad", "gear_ratio", "output_inertia_kgm2",
        "output_viscous_Nms_per_rad", "spring_stiffness_Nm_per_rad", "load_mass_kg",
        "load_distance_m", "load_inertia_kgm2", "load_viscous_Nms_per_rad",
        "gravity_angle_offset_rad", "motor_encoder_counts_per_rev",
        "load_encoder_counts_per_rev", "torque_sensor_noise_Nm", "current_sensor_noise_A",
        "servo_proportional_Nm_per_rad", "servo_derivative_Nms_per_rad", "servo_dead_band_rad",
        "servo_torque_limit_Nm", "servo_delay_s",
    }  # fmt: skip
