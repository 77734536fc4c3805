"""The event-driven engine agrees with DOP853 at rtol 1e-12 and closes its energy balance.

The reference integrates each held command apart, with equations and controller written here.
Over 10 s the spring torque agrees within 1e-10 Nm, linear or by a curve, open or closed loop.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

from rsea_core import (
    ActuatorModel,
    Inputs,
    Load,
    PidTorque,
    Reference,
    Rig,
    simulate,
    simulate_closed_loop,
)
from rsea_core.effects import SpringCurve
from rsea_core.machine.rig import QUANTITIES
from rsea_core.numeric.runge_kutta import MATRIX, NODES, WEIGHTS

R, L, K_T, V, N = 3.78, 4.56e-3, 0.3056, 48.0, 60.0
J, B = N**2 * 3.2e-4 + 2.0e-3, N**2 * 1.0e-4 + 0.02
J_L, B_L, MGD = 0.030, 0.02, 0.3 * 0.3 * 9.80665
K_S = 65.8

# softer one way, with a knee at 0.2 rad like coils that meet; unevenly spaced points
POINTS = np.concatenate((np.linspace(-0.23, 0.18, 18), [0.19, 0.195, 0.2, 0.205, 0.21, 0.23, 0.25]))


def hardening_torque(d):
    knee = 60.0 * (d + np.log(np.cosh(120.0 * (d - 0.2)) / np.cosh(24.0)) / 120.0)
    return 64.0 * d + 30.0 * d**2 + 150.0 * d**3 + knee


def hardening_tangent(d):
    return 64.0 + 60.0 * d + 450.0 * d**2 + 60.0 * (1.0 + np.tanh(120.0 * (d - 0.2)))


@pytest.fixture(scope="module")
def curve():
    return SpringCurve(
        deflection_rad=POINTS,
        torque_Nm=hardening_torque(POINTS),
        tangent_Nm_per_rad=hardening_tangent(POINTS),
    )


def reference_spring(linear):
    if linear:
        return lambda d: K_S * d
    hermite = CubicHermiteSpline(POINTS, hardening_torque(POINTS), hardening_tangent(POINTS))

    def torque(d):
        inside = min(max(d, POINTS[0]), POINTS[-1])
        return float(hermite(inside)) + hardening_tangent(inside) * (d - inside)

    return torque


def reference_torques(tick_s, ticks, spring, moving, duty_at):
    """Spring torque at each tick; duty_at(k, torque, wheel speed) is held for one tick."""
    y, torques = np.zeros(5), np.zeros(ticks + 1)
    for k in range(ticks + 1):
        torques[k] = spring(y[1] - y[3])
        duty = duty_at(k, torques[k])

        def slope(t, y, duty=duty):
            i, wheel, w, load, w_l = y
            tau = spring(wheel - load)
            a_l = (tau - B_L * w_l - MGD * np.sin(load)) / J_L if moving else 0.0
            di = (duty * V - R * i - K_T * N * w) / L
            return di, w, (N * K_T * i - B * w - tau) / J, w_l, a_l

        if k < ticks:
            y = solve_ivp(
                slope,
                (0, tick_s),
                y,
                method="DOP853",
                rtol=1e-12,
                atol=1e-13,
                first_step=tick_s / 4,
            ).y[:, -1]
    return torques


@pytest.mark.parametrize(
    ("linear", "load", "amplitude"),
    [(True, "pendulum", 0.5), (False, "locked", 0.42)],
    ids=["linear, pendulum", "curve with knee, locked"],
)
def test_open_loop_spring_torque_agrees_with_dop853_over_10_s(curve, linear, load, amplitude):
    tick, ticks = 0.01, 1000
    time = np.arange(ticks + 1) * tick
    duty = amplitude * np.sin(2 * np.pi * 1.3 * time)
    expected = reference_torques(
        tick, ticks, reference_spring(linear), load == "pendulum", lambda k, tau: duty[k]
    )
    model = ActuatorModel(Rig.preset("rsea-bench"), () if linear else (curve,))

    result = simulate(model, Inputs(time_s=time, duty=duty, load=Load(kind=load)))

    # the curve's slope is continuous but bends at its points, which costs a digit
    np.testing.assert_allclose(result.torque_Nm, expected, rtol=0, atol=2e-10)
    if not linear:
        assert np.abs(result.spring_deflection_rad).max() > 0.205  # the knee took part


def test_closed_loop_spring_torque_agrees_with_dop853_over_10_s(curve):
    tick, ticks, kp, ki = 0.01, 1000, 10.0, 3.0
    spring, w = reference_spring(False), 2 * np.pi * 0.7
    inverse = np.vectorize(lambda tau: solve_deflection(spring, tau))
    time = np.arange(ticks + 1) * tick
    target = 6.0 * np.sin(w * time)
    rate, second_rate = 6.0 * w * np.cos(w * time), -(w**2) * target
    tangent = CubicHermiteSpline(
        POINTS, hardening_torque(POINTS), hardening_tangent(POINTS)
    ).derivative()(inverse(target))
    state = {"integral": 0.0, "waiting": 0.0}

    def duty_at(k, torque):
        error = target[k] - torque
        state["integral"] += ki * tick * error
        speed, acceleration = rate[k] / tangent[k], second_rate[k] / tangent[k]
        u = target[k] + J * acceleration + B * speed + kp * error + state["integral"]
        acting = state["waiting"]
        state["waiting"] = u * R / (N * K_T * V) + K_T * N * speed / V
        return acting

    expected = reference_torques(tick, ticks, spring, False, duty_at)
    controller = PidTorque(kp=kp, ki=ki, sample_time_s=tick, ideal_sensors=True, delay_samples=1)

    result = simulate_closed_loop(
        ActuatorModel(Rig.preset("rsea-bench"), (curve,)),
        controller,
        Reference(kind="sine", amplitude_Nm=6.0, frequency_Hz=0.7),
        Load(kind="locked"),
        duration_s=10.0,
        row_s=1e-3,
    )

    assert not result.command_limited.any()
    assert np.abs(result.torque_Nm[::10] - target).max() > 0.01  # the loop has errors to agree on
    np.testing.assert_allclose(result.torque_Nm[::10], expected, rtol=0, atol=1e-9)


def contact_slope(duty, stiffness, damping, at, inside):
    def slope(t, y):
        i, wheel, w, load, w_l = y
        tau = K_S * (wheel - load)
        pushed = stiffness * (load - at) + damping * w_l if inside else 0.0
        a_l = (tau - B_L * w_l - MGD * np.sin(load) - pushed) / J_L
        return (duty * V - R * i - K_T * N * w) / L, w, (N * K_T * i - B * w - tau) / J, w_l, a_l

    return slope


def test_contact_agrees_with_dop853_with_located_events():
    """Pendulum against a damped contact; scipy finds each crossing and restarts there."""
    stiffness, damping, at = 90.0, 0.6, 0.05
    time = np.arange(401) * 5e-3
    duty = 0.45 * np.sin(2 * np.pi * 1.7 * time)
    y, inside, angles = np.zeros(5), False, [0.0]
    for k in range(time.size - 1):
        done = 0.0

        def crossing(t, y):
            return y[3] - at

        crossing.terminal = True
        while done < 5e-3:
            crossing.direction = -1.0 if inside else 1.0
            slope = contact_slope(duty[k], stiffness, damping, at, inside)
            part = solve_ivp(
                slope, (done, 5e-3), y, method="DOP853", rtol=1e-12, atol=1e-13, events=crossing,
                first_step=min(1e-3, 5e-3 - done),
            )  # fmt: skip
            done, y = part.t[-1], part.y[:, -1]
            inside = inside != bool(part.t_events[0].size)
        angles.append(y[3])
    load = Load(
        kind="contact",
        contact_stiffness_Nm_per_rad=stiffness,
        contact_angle_rad=at,
        contact_damping_Nms_per_rad=damping,
    )

    result = simulate(
        ActuatorModel(Rig.preset("rsea-bench")), Inputs(time_s=time, duty=duty, load=load)
    )

    assert 0.2 < result.contact_s[-1] < 1.8
    np.testing.assert_allclose(result.load_angle_rad, angles, rtol=0, atol=1e-9)


def solve_deflection(spring, torque):
    low, high = -0.3, 0.3
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if spring(middle) < torque else (low, middle)
    return middle


ENERGY_CASES = {
    "pendulum": (Load(), 0.5),
    "free": (Load(kind="free"), 0.5),
    "locked": (Load(kind="locked"), 0.2),
    "contact without damping": (
        Load(
            kind="contact",
            contact_stiffness_Nm_per_rad=120.0,
            contact_angle_rad=0.08,
            contact_damping_Nms_per_rad=0.0,
        ),
        0.5,
    ),
    "constant-torque": (Load(kind="constant-torque", load_torque_Nm=-0.7), 0.5),
}


@pytest.mark.parametrize("with_curve", [False, True], ids=["linear", "curve"])
@pytest.mark.parametrize("case", ENERGY_CASES)
def test_energy_closes_to_1e_9_of_what_was_supplied(case, with_curve, curve):
    """Held sine duty at 1 kHz over 10 s; viscous friction is on and its losses are counted."""
    load, amplitude = ENERGY_CASES[case]
    time = np.arange(10001) * 1e-3
    duty = amplitude * np.sin(2 * np.pi * 1.3 * time)
    model = ActuatorModel(Rig.preset("rsea-bench"), (curve,) if with_curve else ())

    energy = simulate(model, Inputs(time_s=time, duty=duty, load=load)).energy

    assert energy.supplied_J[-1] > 0.5
    assert np.abs(energy.imbalance_J()).max() < 1e-9 * energy.supplied_J.max()


def test_energy_closes_to_1e_9_without_viscous_friction(curve):
    rig = Rig(
        name="no friction",
        supply_voltage_V=48.0,
        terminal_resistance_ohm=3.78,
        terminal_inductance_H=4.56e-3,
        torque_constant_Nm_per_A=0.3056,
        back_emf_constant_Vs_per_rad=0.3056,
        motor_inertia_kgm2=3.2e-4,
        gear_ratio=60.0,
        load_mass_kg=2.0,
        load_distance_m=0.3,
        load_inertia_kgm2=0.2,
    )
    time = np.arange(10001) * 1e-3
    duty = 0.4 * np.sin(2 * np.pi * 0.9 * time)

    result = simulate(ActuatorModel(rig, (curve,)), Inputs(time_s=time, duty=duty))

    energy = result.energy
    assert np.abs(result.spring_deflection_rad).max() > 0.03
    assert energy.drive_viscous_J[-1] == energy.load_viscous_J[-1] == 0.0
    assert np.abs(energy.imbalance_J()).max() < 1e-9 * energy.supplied_J.max()


def test_energy_with_current_limit_contact_damping_and_mixed_constants_closes():
    """Square duty of 0.9: limit and contact switch many times, k_t exceeds k_e by 24 %."""
    bench = Rig.preset("rsea-bench")
    rig = Rig.from_tables(
        {"rig": {**rig_values(bench), "torque_constant_Nm_per_A": 0.38}}, where="test"
    )
    load = Load(
        kind="contact",
        contact_stiffness_Nm_per_rad=50.0,
        contact_angle_rad=0.1,
        contact_damping_Nms_per_rad=0.4,
    )
    time = np.arange(5001) * 1e-3
    duty = 0.9 * np.sign(np.sin(2 * np.pi * 0.8 * time + 0.1))

    result = simulate(ActuatorModel(rig), Inputs(time_s=time, duty=duty, load=load), step_s=2.5e-4)

    energy = result.energy
    assert result.current_limited_s[-1] > 0.1
    assert result.contact_s[-1] > 0.5
    assert energy.contact_loss_J[-1] > 1e-3
    assert energy.constant_mismatch_J[-1] > 1.0
    assert np.abs(energy.imbalance_J()).max() < 1e-9 * energy.supplied_J.max()


def rig_values(rig):
    values = {key: getattr(rig, key) for key in QUANTITIES if getattr(rig, key) is not None}
    return {"name": rig.name, **values}


def test_halving_the_step_shows_order_8():
    time = np.arange(251) * 4e-3
    duty = 0.6 * np.sin(2 * np.pi * 3.0 * time)
    inputs = Inputs(time_s=time, duty=duty, load=Load(kind="free"))
    model = ActuatorModel(Rig.preset("rsea-bench"))
    exact = simulate(model, inputs, step_s=1e-4).torque_Nm

    errors = [
        np.abs(simulate(model, inputs, step_s=h).torque_Nm - exact).max()
        for h in (2e-3, 1e-3, 5e-4)
    ]

    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 7.5)
    assert errors[-1] < 1e-11


def test_tableau_meets_the_quadrature_and_row_sum_conditions():
    """Weights integrate t^p exactly up to p = 7 (Butcher's conditions B(8)); C(1) holds."""
    for p in range(8):
        rounding = WEIGHTS.size * np.finfo(float).eps * np.abs(WEIGHTS) @ NODES**p
        assert WEIGHTS @ NODES**p == pytest.approx(1.0 / (p + 1), abs=rounding)
    np.testing.assert_allclose(MATRIX.sum(axis=1), NODES, atol=1e-14)


def test_repeated_runs_are_bit_identical():
    rig = Rig.preset("rsea-bench")
    time = np.arange(2001) * 1e-3
    inputs = Inputs(
        time_s=time,
        duty=0.9 * np.sign(np.sin(7.0 * time)),
        load=Load(
            kind="contact",
            contact_stiffness_Nm_per_rad=80.0,
            contact_angle_rad=0.05,
            contact_damping_Nms_per_rad=0.3,
        ),
    )

    first, second = (simulate(ActuatorModel(rig), inputs) for _ in range(2))

    for name, column in first.columns().items():
        assert np.array_equal(column, second.columns()[name]), name
