"""The slips of a log are noticed, a machine as its rig file says has none."""

from pathlib import Path

import pytest

from rsea_core.importing.doctor.health import health
from rsea_core.importing.doctor.slip_catalogue import CATALOGUE, case_slips, try_slips
from rsea_core.recordings.case import Case
from tests.rsea_core.recordings.test_consistency_checks import RIG, recorded

CASE = Case(name="bench", folder=Path(), rig=RIG, recordings=(recorded(),))


def test_a_consistent_recording_shows_no_slip():
    assert case_slips(CASE) == ()


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
