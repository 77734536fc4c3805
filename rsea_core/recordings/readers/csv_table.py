"""Rows of a CSV file of any dialect as columns of numbers.

Comments, repeated headers and lines of text behind the last row are left out; cells that hold a
list (`"[0.1, 0.2]"`), dates, flags or units are converted; other columns of text are named and left
out, but for one that says which signal a row is of: each signal is then a stream.
"""

import contextlib
import csv
import io
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RecordingError
from rsea_core.recordings.readers.log import WIDEST, Log, Stream, flat_columns, library
from rsea_core.recordings.readers.tables.cells import MISSING, is_value, numbers_of
from rsea_core.recordings.readers.tables.csv_dialect import COMMENTS, Dialect, cells_of, sniff

CHUNK_ROWS = 200_000
TAIL_BYTES = 65536
COMMENT_LINE = re.compile(r"(?m)^[ \t]*(?:#|%|//)[^\r\n]*(?:\r\n|\n|\r|$)")
BEYOND = "\0beyond"  # the column behind the last one, which has to stay empty
FEWEST_SIGNALS, FEWEST_ROWS = 2, 3


def read_csv(path: Path, report=None, wanted: frozenset[str] | None = None) -> Log:
    """The columns of a CSV file of any dialect.

    Parameters
    ----------
    report : callable of str, optional
        Told how far a large file is read.
    wanted : set of str, optional
        Columns to keep; an array's by its own name. None keeps all.

    Raises
    ------
    RecordingError
        If the file cannot be read as rows of columns; one line, with the row where one is wrong.
    """
    dialect = sniff(path)
    parts = _chunks(path, dialect, report, wanted)
    arrays: dict[str, object] = {}
    units, text = dict(dialect.units), {}
    for name in list(parts):
        values = np.concatenate(parts.pop(name)) if parts[name] else np.empty(0)
        found = numbers_of(values, dialect.decimal) if values.dtype == object else None
        if found is None and values.dtype == object:
            text[name] = values
        else:
            arrays[name] = values if found is None else found.values
            units |= {name: found.unit} if found is not None and found.unit else {}
    columns = flat_columns(arrays)
    if not columns:
        raise RecordingError(f"{path}: has no column of numbers; text: {', '.join([*text][:5])}")
    streams = _signals(columns, text) or (Stream(columns=columns, units=units, text=tuple(text)),)
    return Log(path=path, format=f"CSV ({dialect.described()})", streams=streams)


def _signals(columns: Mapping[str, NDArray], text: Mapping[str, NDArray]) -> tuple[Stream, ...]:
    """A stream for each signal of a log of time, signal and value; none for another log."""
    if len(columns) != 2 or len(text) != 1:
        return ()
    rising = [n for n, v in columns.items() if np.all(np.diff(v) >= 0.0) and np.ptp(v) > 0.0]
    keys, rows = np.unique(next(iter(text.values())).astype(str), return_inverse=True)
    many = FEWEST_SIGNALS <= keys.size <= min(WIDEST, rows.size // 10)
    if not rising or not many:
        return ()
    clock = rising[0]
    value = next(n for n in columns if n != clock)
    return tuple(
        Stream(name=key, columns={clock: columns[clock][own], key: columns[value][own]})
        for key, own in ((key, rows == k) for k, key in enumerate(keys.tolist()))
        if own.sum() >= FEWEST_ROWS and key != clock
    )


class _Rows:
    """The text of a table from its first row on, without comments and repeated headers."""

    def __init__(self, stream, dialect: Dialect):
        self._stream = stream
        self._heading = dialect.heading
        # a first row with one cell more: a reader then sees where later rows have too many
        self._first = dialect.delimiter.join(["nan"] * (len(dialect.names) + 1)) + "\n"
        for _ in range(dialect.skip):
            stream.readline()

    def read(self, size: int = -1) -> str:
        """Whole lines of about so many characters; "" at the end."""
        if self._first:
            first, self._first = self._first, ""
            return first
        while block := self._stream.read(size):
            if block[-1] not in "\r\n":
                block += self._stream.readline()
            block = block.replace("\u2212", "-")  # the minus sign of printed text
            if any(sign in block for sign in COMMENTS):
                block = COMMENT_LINE.sub("", block)
            for line in self._heading:
                if line in block:
                    block = re.sub(rf"(?m)^{re.escape(line)}(\r\n|\n|\r|$)", "", block)
            if block:
                return block
        return ""

    def __iter__(self):
        return iter(self._stream)


def _chunks(path: Path, d: Dialect, report, wanted) -> dict[str, list[NDArray]]:
    pandas = library("pandas", path)
    all_named = wanted is not None and wanted <= set(d.names)  # else an error names all of them
    kept = [n for n in d.names if not all_named or n in wanted]
    parts: dict[str, list[NDArray]] = {name: [] for name in kept}
    size, rows = path.stat().st_size, 0
    behind = _lines_behind(path, d)
    options = {
        "sep": r"\s+" if d.delimiter == " " else d.delimiter, "decimal": d.decimal,
        "thousands": d.thousands, "header": None, "names": [*d.names, BEYOND],
        "usecols": [*kept, BEYOND], "chunksize": CHUNK_ROWS, "index_col": False,
        "skipinitialspace": True, "skip_blank_lines": True, "na_values": list(MISSING),
    }  # fmt: skip
    try:
        with (
            open(path, encoding=d.encoding, newline="") as stream,
            pandas.read_csv(_Rows(stream, d), **options) as reader,
        ):
            for k, given in enumerate(reader):
                chunk = given[1:] if k == 0 else given
                _require_no_more(path, d, chunk[BEYOND].notna().to_numpy(), rows)
                rows += len(chunk)
                for name in kept:
                    parts[name].append(chunk[name].to_numpy())
                if report is not None and size > 50_000_000:
                    share = stream.buffer.tell() / size
                    report(f"{path.name}: {rows} rows read, {100 * share:.0f} %")
    except UnicodeError as problem:
        raise RecordingError(f"{path}: is not {d.encoding} text throughout") from problem
    except (pandas.errors.ParserError, ValueError, csv.Error) as problem:
        line = re.search(r"line (\d+)", str(problem))
        row = "a row" if line is None else f"row {int(line.group(1)) + d.skip}"
        raise RecordingError(f"{path}: {row} has more or fewer values than the header") from problem
    return {name: _without_last(own, behind) for name, own in parts.items()}


def _require_no_more(path: Path, d: Dialect, beyond: NDArray, rows: int) -> None:
    if beyond.any():
        row = rows + int(np.argmax(beyond)) + 1
        raise RecordingError(f"{path}: data row {row} has more than {len(d.names)} values")


def _without_last(parts: list[NDArray], rows: int) -> list[NDArray]:
    """The chunks of a column without the last rows, which were text."""
    if not rows or not parts:
        return parts
    last = parts[-1][:-rows]
    if last.dtype == object:
        with contextlib.suppress(ValueError, TypeError):
            last = last.astype(float)
    return [*parts[:-1], last]


def _is_text(cells: list[str], width: int) -> bool:
    """Whether a line is no row: words only, or fewer cells that begin with a word."""
    return not any(map(is_value, cells)) or (len(cells) < width and not is_value(cells[0]))


def _lines_behind(path: Path, d: Dialect) -> int:
    """How many lines of text follow the last row.

    Raises
    ------
    RecordingError
        If the last row has fewer values: the file was cut off while it was written.
    """
    with open(path, "rb") as stream:
        stream.seek(0, io.SEEK_END)
        stream.seek(max(0, stream.tell() - TAIL_BYTES) // 2 * 2)
        encoding = "utf-16-le" if d.encoding == "utf-16" else d.encoding
        tail = stream.read()
        if d.encoding == "utf-16":
            stream.seek(0)
            encoding = "utf-16-be" if stream.read(2) == b"\xfe\xff" else encoding
    given = re.split(r"\r\n|\n|\r", tail.decode(encoding, "ignore"))[1:]
    lines = [x for x in given if x.strip() and not x.lstrip().startswith(COMMENTS)]
    behind = 0
    while lines and _is_text(cells_of(lines[-1], d.delimiter), len(d.names)):
        lines.pop()
        behind += 1
    found = len(cells_of(lines[-1], d.delimiter)) if lines else 0
    if lines and d.delimiter != " " and found < len(d.names):
        raise RecordingError(
            f"{path}: the last row has {found} of {len(d.names)} values: the file is cut off"
        )
    return behind
