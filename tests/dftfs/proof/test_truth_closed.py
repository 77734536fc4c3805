"""The true machine under a controller is the machine that plays a recording."""

import numpy as np
import pytest

from dftfs.proof.effects_base import changed
from dftfs.proof.recipes import ALL
from dftfs.proof.rigs import draw_rig
from dftfs.proof.truth import Drive, Start, TruthError, follow, move

INTERVAL_S, STEP_S = 1e-3, 1e-4
DUTY = 0.3 * np.sin(0.02 * np.arange(300))


def machine(name):
    rng = np.random.default_rng(5)
    rig = draw_rig(rng, ("motor_angle_rad",))
    return changed(rig.true, (ALL[name](rng, rig.true)(1.0),))[:3]


@pytest.mark.parametrize("name", ["gear-friction", "gear-backlash", "drive-delay"])
def test_a_controller_that_plays_a_command_moves_the_machine_as_the_command_does(name):
    start = Start(motor_angle_rad=0.5, load_angle_rad=0.02, backlash_place=0.3)
    played = move(
        *machine(name), "pendulum", Drive(interval_s=INTERVAL_S, command=DUTY), start, step_s=STEP_S
    )
    followed, duty = follow(
        *machine(name), "pendulum", lambda k, row: DUTY[k], samples=DUTY.size,
        interval_s=INTERVAL_S, start=start, step_s=STEP_S,
    )  # fmt: skip
    assert np.array_equal(duty, DUTY)
    for column, values in played.values.items():
        assert np.array_equal(followed.values[column], values), column


def test_a_controller_reads_the_sample_before_it_acts():
    seen = []
    followed, _ = follow(
        *machine("gear-friction"), "locked",
        lambda k, row: seen.append(row.copy()) or -2.0 * row[2] / 48.0 + 0.1,
        samples=50, interval_s=INTERVAL_S, step_s=STEP_S,
    )  # fmt: skip
    assert np.array_equal(np.array(seen)[:, 0], followed.values["motor_angle_rad"])


def test_a_loop_that_runs_away_is_reported():
    true, physics, series = machine("drive-delay")
    strong = true._replace(current_limit_A=1e12)
    with pytest.raises(TruthError, match="ran away"):
        follow(
            strong, physics, series, "free", lambda k, row: 1e9, samples=50,
            interval_s=INTERVAL_S, step_s=STEP_S,
        )  # fmt: skip
