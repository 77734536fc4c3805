"""LuGre's bristles with micro-damping against scipy, and what the damping may do."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import rsea_core.step_laws as s
from rsea_core.case import Case
from rsea_core.identify.catalogue import catalogue
from rsea_core.identify.problem import Hypothesis, Problem
from tests.verification.test_core_innovations import RIG, recording

INERTIA, DRAG, LEVEL, STRETCH, MICRO = 0.034, 0.03, 0.15, 5e-4, 1.2  # SI; a load's joint
STIFFNESS = LEVEL / STRETCH


def push(t):
    """Slides through most of each swing, turns back twice in it [Nm]."""
    return 0.25 * np.sin(2 * np.pi * 0.8 * t) + 0.1 * np.sin(2 * np.pi * 3.1 * t)


def stepped(h: float, end_s: float) -> np.ndarray:
    """Angle by the fast engine's laws, one row a step."""
    friction = (0.0, 0.0, 0.0, 0.0, LEVEL, STIFFNESS, -STRETCH)
    speed, angle, stretch, angles = 0.0, 0.0, 0.0, [0.0]
    for k in range(round(end_s / h)):
        drag = DRAG + MICRO * s.bending(friction, stretch, speed)
        middle = push((k + 0.5) * h)
        speed, way, stretch = s.move(INERTIA, drag, middle, friction, stretch, speed, h)
        angle += way
        angles.append(angle)
    return np.array(angles)


def exact(end_s: float, times: np.ndarray) -> np.ndarray:
    """dz/dt = w - |w| z / z_s; torque sigma_0 z + sigma_1 dz/dt (Canudas de Wit et al. 1995)."""

    def rates(t, y):
        _, speed, z = y
        rate = speed - abs(speed) * z / STRETCH
        torque = push(t) - STIFFNESS * z - MICRO * rate - DRAG * speed
        return [speed, torque / INERTIA, rate]

    options = {"method": "LSODA", "rtol": 1e-9, "atol": 1e-12, "max_step": 1e-3}
    return solve_ivp(rates, (0.0, end_s), [0.0, 0.0, 0.0], t_eval=times, **options).y[0]


def test_a_body_on_damped_bristles_moves_as_integrated():
    end = 3.0
    errors = []
    for h in (1e-3, 2.5e-4):
        found = stepped(h, end)
        true = exact(end, np.linspace(0.0, end, found.size))
        errors.append(np.sqrt(np.mean((found - true) ** 2)) / np.ptp(true))
    assert errors[0] < 0.01, "at the fast engine's own step"
    assert errors[1] < 0.4 * errors[0], "and the better the shorter the step"


@given(stretch=st.floats(-1.0, 1.0), speed=st.floats(-5.0, 5.0))
def test_micro_damping_takes_energy_and_ends_where_all_bristles_slide(stretch, speed):
    friction = (0.0, 0.0, 0.0, 0.0, LEVEL, STIFFNESS, -STRETCH)
    share = s.bending(friction, stretch * STRETCH, speed)
    assert 0.0 <= share <= 2.0
    if speed > 0.0:
        assert share == pytest.approx(1.0 - stretch, abs=1e-12)
        assert s.bending(friction, STRETCH, speed) == pytest.approx(0.0, abs=1e-12)
    assert s.bending((0.0,) * 7, stretch * STRETCH, speed) == 0.0


def test_the_gear_moves_on_damped_bristles_as_integrated(tmp_path):
    """A whole locked machine under its duty, with the law's values as a diagnosis names them."""
    bristles = {
        "coulomb_Nm": 0.02, "stribeck_rise": 0.0, "stribeck_velocity_rad_per_s": 2.0,
        "bristle_rad": 2e-3, "asymmetry": 0.0, "bristle_damping_Nms_per_rad": 0.03,
    }  # fmt: skip
    r = recording((), "locked", "locked.csv", 1)
    problem = Problem(Case(name="one", folder=tmp_path, rig=RIG, recordings=(r,)), step_s=1e-3)
    law = catalogue(problem.case)["gear-friction/bristles"]
    hypothesis = Hypothesis(laws=(law,))
    found = []
    for damping in (bristles["bristle_damping_Nms_per_rad"], 0.0):
        values = {**bristles, "bristle_damping_Nms_per_rad": damping}
        x = problem.start(hypothesis, [tuple(values[knob.name] for knob in law.knobs)])
        made = problem.predict(problem.fitted[0], hypothesis, x[None])[0]
        found.append(made[:, problem.fitted[0].channels.index("current_A")])
    true = locked_current(r["time_s"], r["duty"], bristles)[: len(found[0])]
    errors = [np.sqrt(np.mean((current - true) ** 2)) / np.ptp(true) for current in found]
    assert errors[0] < 1e-4, "at the fast engine's own step"
    assert errors[1] > 5.0 * errors[0], "the damping is felt"


def locked_current(t: np.ndarray, duty: np.ndarray, law: dict[str, float]) -> np.ndarray:
    """Current [A] of the planted machine, its output held, by scipy; the duty steps."""
    ratio, stretch = RIG.gear_ratio, law["bristle_rad"]
    inertia = RIG.motor_inertia_kgm2 + RIG.output_inertia_kgm2 / ratio**2
    damping = RIG.motor_viscous_Nms_per_rad + RIG.output_viscous_Nms_per_rad / ratio**2
    spring = RIG.spring_stiffness_Nm_per_rad / ratio**2

    def rates(_, y, volts):
        current, angle, speed, z = y
        rate = speed - abs(speed) * z / stretch
        torque = RIG.torque_constant_Nm_per_A * current - spring * angle - damping * speed
        torque -= law["coulomb_Nm"] * z / stretch + law["bristle_damping_Nms_per_rad"] * rate
        fall = RIG.terminal_resistance_ohm * current + RIG.back_emf_constant_Vs_per_rad * speed
        return [(volts - fall) / RIG.terminal_inductance_H, speed, torque / inertia, rate]

    y, currents = np.zeros(4), [0.0]
    for k in range(t.size - 1):
        span, volts = (t[k], t[k + 1]), RIG.supply_voltage_V * duty[k]
        options = {"method": "LSODA", "rtol": 1e-7, "atol": 1e-10, "args": (volts,)}
        y = solve_ivp(rates, span, y, **options).y[:, -1]
        currents.append(y[0])
    return np.array(currents)
