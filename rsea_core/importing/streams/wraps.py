"""Angles that start again after a turn: found by jumps of a whole turn between two rows."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rsea_core.importing.streams.column_names import name_evidence
from rsea_core.machine.rig import Rig
from rsea_core.recordings.log_clock import unwrapped

CALM = 0.3  # of a turn: at most what an angle moves between two rows
EDGE = 1e-3  # of a turn, beyond its ends
COUNTS = (*(2.0**k for k in range(8, 33)), 1000.0, 2000.0, 4000.0, 10_000.0, 36_000.0)
TURNS = {"deg": (360.0,), "rad": (2.0 * np.pi,), "turn": (1.0,), "count": COUNTS}


def wraps_of(
    raw: Mapping[str, NDArray], units: Mapping[str, str], rig: Rig | None
) -> dict[str, float]:
    """Column to its turn, in the log's unit, of the angles that wrap.

    Parameters
    ----------
    raw : mapping of column name to (n,) array
        As logged.
    units : mapping of column name to the unit that the file states
    """
    own = () if rig is None else (rig.motor_encoder_counts_per_rev, rig.load_encoder_counts_per_rev)
    found = {}
    for name, values in raw.items():
        evidence = name_evidence(name, units.get(name))
        if evidence.quantity != "angle" or evidence.is_goal or not np.all(np.isfinite(values)):
            continue
        turns = TURNS.get(evidence.unit or "", (*TURNS["deg"], *TURNS["rad"], 1.0, *COUNTS))
        turn = _turn(values, sorted({*turns, *(float(n) for n in own if n)}))
        if turn is not None:
            found[name] = turn
    return found


def without_wraps(raw: Mapping[str, NDArray], wraps: Mapping[str, float]) -> dict[str, NDArray]:
    """The columns with the turns of those that wrap counted."""
    return {n: unwrapped(v, wraps[n]) if n in wraps else v for n, v in raw.items()}


def _turn(values: NDArray, turns: list[float]) -> float | None:
    """The turn within whose ends an angle stays, and of which it jumps at times."""
    steps = np.abs(np.diff(values))
    low, high = float(values.min()), float(values.max())
    for turn in turns:
        edge = EDGE * turn
        inside = any(low >= a - edge and high <= a + turn + edge for a in (0.0, -0.5 * turn))
        jumps = steps > (1.0 - CALM) * turn
        if inside and jumps.any() and np.all(steps[~jumps] < CALM * turn):
            return turn
    return None
