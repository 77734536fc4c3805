"""An even clock that lacks a row now and then is filled, with a note; a longer gap is refused."""

import numpy as np
import pytest

from rsea_core.errors import RecordingError
from rsea_core.recordings.log_clock import longest_step, lost_rows, tick_hint
from rsea_core.recordings.recording import read_recording

ROWS, STEP_s = 600, 0.004
LOST = (100, 300, 301)


def log(folder, lost: tuple[int, ...], jitter: float = 0.0):
    """A log of an even clock less some rows: a ramp, and a command that steps where one is lost."""
    k = np.delete(np.arange(ROWS), lost)
    rng = np.random.default_rng(1)
    time = STEP_s * (k + jitter * rng.uniform(-0.5, 0.5, k.size))
    rows = np.stack([time, 0.1 * (k >= 300), 0.01 * k], axis=1)
    path = folder / "log.csv"
    head = "time_s,duty,motor_angle_rad"
    np.savetxt(path, rows, delimiter=",", header=head, comments="", fmt="%.9g")
    return path


def test_single_and_double_lost_rows_of_an_even_clock_are_filled_and_counted(tmp_path):
    r = read_recording(log(tmp_path, LOST))
    assert r.rows == ROWS
    assert r.sample_time_s == pytest.approx(STEP_s)
    assert np.allclose(r["motor_angle_rad"], 0.01 * np.arange(ROWS))
    assert r["duty"][301] == 0.0  # a command is held from the row before
    assert r.logged is None
    (note,) = r.notes
    assert "3 of 600 rows were lost, 2 in a row at most; filled" in note.text


def test_three_lost_rows_in_a_row_are_a_gap(tmp_path):
    with pytest.raises(RecordingError, match=r"gap of 0\.016 s .*import --split"):
        read_recording(log(tmp_path, (200, 201, 202)))


def test_a_clock_that_drifts_is_filled_at_its_own_times():
    steps = np.where(np.arange(ROWS) % 100 == 50, 2.0, 1.0)
    assert lost_rows(steps).sum() == 6
    assert longest_step(steps) == 3.5
    assert not lost_rows(np.random.default_rng(2).uniform(0.5, 3.0, ROWS)).any()


def test_a_clock_whose_ticks_are_coarser_than_the_rows_has_a_rate_to_state():
    ticks = np.floor(1e3 * np.arange(ROWS) / 1600.0) * 1e-3
    assert "--rate-hz 1600 " in tick_hint(ticks)
    assert tick_hint(STEP_s * np.arange(ROWS)) == ""
