"""The transmission error of a gear whose train has no spring: kinematics alone."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core import ActuatorModel, Inputs, Load, simulate
from rsea_core.effects.gear_transmission_error import GearTransmissionError
from rsea_core.engines.fixed_step.replay import CHANNELS, Replay
from tests.cases.fixed_step import BENCH

TIME = np.arange(0.0, 1.0, 1e-3)
ERROR = GearTransmissionError(
    wheel_amplitude_rad=2e-3, wheel_phase_rad=0.4, worm_amplitude_rad=4e-4, offset_rad=1e-3
)
RIGID = ActuatorModel(replace(BENCH, parts=("drive", "gear", "load")), (ERROR,))
INPUTS = Inputs(time_s=TIME, duty=0.4 * np.sin(2 * np.pi * 1.5 * TIME), load=Load(kind="pendulum"))


def stated(wheel: np.ndarray) -> np.ndarray:
    """e(theta) - e(0) + offset of the class's docstring."""
    ratio = RIGID.rig.gear_ratio

    def sines(at):
        return 2e-3 * np.sin(at + 0.4) + 4e-4 * np.sin(ratio * at)

    return sines(wheel) - sines(0.0) + 1e-3


def simulated() -> dict[str, np.ndarray]:
    found = simulate(RIGID, INPUTS)
    return {name: getattr(found, name) for name in CHANNELS if name.endswith(("rad", "per_s"))}


def replayed() -> dict[str, np.ndarray]:
    rows = Replay.of(INPUTS).run(RIGID)
    return {name: rows[:, j] for j, name in enumerate(CHANNELS)}


@pytest.mark.parametrize("run", [simulated, replayed])
def test_the_load_is_where_the_wheel_is_and_the_error_more(run):
    rows = run()
    wheel = rows["motor_angle_rad"] / RIGID.rig.gear_ratio
    assert np.ptp(wheel) > 0.1
    np.testing.assert_allclose(rows["load_angle_rad"], wheel + stated(wheel), atol=1e-12)


@pytest.mark.parametrize("run", [simulated, replayed])
def test_the_load_s_speed_is_the_rate_of_its_angle(run):
    rows = run()
    wheel = rows["motor_angle_rad"] / RIGID.rig.gear_ratio
    slope = (stated(wheel + 1e-6) - stated(wheel - 1e-6)) / 2e-6
    speed = rows["motor_velocity_rad_per_s"] / RIGID.rig.gear_ratio
    np.testing.assert_allclose(rows["load_velocity_rad_per_s"], (1.0 + slope) * speed, atol=1e-9)


def test_the_error_moves_no_body():
    plain = replace(RIGID, terms=())
    with_error, without = (Replay.of(INPUTS).run(model) for model in (RIGID, plain))
    motor = CHANNELS.index("motor_angle_rad")
    np.testing.assert_array_equal(with_error[:, motor], without[:, motor])


def test_the_energy_of_a_rigid_train_balances_with_the_error():
    energy = simulate(RIGID, INPUTS).energy
    supplied = np.max(np.abs(energy.supplied_J))
    assert supplied > 0.1
    assert np.max(np.abs(energy.imbalance_J())) < 1e-9 * supplied


def test_the_largest_harmonics_are_the_amplitudes_reported():
    wave_generator = GearTransmissionError(
        wheel_amplitude_rad=5.5e-4, worm_amplitude_rad=2e-7, worm_second_amplitude_rad=1.6e-4
    )
    figures = {"wheel_amplitude_rad": 5.5e-4, "worm_amplitude_rad": 1.6e-4}
    assert wave_generator.comparable() == figures
