"""The columns of a log on one clock, for looking at them, and the parts that it splits into."""

import itertools
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RecordingError
from rsea_core.files.toml_tables import nearest
from rsea_core.importing.streams.column_names import name_evidence
from rsea_core.importing.streams.common_clock import clock_name, require_one_clock, telling_name
from rsea_core.recordings.column_map import ColumnMap
from rsea_core.recordings.log_clock import continuous, longest_step
from rsea_core.recordings.mapped_log import by_channel
from rsea_core.recordings.readers.log import Log, Stream
from rsea_core.recordings.readers.messages import STAMP

SHORTEST = 0.01  # of the longest stream's rows: settings, not readings
FEW_READINGS = 100
JOINT_LIST = "joint_list.txt"
GOAL_FILE = re.compile(r"control|command|goal|setpoint", re.I)


@dataclass(frozen=True, kw_only=True)
class Column:
    """A column where it stands in a log."""

    name: str
    topic: str | None
    values: NDArray
    unit: str | None


def columns_on_one_clock(
    logs: Sequence[Log], joint: str | None, clock: str | None = None
) -> tuple[dict[str, Column], dict[str, str]]:
    """The columns of the logs of one recording by a unique label, at the longest stream's times.

    Other streams are brought there by holding, and so are rows at which a column has no cell:
    enough to recognise them, not to fit.

    Parameters
    ----------
    clock : str, optional
        The column of times; None: by its name.

    Returns
    -------
    (columns, labels)
        `labels` is what of a column's name says something, without the joint.

    Raises
    ------
    RecordingError
        If there are several joints and none is named, or the one named is not there.
    """
    streams = [
        (stream, stream.name or (log.path.stem if len(logs) > 1 else ""))
        for log in logs
        for stream in log.streams
    ]
    longest = max(s.rows for s, _ in streams)
    streams = [(s, topic) for s, topic in streams if s.rows >= max(10, SHORTEST * longest)]
    if not streams:
        raise RecordingError(f"{logs[0].path}: has {longest} rows; too few to recognise them")
    streams = [(_on_running_clock(s, clock), topic) for s, topic in streams]
    wanted = _joint_filter([s for s, _ in streams], joint, logs[0].path)
    streams = [(s, topic) for s, topic in streams if any(wanted(n) for n in s.columns)]
    base = max((s for s, _ in streams), key=lambda s: s.rows * sum(map(wanted, s.columns)))
    clock = clock or clock_name(base, [s for s, _ in streams])
    require_one_clock(logs[0].path, base, streams, clock)
    found: dict[str, Column] = {}
    labels: dict[str, str] = {}
    for stream, topic in sorted(streams, key=lambda item: item[0] is not base):
        rows = _rows_on(base, stream, clock)
        if rows is None:
            continue
        several = len(streams) > 1
        for name, values in stream.columns.items():
            other_clock = name == STAMP and clock not in (STAMP, None)
            if not wanted(name) or other_clock or (stream is not base and name == clock):
                continue
            label = name if name not in found else f"{topic}: {name}"
            own_topic = topic if several and name != clock else None
            held = _held(values)[rows]
            unit = stream.units.get(name)
            found[label] = Column(name=name, topic=own_topic, values=held, unit=unit)
            labels[label] = without_joint_label(label, found[label], joint)
    return found, labels


def _advancing(time: NDArray) -> NDArray:
    """Rows whose time is later than that of every row before them, but for a clock that wraps."""
    if np.mean(np.diff(time) < 0.0) > 0.0 or not np.all(np.isfinite(time)):
        return np.arange(time.size)
    return np.flatnonzero(np.concatenate(([True], np.diff(time) > 0.0)))


def _held(values: NDArray) -> NDArray:
    """Empty cells filled by the value before them; as given where all or none is empty."""
    there = np.flatnonzero(np.isfinite(values))
    if there.size in (0, values.size):
        return values
    last = np.searchsorted(there, np.arange(values.size), side="right") - 1
    return values[there[np.maximum(last, 0)]]


def channels_of(logs: Sequence[Log]) -> dict[str, str] | None:
    """Channel, value and time of a log with one reading a row; None for any other log.

    Such a log has three columns: a few whole numbers that change from row to row, and a clock
    that stands still or is 0 while the readings of one moment are written.
    """
    if len(logs) != 1 or len(logs[0].streams) != 1 or len(logs[0].streams[0].columns) != 3:
        return None
    columns = logs[0].streams[0].columns
    for channel, time in itertools.permutations(columns, 2):
        keys, stamps = columns[channel], columns[time]
        if not np.array_equal(keys, np.round(keys)) or keys.size < FEW_READINGS:
            continue
        own = np.diff(stamps[stamps > 0.0])
        several = 2 <= np.unique(keys).size <= keys.size / 10
        if not several or own.size < 0.2 * keys.size or np.mean(np.diff(keys) != 0.0) < 0.5:
            continue
        if np.mean(own == 0.0) > 0.05 and np.mean(own >= 0.0) > 0.5 and own.sum() > 0.0:
            value = next(n for n in columns if n not in (channel, time))
            return {"channel": channel, "value": value, "time": time}
    return None


def by_channels(logs: Sequence[Log], channels: Mapping[str, str]) -> list[Log]:
    """The logs with a stream for each channel."""
    columns = ColumnMap(channels=tuple(channels.items()))
    return [by_channel(log, columns) for log in logs]


def without_joint_label(label: str, column: Column, joint: str | None) -> str:
    """What of a column's name says something: without the joint, a goal's file named."""
    name = telling_name(column.name, column.topic)
    end = re.fullmatch(r"(.*)\[([^\]]+)\]", name) if joint is None else None
    if end and _side(end[2]):
        name = f"{end[2]} {end[1]}"
    bare = _without_joint(name, joint) or (label if name == column.name else name)
    is_goal = column.topic is not None and GOAL_FILE.search(column.topic)
    return f"goal {bare}" if is_goal else bare


def _on_running_clock(stream: Stream, clock: str | None) -> Stream:
    """The stream with its clock's wraps and restarts undone."""
    name = clock or clock_name(stream)
    if name not in stream.columns:
        return stream
    running, _ = continuous(stream.columns[name])
    return replace(stream, columns={**stream.columns, name: running})


def _rows_on(base: Stream, stream: Stream, clock: str | None) -> NDArray | None:
    if stream is base:
        return _advancing(base.columns[clock]) if clock in base.columns else np.arange(base.rows)
    if clock is None:
        return np.arange(base.rows) if stream.rows == base.rows else None
    if clock not in stream.columns:
        return None
    at = base.columns[clock][_advancing(base.columns[clock])]
    after = np.searchsorted(stream.columns[clock], at, side="right") - 1
    return np.clip(after, 0, stream.rows - 1)


def _joint_filter(streams: Sequence[Stream], joint: str | None, path: Path):
    """Whether a column is the joint's or no joint's."""
    names = [n for s in streams for n in s.columns]
    found = [m.groups() for n in names if (m := re.fullmatch(r"(.*)\[([^\]]+)\]", n))]
    labels = list(dict.fromkeys(label for _, label in found))
    stems = Counter(stem for stem, _ in dict.fromkeys(found))  # "position" of [hip] and [knee]
    indexed = list(
        dict.fromkeys(s for stem, s in found if stems[stem] > 1 and name_evidence(stem).quantity)
    )
    if joint is None:
        if len(indexed) > 1 and not _are_units(indexed) and not _are_sides(indexed):
            known = ", ".join(_listed_joints(path) or indexed)
            raise RecordingError(f"{path}: several joints ({known}): choose one with --joint")
        return lambda name: True
    own = _joint_label(path, joint, labels)
    if own in labels:
        return lambda name: f"[{own}]" in name or not re.search(r"\[[^\]]+\]$", name)
    if any(joint in n for n in names):
        return lambda name: joint in name or name_evidence(name).quantity == "time"
    known = _listed_joints(path) or indexed or names
    raise RecordingError(f"{path}: joint {joint!r} is not there; {nearest(joint, known)}")


def _are_sides(labels: Sequence[str]) -> bool:
    """Whether two "joints" are the two ends of one: a motor and its link."""
    return sorted(map(_side, labels)) == ["load", "motor"]


def _side(label: str) -> str:
    """The end that a label names in full; "" for a unit, as the m of mNm is none."""
    return (name_evidence(label).side or "") if len(label) > 3 and label.isalpha() else ""


def _are_units(labels: Sequence[str]) -> bool:
    return all(not label.isdigit() and name_evidence(f"x [{label}]").quantity for label in labels)


def _listed_joints(path: Path) -> list[str]:
    try:
        return (path.parent / JOINT_LIST).read_text(encoding="utf-8").split()
    except (OSError, UnicodeDecodeError):
        return []


def _joint_label(path: Path, joint: str, labels: Sequence[str]) -> str:
    listed = _listed_joints(path)
    return str(listed.index(joint)) if joint in listed and joint not in labels else joint


def _without_joint(name: str, joint: str | None) -> str:
    bare = re.sub(r"\[[^\]]*\]$", "", name) if joint is not None else name
    return bare if joint is None else bare.replace(joint, "").strip("_ .")


def parts_at_gaps(time_s: NDArray) -> list[tuple[float, float]]:
    """First and last second, since the first row, of runs between gaps or backward steps.

    A gap is what `read_recording` refuses in one recording.
    """
    edges = np.flatnonzero(np.diff(time_s) < 0.0) + 1
    open_runs, runs = [(a, b) for a, b in zip([0, *edges], [*edges, time_s.size])], []
    while open_runs:
        a, b = open_runs.pop()
        steps = np.diff(time_s[a:b])
        gaps = np.flatnonzero(steps > longest_step(steps)) + 1 if steps.size > 1 else ()
        cuts = [a, *(a + k for k in gaps), b]
        (open_runs if len(cuts) > 2 else runs).extend(itertools.pairwise(cuts))
    zero = time_s[0]
    return [(float(time_s[a] - zero), float(time_s[b - 1] - zero)) for a, b in sorted(runs)
            if b - a > 3]  # fmt: skip


def parts_at_flag(time_s: NDArray, flag: NDArray) -> list[tuple[float, float]]:
    """The runs in which a flag keeps a value other than 0."""
    edges = np.flatnonzero(np.diff(flag) != 0.0) + 1
    firsts, lasts = [0, *edges], [*(edges - 1), flag.size - 1]
    zero = time_s[0]
    return [(float(time_s[a] - zero), float(time_s[b] - zero)) for a, b in zip(firsts, lasts)
            if flag[a] != 0.0 and b - a >= 3]  # fmt: skip


def stated_units(columns: Mapping[str, Column]) -> dict[str, str]:
    """The units that the files state, by label."""
    return {label: c.unit for label, c in columns.items() if c.unit}
