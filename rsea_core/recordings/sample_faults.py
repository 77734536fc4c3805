"""Faults of single rows of a reading: it stands still, jumps, wraps or is cut off."""

import numpy as np
from numpy.typing import NDArray

from rsea_core.recordings.finding import Finding, Kind
from rsea_core.recordings.recording import Recording

STILL_s, STILL_SHARE = 0.3, 0.1  # a reading stands still for so long, and for this share of rows
JUMP = 30.0  # times the steps that nine of ten rows keep to: no inertia allows it
ALONE = 4.0  # times the steps of neighbouring rows: an oscillation has many large ones
AS_FAST = 0.05  # share by which the speed of an angle and a velocity may differ
FLAT_s = 0.02  # a noisy reading that stays at its extreme for this long is cut off
OUTER = 0.1  # of the largest reading: a drive that is off reads nothing for long, and is not cut
AT_ONCE_s = 0.01  # in which no motor or link stops from a good part of its largest speed
CUT, CUT_FLOORS = 0.3, 5.0  # that part, and standard deviations of its sensor
FEW = 200
PART = 0.3  # of all motion that passes while a reading stands still
CLEAR = 20.0  # sensor deviations that a motion has to span, to be one here


def constant_value_cause(values: NDArray, row: int) -> str:
    """Phrase: why a reading may keep the value of a row."""
    died = "the sensor died, or the logger repeats it"
    extreme = np.ptp(values) > 0.0 and values[row] in (values.max(), values.min())
    return f"it is cut off at {values[row]:.4g}, or {died}" if extreme else died


def longest_constant_run(values: NDArray) -> tuple[int, int]:
    """First row and the row after the last of the longest run of one value."""
    changes = np.flatnonzero(np.diff(values) != 0.0) + 1
    edges = np.concatenate(([0], changes, [values.size]))
    k = int(np.argmax(np.diff(edges)))
    return int(edges[k]), int(edges[k + 1])


def is_long_run(r: Recording, first: int, last: int) -> bool:
    """Whether a reading that keeps one value over these rows does so for long."""
    rows = last - first
    return rows >= STILL_SHARE * r.rows and rows * r.sample_time_s >= STILL_s


def stopped_noise(r: Recording, name: str, noise: float) -> Finding | None:
    """A sensor with noise whose noise stops; None where it goes on.

    Parameters
    ----------
    noise : float
        Its standard deviation.
    """
    values = r[name]
    first, last = longest_constant_run(values)
    rest = np.diff(np.delete(values, slice(first, last)))
    if not is_long_run(r, first, last) or rest.size < 10 or np.mean(rest == 0.0) > PART:
        return None
    if np.median(np.abs(rest)) > CLEAR * noise:
        return None
    text = (
        f"{name} repeats {values[first]:.5g} from {r.time_s[first]:.4g} to"
        f" {r.time_s[last - 1]:.4g} s without any noise: the sensor died, or the logger repeats it"
    )
    return Finding(kind=Kind.NOISE_STOPS, text=text, file=r.file, column=name)


def jumps(r: Recording, name: str, floor: float) -> list[Finding]:
    """Steps or spikes of one row that no inertia allows; by a full turn: an angle that wraps."""
    steps = np.diff(r[name])
    usual = max(float(np.percentile(np.abs(steps), 90.0)), 2.0 * floor)
    limit = max(JUMP * usual, CLEAR * floor)
    alone = np.minimum(np.abs(steps[:-1]), np.abs(steps[1:])) * (steps[:-1] * steps[1:] < 0.0)
    spikes = np.flatnonzero(alone > limit)
    if spikes.size:
        k = int(spikes[0]) + 1
        times = "" if spikes.size == 1 else f", {spikes.size} rows in all"
        text = f"{name}: spike of {alone[k - 1]:.4g} at {r.time_s[k]:.6g} s{times}"
        return [_jump(r, name, float(alone[k - 1]), text, Kind.SPIKE)]
    if not name.endswith("angle_rad"):
        return []
    sizes = np.abs(steps)
    near = np.minimum(_largest_at(sizes, (1,)), _largest_at(sizes, (2, 3)))  # of one row, or two
    far = np.flatnonzero((sizes > limit) & (sizes > ALONE * near))
    if not far.size:
        return []
    k = int(far[0])
    size = float(abs(steps[k]))
    times = "" if far.size == 1 else f", {far.size} times in all"
    text = f"{name} jumps by {size:.4g} rad at {r.time_s[k + 1]:.6g} s{times}"
    return [_jump(r, name, size, text, Kind.JUMP)]


def _largest_at(sizes: NDArray, rows: tuple[int, ...]) -> NDArray:
    """Largest of the sizes (n,) that many rows before and after each."""
    padded = np.pad(sizes, max(rows))
    shifted = [np.roll(padded, k) for row in rows for k in (row, -row)]
    return np.max(shifted, axis=0)[max(rows) : -max(rows)]


def _jump(r: Recording, name: str, size: float, text: str, kind: Kind) -> Finding:
    """A step of this size, or a wrap where an angle jumps by a full turn."""
    if name.endswith("angle_rad") and abs(size - 2.0 * np.pi) < 0.3 * np.pi:
        kind, text = (
            Kind.WRAP,
            f"{text} (a full turn: the reading wraps; `wrap` in [columns] undoes it)",
        )
    return Finding(kind=kind, text=text, file=r.file, column=name)


def clipping_levels(r: Recording, name: str) -> list[float]:
    """The extremes at which both noise and motion stop for a while.

    A velocity is not clipped where its angle passes as fast: a triangle has a constant speed.
    """
    values = r[name]
    moves = np.abs(np.diff(values)) > 0.0
    if np.mean(moves) <= 0.5:
        return []
    run = max(5, round(FLAT_s / r.sample_time_s))
    found = []
    for top in (float(values.max()), float(values.min())):
        at_top = np.abs(values - top) <= 1e-12 * max(abs(top), 1.0)
        if at_top.sum() < 3 * run or abs(top) < OUTER * float(np.abs(values).max()):
            continue
        edges = np.flatnonzero(np.diff(np.concatenate(([0], at_top.astype(int), [0]))))
        longest = int(np.argmax(edges[1::2] - edges[::2]))
        first, last = int(edges[2 * longest]), int(edges[2 * longest + 1]) - 1
        if last - first + 1 >= run and not _passes_as_fast(r, name, first, last):
            found.append(top)
    return found


def _passes_as_fast(r: Recording, name: str, first: int, last: int) -> bool:
    """Whether the angle of a velocity passes, from one row to another, as it states."""
    angle = name.replace("_velocity_rad_per_s", "_angle_rad")
    if angle == name or angle not in r:
        return False
    passed = (r[angle][last] - r[angle][first]) / (r.time_s[last] - r.time_s[first])
    return bool(abs(passed - r[name][first]) < AS_FAST * abs(r[name][first]))


def angle_clipping_levels(r: Recording, name: str, floor: float) -> list[float]:
    """The extremes at which an angle is clipped: it stops there at once and goes on at once.

    What stops at an extreme by itself was slow before: friction needs longer than a few rows. It
    has to happen twice, and the motion has to be more than a few counts.
    """
    values = np.asarray(r[name])
    if r.quasi_static or r.rows < FEW or r.sample_time_s > 0.5 * AT_ONCE_s:
        return []
    run, lag = max(5, round(FLAT_s / r.sample_time_s)), round(AT_ONCE_s / r.sample_time_s)
    if r.rows < 4 * lag:
        return []
    gone = np.abs(values[lag:] - values[:-lag])
    least = max(CUT * float(np.percentile(gone, 99.0)), CUT_FLOORS * floor)
    found = []
    for top in (float(values.max()), float(values.min())):
        flat = np.concatenate(([0], (values == top).astype(int), [0]))
        first, last = np.flatnonzero(np.diff(flat) == 1), np.flatnonzero(np.diff(flat) == -1)
        whole = (last - first >= run) & (first > lag) & (last < r.rows - lag)
        at_once = (gone[first[whole] - lag - 1] >= least) & (gone[last[whole]] >= least)
        if np.sum(at_once) >= 2:
            found.append(top)
    return found
