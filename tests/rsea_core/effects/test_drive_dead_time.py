"""Both engines agree with scipy on the dead time of an inverter."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import rsea_core.machine.quantities as q
from rsea_core import simulate
from rsea_core.effects import DriveDeadTime
from rsea_core.engines.fixed_step.replay import Replay
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel

RIG = Rig.preset("rsea-bench")
TERM = DriveDeadTime(width_duty=0.01, crossover_A=0.05)
TIME = 0.001 * np.arange(300)
INPUTS = Inputs(time_s=TIME, duty=0.1 * np.sin(2 * np.pi * 3.0 * TIME), load=Load(kind="locked"))
N, L, R, K = 60.0, 4.56e-3, 3.78, 65.8
J = q.impedance_to_output(RIG.motor_inertia_kgm2, N) + RIG.output_inertia_kgm2
B = q.impedance_to_output(RIG.motor_viscous_Nms_per_rad, N) + RIG.output_viscous_Nms_per_rad
K_T, U = 0.3056 * N, 48.0


def lost(current):
    """Voltage that the dead time takes."""
    return 0.01 * U * np.tanh(current / 0.05)


def exact(slope, states, rtol):
    """(rows, states) by scipy, row by row."""
    y, found = np.zeros(states), [np.zeros(states)]
    for k in range(TIME.size - 1):
        span = TIME[k : k + 2]
        done = solve_ivp(
            slope, span, y, method="DOP853", args=(INPUTS.duty[k],), rtol=rtol, atol=1e-12
        )
        y = done.y[:, -1]
        found.append(y)
    return np.array(found)


def with_winding(time, y, u):
    current, angle, speed = y
    volts = u * U - lost(current) - R * current - K_T * speed
    return [volts / L, speed, (K_T * current - B * speed - K * angle) / J]


def current_at(volts):
    return brentq(lambda i: R * i + lost(i) - volts, -20.0, 20.0, xtol=1e-14)


def without_inductance(time, y, u):
    angle, speed = y
    current = current_at(u * U - K_T * speed)
    return [speed, (K_T * current - B * speed - K * angle) / J]


def test_dead_time_of_the_event_driven_engine_agrees_with_scipy_and_balances():
    found = simulate(ActuatorModel(RIG, (TERM,)), INPUTS)
    wanted = exact(with_winding, 3, 1e-10)
    assert np.ptp(wanted[:, 0]) > 0.3
    np.testing.assert_allclose(found.current_A, wanted[:, 0], atol=1e-7)
    np.testing.assert_allclose(found.motor_angle_rad, N * wanted[:, 1], atol=1e-7)
    assert np.abs(found.energy.imbalance_J()).max() < 1e-9


def test_dead_time_without_inductance_agrees_with_scipy():
    rig = replace(RIG, terminal_inductance_H=None)
    found = simulate(ActuatorModel(rig, (TERM,)), INPUTS)
    wanted = exact(without_inductance, 2, 1e-9)
    np.testing.assert_allclose(found.motor_angle_rad, N * wanted[:, 0], atol=1e-6)


def test_dead_time_of_the_fixed_step_engine_agrees_with_scipy():
    wanted = exact(with_winding, 3, 1e-8)
    out = Replay.of(INPUTS).run(ActuatorModel(RIG, (TERM,)))
    assert out[:, 0] / N == pytest.approx(wanted[:, 1], abs=0.1 * 2.0 * np.pi / 8192)
    assert out[:, 3] == pytest.approx(wanted[:, 0], abs=1e-2 * np.ptp(wanted[:, 0]))
