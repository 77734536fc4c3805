"""Gear flanks that meet obey Newton's law of impact in both engines."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core import ActuatorModel, Inputs, Load, Rig, simulate
from rsea_core.effects import GearBacklash
from rsea_core.effects.layout import EFFECTS, N_EFFECTS
from rsea_core.engines.event_driven.flanks import after_impact
from rsea_core.simulation.simulate_fast import simulate_stepping

BENCH = replace(
    Rig.preset("rsea-bench"), motor_viscous_Nms_per_rad=0.0, output_viscous_Nms_per_rad=0.0
)
N, HALF, WHEEL = BENCH.gear_ratio, 0.01, 0.05
FRONT = N**2 * BENCH.motor_inertia_kgm2 + BENCH.output_inertia_kgm2 - WHEEL
REDUCED = FRONT * WHEEL / (FRONT + WHEEL)
TIME_s = np.linspace(0.0, 0.4, 401)
STEPS_s = (1e-3, 2.5e-4, 6.25e-5)


def with_backlash(rebound, **more):
    return ActuatorModel(BENCH, (GearBacklash(width_rad=2.0 * HALF, rebound=rebound, **more),))


def pushed(torque_Nm):
    return Inputs(
        time_s=TIME_s, motor_torque_Nm=np.full(TIME_s.size, torque_Nm), load=Load(kind="locked")
    )


@pytest.mark.parametrize("rebound", [0.0, 0.3, 0.6, 0.9])
def test_an_impact_takes_its_share_of_the_relative_energy_and_none_is_lost_besides(rebound):
    """Known: (1 - e^2) m v^2 / 2, m the reduced inertia, v from rest through half the play."""
    applied = 0.02
    model = with_backlash(rebound, wheel_inertia_kgm2=WHEEL)
    run = simulate(model, pushed(applied))
    along = applied * N / FRONT
    meet_s, fast = np.sqrt(2.0 * HALF / along), np.sqrt(2.0 * HALF * along)
    lost = run.energy.impact_loss_J
    first = int(np.searchsorted(TIME_s, meet_s))
    assert np.all(lost[:first] == 0.0)
    assert lost[first] == pytest.approx((1.0 - rebound**2) * 0.5 * REDUCED * fast**2, rel=1e-9)
    assert np.diff(lost).min() >= 0.0
    assert (np.count_nonzero(np.diff(lost)) > 1) == (rebound > 0.0)  # it bounces
    assert np.abs(run.energy.imbalance_J()).max() < 1e-9 * run.energy.supplied_J.max()
    gap = run.motor_angle_rad / N - run.wheel_angle_rad
    assert np.abs(gap).max() < HALF * (1.0 + 1e-12)
    # flat, the wheel bounces on the motor until it is in mesh; a spring takes it away again
    assert np.abs(gap[first:] - HALF).min() < 1e-9


@pytest.mark.parametrize("rebound", [0.3, 0.6])
def test_both_engines_bounce_alike_as_the_step_is_halved(rebound):
    model = with_backlash(rebound)
    duty = 0.25 * np.sin(8.0 * np.pi * TIME_s)
    inputs = Inputs(time_s=TIME_s, duty=duty, load=Load(kind="pendulum"))
    exact = simulate(model, inputs)
    plain = simulate(with_backlash(0.0), inputs)
    for name in ("motor_angle_rad", "wheel_angle_rad", "torque_Nm"):
        truth = getattr(exact, name)
        span = np.ptp(truth)
        apart = [
            np.abs(getattr(simulate_stepping(model, inputs, step_s=h), name) - truth).max() / span
            for h in STEPS_s
        ]
        assert apart[1] < 0.5 * apart[0]
        assert apart[2] < 0.25 * apart[1]  # at least first order
        assert apart[2] < 1e-5
        assert np.abs(getattr(plain, name) - truth).max() > 1e2 * apart[2] * span


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("drive", "back"), [(0.0, 0.0), (0.6, 0.5), (0.6, 1.4)])
@pytest.mark.parametrize(("before", "at"), [(1.0, 0.2), (0.3, -2.0), (-0.1, -1.0)])
def test_an_impact_through_a_worm_is_its_sum_over_small_impulses(side, drive, back, before, at):
    """The motor side gives the wheel's impulse and a share more, or less while it is driven."""
    front, behind, rebound = 1.2, 0.4, 0.5
    fx = np.zeros(N_EFFECTS)
    fx[EFFECTS.index("gear_drive_loss")] = drive
    fx[EFFECTS.index("gear_backdrive_loss")] = back
    parting = rebound * (before - at)
    found = after_impact(fx, front, behind, side * before, side * at, side, parting)
    motor, wheel, impulse = before, at, 1e-5
    while wheel - motor < parting:
        share = 1.0 + drive if motor > 0.0 else max(1.0 - back, 0.0)
        motor, wheel = motor - share * impulse / front, wheel + impulse / behind
    assert side * np.array(found) == pytest.approx([motor, wheel], abs=1e-4)
    assert side * (found[1] - found[0]) == pytest.approx(parting, abs=1e-12)
