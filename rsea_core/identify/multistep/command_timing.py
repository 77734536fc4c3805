"""When a command acts, and when its row is read: hypotheses about a log whose rows are uneven.

A controller may run on a clock of its own while the logger stamps its rows late or early; then the
command changes at even times whatever the stamps say, and the readings belong to the stamps or to
the even times (docs/diagnosis-search.md 10.2).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.fft import dct, idct

from rsea_core.engines.fixed_step.replay import CHANNELS
from rsea_core.identify.multistep.criteria import APPLIED_CURRENT, FAST_SHARE, TURNS
from rsea_core.recordings.case import Case, apparent_noise, noise_floor
from rsea_core.recordings.consistency_checks import FACTOR
from rsea_core.recordings.recording import Recording

UNEVEN = 2e-3  # of a row: rms deviation of the stamps below which they are even
LOG_WEIGHTS = (-4.0, 24.0, 0.25)  # decades of the smoother's weight of fourth differences
FARTHEST = 0.5  # of a row: a stamp further from its even time belongs to another row
CURRENT_ROWS = 4  # commands to which the current of a row is compared: its own and those before
CURRENT = CHANNELS.index("current_A")
SPEED_OF = tuple(
    (CHANNELS.index(f"{part}_angle_rad"), CHANNELS.index(f"{part}_velocity_rad_per_s"))
    for part in ("motor", "load")
)


class RowTimes(StrEnum):
    """What the stamps of a log are the times of."""

    LOGGED = "readings and commands"
    READINGS = "the readings only (commands act at even times)"
    NEITHER = "neither readings nor commands (both are at even times)"


@dataclass(frozen=True, kw_only=True)
class CommandTiming:
    """How a command moves between rows (linearly, or held) and what the stamps say.

    Attributes
    ----------
    fast_share : float
        Share of a command's fast part that acts, where the command turns often (`turns_often`); the
        fast part is what smoothing removes (`mean_commands`). 1: commands act as logged.
    """

    linear: bool = False
    rows: RowTimes = RowTimes.LOGGED
    fast_share: float = 1.0

    @property
    def smooth(self) -> bool:
        """Whether commands are smoothed."""
        return self.fast_share < 1.0


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
    found = [replace(timing, rows=t) for t in rows]
    plain = (False, True) if timing.smooth else (not timing.linear,)
    found += [replace(timing, linear=x, fast_share=1.0) for x in plain]
    if not timing.smooth and any(turns_often(r[r.command_name]) for r in driven):
        found.append(replace(timing, linear=True, fast_share=FAST_SHARE))
    return found


def turns_often(command: NDArray) -> bool:
    """Whether the change of a command (n,) reverses its sign in more than `TURNS` of the rows."""
    steps = np.diff(command)
    return bool(np.mean(steps[1:] * steps[:-1] < 0.0) > TURNS) if len(steps) > 1 else False


def mean_commands(command: NDArray, fast_share: float) -> NDArray:
    """Estimated mean of each row's commands from one of them (n,): smoothed, plus a share.

    A loop that runs faster than its log gives many commands in a row. The logged one contains the
    quantisation noise of its own encoder sample, amplified by the derivative: a fit that uses it as
    the applied command underestimates the gain (errors in variables). The smoother penalises fourth
    differences, with the weight of smallest generalised cross-validation, by a cosine transform:
    Garcia, Computational Statistics & Data Analysis 54 (2010) 1167, eqs. 8, 13 and 14. (Second
    differences, as there, attenuate the fastest motion in the command.) The straight line through
    the first and the last value is removed before, because the transform implies level ends. The
    result stays within the log's commands: a smoother overshoots next to a command at its limit.

    Parameters
    ----------
    fast_share : float
        Share of what the smoother removes, that is added again.
    """
    n = len(command)
    line = np.linspace(command[0], command[-1], n)
    spectrum = dct(command - line, norm="ortho")
    roughness = (2.0 - 2.0 * np.cos(np.pi * np.arange(n) / n)) ** 4

    def passed(log_weight: float) -> NDArray:
        return 1.0 / (1.0 + 10.0**log_weight * roughness)

    def validation(log_weight: float) -> float:
        share = passed(log_weight)
        return float(np.sum(((1.0 - share) * spectrum) ** 2) / (n - np.sum(share)) ** 2)

    best = min(np.arange(*LOG_WEIGHTS), key=validation)
    slow = line + idct(passed(best) * spectrum, norm="ortho")
    return np.clip(slow + fast_share * (command - slow), np.min(command), np.max(command))


def current_is_commanded(case: Case) -> bool:
    """Whether a measured current is that of the current commands in the log.

    A loop that runs faster than its log, or a slow amplifier, applies currents that no row holds;
    then the measured current is no reading of what the model simulates. Compared are the fastest
    errors of a regression on the last commands: with an offset, a drift, a scale factor, a delay or
    a limit they are as small as the sensor's noise in at least one recording. A current of the
    wrong sign or unit is none of these.
    """
    read = [
        r for r in case.identification
        if r.command_name == "current_command_A" and "current_A" in r.responses
    ]  # fmt: skip
    for r in read:
        gain, noise = _gain_of_commands(r)
        floor = noise_floor(case.rig, r, order=4)["current_A"]
        if 1.0 / FACTOR < gain < FACTOR and noise < APPLIED_CURRENT * floor:
            return True
    return False


def _gain_of_commands(r: Recording) -> tuple[float, float]:
    """Steady gain of a current by its last commands, and the apparent noise [A] that they leave."""
    command, current = r["current_command_A"], r["current_A"]
    rows, last = r.rows, CURRENT_ROWS - 1
    if rows < 2 * CURRENT_ROWS:
        return 0.0, np.inf
    columns = [command[last - j : rows - j] for j in range(CURRENT_ROWS)]
    columns += [np.ones(rows - last), r.time_s[last:]]
    design = np.stack(columns, axis=1)
    found = np.linalg.lstsq(design, current[last:], rcond=None)[0]
    left = current[last:] - design @ found
    return float(np.sum(found[:CURRENT_ROWS])), apparent_noise(left, order=2)


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
    row = float(np.mean(np.diff(time_s)))
    since = np.where(ahead_s > 0.0, ahead_s, ahead_s + row)  # the command that drives it acts
    share = np.ones_like(since)
    if winding_time_s > 1e-3 * row:
        share = np.expm1(-since / winding_time_s) / np.expm1(-row / winding_time_s)
    return _expanded(np.ascontiguousarray(runs), ahead_s, time_s, begins, share, row)


@njit(cache=True, nogil=True, error_model="numpy")
def _expanded(runs, ahead, time, begins, share, row):
    """Runs (m, n, 7) about their rows; `share` (n,) of its change that a current has made."""
    m, n, channels = runs.shape
    out, left, right = np.empty_like(runs), np.empty(channels), np.empty(channels)
    for t in range(n):
        before, after = not begins[t], not begins[t + 1]
        rate_before = 1.0 / (time[t] - time[t - 1]) if before else 0.0
        rate_after = 1.0 / (time[t + 1] - time[t]) if after else 0.0
        fraction = ahead[t] / row if before and after else 0.0
        toward = right if ahead[t] > 0.0 else left
        for i in range(m):
            for c in range(channels):
                here = runs[i, t, c]
                left[c] = (here - runs[i, t - 1, c]) * rate_before if before else 0.0
                right[c] = (runs[i, t + 1, c] - here) * rate_after if after else left[c]
                if not before:
                    left[c] = right[c]
                second_order = fraction * (right[c] - left[c])
                out[i, t, c] = here + 0.5 * ahead[t] * (left[c] + right[c] + second_order)
            for angle, speed in SPEED_OF:
                mean_speed = runs[i, t, speed] + 0.5 * ahead[t] * toward[speed]
                out[i, t, angle] = runs[i, t, angle] + ahead[t] * mean_speed
            change = row * toward[CURRENT]
            begun = runs[i, t, CURRENT] - (0.0 if ahead[t] > 0.0 else change)
            out[i, t, CURRENT] = begun + share[t] * change
    return out
