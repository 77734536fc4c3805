"""The friction of a worm on a rigid load follows the torque that it transmits."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rsea_core import ActuatorModel, Inputs, Load, Rig, simulate
from rsea_core.effects import GearFriction, GearLoadFriction
from rsea_core.errors import TermError
from rsea_core.simulation.simulate_fast import simulate_stepping

RIG = replace(
    Rig.preset("rsea-bench"),
    parts=("drive", "gear", "load"),
    spring_stiffness_Nm_per_rad=None,
    load_mass_kg=2.0,
    load_inertia_kgm2=0.4,
    current_limit_A=None,
)
N, K_T, R, L, V = 60.0, 60.0 * 0.3056, 3.78, 4.56e-3, 48.0
J, B = N**2 * 3.2e-4 + 2e-3, N**2 * 1e-4 + 0.02
MGD = 2.0 * 9.80665 * 0.3
TIME = 1e-3 * np.arange(801)


def worm(lead, friction):
    """The term with its losses driving and back-driven."""
    term = GearLoadFriction(lead_angle_rad=lead, friction_coefficient=friction)
    angle = np.arctan(friction)
    return (
        term,
        np.tan(lead + angle) / np.tan(lead) - 1.0,
        1.0 - np.tan(lead - angle) / np.tan(lead),
    )


def exact(drive, back, dry, duty, start):
    """(rows, 3) of current, angle, speed with located stops, sign of the torque solved for."""

    def given(y):
        return K_T * y[0] - B * y[2], -MGD * np.sin(y[1]) - 0.02 * y[2]

    def moving(t, y, u, sense):
        wheel, load = given(y)
        wheel -= sense * dry
        sign = 1.0 if 0.4 * wheel - J * load > 0.0 else -1.0
        share = 1.0 + drive if sense * sign > 0.0 else 1.0 - back
        rate = (wheel + share * load) / (J + share * 0.4)
        return [(u * V - R * y[0] - K_T * y[2]) / L, y[2], rate]

    def resting(t, y, u, sense):
        return [(u * V - R * y[0]) / L, 0.0, 0.0]

    def excess(t, y, u, sense):
        wheel, load = given(y)
        net = wheel + load
        loss = drive if net * -load > 0.0 else back
        return abs(net) - dry - loss * abs(load)

    def stop(t, y, u, sense):
        return sense * y[2]

    excess.terminal = stop.terminal = True
    excess.direction, stop.direction = 1.0, -1.0
    y, sense, found = np.array([0.0, start, 0.0]), 0.0, []
    for row in range(TIME.size):
        found.append(y)
        t, u = TIME[row], duty[row]
        if row + 1 == TIME.size:
            break
        while t < TIME[row + 1]:
            if sense == 0.0 and excess(t, y, u, sense) > 0.0:
                sense = float(np.sign(sum(given(y))))
            law, event = (moving, stop) if sense else (resting, excess)
            done = solve_ivp(
                law, (t, TIME[row + 1]), y, method="DOP853", rtol=1e-9, atol=1e-11,
                args=(u, sense), events=event,
            )  # fmt: skip
            t, y = done.t[-1], done.y[:, -1].copy()
            if done.status == 1:
                sense = 0.0 if sense else float(np.sign(sum(given(y))))
                y[2] = 0.0
    return np.array(found)


@pytest.mark.parametrize(("lead", "friction"), [(0.12, 0.05), (0.07, 0.075)])
def test_rigid_worm_agrees_with_scipy_driving_and_back_driven(lead, friction):
    term, drive, back = worm(lead, friction)
    assert (back > 1.0) == (lead < 0.1)
    duty = np.round(0.35 * np.sin(9.0 * TIME) + 0.1 * np.sin(25.0 * TIME), 3)
    inputs = Inputs(time_s=TIME, duty=duty, load=Load(),
                    initial_motor_angle_rad=60.0 * 0.6, initial_load_angle_rad=0.6)  # fmt: skip
    model = ActuatorModel(RIG, (term, GearFriction(coulomb_Nm=0.5 / 60.0)))
    found = simulate(model, inputs)
    wanted = exact(drive, back, 0.5, duty, 0.6)
    assert np.ptp(wanted[:, 1]) > 0.1
    np.testing.assert_allclose(found.load_angle_rad, wanted[:, 1], atol=1e-7)
    assert np.abs(found.energy.imbalance_J()).max() < 1e-7
    assert np.diff(found.energy.gear_friction_J).min() >= -1e-12
    fast = simulate_stepping(model, inputs, step_s=2.5e-4)
    assert np.abs(fast.load_angle_rad - wanted[:, 1]).max() < 0.1 * 2.0 * np.pi / 8192


def test_self_locking_worm_holds_a_rigid_load_without_current_for_ever():
    term, _, back = worm(0.07, 0.075)
    assert back > 1.0
    still = Inputs(time_s=0.1 * np.arange(50), duty=np.zeros(50), load=Load(),
                   initial_motor_angle_rad=60.0, initial_load_angle_rad=1.0)  # fmt: skip
    found = simulate(ActuatorModel(RIG, (term,)), still)
    assert (found.load_angle_rad == 1.0).all()


def test_a_worm_that_would_jam_is_refused_in_a_line():
    term, _, _ = worm(0.02, 0.3)
    heavy = replace(RIG, load_inertia_kgm2=5.0)
    with pytest.raises(TermError, match="jams under a rigid load of 5 kg m"):
        ActuatorModel(heavy, (term,)).effects("duty", Load())
