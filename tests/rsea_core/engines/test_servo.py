"""A servo of gains k_p, k_d turns its load as its linear equation says, in all three engines.

Its torque limit, dead band, delay and the goal's rate act as they are stated.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim

from rsea_core.effects.registry import LoadFriction
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.simulation.simulate import simulate
from rsea_core.simulation.simulate_fast import simulate_stepping

TIME = np.arange(600) * 2e-3
SQUARE = 0.3 * np.sign(np.sin(3.0 * np.pi * (TIME + 1e-4)))
FREE = Load(kind="free")
RIG = Rig(
    name="servo", parts=("drive", "load"), servo="angle", servo_proportional_Nm_per_rad=20.0,
    servo_derivative_Nms_per_rad=0.8, load_inertia_kgm2=0.03,
)  # fmt: skip
COULOMB = (LoadFriction(coulomb_Nm=0.5),)
ENGINES = ("piecewise-linear", "event-driven", "fixed")


def turned(rig, *terms, goal=SQUARE, engine="fixed", step_s=1e-4, load=FREE) -> np.ndarray:
    inputs = Inputs(time_s=TIME, position_command_rad=goal, load=load)
    model = ActuatorModel(rig, terms)
    if engine == "fixed":
        return simulate_stepping(model, inputs, step_s=step_s).load_angle_rad
    return simulate(model, inputs, engine=engine).load_angle_rad


@pytest.mark.parametrize("engine", ENGINES)
def test_a_pd_servo_follows_steps_as_its_transfer_function(engine):
    _, expected, _ = lsim(([20.0], [0.03, 0.8, 20.0]), SQUARE, TIME, interp=False)
    within = 1e-9 if engine != "fixed" else 2e-5
    assert turned(RIG, engine=engine) == pytest.approx(expected, abs=within)


@pytest.mark.parametrize(
    ("rig", "terms"),
    [(RIG, COULOMB), (replace(RIG, servo_torque_limit_Nm=2.0), COULOMB),
     (replace(RIG, servo_delay_s=0.0113), ())],
    ids=["dry friction", "torque limit", "delay"],
)  # fmt: skip
def test_the_engines_agree(rig, terms):
    exact = turned(rig, *terms, engine="piecewise-linear")
    assert turned(rig, *terms, engine="event-driven") == pytest.approx(exact, abs=1e-9)
    coarse, fine = (np.abs(turned(rig, *terms, step_s=step) - exact).max() for step in (4e-4, 1e-4))
    assert fine < 1e-4
    assert fine < 0.6 * coarse


def test_the_gain_on_the_angle_is_stable_at_any_step():
    stiff = replace(RIG, servo_proportional_Nm_per_rad=2e5, servo_derivative_Nms_per_rad=8e3)
    expected = turned(stiff, engine="piecewise-linear")
    assert turned(stiff, step_s=2e-3) == pytest.approx(expected, abs=0.1)


def test_dry_friction_over_the_gain_is_the_band_in_which_it_stands():
    goal = np.full(TIME.size, 0.02)  # 0.4 Nm, below the friction
    assert np.all(turned(RIG, *COULOMB, goal=goal) == 0.0)
    assert turned(RIG, *COULOMB, goal=2.0 * goal)[-1] > 0.01


def test_a_dead_band_lets_the_servo_rest_near_its_goal():
    rig = replace(RIG, servo_dead_band_rad=0.03)
    for engine in ("fixed", "event-driven"):
        rest = turned(rig, goal=np.full(TIME.size, 0.3), engine=engine)[-1]
        assert 0.01 < abs(rest - 0.3) <= 0.03
    smooth = turned(rig, engine="event-driven")
    assert turned(rig) == pytest.approx(smooth, abs=2e-4)


def test_a_late_goal_is_held_at_its_first_value_before():
    rig = replace(RIG, servo_delay_s=0.05)
    goal = np.where(TIME < 0.02, 0.0, 0.2)
    angle = turned(rig, goal=goal)
    assert np.all(angle[TIME < 0.07] == 0.0)
    assert angle[-1] == pytest.approx(0.2, abs=1e-3)


@pytest.mark.parametrize("engine", ENGINES)
def test_with_the_goals_rate_a_ramp_is_followed_without_lag(engine):
    rig = replace(RIG, servo="angle-and-rate")
    ramp = 0.5 * TIME
    assert turned(rig, goal=ramp, engine=engine)[-1] == pytest.approx(ramp[-1], abs=1.5e-3)
    lag = 0.5 * 0.8 / 20.0
    assert turned(RIG, goal=ramp, engine=engine)[-1] == pytest.approx(ramp[-1] - lag, abs=1.5e-3)


def test_the_equations_are_printed_with_gains_and_limit():
    rig = replace(RIG, servo_torque_limit_Nm=2.0)
    text = ActuatorModel(rig).describe("position_command_rad", FREE)
    assert "tau_drive = k_p e - k_d w_w,  e = position_command_rad - theta_w" in text
    assert "|tau_drive| <= 2 Nm" in text
