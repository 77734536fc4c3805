"""A quick look fits few rows in which the machine moves, and its findings state which."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.identify.brief_case import (
    BRIEF_ROWS,
    MOST_ROWS,
    MOST_SEARCH_ROWS,
    SEARCH_ROWS,
    brief_case,
    with_excerpts,
)
from rsea_core.identify.fitting.truncation import rows_between
from tests.cases.one_axis import axis_case, axis_recording, axis_rig

ANGLE = "motor_angle_rad"
SLOWER = 800  # a cycle has more rows than a quick look


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


def several(case, *, copies: int, times: int):
    """The case with its recording repeated, and that so many times as recordings of their own."""
    r = longer(case, still=0, times=times).recordings[0]
    return replace(case, recordings=tuple(replace(r, file=f"{j}.csv") for j in range(copies)))


def test_rows_that_a_search_leaves_out_are_held_out(case):
    given = several(case, copies=2, times=1 + 2 * SEARCH_ROWS // case.recordings[0].rows)
    found, findings = with_excerpts(given)
    assert sum(r.rows for r in found.identification) <= MOST_SEARCH_ROWS
    assert len(found.validation) == len(findings) == 2
    for one, rest in zip(found.identification, found.validation, strict=True):
        whole = given.recordings[0][ANGLE]
        assert one.file == rest.file
        assert not rest.initial_rest
        assert one.rows + rest.rows <= whole.size
        assert np.array_equal(rest[ANGLE], whole[-rest.rows :])


def test_a_search_fits_all_rows_of_a_short_case(case):
    assert with_excerpts(case) == (case, ())


def test_few_rows_show_whole_cycles_of_some_recordings_and_the_last_is_left_out(case):
    """Beginnings of all of them would show no cycle of any."""
    r = case.recordings[0]
    at = np.arange(SLOWER * r.rows) / SLOWER
    slow = {n: np.interp(at, np.arange(r.rows), v) for n, v in r.columns.items()}
    slow["time_s"] = r.sample_time_s * np.arange(slow["time_s"].size)
    given = replace(
        case, recordings=(*several(case, copies=3, times=2).recordings,
                          replace(r, file="slow.csv", columns=slow, logged=None)),
    )  # fmt: skip
    found, findings = brief_case(given)
    assert {r.file for r in found.identification} <= {"0.csv", "1.csv", "2.csv"}
    assert any(f.file == "slow.csv" and f.text.startswith("not fitted") for f in findings)
