"""Reversals, half cycles and loops of a motion: the events that signatures count."""

import itertools

import numpy as np
from numpy.typing import NDArray

LONGEST_s = 0.15  # how far before and after a reversal a torque is averaged
STILL = 0.02  # of the root mean square speed: slower is at rest
ALIKE = 0.25  # how much two half cycles of a loop may differ in amplitude


def reversals(speed: NDArray, recording: NDArray) -> NDArray:
    """Rows at which the motion has turned back: the first row of the new direction."""
    still = STILL * np.sqrt(np.mean(speed**2))
    sign = np.where(np.abs(speed) > still, np.sign(speed), 0.0)
    moving = np.flatnonzero(sign != 0.0)
    if moving.size < 2:
        return np.zeros(0, dtype=int)
    turned = (sign[moving][1:] != sign[moving][:-1]) & (np.diff(recording[moving]) == 0)
    return moving[1:][turned]


def reversal_steps(torque: NDArray, speed: NDArray, row_s: NDArray, recording: NDArray) -> NDArray:
    """(events,): torque after less before each reversal, times the new direction.

    Averages over the outer two thirds of up to `LONGEST_s`, less where the next reversal is near,
    so that the smoothing of a step does not count.
    """
    at = reversals(speed, recording)
    found = []
    for k, row in enumerate(at):
        rows = int(LONGEST_s / row_s[row])
        before = row - (at[k - 1] if k else np.searchsorted(recording, recording[row]))
        end = np.searchsorted(recording, recording[row], side="right")
        after = (at[k + 1] if k + 1 < at.size else end) - row
        reach = min(rows, before // 2, min(after, end - row) // 2)
        near = reach // 3
        if reach - near < 3:
            continue
        early = torque[row - reach : row - near].mean()
        late = torque[row + near : row + reach].mean()
        found.append((late - early) * np.sign(speed[row]))
    return np.array(found)


def half_cycles(
    torque: NDArray, angle: NDArray, speed: NDArray, row_s: NDArray, recording: NDArray
) -> NDArray:
    """(cycles, 5): amplitude, duration, work, direction and recording between reversals.

    Work is that of the torque on the motion.
    """
    at = reversals(speed, recording)
    found = []
    for first, last in itertools.pairwise(at):
        if recording[first] != recording[last]:
            continue
        part = slice(first, last + 1)
        work = float(np.trapezoid(torque[part], angle[part]))
        moved = angle[last] - angle[first]
        seconds = (last - first) * row_s[first]
        found.append((0.5 * abs(moved), seconds, work, np.sign(moved), recording[first]))
    return np.array(found).reshape(-1, 5)


def loop_rows(cycles: NDArray) -> NDArray:
    """(loops, 3): amplitude, rate [1/s] and loss of closed pairs of half cycles.

    What a conservative torque does on the way out it undoes on the way back.
    """
    found = []
    for a, b in itertools.pairwise(cycles):
        if a[4] != b[4] or a[3] == b[3] or abs(a[0] - b[0]) > ALIKE * max(a[0], b[0]):
            continue
        if a[0] > 0.0 and a[1] + b[1] > 0.0:
            found.append((0.5 * (a[0] + b[0]), 1.0 / (a[1] + b[1]), -(a[2] + b[2])))
    return np.array(found).reshape(-1, 3)
