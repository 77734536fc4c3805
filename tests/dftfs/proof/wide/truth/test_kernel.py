"""The wide proof's integrator agrees with closed forms and scipy, and conserves energy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from dftfs.proof.wide.truth.body import (
    BY_CURRENT,
    BY_VOLTAGE,
    LOCKED,
    NO_DRIVE,
    SWINGING,
    Body,
    Extra,
    Loop,
    Start,
)
from dftfs.proof.wide.truth.kernel import run
from dftfs.proof.wide.truth.simulate import PHASE_rad, Planned, Session, step_of

SEA = Body(
    drive=BY_VOLTAGE, sprung=1, gear_ratio=60.0, supply=48.0, resistance=3.0, inductance=4e-3,
    torque_constant=0.3, emf_constant=0.3, motor_inertia=3e-4, motor_viscous=1e-4,
    output_inertia=2e-3, output_viscous=0.02, stiffness=65.0, load_inertia=0.03,
    load_viscous=0.02, gravity=0.9, gravity_offset=0.1,
)  # fmt: skip
PENDULUM = Body(drive=NO_DRIVE, sprung=0, load_inertia=0.02, gravity=0.5)
AXIS = Body(drive=BY_CURRENT, sprung=0, gear_ratio=10.0, torque_constant=0.1,
            motor_inertia=1e-4, load_inertia=0.02)  # fmt: skip


def simulated(body, extra, seconds, step, *, command=None, pulse=0.0, start=None, mode=SWINGING):
    n = round(seconds / step)
    middle = step * (np.arange(n) + 0.5)
    u = np.zeros(n) if command is None else command(middle)
    out, _ = run(body, extra, Loop(), mode, step, u, np.full(n, pulse), start or Start())
    return step * np.arange(n + 1), out


def command(t):
    return 0.3 * np.sin(7.0 * t) + 0.1 * np.sin(31.0 * t)


def reference(seconds):
    b, n = SEA, SEA.gear_ratio
    inertia = n * n * b.motor_inertia + b.output_inertia

    def rates(t, y):
        q, w, p, v, i = y
        tau = b.stiffness * (q - p)
        loss = (n * n * b.motor_viscous + b.output_viscous) * w
        return [
            w, (n * b.torque_constant * i - loss - tau) / inertia,
            v, (tau - b.load_viscous * v - b.gravity * np.sin(p + b.gravity_offset))
            / b.load_inertia,
            (command(t) * b.supply - b.resistance * i - b.emf_constant * n * w) / b.inductance,
        ]  # fmt: skip

    return solve_ivp(rates, (0.0, seconds), np.zeros(5), method="DOP853", rtol=1e-10,
                     atol=1e-12).y[:, -1]  # fmt: skip


def test_whole_chain_converges_to_scipy_with_second_order():
    wanted = reference(0.5)
    errors = []
    for step in (2e-4, 1e-4):
        _, out = simulated(SEA, Extra(), 0.5, step, command=command)
        errors.append(np.abs(out[-1, :4] - wanted[:4]) / np.abs(wanted[:4]))
    assert errors[1].max() < 2e-4
    assert errors[0].max() / errors[1].max() == pytest.approx(4.0, rel=0.15)


def test_a_free_pendulum_conserves_its_energy():
    _, out = simulated(PENDULUM, Extra(), 20.0, 1e-3, start=Start(angle=2.0))
    energy = 0.5 * 0.02 * out[:, 3] ** 2 - 0.5 * np.cos(out[:, 2])
    assert np.ptp(energy) < 1e-3 * 0.5
    assert abs(energy[-1000:].mean() - energy[:1000].mean()) < 1e-5


def test_a_light_pendulum_keeps_its_phase_to_less_than_a_fine_encoder_shows():
    """At its own step: an error of phase would be physics that nobody planted."""
    rows, none = np.arange(0.0, 20.0, 0.02), np.zeros(0)
    planned = Planned(description="swing", rows_s=rows, ticks_s=none, command=none)
    rate = np.sqrt(PENDULUM.gravity / PENDULUM.load_inertia)
    step, _ = step_of(Session(body=PENDULUM, fastest=rate), planned)
    time, out = simulated(PENDULUM, Extra(), 20.0, step, start=Start(angle=0.8))
    exact = solve_ivp(lambda _, y: (y[1], -(rate**2) * np.sin(y[0])), (0.0, time[-1]), (0.8, 0.0),
                      method="DOP853", rtol=1e-11, atol=1e-12).y[0, -1]  # fmt: skip
    assert abs(out[-1, 2] - exact) < PHASE_rad
    assert PHASE_rad < 2.0 * np.pi / 16384 / np.sqrt(12.0)


def test_dry_friction_takes_four_levels_over_stiffness_from_each_swing():
    extra = Extra(parallel=2.0, load_coulomb=0.01, load_bristle=1e-6)
    body = Body(drive=NO_DRIVE, sprung=0, load_inertia=0.02)
    time, out = simulated(body, extra, 2.4, 2e-4, start=Start(angle=0.5))
    tops = [k for k in range(1, time.size - 1) if out[k, 3] > 0 >= out[k + 1, 3]]
    assert len(tops) >= 3
    peaks = [0.5, *(out[k, 2] for k in tops)]
    assert np.diff(peaks) == pytest.approx(-4 * 0.01 / 2.0, rel=0.01)


def test_a_rigid_axis_falls_behind_by_its_share_of_load_friction():
    inertia = 100 * AXIS.motor_inertia
    extra = Extra(share_driving=0.25, share_back=0.4, gear_bristle=1e-7)
    _, out = simulated(AXIS, extra, 0.1, 1e-4, command=lambda t: np.ones(t.size))
    assert out[-1, 1] == pytest.approx(0.1 / (inertia + 1.25 * AXIS.load_inertia), rel=1e-3)
    _, out = simulated(AXIS, extra, 0.1, 1e-4, command=lambda t: -np.ones(t.size),
                       start=Start(speed=20.0))  # fmt: skip
    slowing = (20.0 - out[-1, 1]) / 0.1
    assert slowing == pytest.approx(1.0 / (inertia + 0.6 * AXIS.load_inertia), rel=1e-3)


def test_a_locked_load_holds_and_a_soft_clamp_gives_by_its_stiffness():
    steady = {"command": lambda t: np.full(t.size, 0.05), "mode": LOCKED}
    _, held = simulated(SEA, Extra(), 12.0, 4e-4, **steady)
    assert np.all(held[:, 2] == 0.0)
    soft = Extra(clamp_stiffness=650.0, clamp_damping=3.0)
    _, out = simulated(SEA._replace(gravity=0.0), soft, 12.0, 4e-4, **steady)
    torque = 60 * 0.3 * 0.05 * 48.0 / 3.0
    assert held[-1, 5] == pytest.approx(torque, rel=0.01)
    assert out[-1, 2] == pytest.approx(torque / 650.0, rel=0.02)


def test_a_maxwell_branch_has_the_stiffness_of_a_standard_linear_solid():
    share, decay, omega = 20.0, 0.05, 10.0
    extra = Extra(branch_stiffness=np.array([share, 0.0]), branch_time=np.array([decay, 1.0]))
    body = SEA._replace(drive=BY_CURRENT)
    time, out = simulated(body, extra, 4 * np.pi, 2e-4, mode=LOCKED,
                          command=lambda t: np.sin(omega * t))  # fmt: skip
    late = time > 2 * np.pi
    sines = np.column_stack([np.sin(omega * time[late]), np.cos(omega * time[late])])
    turn, torque = (np.linalg.lstsq(sines, out[late, j], rcond=None)[0] for j in (0, 5))
    found = complex(*torque) / complex(*turn)
    wanted = body.stiffness + share * 1j * omega * decay / (1.0 + 1j * omega * decay)
    assert found == pytest.approx(wanted, rel=2e-3)


def test_stops_keep_a_loop_as_wide_as_twice_their_torque():
    extra = Extra(stop_stiffness=np.r_[50.0, np.zeros(5)], stop_torque=np.r_[0.2, np.ones(5)])
    body = SEA._replace(inductance=0.0, motor_viscous=1e-3)
    _, out = simulated(body, extra, 8.0, 2e-4, mode=LOCKED,
                       command=lambda t: 0.03 * np.sin(2 * np.pi * 0.5 * t))  # fmt: skip
    loop = out[20000:, 5] - body.stiffness * out[20000:, 0]
    assert np.ptp(loop) == pytest.approx(0.4, rel=1e-3)


def test_the_winding_warms_to_power_times_resistance_to_the_air():
    extra = Extra(winding_capacity=0.05, case_capacity=0.05, winding_to_case=1.0, case_to_air=2.0)
    body = SEA._replace(inductance=0.0, emf_constant=0.0)
    _, out = simulated(body, extra, 2.0, 5e-4, mode=LOCKED,
                       command=lambda t: np.full(t.size, 0.05))  # fmt: skip
    amps = 0.05 * 48.0 / 3.0
    assert out[-1, 6] == pytest.approx(2.0 * 3.0 * amps**2, rel=0.01)


def test_feedback_replayed_from_its_log_moves_the_machine_the_same():
    step, n = 1e-4, 5000
    loop = Loop(proportional=20.0, derivative=400.0, limit=1.0, tick=10)
    target = np.full(n, 0.2)
    out, commanded = run(SEA, Extra(), loop, SWINGING, step, np.concatenate([target, np.zeros(n)]),
                    np.zeros(n), Start())  # fmt: skip
    again, _ = run(SEA, Extra(), Loop(), SWINGING, step, commanded, np.zeros(n), Start())
    assert np.array_equal(out, again)
    assert out[-1, 0] == pytest.approx(0.2, abs=0.02)
