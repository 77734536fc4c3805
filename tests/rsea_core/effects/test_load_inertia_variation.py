"""The inertia of a load that varies with its angle, in both engines: Lagrange's equation."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rsea_core import ActuatorModel, Inputs, Load, Replay, simulate
from rsea_core.effects.load_inertia_variation import LoadInertiaVariation
from rsea_core.errors import TermError
from tests.cases.one_axis import axis_rig
from tests.cases.planted import RIG

TERM = LoadInertiaVariation(cosine_share=0.3, sine_share=-0.2, cycles_per_rev=2.0)
ROW_s = 0.01
TIME_s = ROW_s * np.arange(400)
CURRENT_A = 1.2 * np.sin(2.0 * np.pi * 0.8 * TIME_s) + 0.8 * np.cos(2.0 * np.pi * 0.31 * TIME_s)


def lagrange() -> np.ndarray:
    """Angle (n,) of a rigid axis with that inertia, by DOP853 with the command held."""
    rig = axis_rig()

    def rates(_, y, torque):
        angle, speed = y
        cosine, sine = np.cos(2.0 * angle), np.sin(2.0 * angle)
        wave, slope = 0.3 * cosine - 0.2 * sine, 2.0 * (-0.2 * cosine - 0.3 * sine)
        inertia = rig.motor_inertia_kgm2 + rig.load_inertia_kgm2 * (1.0 + wave)
        lost = rig.load_viscous_Nms_per_rad * speed
        lost += 0.5 * rig.load_inertia_kgm2 * slope * speed**2
        return speed, (torque - lost) / inertia

    states = [np.zeros(2)]
    for current in CURRENT_A[:-1]:
        torque = (rig.torque_constant_Nm_per_A * current,)
        piece = solve_ivp(rates, (0.0, ROW_s), states[-1], "DOP853", args=torque,
                          rtol=1e-11, atol=1e-12)  # fmt: skip
        states.append(piece.y[:, -1])
    return np.array(states)[:, 0]


def test_both_engines_agree_with_lagranges_equation_of_a_rigid_axis():
    model = ActuatorModel(axis_rig(), (TERM,))
    inputs = Inputs(time_s=TIME_s, current_command_A=CURRENT_A, load=Load(kind="free"))
    expected = lagrange()
    without = simulate(ActuatorModel(axis_rig()), inputs).motor_angle_rad
    assert np.max(np.abs(without - expected)) > 1.0  # rad
    exact = simulate(model, inputs).motor_angle_rad
    np.testing.assert_allclose(exact, expected, rtol=0.0, atol=1e-6)
    coarse, fine = (
        np.max(np.abs(Replay.of(inputs, step_s=h).run(model)[:, 0] - expected))
        for h in (2e-3, 5e-4)
    )
    assert coarse < 1e-2
    assert fine < coarse / 8.0  # of second order


def test_energy_is_kept_behind_a_spring():
    duty = 0.3 * np.sin(7.0 * TIME_s)
    inputs = Inputs(time_s=TIME_s, duty=duty, load=Load(kind="pendulum"))
    plain, varying = (simulate(ActuatorModel(RIG, terms), inputs) for terms in ((), (TERM,)))
    assert np.ptp(varying.load_angle_rad - plain.load_angle_rad) > 5e-3
    for run in (plain, varying):
        error = run.energy.imbalance_J()
        assert np.max(np.abs(error)) < 1e-6 * np.max(run.energy.supplied_J)


def test_more_than_two_thirds_in_one_part_is_refused():
    with pytest.raises(TermError, match="cosine_share"):
        LoadInertiaVariation(cosine_share=0.9)


def test_the_step_follows_the_smallest_inertia_of_the_load():
    """A load that is thirty times as light in some positions, on a stiff spring."""
    light = LoadInertiaVariation(cosine_share=0.66, sine_share=0.66, cycles_per_rev=4.0)
    model = ActuatorModel(RIG, (light,))
    inputs = Inputs(time_s=TIME_s, duty=0.5 * np.sin(5.0 * TIME_s), load=Load(kind="pendulum"))
    run = simulate(model, inputs)
    finer = simulate(model, inputs, step_s=2e-5)
    np.testing.assert_allclose(run.load_angle_rad, finer.load_angle_rad, rtol=0.0, atol=1e-6)
    assert np.max(np.abs(run.energy.imbalance_J())) < 1e-6 * np.max(run.energy.supplied_J)
