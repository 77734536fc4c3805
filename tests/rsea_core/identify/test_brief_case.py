"""A quick look fits few rows in which the machine moves, and its findings state which."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.identify.brief_case import BRIEF_ROWS, MOST_ROWS, brief_case
from rsea_core.identify.fitting.truncation import rows_between
from tests.cases.one_axis import axis_case, axis_recording, axis_rig

ANGLE = "motor_angle_rad"


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    return axis_case(tmp_path_factory.mktemp("case"), axis_recording(seed=1), rig=axis_rig())


def longer(case, *, still: int, times: int):
    """The case with rows of standstill before its recording, and that so many times."""
    r = case.recordings[0]
    columns = {n: np.concatenate([np.repeat(v[:1], still), np.tile(v, times)])
               for n, v in r.columns.items()}  # fmt: skip
    columns["time_s"] = r.sample_time_s * np.arange(columns["time_s"].size)
    return replace(case, recordings=(replace(r, columns=columns, logged=None),))


def test_a_short_case_stays_as_it_is(case):
    assert case.recordings[0].rows <= BRIEF_ROWS
    assert brief_case(case) == (case, ())


def test_what_is_kept_of_a_long_recording_begins_where_it_moves(case):
    still = 2 * BRIEF_ROWS
    given = longer(case, still=still, times=3)
    found, findings = brief_case(given)
    (r,) = found.recordings
    assert r.rows <= MOST_ROWS * BRIEF_ROWS
    angle = r[ANGLE]
    assert np.ptp(angle) > 0.5 * np.ptp(given.recordings[0][ANGLE])
    assert abs(angle[0] - given.recordings[0][ANGLE][0]) < 0.1 * np.ptp(angle)
    assert r.time_s[0] == 0.0
    assert findings


def test_rows_of_a_recording_are_those_of_its_log_too(case):
    """Predictions over windows use the log's own times where these are uneven."""
    r = case.recordings[0]
    uneven = np.array(r.time_s) + 0.2 * r.sample_time_s * np.sin(np.arange(r.rows))
    r = replace(r, logged={**r.columns, "time_s": uneven})
    part = rows_between(r, 100, 250)
    assert part.rows == 150
    assert part.logged["time_s"].size == 150
    assert part.time_s[0] == 0.0
    assert np.array_equal(part.logged[ANGLE], r[ANGLE][100:250])
    assert np.allclose(part.logged["time_s"] - part.time_s, (uneven - r.time_s)[100:250])
