"""What a quantised reading knows, and when.

An encoder that moves many counts a row has an error that is white and uniform. One that moves
slowly repeats a count for many rows: its error is then one unknown of up to half a count, not a
fresh draw a row, while the moment at which the count changes is known to a row and therefore the
angle there to a fraction of a count. Both are put into the readings and their variances here, so
that the smoother's white-noise arithmetic counts the information once.
"""

import numpy as np
from numpy.typing import NDArray

UNIFORM = 1.0 / 12.0  # variance of a uniform error of width 1
FINEST_EDGE = 0.04  # of a count: an edge is not trusted more than this (1/25 of a line)
SMALLEST_PLATEAU = 2  # rows: below it every row has its own count


def count_of(values: NDArray) -> float | None:
    """The step of a reading in whole counts, None where it has none.

    The smallest change between rows, where most changes are whole multiples of it.
    """
    change = np.abs(np.diff(values))
    change = change[change > 1e-12 * max(1.0, float(np.abs(values).max()))]
    if change.size < 3:
        return None
    smallest = float(np.percentile(change, 1.0))
    few = np.unique(np.round(change / smallest)).size < 400
    return smallest if few and changes_by_counts(values, smallest) else None


def changes_by_counts(values: NDArray, count: float) -> bool:
    """Whether most changes between rows are whole multiples of a count, one at least."""
    whole = np.abs(np.diff(values)) / count
    whole = whole[whole > 0.5]
    return whole.size >= 3 and np.mean(np.abs(whole - np.round(whole)) < 0.15) > 0.9


def sharpened(reading: NDArray, count: float) -> tuple[NDArray, NDArray]:
    """Readings with the moments of their changes used, and the variance of each.

    Parameters
    ----------
    reading : (n,) array
        In whole counts of any phase.
    count : float
        Size of one count in the reading's unit.

    Returns
    -------
    value, variance : (n,) arrays
        On a plateau of m rows every row carries a share 1/m of one count's information. The row
        after a change of one count carries the edge, with an error that shrinks as the shorter
        of the two plateaus grows (twice the traverse, which covers a reversal just past it).
    """
    changed = np.flatnonzero(np.diff(reading) != 0.0)
    bounds = np.concatenate(([0], changed + 1, [reading.size]))
    length = np.diff(bounds)
    rows = np.repeat(length, length).astype(float)
    value = reading.copy()
    variance = count**2 * UNIFORM * rows
    for before, after, row in zip(length[:-1], length[1:], bounds[1:-1], strict=True):
        shorter = min(before, after)
        step = reading[row] - reading[row - 1]
        if shorter < SMALLEST_PLATEAU or abs(step) > 1.5 * count:
            continue
        share = min(1.0, max(2.0 / shorter, FINEST_EDGE))
        value[row] = 0.5 * (reading[row] + reading[row - 1]) + 0.5 * step / shorter
        variance[row] = (share * count) ** 2 * UNIFORM
    return value, variance


def noise_of(values: NDArray) -> float:
    """Standard deviation of the white part of a smooth signal, from its second differences.

    Median-based, so that a few jumps do not count (Rousseeuw & Croux 1993); where most second
    differences vanish, the root mean square of the rest.
    """
    second = np.diff(values, 2)
    spread = float(np.median(np.abs(second))) / 0.6745
    if spread == 0.0:
        spread = float(np.sqrt(np.mean(second**2)))
    return spread / np.sqrt(6.0)
