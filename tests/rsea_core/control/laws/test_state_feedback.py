"""The LQG loop that runs is the one that python-control designs, on every drive and load."""

from dataclasses import replace

import numpy as np
import pytest

import rsea_core.control.laws.state_feedback as lqg
import rsea_core.engines.event_driven.states as k
from rsea_core import ActuatorModel, Load, Reference, Rig, tracking_metrics
from rsea_core.control import LqgTorque, simulate_closed_loop
from rsea_core.control.stability.margins import pole_radius
from rsea_core.engines.linear.linearise import linearise

BENCH = Rig.preset("rsea-bench")
SINE = Reference(kind="sine", amplitude_Nm=2.0, frequency_Hz=1.0)


def designed(law, model, load):
    """Gains of regulator and estimator by python-control, and the largest pole of both."""
    control = pytest.importorskip("control", reason="python-control is the oracle here")
    linear = linearise(model, command_name=law.command_name, load=load)
    plant, T = model.plant(law.command_name, load), law.sample_time_s
    electric = int(law.command_name == "duty" and plant.inductance > 0.0)
    states = [k.IM] * electric + [k.TW, k.WW] + [k.TL, k.WL] * (not load.is_held)
    A, b = linear.A[np.ix_(states, states)], linear.b[states][:, None]
    row, n = linear.torque_row[states], len(states)
    if load.kind == "free":  # deflection in place of both angles
        basis = np.linalg.pinv(np.delete(change(n, electric), electric + 2, axis=0))
        reduced = np.linalg.pinv(basis)
    else:
        basis = reduced = np.eye(n)
    held = control.sample_system(
        control.ss(reduced @ A @ basis, reduced @ b, row @ basis, 0.0), T, "zoh"
    )
    m = len(held.A)
    big, drive = np.zeros((m + 2, m + 2)), np.zeros((m + 2, 1))
    big[:m, :m], big[:m, m], drive[m] = held.A, held.B[:, 0], 1.0
    big[-1, :m], big[-1, -1] = -T * held.C[0], 1.0
    Q = np.zeros_like(big)
    Q[:m, :m] = law.torque_weight * held.C.T @ held.C
    Q[-1, -1] = law.integral_weight
    limit = law.compile(model, load).command_limit
    gain, _, _ = control.dlqr(big, drive, Q + 1e-12 * np.eye(m + 2), law.command_weight / limit**2)
    gain = np.asarray(gain)
    on_states = np.concatenate((gain[0, :m] @ reduced, gain[0, m:]))
    gain[0, :m] -= gain[0, -1] * T * held.C[0]  # the law's integral holds this sample's error, too
    whole = control.sample_system(control.ss(A, b, row, 0.0), T, "zoh").A
    C = np.eye(n)[[electric, electric + 2][: 2 - load.is_held]]
    counts = np.array([plant.motor_count / plant.gear_ratio, plant.load_count])[: len(C)]
    noise = np.diag(np.maximum(counts, 1e-6) ** 2 / 12.0)
    into = np.zeros((n, len(C)))
    for j, inertia in enumerate((plant.inertia, plant.load_inertia)[: len(C)]):
        at = electric + 2 * j
        into[at : at + 2, j] = (
            0.5 * law.disturbance_Nm * T**2 / inertia,
            law.disturbance_Nm * T / inertia,
        )
    L, _, _ = control.dlqe(whole, np.eye(n), C, into @ into.T + 1e-14 * np.eye(n), noise)
    poles = np.linalg.eigvals(big - drive @ gain), np.linalg.eigvals(whole - L @ C)
    return on_states, np.linalg.solve(whole, L), max(np.abs(p).max() for p in poles)


def change(n, electric):
    found = np.eye(n)
    found[electric, electric + 2] = -1.0
    return found


@pytest.mark.parametrize("load", ["locked", "pendulum", "free"])
@pytest.mark.parametrize("inductance_H", [0.0, BENCH.terminal_inductance_H])
@pytest.mark.parametrize("command", ["duty", "current_command_A", "motor_torque_Nm"])
def test_lqg_closes_the_loop_that_python_control_designs(command, inductance_H, load):
    model = ActuatorModel(replace(BENCH, terminal_inductance_H=inductance_H))
    # what else is in a torque loop is taken out: it feeds measured motion back
    law = LqgTorque(
        command_name=command, load_feedforward="none", load_filter_s=0.0, derivative_filter_s=0.0
    )
    given = Load(kind=load)
    gains, corrections, radius = designed(law, model, given)
    p, n = law.compile(model, given).parameters, len(corrections)
    ours = p[[*range(lqg.AT_K, lqg.AT_K + n), lqg.AT_K + lqg.LARGEST, lqg.AT_K + lqg.LARGEST + 1]]
    np.testing.assert_allclose(ours, gains, rtol=1e-5, atol=1e-9)
    own = p[lqg.AT_L : lqg.AT_L + 2 * n].reshape(n, 2)[:, : corrections.shape[1]]
    np.testing.assert_allclose(own, corrections, rtol=1e-5, atol=1e-9)
    # the common angle of wheel and free load, which nothing regulates, stays where it is
    expected = max(radius, 1.0) if load == "free" else radius
    assert pole_radius(model, law, given) == pytest.approx(expected, abs=1e-6)
    ran = simulate_closed_loop(model, law, SINE, given, duration_s=2.0)
    assert np.abs(ran.command).max() > 0.0
    if load == "locked":  # a load that is not held swings at the drive's limits
        assert tracking_metrics(ran, SINE, from_s=1.0).rmse_Nm < 1e-3
