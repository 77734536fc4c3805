"""When a command acts, and when its row is read: hypotheses about a log whose rows are uneven.

A controller may run on a clock of its own while the logger stamps its rows late or early; then the
command changes at even times whatever the stamps say, and the readings belong to the stamps or to
the even times (docs/diagnosis.md 10.2).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from rsea_core.engines.fixed_step.replay import CHANNELS
from rsea_core.recordings.case import Case

UNEVEN = 2e-3  # of a row: rms deviation of the stamps below which they are even
FARTHEST = 0.5  # of a row: a stamp further from its even time belongs to another row
CURRENT = CHANNELS.index("current_A")
SPEED_OF = {
    CHANNELS.index("motor_angle_rad"): CHANNELS.index("motor_velocity_rad_per_s"),
    CHANNELS.index("load_angle_rad"): CHANNELS.index("load_velocity_rad_per_s"),
}


class RowTimes(StrEnum):
    """What the stamps of a log are the times of."""

    LOGGED = "readings and commands"
    READINGS = "the readings only (commands act at even times)"
    NEITHER = "neither readings nor commands (both are at even times)"


@dataclass(frozen=True, kw_only=True)
class CommandTiming:
    """How a command moves between rows (linearly, or held) and what the stamps say."""

    linear: bool = False
    rows: RowTimes = RowTimes.LOGGED


AS_LOGGED = CommandTiming()


def even_times(time_s: NDArray) -> NDArray | None:
    """Even times (n,) nearest to uneven stamps (n,); None if the stamps are even, or follow none.

    Rows that the log lacks are counted by the stamps about them.
    """
    steps = np.diff(time_s)
    rows = np.concatenate([[0.0], np.cumsum(np.maximum(np.round(steps / np.median(steps)), 1.0))])
    slope, first = np.polyfit(rows, time_s, 1)
    even = first + slope * rows
    off = np.abs(time_s - even) / slope
    if np.sqrt(np.mean(off**2)) < UNEVEN or np.max(off) > FARTHEST:
        return None
    return even


def timings(case: Case, timing: CommandTiming) -> list[CommandTiming]:
    """The other timings that a case's logs may have: of rows with the same hold, then the hold."""
    driven = [r for r in case.identification if r.command_name]
    if not driven:
        return []
    uneven = any(even_times(r.time_s if r.logged is None else r.logged["time_s"]) is not None
                 for r in driven)  # fmt: skip
    rows = [t for t in RowTimes if uneven and t is not timing.rows]
    return [replace(timing, rows=t) for t in rows] + [replace(timing, linear=not timing.linear)]


@np.errstate(invalid="ignore", over="ignore")  # runs that leave the range of numbers
def runs_at(
    runs: NDArray, ahead_s: NDArray, time_s: NDArray, first_rows: Sequence[int],
    winding_time_s: float = 0.0,
) -> NDArray:  # fmt: skip
    """Runs (m, n, 7) at times `ahead_s` (n,) after those of their rows.

    Taylor's expansion of second order, with differences of neighbouring rows of the same window.
    The current follows the command of its row as a winding does, at once without inductance.

    Parameters
    ----------
    time_s : (n,) array
        Times of the rows.
    first_rows : sequence of int
        Rows at which windows begin.
    winding_time_s : float
        Inductance over resistance.
    """
    n = runs.shape[1]
    begins = np.zeros(n + 1, bool)
    begins[[*first_rows, 0, n]] = True
    before, after = ~begins[:n], ~begins[1:]  # whether the window has a row before, after
    step = np.diff(time_s)[None, :, None]
    slope = np.diff(runs, axis=1) / step  # of the interval after each row but the last
    right = np.concatenate([slope, slope[:, -1:]], axis=1)
    left = np.concatenate([slope[:, :1], slope], axis=1)
    left[:, ~before] = right[:, ~before]
    right[:, ~after] = left[:, ~after]
    alone = ~before & ~after
    right[:, alone] = left[:, alone] = 0.0
    toward = np.where((ahead_s > 0.0)[None, :, None], right, left)
    ahead = ahead_s[None, :, None]
    curved = (before & after)[None, :, None] * (right - left) / np.mean(step)
    found = runs + 0.5 * ahead * (left + right) + 0.5 * ahead**2 * curved
    for angle, speed in SPEED_OF.items():
        found[:, :, angle] = (
            runs[:, :, angle]
            + ahead[..., 0] * runs[:, :, speed]
            + 0.5 * ahead[..., 0] ** 2 * toward[:, :, speed]
        )
    row = float(np.mean(step))
    since = np.where(ahead_s > 0.0, ahead_s, ahead_s + row)  # the command that drives it acts
    share = np.ones_like(since)
    if winding_time_s > 1e-3 * row:
        share = np.expm1(-since / winding_time_s) / np.expm1(-row / winding_time_s)
    change = row * toward[:, :, CURRENT]
    begun = runs[:, :, CURRENT] - np.where(ahead_s > 0.0, 0.0, change)
    found[:, :, CURRENT] = begun + share * change
    return found
