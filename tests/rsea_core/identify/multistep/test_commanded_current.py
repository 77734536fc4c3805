"""With a commanded current a measured one is a reading if it follows the commands of the log.

A loop that runs faster than its log applies currents that no row holds.
"""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.identify.multistep.command_timing import current_is_commanded
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.window_diagnosis import diagnose_windows
from rsea_core.recordings.case import Case
from tests.cases.one_axis import ROW_s, axis_case, axis_recording, axis_rig

NOISE_A = 0.01
DRIFT_A_per_s = 0.012


def with_current(folder, applied) -> Case:
    """A case of an axis whose measured current is `applied` of commands and times, with noise."""
    plain = axis_recording(seed=1)
    noise = NOISE_A * np.random.default_rng(101).standard_normal(plain.rows)
    current = applied(plain["current_command_A"], plain.time_s) + noise
    recording = replace(plain, columns={**plain.columns, "current_A": current})
    rig = replace(axis_rig(), current_sensor_noise_A=NOISE_A)
    return axis_case(folder, recording, rig=rig)


def delayed(command, rows: int = 1):
    """The command of some rows before, zero in the first ones."""
    return np.concatenate([np.zeros(rows), command[:-rows]])


@pytest.mark.parametrize(
    "applied",
    [
        lambda u, t: delayed(u),
        lambda u, t: delayed(u, 2) + 0.3,
        lambda u, t: 1.1 * delayed(u) + DRIFT_A_per_s * t,
        lambda u, t: np.clip(delayed(u), -1.5, 1.5),
    ],
    ids=["held", "delayed with an offset", "scale and drift", "limited"],
)
def test_a_current_that_follows_the_commands_of_the_log_is_predicted(tmp_path, applied):
    case = with_current(tmp_path, applied)
    assert current_is_commanded(case)
    (found,) = MultistepProblem(case).fitted
    assert set(found.channels) == {"motor_angle_rad", "current_A"}


@pytest.mark.parametrize(
    "applied",
    [
        lambda u, t: delayed(u) + 0.2 * np.random.default_rng(5).standard_normal(len(u)),
        lambda u, t: -delayed(u),
        lambda u, t: 1000.0 * delayed(u),
        lambda u, t: 0.0 * u,
    ],
    ids=["commands that the log lacks", "wrong sign", "wrong unit", "dead sensor"],
)
def test_any_other_current_is_not_predicted(tmp_path, applied):
    case = with_current(tmp_path, applied)
    assert not current_is_commanded(case)
    (found,) = MultistepProblem(case).fitted
    assert found.channels == ("motor_angle_rad",)


def test_a_drift_of_the_current_sensor_is_found_where_current_is_commanded(tmp_path):
    case = with_current(tmp_path, lambda u, t: delayed(u) + DRIFT_A_per_s * t)
    document = diagnose_windows(case).document
    (effect,) = [e for e in document["effects"] if e["confidence"] >= 0.5]
    assert (effect["name"], effect["subsystem"]) == ("sensor-drift", "sensor:current_A")
    rate = effect["parameters"]["rate_per_s"]
    # white noise of the reading over the whole recording: the least deviation that a rate has
    rows = case.recordings[0].rows
    least = NOISE_A / (ROW_s * rows) * (12.0 / rows) ** 0.5
    assert abs(rate["value"] - DRIFT_A_per_s) < 3.0 * max(rate["std"], least)
