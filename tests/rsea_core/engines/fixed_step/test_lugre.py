"""LuGre bristles with micro-damping agree with scipy, and the damping creates no energy."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import rsea_core.engines.fixed_step.body_steps as b
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.recordings.case import Case
from tests.cases.planted import RIG, recording


@dataclass(frozen=True, kw_only=True)
class Body:
    """On bristles in SI units, pushed by waves of (torque, frequency)."""

    inertia: float
    drag: float
    level: float
    deflection: float
    micro: float
    sines: tuple[tuple[float, float], ...]

    @property
    def stiffness(self) -> float:
        return self.level / self.deflection

    @property
    def friction(self) -> b.Friction:
        return b.Friction(0.0, 0.0, 0.0, 0.0, self.level, self.stiffness, -self.deflection)

    def applied_torque(self, t: float) -> float:
        return sum(torque * np.sin(2 * np.pi * f * t) for torque, f in self.sines)


LOAD = Body(
    inertia=0.034,
    drag=0.03,
    level=0.15,
    deflection=5e-4,
    micro=1.2,
    sines=((0.25, 0.8), (0.1, 3.1)),
)  # slides through most of each swing, turns back twice in it
MOTOR = Body(
    inertia=3e-4, drag=1e-4, level=0.02, deflection=1.5e-3, micro=0.03, sines=((0.06, 12.0),)
)  # turns back within about the way of a step


def stepped(body: Body, h: float, end_s: float) -> np.ndarray:
    """Speed by the fixed-step engine's laws, one row a step, as the kernel does."""
    speed, deflection, rate, speeds = 0.0, 0.0, 0.0, [0.0]
    for k in range(round(end_s / h)):
        foreseen = h * (speed + 0.5 * h * rate)
        drag = body.drag + body.micro * b.bristle_share(body.friction, deflection, foreseen)
        middle = body.applied_torque((k + 0.5) * h)
        felt = b.Body(body.inertia, drag, middle)
        after, _, deflection = b.body_step(felt, body.friction, deflection, speed, h)
        speed, rate = after, (after - speed) / h
        speeds.append(speed)
    return np.array(speeds)


def exact(body: Body, end_s: float, times: np.ndarray) -> np.ndarray:
    """dz/dt = w - |w| z / z_s; torque sigma_0 z + sigma_1 dz/dt (Canudas de Wit et al. 1995)."""

    def rates(t, y):
        speed, z = y
        rate = speed - abs(speed) * z / body.deflection
        torque = body.applied_torque(t) - body.stiffness * z - body.micro * rate - body.drag * speed
        return [torque / body.inertia, rate]

    options = {"method": "LSODA", "rtol": 1e-8, "atol": 1e-11, "max_step": 1e-3}
    return solve_ivp(rates, (0.0, end_s), [0.0, 0.0], t_eval=times, **options).y[0]


@pytest.mark.parametrize("body", [LOAD, MOTOR], ids=["load", "motor"])
def test_a_body_on_damped_bristles_moves_as_integrated(body):
    end = 1.0
    errors = []
    for h in (1e-3, 2.5e-4):
        found = stepped(body, h, end)
        times = np.linspace(0.0, end, found.size)
        true = exact(body, end, times)
        errors.append(np.sqrt(np.mean((found - true) ** 2)) / np.std(true))
    felt = np.std(exact(replace(body, micro=0.0), end, times) - true) / np.std(true)
    assert errors[0] < 0.05 * felt, "at the fixed-step engine's own step"
    assert errors[1] < 0.4 * errors[0], "and the better the shorter the step"


@given(deflection=st.floats(-1.0, 1.0), travel=st.floats(-5e-3, 5e-3))
def test_micro_damping_takes_what_the_bristles_deflect_and_no_more(deflection, travel):
    """Its impulse is sigma_1 times the change of their stretch."""
    share = b.bristle_share(LOAD.friction, deflection * LOAD.deflection, travel)
    assert 0.0 <= share <= 2.0
    end = np.copysign(LOAD.deflection, travel)
    begun = deflection * LOAD.deflection
    deflected = (end - begun) * -np.expm1(-abs(travel) / LOAD.deflection)
    assert share * travel == pytest.approx(deflected, rel=1e-6, abs=1e-12)
    assert b.bristle_share(LOAD.friction, np.sign(travel) * LOAD.deflection, travel) == (
        0.0 if travel else 1.0
    )
    assert b.bristle_share(b.NO_FRICTION, begun, travel) == 0.0


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
        x = problem.start(hypothesis, [tuple(values[parameter.name] for parameter in law.unknowns)])
        made = problem.predict(problem.fitted[0], hypothesis, x[None])[0]
        found.append(made[:, problem.fitted[0].channels.index("current_A")])
    true = locked_current(r["time_s"], r["duty"], bristles)[: len(found[0])]
    errors = [np.sqrt(np.mean((current - true) ** 2)) / np.ptp(true) for current in found]
    assert errors[0] < 1e-4, "at the fixed-step engine's own step"
    assert errors[1] > 5.0 * errors[0], "the damping is felt"


def locked_current(t: np.ndarray, duty: np.ndarray, law: dict[str, float]) -> np.ndarray:
    """Current [A] of the planted machine, its output held, by scipy; the duty steps."""
    ratio, deflection = RIG.gear_ratio, law["bristle_rad"]
    inertia = RIG.motor_inertia_kgm2 + RIG.output_inertia_kgm2 / ratio**2
    damping = RIG.motor_viscous_Nms_per_rad + RIG.output_viscous_Nms_per_rad / ratio**2
    spring = RIG.spring_stiffness_Nm_per_rad / ratio**2

    def rates(_, y, volts):
        current, angle, speed, z = y
        rate = speed - abs(speed) * z / deflection
        torque = RIG.torque_constant_Nm_per_A * current - spring * angle - damping * speed
        torque -= law["coulomb_Nm"] * z / deflection + law["bristle_damping_Nms_per_rad"] * rate
        fall = RIG.terminal_resistance_ohm * current + RIG.back_emf_constant_Vs_per_rad * speed
        return [(volts - fall) / RIG.terminal_inductance_H, speed, torque / inertia, rate]

    y, currents = np.zeros(4), [0.0]
    for k in range(t.size - 1):
        span, volts = (t[k], t[k + 1]), RIG.supply_voltage_V * duty[k]
        options = {"method": "LSODA", "rtol": 1e-7, "atol": 1e-10, "args": (volts,)}
        y = solve_ivp(rates, span, y, **options).y[:, -1]
        currents.append(y[0])
    return np.array(currents)
