"""The clock that the streams of a log have in common, and streams that have none."""

import shlex
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RecordingError
from rsea_core.importing.streams.column_names import name_evidence
from rsea_core.recordings.mapped_log import OVERLAP
from rsea_core.recordings.readers.log import LOG_TIME, Stream
from rsea_core.recordings.readers.messages import STAMP

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
FEWEST_ROWS, MOST_LOST = 50, 0.2  # of the rows: a counter that lacks more counts something else
SAME_RATE = 1e-3  # relative
OTHER_UNIT = 50.0  # times as long and as coarse: a clock in another unit


def clock_name(stream: Stream, others: Sequence[Stream] = ()) -> str | None:
    """The column of times; one that the other streams of readings have too is preferred."""
    own = [n for n in stream.columns if name_evidence(n).quantity == "time"]
    own = [n for n in own if n not in (STAMP, LOG_TIME)]
    known = [n for n in (STAMP, *own, LOG_TIME) if n in stream.columns]
    common = [n for n in known if all(n in s.columns for s in others if has_readings(s))]
    return next(iter([*common, *known]), None)


def clock_notes(stream: Stream, rate_Hz: float) -> tuple[str, ...]:
    """Columns of a stream that show other times than the rate that is stated for its rows."""
    return tuple(
        text
        for name, values in stream.columns.items()
        if values.size > FEWEST_ROWS and np.all(np.diff(values) >= 0.0)
        for text in [_other_time(name, stream.units.get(name), values, rate_Hz)]
        if text is not None
    )


def _other_time(name: str, unit: str | None, values: NDArray, rate_Hz: float) -> str | None:
    rows, passed = values.size, float(values[-1] - values[0])
    evidence = name_evidence(name, unit)
    if evidence.quantity != "time":
        lost = passed - (rows - 1)
        steps = np.diff(values)
        counts = np.median(steps) == 1.0 and np.all(steps == np.round(steps))
        if not counts or not 1.0 <= lost <= MOST_LOST * rows:
            return None
        entry = f'{{ name = "{name}", scale = {1.0 / rate_Hz:.9g} }}'
        return (
            f"column {name!r} counts {lost:.0f} rows that the log lacks, which --rate-hz closes"
            f" up; it is the clock by --column {shlex.quote(f'time_s={entry}')}"
        )
    units = [evidence.unit] if evidence.unit in SECONDS else list(SECONDS)
    shares = {u: SECONDS[u] * passed * rate_Hz / (rows - 1) for u in units}
    own = min(shares, key=lambda u: abs(np.log(max(shares[u], 1e-12))))
    if abs(shares[own] - 1.0) * (rows - 1) < 1.5 or abs(shares[own] - 1.0) < SAME_RATE:
        return None
    return (
        f"column {name!r} passes {SECONDS[own] * passed:.6g} s, {rows} rows at --rate-hz"
        f" {rate_Hz:g} take {(rows - 1) / rate_Hz:.6g} s: rows were lost, or the rate is another;"
        f" it is the clock by --column {shlex.quote(f'time_s={name}:{own}')}"
    )


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
