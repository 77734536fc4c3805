"""The slips of a log are noticed, a machine as its rig file says has none."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rsea_core.importing.doctor.health import health
from rsea_core.importing.doctor.slip_catalogue import CATALOGUE, case_slips, try_slips
from rsea_core.recordings.case import Case
from rsea_core.recordings.finding import Kind
from tests.rsea_core.recordings.test_consistency_checks import RIG, recorded

CASE = Case(name="bench", folder=Path(), rig=RIG, recordings=(recorded(),))


def test_a_consistent_recording_shows_no_slip():
    assert case_slips(CASE) == ()


def test_a_column_is_late_where_most_recordings_show_it_and_not_where_one_does():
    """A slow motion alone has a phase by friction that looks like a delay."""
    right = CASE.recordings[0]
    late = {n: np.roll(v, 60) if n == "torque_Nm" else v for n, v in right.columns.items()}
    late = replace(right, columns=late)
    for recordings, reported in (((late,) * 2, True), ((late, right, right), False)):
        found = case_slips(replace(CASE, recordings=recordings))
        assert any(f.kind is Kind.CLOCK for f in found) is reported


def test_most_of_the_forty_slips_are_noticed_each_by_one_line():
    results = try_slips(CASE)
    noticed = [r for r in results if r.noticed]
    assert len(results) == len(CATALOGUE) == 40
    assert len(noticed) >= 37
    assert all(r.text and "\n" not in r.text for r in noticed)


@pytest.mark.parametrize("column", ["motor_angle_rad", "torque_Nm", "current_A"])
def test_health_has_lines_for_every_reading(column):
    lines = [line.sentence() for line in health(RIG, CASE.recordings[0])]
    assert any(f"{column}: noise" in line for line in lines)
    assert any("1000 Hz" in line for line in lines)
