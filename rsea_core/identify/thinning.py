"""A case with fewer rows: what a quick look replays.

Replays take at least one step a row, so that a coarse step needs coarse rows. Readings are those
of every so manieth row; an input that is held from row to row becomes its mean until the next row
that is kept, which moves the machine as far. An input that jumps between kept rows is not so
replaced: the current shows when it jumped, and its recording stays whole.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.arrays import read_only
from rsea_core.case import Case
from rsea_core.recording import HELD, Recording

FEWEST_ROWS = 400  # of a recording that is thinned
JUMP = 0.1  # of an input's range, within a kept row
SLACK = 1e-6  # of a row: sample times are rounded


def thinned(case: Case, row_s: float) -> Case:
    """The case with rows as long as they may be, up to `row_s` [s]."""
    return replace(case, recordings=tuple(_thinned(r, row_s) for r in case.recordings))


def _thinned(r: Recording, row_s: float) -> Recording:
    every = int(row_s / r.sample_time_s + SLACK)
    kept = r.rows // max(every, 1)
    if every < 2 or kept < FEWEST_ROWS or r.quasi_static:
        return r
    columns = {}
    for name, values in r.columns.items():
        rows = values[: kept * every].reshape(kept, every)
        held = name in HELD or name == r.command_name
        if held and _jumps(rows):
            return r
        columns[name] = read_only(rows.mean(axis=1) if held else rows[:, 0].copy())
    return replace(r, columns=columns, sample_time_s=every * r.sample_time_s)


def _jumps(rows: NDArray) -> bool:
    return bool(np.ptp(rows, axis=1).max() > JUMP * np.ptp(rows))
