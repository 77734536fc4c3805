"""Uneven stamps: whether commands, readings or neither are at them; runs at times between rows."""

import numpy as np
import pytest

from rsea_core.effects.registry import GearFriction
from rsea_core.engines.fixed_step.replay import CHANNELS
from rsea_core.identify.multistep.command_timing import (
    AS_LOGGED,
    CommandTiming,
    RowTimes,
    even_times,
    runs_at,
    timings,
)
from rsea_core.identify.window_diagnosis import diagnose_windows
from tests.cases.one_axis import axis_case, axis_recording, axis_rig

ROW_s, N = 0.02, 400
ANGLE, SPEED = (CHANNELS.index(f"motor_{what}") for what in ("angle_rad", "velocity_rad_per_s"))
CURRENT = CHANNELS.index("current_A")
GRID = ROW_s * np.arange(N)


def accelerated(time: np.ndarray) -> np.ndarray:
    """(1, n, 7) of a motor at 3 rad/s that gains 5 rad/s every second."""
    run = np.zeros((1, time.size, len(CHANNELS)))
    run[0, :, ANGLE], run[0, :, SPEED] = 3.0 * time + 2.5 * time**2, 3.0 + 5.0 * time
    return run


def test_even_times_of_uneven_stamps_are_those_that_the_jitter_was_added_to():
    jitter = 0.05 * ROW_s * np.random.default_rng(1).standard_normal(N)
    assert even_times(GRID + jitter) == pytest.approx(GRID, abs=0.01 * ROW_s)


def test_a_row_that_the_log_lacks_is_counted():
    jitter = 0.05 * ROW_s * np.random.default_rng(2).standard_normal(N)
    found = even_times(np.delete(GRID + jitter, 200))
    assert found == pytest.approx(np.delete(GRID, 200), abs=0.01 * ROW_s)


def test_even_stamps_and_steps_that_wander_have_no_other_even_times():
    wandering = np.cumsum(ROW_s * (1.0 + 0.1 * np.random.default_rng(3).standard_normal(N)))
    assert even_times(GRID) is None
    assert even_times(np.delete(GRID, 200)) is None
    assert even_times(wandering) is None


def test_uniform_acceleration_is_exact_between_rows():
    ahead = 0.3 * ROW_s * np.sin(np.arange(N))
    found = runs_at(accelerated(GRID), ahead, GRID, first_rows=(0, 50, 51))
    exact = accelerated(GRID + ahead)
    for column in (ANGLE, SPEED):  # a window of one row has no neighbour to say how speed changes
        one, other = (np.delete(each[0, :, column], 50) for each in (found, exact))
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-11)


def test_no_window_lends_another_one_its_motion():
    run = accelerated(GRID)
    run[0, 100:, ANGLE] += 50.0
    run[0, 100:, SPEED] -= 7.0
    found = runs_at(run, np.full(N, 0.2 * ROW_s), GRID, first_rows=(0, 100))
    assert found[0, 99, ANGLE] == pytest.approx(
        accelerated(GRID[99:100] + 0.2 * ROW_s)[0, 0, ANGLE]
    )


@pytest.mark.parametrize(("lag_s", "share"), [(0.0, 1.0), (5.0, 0.25)])
def test_a_current_follows_its_command_at_once_or_as_its_winding_does(lag_s, share):
    run = np.zeros((1, N, len(CHANNELS)))
    run[0, 11:, CURRENT] = 1.0  # read before a row's command acts: that of row 10 is another one
    found = runs_at(run, np.full(N, 0.25 * ROW_s), GRID, (0,), winding_time_s=lag_s)
    assert found[0, 9, CURRENT] == 0.0
    assert found[0, 10, CURRENT] == pytest.approx(share, rel=2e-3)


def test_other_timings_are_tried_where_stamps_are_uneven(tmp_path):
    even, uneven = (axis_recording(seed=1, uneven=u) for u in (0.0, 0.03))
    cases = [axis_case(tmp_path, r, rig=axis_rig()) for r in (even, uneven)]
    assert timings(cases[0], AS_LOGGED) == [CommandTiming(linear=True)]
    assert {t.rows for t in timings(cases[1], AS_LOGGED)} == set(RowTimes)


def test_friction_is_found_where_the_log_stamps_its_readings_late_or_early(tmp_path):
    made = [axis_recording(GearFriction(coulomb_Nm=0.06), seed=s, uneven=0.05) for s in (1, 2)]
    found = diagnose_windows(axis_case(tmp_path, *made, rig=axis_rig()))
    assert found.conclusion.problem.timing == CommandTiming(rows=RowTimes.READINGS)
    first = found.document["effects"][0]
    assert first["name"] in ("gear-friction", "load-friction")
    assert first["parameters"]["coulomb_Nm"]["value"] == pytest.approx(0.06, rel=0.05)
