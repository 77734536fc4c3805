"""A log through its column map: columns of the contract in SI, each reading at its own time.

Columns of other streams (topics, rates) than the first reading's are brought to its times, commands
by holding, readings by straight lines, and a note says so; nothing is resampled without one.
"""

import ast
import difflib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RecordingError
from rsea_core.recordings.column_map import ColumnMap, ColumnSource
from rsea_core.recordings.finding import Finding, Kind
from rsea_core.recordings.log_clock import continuous, rows_written_once, slope_over, unwrapped
from rsea_core.recordings.readers.log import LOG_TIME, Log, Stream
from rsea_core.recordings.readers.open_log import open_log
from rsea_core.recordings.units import to_si, unit_of_column

SPARSE = 0.02  # share of empty cells from which a column was written at its own, slower rate
OVERLAP = 0.5  # of the shorter stream: less in common are two clocks
CLOCK = "time_s"


class NoNumbersError(RecordingError):
    """A column all of whose cells are empty."""


def columns_of_log(
    paths: tuple[Path, ...],
    columns: ColumnMap,
    *,
    gear_ratio: float | None,
    held: tuple[str, ...] = (),
    window_s: tuple[float | None, float | None] = (None, None),
    report: Callable[[str], None] | None = None,
) -> tuple[dict[str, NDArray], dict[str, NDArray], tuple[Finding, ...]]:
    """Columns of the contract, references as logged, and what was done.

    Parameters
    ----------
    paths : tuple of Path
        The log; further files of the same clock.
    held : tuple of str
        Columns that hold their value from row to row; the others are sampled signals.
    window_s : (start, end)
        Seconds since the first row of the streams named to keep; None keeps all.

    Raises
    ------
    RecordingError
        If a column is not there (with the nearest names), a unit is wrong, or clocks disagree.
    """
    log = read_streams(paths, columns, report)
    path = paths[0]
    found = {s.target: _series(path, log, columns, s) for s in columns.sources if s.target != CLOCK}
    if not found:
        raise RecordingError(f"{path}: [columns] names no reading")
    base = next((t for t in found if t.endswith("angle_rad")), next(iter(found)))
    time = found[base][0]
    keep, cut = _common_rows(path, found, time)
    data, notes = {CLOCK: time}, [*log.notes, *cut]
    for name, (own, values) in found.items():
        if not (own is time or np.array_equal(own, time)):
            values = _brought(time, own, values, name in held)
            how = "held" if name in held else "by straight lines"
            text = f"{name} ({own.size} rows at its own times) brought to those of {base}, {how}"
            notes.append(text)
        data[name] = _on_side(columns.source(name), values, gear_ratio, path)
    begin = min(float(t[0]) for t, _ in found.values())
    first, last = (
        edge if at is None else at + begin for at, edge in zip(window_s, (-np.inf, np.inf))
    )
    keep &= (time >= first - 1e-9) & (time <= last + 1e-9)
    if keep.sum() < 3:
        raise RecordingError(f"{path}: {int(keep.sum())} rows are left between start_s and end_s")
    references, empty = _references(path, log, columns, time, keep)
    notes += empty
    if not keep.all():
        data = {name: values[keep] for name, values in data.items()}
    data[CLOCK] = data[CLOCK] - data[CLOCK][0]
    if references:
        notes.append(f"kept as references, not fitted: {', '.join(references)}")
    made = (Finding(kind=Kind.READER, text=text, file=path.name) for text in notes)
    return data, references, tuple(made)


def _common_rows(
    path: Path, found: dict[str, tuple[NDArray, NDArray]], time: NDArray
) -> tuple[NDArray, list[str]]:
    """Rows at which every stream has begun and goes on, and a note where others are left out."""
    others = [t for t, _ in found.values() if t is not time and not np.array_equal(t, time)]
    lowest = max([time[0], *(t[0] for t in others)])
    highest = min([time[-1], *(t[-1] for t in others)])
    if highest - lowest < OVERLAP * min([np.ptp(time), *(np.ptp(t) for t in others)]):
        ranges = ", ".join(f"{n} {t[0]:.6g} to {t[-1]:.6g} s" for n, (t, _) in found.items())
        raise RecordingError(f"{path}: two clocks that disagree: {ranges}")
    keep = (time >= lowest - 1e-9) & (time <= highest + 1e-9)
    left = int((~keep).sum())
    return keep, [f"{left} rows left out that not every stream covers"] if left else []


def identity_map(path: Path, targets: tuple[str, ...]) -> ColumnMap:
    """The map of a log whose columns have the contract's names already, in any format.

    Raises
    ------
    RecordingError
        If none of its streams has `time_s`, or a column has another name.
    """
    log = open_log(path)
    for stream in log.streams:
        if CLOCK in stream.columns:
            foreign = next((n for n in stream.columns if n not in targets), None)
            if foreign is not None:
                raise RecordingError(
                    f"{path}: unknown column {foreign!r}; {_nearest(foreign, list(targets))};"
                    " `dftfs import` maps own names"
                )
            topic = stream.name or None
            return ColumnMap(
                sources=tuple(ColumnSource(target=n, name=n, topic=topic) for n in stream.columns)
            )
    names = [n for s in log.streams for n in s.columns][:6]
    raise RecordingError(
        f"{path}: {log.format} with columns {', '.join(names)}, without time_s: [columns] in"
        " rig.toml has to name them; `dftfs import` proposes that table"
    )


class Streams:
    """The streams of a log with their times in seconds.

    Attributes
    ----------
    streams : list of (Stream, (n,) times)
    notes : tuple of str
        What was done to their clocks.
    """

    def __init__(self, streams: list[tuple[Stream, NDArray]], notes: tuple[str, ...] = ()):
        self.streams = streams
        self.notes = notes


def read_streams(
    paths: tuple[Path, ...], columns: ColumnMap, report: Callable[[str], None] | None = None
) -> Streams:
    """The streams that a map names, each with its times; errors as `columns_of_log`."""
    own: list[Stream] = []
    for path in paths:
        log = open_log(path, report, _wanted(columns))
        log = log if columns.channels is None else by_channel(log, columns)
        label = path.stem if len(paths) > 1 else ""
        own += [replace(s, name=s.name or label) for s in log.streams]
    timed, notes = [], []
    for given in own:
        stream, clock_notes = _with_clock(given, columns)
        time = _times(paths[0], stream, columns)
        if time is not None:
            timed.append((stream, time))
            notes += [f"{stream.name}: {text}" if stream.name else text for text in clock_notes]
    if not timed:
        source = columns.source(CLOCK)
        if source is not None:
            raise RecordingError(f"{paths[0]}: {_missing(source.name, own)}")
        raise RecordingError(
            f"{paths[0]}: a log without time: [columns] needs time_s, or rate_Hz where it has none"
        )
    return Streams(timed, tuple(notes))


def _with_clock(stream: Stream, columns: ColumnMap) -> tuple[Stream, list[str]]:
    """The stream with its clock's wraps and restarts undone and no row twice; what was done."""
    source = columns.source(CLOCK)
    name = LOG_TIME if source is None else source.name
    if name not in stream.columns or columns.rate_Hz is not None:
        return stream, []
    time, undone = continuous(stream.columns[name])
    table = {**stream.columns, name: time}
    rows, left = rows_written_once(table, name)
    if left is not None:
        table = {n: v[rows] for n, v in table.items()}
    return replace(stream, columns=table), [text for text in (undone, left) if text]


def _wanted(columns: ColumnMap) -> frozenset[str] | None:
    """Names whose columns are read from a large table; None where arrays or formulas are named."""
    if columns.channels is not None or columns.joint is not None:
        return None
    if any(s.formula for s in columns.sources) or "*" not in columns.ignored:
        return None
    names = [*(s.name for s in columns.sources), *columns.references]
    return None if any("[" in n for n in names) else frozenset(names)


def _times(path: Path, stream: Stream, columns: ColumnMap) -> NDArray | None:
    if columns.rate_Hz is not None:
        return np.arange(stream.rows) / columns.rate_Hz
    source = columns.source(CLOCK)
    name = LOG_TIME if source is None else source.name
    if name not in stream.columns:
        return None
    values = stream.columns[name]
    unit = "s" if source is None else source.unit or stream.units.get(name) or "s"
    scale = 1.0 if source is None else source.sign * source.scale
    zero = 0.0 if source is None else source.zero
    with_context = f"{path}: time_s"
    try:
        return scale * to_si(values - zero, unit, "s")
    except RecordingError as problem:
        raise RecordingError(f"{with_context}: {problem}") from problem


def by_channel(log: Log, columns: ColumnMap) -> Log:
    """A log of one reading a row as a stream for each channel; times that stand at 0 are none.

    Raises
    ------
    RecordingError
        If a column that the map names is not there.
    """
    names = dict(columns.channels)
    for name in names.values():
        if all(name not in s.columns for s in log.streams):
            raise RecordingError(f"{log.path}: {_missing(name, log.streams)}")
    table = log.streams[0].columns
    channel, value, time = (table[names[k]] for k in ("channel", "value", "time"))
    source = columns.source(CLOCK)
    clock = names["time"] if source is None else source.name
    streams = []
    for key in np.unique(channel):
        rows = (channel == key) & (time > 0.0)
        own = np.flatnonzero(rows)  # a reading that a logger wrote twice is one
        again = (np.diff(time[own]) == 0.0) & (np.diff(value[own]) == 0.0)
        rows[own[1:][again]] = False
        if rows.sum() >= 3:
            label = f"{key:g}"
            streams.append(Stream(name=label, columns={clock: time[rows], label: value[rows]}))
    return replace(log, streams=tuple(streams))


def _named(path: Path, log: Streams, name: str, topic: str | None) -> tuple[NDArray, NDArray]:
    found = [
        (stream, time)
        for stream, time in log.streams
        if name in stream.columns and topic in (None, stream.name)
    ]
    if not found:
        if topic is not None and all(s.name != topic for s, _ in log.streams):
            known = [s.name for s, _ in log.streams]
            raise RecordingError(f"{path}: topic {topic!r} is not there; {_nearest(topic, known)}")
        raise RecordingError(f"{path}: {_missing(name, [s for s, _ in log.streams])}")
    if len(found) > 1:
        topics = ", ".join(s.name or "(first)" for s, _ in found)
        raise RecordingError(f"{path}: column {name!r} is in several streams: say topic = {topics}")
    stream, time = found[0]
    values = stream.columns[name]
    empty = ~np.isfinite(values)
    share = float(empty.mean())
    if share >= 1.0:
        raise NoNumbersError(f"{path}: column {name!r} holds no numbers")
    if share > SPARSE:  # a topic of its own rate in a common table
        return time[~empty], values[~empty]
    if share > 0.0:
        row = int(np.argmax(empty)) + 1
        raise RecordingError(f"{path}: column {name!r}, data row {row}: is not a finite number")
    return time, values


def _series(
    path: Path, log: Streams, columns: ColumnMap, source: ColumnSource
) -> tuple[NDArray, NDArray]:
    """Times and SI values of one column, still on its own side of the gear."""
    if source.formula is not None:
        time, values = _evaluated(path, log, source)
    else:
        name = source.name.replace("{joint}", columns.joint or "{joint}")
        time, values = _named(path, log, name, source.topic)
    target = unit_of_column(source.target)
    stated = _stated_unit(log, source)
    try:
        values = values if source.wrap is None else unwrapped(values, source.wrap)
        si = to_si(values - source.zero, source.unit or stated or target, target,
                   source.counts_per_rev, linear=columns.linear)  # fmt: skip
    except RecordingError as problem:
        raise RecordingError(
            f"{path}: {source.target} from {source.name!r}: {problem}"
        ) from problem
    factor = source.sign * source.scale
    return time, si if factor == 1 else factor * si


def _stated_unit(log: Streams, source: ColumnSource) -> str | None:
    """The unit that the file states; a map's own unit is preferred to it."""
    for stream, _ in log.streams:
        if source.name in stream.units and source.topic in (None, stream.name):
            return stream.units[source.name]
    return None


def _on_side(
    source: ColumnSource, values: NDArray, gear_ratio: float | None, path: Path
) -> NDArray:
    own = source.target.split("_")[0]
    if source.side is None or own not in ("motor", "load") or source.side == own:
        return values
    if gear_ratio is None:
        raise RecordingError(f"{path}: {source.target}: side needs a gear_ratio in [rig]")
    return values * gear_ratio if own == "motor" else values / gear_ratio


def _brought(time: NDArray, own: NDArray, values: NDArray, hold: bool) -> NDArray:
    if hold:
        before = np.searchsorted(own, time + 1e-9, side="right") - 1
        return values[np.clip(before, 0, own.size - 1)]
    return np.interp(time, own, values)


def _references(path: Path, log: Streams, columns: ColumnMap, time: NDArray, keep: NDArray):
    found, empty = {}, []
    for given in columns.references:
        name = given.replace("{joint}", columns.joint or "{joint}")
        topic, apart, bare = name.rpartition(": ")
        try:
            own, values = _named(path, log, bare if apart else name, topic if apart else None)
        except NoNumbersError:
            empty.append(name)
            continue
        found[name] = (values if own is time else _brought(time, own, values, True))[keep]
    return found, [f"column {n!r} holds no numbers: left out" for n in empty]


def _evaluated(path: Path, log: Streams, source: ColumnSource) -> tuple[NDArray, NDArray]:
    """A formula of quoted columns, on the times of the first one; nothing but + - * / and
    `rate('column', seconds)`, the slope over so many seconds, is run."""
    clock: list[NDArray] = []
    fault = RecordingError(
        f"{path}: {source.target}: formula {source.formula!r}: only numbers, quoted columns,"
        " + - * /, rate('column', seconds) and brackets are allowed"
    )

    def value(node: ast.AST):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            time, values = _named(path, log, node.value, source.topic)
            if not clock:
                clock.append(time)
            return values if time is clock[0] else _brought(clock[0], time, values, True)
        if isinstance(node, ast.Constant) and type(node.value) in (int, float):
            return node.value
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "rate":
            if len(node.args) != 2 or not isinstance(node.args[0], ast.Constant):
                raise fault
            own, values = _named(path, log, str(node.args[0].value), source.topic)
            derivative = slope_over(own, values, float(value(node.args[1])))
            if not clock:
                clock.append(own)
            return derivative if own is clock[0] else _brought(clock[0], own, derivative, False)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            return -value(node.operand)
        operations = {ast.Add: np.add, ast.Sub: np.subtract, ast.Mult: np.multiply}
        operations[ast.Div] = np.divide
        if isinstance(node, ast.BinOp) and type(node.op) in operations:
            return operations[type(node.op)](value(node.left), value(node.right))
        raise fault

    try:
        tree = ast.parse(source.formula.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError) as problem:
        raise fault from problem
    values = value(tree.body)
    if not clock:
        raise fault
    return clock[0], values


def _missing(name: str, streams) -> str:
    known = list(dict.fromkeys(n for s in streams for n in s.columns))
    return f"has no column {name!r}; {_nearest(name, known)}"


def _nearest(name: str, known: list[str]) -> str:
    match = difflib.get_close_matches(name, known, n=3, cutoff=0.0)
    return f"nearest: {', '.join(repr(m) for m in match)}" if match else "there is none"
