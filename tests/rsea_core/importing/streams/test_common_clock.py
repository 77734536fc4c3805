"""A stated rate is held against the times and counters of a log."""

import numpy as np
import pytest

from rsea_core.importing.streams.common_clock import clock_notes
from rsea_core.recordings.readers.log import Stream

KEPT = np.delete(np.arange(1000), (100, 400, 700))


@pytest.mark.parametrize(
    ("name", "scale", "says"),
    [
        ("us", 2000.0, "--column time_s=us:us"),
        ("stamp", 2.0, "passes 1.998 s, 997 rows"),
        ("seq", 1.0, "counts 3 rows that the log lacks"),
    ],
)
def test_lost_rows_that_a_rate_closes_up_are_noted(name, scale, says):
    (note,) = clock_notes(Stream(columns={name: scale * KEPT, "pos": np.sin(KEPT)}), 500.0)
    assert says in note


def test_a_clock_that_agrees_with_the_rate_draws_no_note():
    whole = Stream(columns={"ms": 2.0 * np.arange(1000), "seq": np.arange(1000.0)})
    assert clock_notes(whole, 500.0) == ()
