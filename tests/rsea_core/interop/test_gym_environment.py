"""The environment passes gymnasium's own checks and is the machine that `simulate` runs."""

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium", reason="gymnasium is not installed")

from gymnasium.utils.env_checker import check_env  # noqa: E402

from rsea_core import ActuatorModel, Inputs, Load, Rig, simulate  # noqa: E402
from rsea_core.effects import GearFriction  # noqa: E402
from rsea_core.errors import InputError  # noqa: E402
from rsea_core.interop.gym_environment import TorqueTracking  # noqa: E402

SHORT = {"duration_s": 0.2}


@pytest.mark.filterwarnings("ignore")
def test_gymnasiums_checker_passes():
    check_env(gymnasium.make("rsea/TorqueTracking-v0", **SHORT).unwrapped)


def test_an_episode_is_the_machine_that_simulate_runs():
    """Random duties for 0.2 s against the event-driven engine, dry friction included."""
    model = ActuatorModel(Rig.preset("rsea-bench"), (GearFriction(coulomb_Nm=0.02),))
    env = TorqueTracking(model, **SHORT)
    env.reset(seed=1)
    actions = np.random.default_rng(0).uniform(-0.5, 0.5, 200).astype(np.float32)
    found = [env.step(np.array([a]))[4]["torque_Nm"] for a in actions]
    time = np.arange(201) * 1e-3
    duty = np.append(actions.astype(float), 0.0)
    exact = simulate(model, Inputs(time_s=time, duty=duty, load=Load(kind="locked")))
    np.testing.assert_allclose(found, exact.torque_Nm[1:], atol=2e-3)
    assert np.ptp(exact.torque_Nm) > 0.1


def test_the_same_seed_gives_the_same_episode_and_it_ends():
    env = TorqueTracking(**SHORT)
    ends = []
    for _ in range(2):
        first, _ = env.reset(seed=7)
        done, total = False, 0.0
        while not done:
            _, reward, terminated, done, _ = env.step(np.array([0.1], dtype=np.float32))
            assert not terminated
            total += reward
        ends.append((tuple(first), total))
    assert ends[0] == ends[1]
    assert ends[0][1] < 0.0


def test_unusable_times_are_refused():
    with pytest.raises(InputError, match="sample_time_s = 0"):
        TorqueTracking(sample_time_s=0.0)
