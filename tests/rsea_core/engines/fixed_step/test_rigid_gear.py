"""Load-dependent friction on a machine without spring agrees with its closed form."""

import numpy as np
import pytest

import rsea_core.effects.layout as e
from rsea_core.engines.fixed_step.replay import CHANNELS, Replay
from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel

MOTOR, LEVER, WEIGHT = 0.02, 0.05, 1.5  # kgm2, kgm2, Nm of a constant load
RIG = Rig(
    name="lever", parts=("drive", "gear", "load"), torque_constant_Nm_per_A=1.0,
    current_limit_A=100.0, gear_ratio=1.0, motor_inertia_kgm2=MOTOR, output_inertia_kgm2=0.0,
    load_inertia_kgm2=LEVER, load_viscous_Nms_per_rad=0.0, motor_viscous_Nms_per_rad=0.0,
)  # fmt: skip


def run(torque, *, drive_loss, back_loss, load=-WEIGHT, coulomb=0.0, seconds=0.5, speed=0.0):
    """Rows of a constant motor torque against a constant load."""
    t = np.arange(0.0, seconds, 1e-3)
    replay = Replay(
        time_s=t, command_name="current_command_A", command=np.full(t.size, torque),
        load=Load(kind="constant-torque", load_torque_Nm=load), step_s=1e-3,
    )  # fmt: skip
    numbers = replay.numbers(ActuatorModel(RIG))
    fx = numbers.fx.copy()
    fx[[e.ANY, e.WHEEL_DRY]] = 1.0
    fx[e.GEAR_DRIVE_LOSS], fx[e.GEAR_BACKDRIVE_LOSS] = drive_loss, back_loss
    fx[e.GEAR_FORWARD] = fx[e.GEAR_BACKWARD] = coulomb
    start = replay.start_state(numbers)
    start[[2, 4, 6, 8]] = speed
    return t, replay.run(numbers._replace(fx=fx), start=start)


def acceleration(t, rows):
    """Of the load, by its speed's straight line."""
    return float(np.polyfit(t, rows[:, CHANNELS.index("load_velocity_rad_per_s")], 1)[0])


@pytest.mark.parametrize("loss", [0.2, 0.8, 3.0])
def test_lifting_accelerates_with_load_and_its_inertia_counted_by_the_efficiency(loss):
    # (J_m + J_l (1 + mu)) a = tau - (1 + mu) W: transmitted torque W + J_l a, loss mu of it
    torque = (1.0 + loss) * WEIGHT + 2.0
    t, rows = run(torque, drive_loss=loss, back_loss=0.1)
    expected = 2.0 / (MOTOR + LEVER * (1.0 + loss))
    assert acceleration(t, rows) == pytest.approx(expected, rel=1e-9)
    joint = rows[-1, CHANNELS.index("torque_Nm")]
    assert joint == pytest.approx(WEIGHT + LEVER * expected, rel=1e-9)


@pytest.mark.parametrize("loss", [0.3, 0.9])
def test_lowering_lets_the_load_drive_by_the_backdriving_efficiency(loss):
    # the load pulls down (motion negative), the motor holds back by less than it takes
    torque = 0.5 * (1.0 - loss) * WEIGHT
    t, rows = run(torque, drive_loss=0.3, back_loss=loss, speed=-0.1)
    expected = (torque - (1.0 - loss) * WEIGHT) / (MOTOR + LEVER * (1.0 - loss))
    assert acceleration(t, rows) == pytest.approx(expected, rel=1e-9)


def test_steady_lift_and_lower_torques_have_the_ratio_of_the_efficiencies():
    drive, back = 0.6, 0.45  # efficiencies
    losses = {"drive_loss": 1.0 / drive - 1.0, "back_loss": 1.0 - back}
    for torque, speed in ((WEIGHT / drive, 0.4), (back * WEIGHT, -0.4)):
        t, rows = run(torque, speed=speed, **losses)
        assert acceleration(t, rows) == pytest.approx(0.0, abs=1e-9)
    assert (WEIGHT / drive) / (back * WEIGHT) == pytest.approx(1.0 / (drive * back))


@pytest.mark.parametrize(("torque", "moves"), [(2.35, 0), (2.45, 1), (0.95, 0), (0.85, -1)])
def test_at_rest_the_gear_holds_within_its_losses(torque, moves):
    # up: tau > (1 + 0.5) W + F = 2.4; down: tau < (1 - 0.3) W - F = 0.9
    _, rows = run(torque, drive_loss=0.5, back_loss=0.3, coulomb=0.15, seconds=0.1)
    assert np.sign(rows[-1, CHANNELS.index("load_velocity_rad_per_s")]) == moves


def test_a_self_locking_gear_stops_a_lowering_load_and_holds_it():
    _, rows = run(0.0, drive_loss=0.5, back_loss=1.2, speed=-0.5)
    speed = rows[:, CHANNELS.index("load_velocity_rad_per_s")]
    assert speed[0] == -0.5
    assert np.all(speed[-100:] == 0.0)
    assert np.all(np.diff(rows[-100:, CHANNELS.index("load_angle_rad")]) == 0.0)


def test_a_body_without_losses_moves_as_before():
    t, rows = run(2.0, drive_loss=0.0, back_loss=0.0)
    assert acceleration(t, rows) == pytest.approx((2.0 - WEIGHT) / (MOTOR + LEVER), rel=1e-9)


def test_viscous_friction_by_direction_sets_both_end_speeds():
    # current 1 against B + skew forward and B - skew backward
    t = np.arange(0.0, 4.0, 1e-3)
    for sign in (1.0, -1.0):
        replay = Replay(
            time_s=t, command_name="current_command_A", command=np.full(t.size, sign),
            load=Load(kind="free"), step_s=1e-3,
        )  # fmt: skip
        numbers = replay.numbers(ActuatorModel(RIG))
        fx = numbers.fx.copy()
        fx[e.ANY], fx[e.GEAR_VISCOUS], fx[e.VISCOUS_SKEW] = 1.0, 0.5, 0.2
        rows = replay.run(numbers._replace(fx=fx))
        speed = rows[-1, CHANNELS.index("load_velocity_rad_per_s")]
        assert speed == pytest.approx(sign / (0.5 + 0.2 * sign), rel=1e-6)
