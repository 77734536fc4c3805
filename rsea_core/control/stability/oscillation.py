"""Whether a signal about a reference at rest comes to rest, swings on, or runs away."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

SETTLED = 0.5  # of the record: what happens before is the transient
PERIODS = 4
LASTING = 0.7  # of its first amplitude: a swing that keeps more is not dying out
GROWING = 1.15
DYING = 0.9  # of what moved a fifth of the record before: it is coming to rest
REST = 0.2  # of the record: its last parts, of which each is that long


@dataclass(frozen=True, kw_only=True)
class Oscillation:
    """A swing that does not die out.

    Attributes
    ----------
    amplitude : float
        At the end, half of peak to peak, in the signal's unit.
    frequency_Hz : float
    growth : float
        Amplitude of the last third of the periods over that of the first third.
    """

    amplitude: float
    frequency_Hz: float
    growth: float

    @property
    def is_growing(self) -> bool:
        """Whether it is larger at the end than when the transient was over."""
        return self.growth > GROWING

    def __str__(self) -> str:
        kind = "growing" if self.is_growing else "sustained"
        return f"{kind} oscillation of {self.amplitude:.3g} at {self.frequency_Hz:.3g} Hz"


def oscillation(time_s: NDArray, signal: NDArray, *, smallest: float) -> Oscillation | None:
    """The oscillation of the second half of a signal; None: it dies out or is below `smallest`.

    A slope is taken out first, so that a slow approach is no swing.
    """
    rows = time_s >= time_s[0] + SETTLED * (time_s[-1] - time_s[0])
    t = time_s[rows]
    x = signal[rows] - np.polyval(np.polyfit(t - t[0], signal[rows], 1), t - t[0])
    band = 0.1 * np.abs(x).max()  # counts of an encoder about zero are not periods
    rising, armed = [], False
    for j, value in enumerate(x):
        if value < -band:
            armed = True
        elif armed and value > band:
            rising.append(j)
            armed = False
    if len(rising) < PERIODS + 1:
        return None
    sizes = np.array([0.5 * np.ptp(x[a : b + 1]) for a, b in pairwise(rising)])
    third = max(sizes.size // 3, 1)
    first, last = float(np.median(sizes[:third])), float(np.median(sizes[-third:]))
    if last <= smallest or last < LASTING * first:
        return None
    return Oscillation(
        amplitude=last,
        frequency_Hz=float(sizes.size / (t[rising[-1]] - t[rising[0]])),
        growth=last / first,
    )


@dataclass(frozen=True, kw_only=True)
class Unrest:
    """What still moves at the end of a record.

    Attributes
    ----------
    moved : float
        Peak to peak of the last fifth, or what its mean is off that of the fifth before.
    is_dying : bool
        It is clearly less than a fifth earlier: a longer record may find it at rest.
    """

    moved: float
    is_dying: bool


def unrest(time_s: NDArray, signal: NDArray, *, smallest: float, still: float) -> Unrest | None:
    """What of a signal does not come to rest; None: nothing of it.

    Parameters
    ----------
    smallest : float
        Below it no growth from fifth to fifth is seen.
    still : float
        What a signal at rest may move by in the last fifth, and from the fifth before.
    """
    last = [1.0 - REST * j for j in (3, 2, 1, 0)]
    edges = time_s[0] + np.array(last) * (time_s[-1] - time_s[0])
    parts = [signal[(time_s >= a) & (time_s <= b)] for a, b in pairwise(edges)]
    if not all(np.isfinite(part).all() for part in parts):
        return Unrest(moved=np.inf, is_dying=False)
    sizes = [float(np.ptp(part)) for part in parts]
    drifts = [abs(float(b.mean() - a.mean())) for a, b in pairwise(parts)]
    grows = sizes[2] > max(smallest, GROWING * sizes[1]) and sizes[1] > GROWING * sizes[0]
    moved = max(sizes[2], drifts[1])
    if moved <= still and not grows:
        return None
    dying = not grows and moved < DYING * max(sizes[1], drifts[0])
    return Unrest(moved=moved, is_dying=dying)
