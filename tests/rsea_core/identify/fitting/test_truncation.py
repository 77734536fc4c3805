"""Recordings longer than a diagnosis can replay are cut to one length, and it is said."""

from pathlib import Path

import numpy as np
import pytest

from rsea_core.identify.fitting.truncation import truncate
from rsea_core.machine.rig import Rig
from rsea_core.recordings.case import Case
from rsea_core.recordings.recording import Recording

RIG = Rig.preset("rsea-bench")


def case(*lengths: tuple[str, int, float]) -> Case:
    recordings = []
    for role, rows, row_s in lengths:
        t = row_s * np.arange(rows)
        columns = {"time_s": t, "duty": 0.0 * t, "motor_angle_rad": np.sin(t)}
        name = f"{len(recordings)}.csv"
        recordings.append(Recording(file=name, role=role, columns=columns, sample_time_s=row_s))
    return Case(name="c", folder=Path(), rig=RIG, recordings=tuple(recordings))


def test_a_case_that_is_short_enough_stays_as_it_is():
    given = case(("identification", 300, 0.001), ("validation", 5000, 0.001))
    kept, found = truncate(given, 0.001, 1000)
    assert kept == given
    assert found == ()


def test_the_longest_are_cut_to_one_length_in_time_and_the_others_stay():
    given = case(
        ("identification", 200, 0.001), ("identification", 5000, 0.001),
        ("identification", 900, 0.01), ("validation", 9000, 0.001),
    )  # fmt: skip
    kept, found = truncate(given, 0.001, 2000)
    assert [r.rows for r in kept.recordings] == [200, 900, 90, 9000]
    steps = sum(r.rows * max(1.0, r.sample_time_s / 0.001) for r in kept.identification)
    assert steps == pytest.approx(2000, abs=20)
    assert [f.file for f in found] == ["1.csv", "2.csv"]
    assert "only its first 0.9 s of 5 s" in found[0].text
