"""The clock that the streams of a log have in common, and streams that have none."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rsea_core.errors import RecordingError
from rsea_core.importing.streams.column_names import name_evidence
from rsea_core.recordings.mapped_log import OVERLAP
from rsea_core.recordings.readers.log import LOG_TIME, Stream
from rsea_core.recordings.readers.messages import STAMP

OTHER_UNIT = 50.0  # times as long and as coarse: a clock in another unit


def clock_name(stream: Stream, others: Sequence[Stream] = ()) -> str | None:
    """The column of times; one that the other streams of readings have too is preferred."""
    own = [n for n in stream.columns if name_evidence(n).quantity == "time"]
    own = [n for n in own if n not in (STAMP, LOG_TIME)]
    known = [n for n in (STAMP, *own, LOG_TIME) if n in stream.columns]
    common = [n for n in known if all(n in s.columns for s in others if has_readings(s))]
    return next(iter([*common, *known]), None)


def telling_name(name: str, topic: str | None) -> str:
    """What tells of a column: its name, or its topic where every message calls its number data."""
    return topic.replace("/", " ").strip() if topic and name == "data" else name


def has_readings(stream: Stream) -> bool:
    """Whether names of its columns say that they are readings, not goals."""
    found = [name_evidence(telling_name(n, stream.name)) for n in stream.columns]
    return any(e.quantity not in (None, "time") and not e.is_goal for e in found)


def require_one_clock(
    path: Path, base: Stream, streams: Sequence[tuple[Stream, str]], clock: str | None
) -> None:
    """Refuse streams of readings that no clock ties to the longest one.

    Parameters
    ----------
    streams : sequence of (stream, its name)
    clock : str or None
        The column of times of `base`.

    Raises
    ------
    RecordingError
        If one lacks that column, or its times have little in common or are in another unit.
    """
    others = [(s, name) for s, name in streams if s is not base and has_readings(s)]
    for stream, name in others if clock in base.columns else ():
        longest = base.name or next(own for s, own in streams if s is base) or "the longest"
        if clock in stream.columns:
            _require_same_times(path, (longest, base), (name, stream), clock)
        else:
            raise RecordingError(
                f"{path}: {name} has no column {clock!r} as {longest} has: its readings cannot be"
                " brought to one clock"
            )


def _require_same_times(
    path: Path, base: tuple[str, Stream], other: tuple[str, Stream], clock: str
) -> None:
    times = [stream.columns[clock] for _, stream in (base, other)]
    spans = [float(np.ptp(t)) for t in times]
    steps = [max(float(np.median(np.diff(t))), 1e-12) for t in times]
    common = min(float(t.max()) for t in times) - max(float(t.min()) for t in times)
    slower, longer = steps[1] / steps[0], spans[1] / max(spans[0], 1e-12)
    is_other_unit = min(slower, longer) > OTHER_UNIT or max(slower, longer) < 1.0 / OTHER_UNIT
    if common < OVERLAP * min(spans) or is_other_unit:
        ranges = ", ".join(
            f"{name} {t.min():.9g} to {t.max():.9g}" for (name, _), t in zip((base, other), times)
        )
        raise RecordingError(f"{path}: two clocks that disagree: {clock!r} of {ranges}")
