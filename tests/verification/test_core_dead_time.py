"""A bridge's dead time in the fast engine, against scipy on the same equations."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import rsea_core.effects as e
import rsea_core.quantities as q
from rsea_core.inputs import Inputs, Load
from rsea_core.model import ActuatorModel
from rsea_core.replay import Replay
from rsea_core.rig import Rig


def test_dead_time_agrees_with_scipy():
    rig = Rig.preset("rsea-bench")
    t = 0.001 * np.arange(300)
    duty = 0.1 * np.sin(2 * np.pi * 3.0 * t)
    inputs = Inputs(time_s=t, duty=duty, load=Load(kind="locked"))
    replay = Replay.of(inputs, step_s=1.25e-4)
    numbers = replay.numbers(ActuatorModel(rig))
    numbers.fx[e.DEAD_TIME], numbers.fx[e.DEAD_TIME_CURRENT] = 0.01, 0.05
    out = replay.run(numbers)

    N, L, R = rig.gear_ratio, rig.terminal_inductance_H, rig.terminal_resistance_ohm
    J = q.impedance_to_output(rig.motor_inertia_kgm2, N) + (rig.output_inertia_kgm2 or 0.0)
    B = q.impedance_to_output(rig.motor_viscous_Nms_per_rad or 0.0, N)
    B += rig.output_viscous_Nms_per_rad or 0.0
    k_t, k_e = rig.torque_constant_Nm_per_A * N, rig.back_emf_constant_Vs_per_rad * N
    U, K = rig.supply_voltage_V, rig.spring_stiffness_Nm_per_rad

    def slope(time, y, u):
        current, angle, speed = y
        lost = 0.01 * U * np.tanh(current / 0.05)
        return [
            (u * U - lost - R * current - k_e * speed) / L,
            speed,
            (k_t * current - B * speed - K * angle) / J,
        ]

    y, states = np.zeros(3), [np.zeros(3)]
    for k in range(t.size - 1):
        span = (t[k], t[k + 1])
        y = solve_ivp(slope, span, y, args=(duty[k],), rtol=1e-8, atol=1e-10).y[:, -1]
        states.append(y)
    exact = np.array(states)
    assert np.ptp(exact[:, 0]) > 0.3
    assert out[:, 0] == pytest.approx(N * exact[:, 1], abs=2e-3 * np.ptp(N * exact[:, 1]))
    assert out[:, 3] == pytest.approx(exact[:, 0], abs=1e-2 * np.ptp(exact[:, 0]))
