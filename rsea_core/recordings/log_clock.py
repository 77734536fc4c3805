"""The clock of a log: counters that wrap, runs that restart, rows that were written twice.

Loggers count microseconds in 32 bits (a wrap every 71.6 minutes) or start again at zero with every
run. Both are undone here, each with a note; any other step backwards stays, and is refused later.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RecordingError

MODULI = (2.0**16, 2.0**24, 2.0**31, 2.0**32)
USUAL = 20.0  # times the usual step: what a wrap leaves, and the gap put between two runs
UNCLEAR = 0.1  # of a turn, around half of one
RESTART = 0.05  # of the span: how close to its first value a new run begins
EVEN = 0.05  # steps within this share of their mean are one grid, printed with few digits
DROPPED = 1.5  # of an otherwise even grid: a longer step has lost a row
TICK_ROWS = 50  # over which ticks are counted
FEW_TICKS = 3  # that repeat: the clock is coarser than the rows
MOST_LOST = 2  # rows in a row that are filled there; more are a gap
GAP = 10.0  # of a jittery one: times the 99th percentile of its steps


def continuous(values: NDArray) -> tuple[NDArray, str | None]:
    """Times that go on where a counter wrapped or a run restarted, and what was done.

    Parameters
    ----------
    values : (n,) array
        As logged.
    """
    steps = np.diff(values)
    back = np.flatnonzero(steps < 0.0)
    if back.size == 0 or back.size > max(3, values.size // 50) or not np.any(steps > 0.0):
        return values, None
    usual = float(np.median(steps[steps > 0.0]))
    jumps = np.zeros(values.size)
    for modulus in MODULI:
        left = steps[back] + modulus
        if np.all((left > 0.0) & (left <= USUAL * usual)) and values.max() < modulus:
            jumps[back + 1] = modulus
            return values + np.cumsum(jumps), f"its clock wraps {back.size} times at {modulus:g}"
    near_begin = values[back + 1] <= values[0] + RESTART * (values.max() - values.min())
    if not np.all(near_begin):
        return values, None
    jumps[back + 1] = USUAL * usual - steps[back]
    text = f"its time restarts {back.size} times: {back.size + 1} runs, one after the other"
    return values + np.cumsum(jumps), text


def longest_step(steps: NDArray) -> float:
    """The step beyond which a clock has a gap, at which its recording has to be split."""
    if _is_even(steps):
        return (MOST_LOST + DROPPED) * float(np.median(steps))
    return GAP * float(np.percentile(steps, 99.0))


def tick_hint(time: NDArray) -> str:
    """What to do about a clock whose ticks are too coarse for its rows; "" where it is another."""
    steps = np.diff(time)
    if np.any(steps < 0.0) or np.sum(steps == 0.0) < FEW_TICKS:
        return ""
    k = max(1, min(TICK_ROWS, time.size // 4))
    passed = time[k:] - time[:-k]
    off = np.abs(passed - np.median(passed))  # large where rows are late, or lost
    row_s = float(np.mean(passed[off < 1.5 * steps[steps > 0.0].min()])) / k if steps.any() else 0.0
    if not row_s > 0.0:
        return ""
    rate = f"{1.0 / row_s:.4g}"
    return f"; its ticks show {rate} rows per second: state --rate-hz {rate} (rate_Hz in [columns])"


def lost_rows(steps: NDArray) -> NDArray:
    """Rows that an otherwise even clock lacks in each of its (n,) steps; none of a jittery one."""
    median = float(np.median(steps))
    long = (steps > DROPPED * median) & _is_even(steps)
    return np.where(long, np.round(steps / median) - 1.0, 0.0).astype(int)


def places_of_rows(time: NDArray, lost: NDArray) -> tuple[NDArray, NDArray, float]:
    """Where the (m,) rows of a log lie on an even grid with those it lost.

    Returns
    -------
    (m,) array, in rows of the grid
    (n,) array, the rows of the grid
    float, the time between two of these
    """
    at = np.concatenate(([0.0], np.cumsum(1.0 + lost)))
    mean = float(time[-1] - time[0]) / at[-1]
    passed = (time - time[0]) / mean
    drifts = np.max(np.abs(at - passed)) > 0.5
    return passed if drifts else at, np.arange(at[-1] + 1.0), mean


def _is_even(steps: NDArray) -> bool:
    return float(np.percentile(steps, 95.0)) <= (1.0 + EVEN) * float(np.median(steps))


def rows_written_once(columns: Mapping[str, NDArray], clock: str) -> tuple[NDArray, str | None]:
    """Rows without those that repeat the row before them, time and all; and what was done."""
    rows = columns[clock].size
    again = np.concatenate(([False], np.diff(columns[clock]) == 0.0))
    if not again.any():
        return np.arange(rows), None
    for values in columns.values():
        same = (values[1:] == values[:-1]) | (np.isnan(values[1:]) & np.isnan(values[:-1]))
        again[1:] &= same
    kept = np.flatnonzero(~again)
    text = f"{rows - kept.size} rows that repeat the row before them left out"
    return kept, text if kept.size < rows else None


def unwrapped(values: NDArray, turn: float) -> NDArray:
    """An angle that starts again after a turn, with its turns counted.

    Raises
    ------
    RecordingError
        If it moves by about half a turn between two rows, so that turns cannot be counted.
    """
    steps = np.abs(np.diff(values)) % turn
    unclear = np.flatnonzero(np.abs(steps - 0.5 * turn) < UNCLEAR * turn)
    if unclear.size:
        row = int(unclear[0]) + 2
        raise RecordingError(
            f"wrap = {turn:g}: between data rows {row - 1} and {row} it moves by about half of it,"
            " so that turns cannot be counted"
        )
    return np.unwrap(values, period=turn)


def slope_over(time: NDArray, values: NDArray, seconds: float) -> NDArray:
    """Slope between the ends of a window of so many seconds around each row.

    Parameters
    ----------
    time, values : (n,) arrays
        Time in seconds.
    """
    step = float(np.median(np.diff(time)))
    rows = int(np.clip(round(0.5 * seconds / max(step, 1e-9)), 1, max(1, time.size // 4)))
    edges = np.arange(time.size)
    before, after = np.maximum(edges - rows, 0), np.minimum(edges + rows, time.size - 1)
    return (values[after] - values[before]) / np.maximum(time[after] - time[before], 1e-9)
