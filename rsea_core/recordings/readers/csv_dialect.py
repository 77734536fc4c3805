"""CSV of any dialect: encoding, delimiter, decimal sign, header lines and units are found out.

What is decided comes from the first rows; every later row has to agree. Cells that hold a list
(`"[0.1, 0.2]"`), dates and flags are converted; a column of other text is named and left out.
"""

import contextlib
import csv
import io
import json
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RecordingError
from rsea_core.recordings.readers.log import Log, Stream, flat_columns, library

HEAD_BYTES = 1 << 16
CHUNK_ROWS = 200_000
DELIMITERS = (",", ";", "\t", "|", " ")
NUMBER = re.compile(r"^[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$|^[+-]?(nan|inf)$", re.I)
COMMA_NUMBER = re.compile(r"^[+-]?(\d{1,3}(\.\d{3})+|\d+)(,\d+)?([eE][+-]?\d+)?$")
POINT_THOUSANDS = re.compile(r"^[+-]?\d{1,3}(,\d{3})+(\.\d+)?$")
DATE = re.compile(r"^\d{4}-\d\d-\d\d[T ]\d\d:\d\d")
UNIT_CELL = re.compile(r"^[\[(]?[A-Za-zµμ°%/·*^0-9 .-]{0,12}[\])]?$")
UNIT_IN_NAME = re.compile(r"[\[(]\s*([^\[\]()]+?)\s*[\])]\s*$")
FLAGS = {"true": 1.0, "false": 0.0, "on": 1.0, "off": 0.0, "yes": 1.0, "no": 0.0}
COMMENTS = ("#", "%", "//")


@dataclass(frozen=True, kw_only=True)
class Dialect:
    """How a CSV file is written.

    Attributes
    ----------
    encoding, delimiter, decimal : str
    thousands : str or None
    skip : int
        Lines before the first row of data.
    names : tuple of str
    units : mapping of name to str
    """

    encoding: str
    delimiter: str
    decimal: str
    thousands: str | None
    skip: int
    names: tuple[str, ...]
    units: dict[str, str]


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
    text = []
    for name in list(parts):
        values = np.concatenate(parts.pop(name)) if parts[name] else np.empty(0)
        if values.dtype == object:
            values = _converted(values)
        if values is None:
            text.append(name)
        else:
            arrays[name] = values
    columns = flat_columns(arrays)
    if not columns:
        raise RecordingError(f"{path}: has no column of numbers; text: {', '.join(text[:5])}")
    stream = Stream(columns=columns, units=dialect.units, text=tuple(text))
    return Log(path=path, format=f"CSV ({_described(dialect)})", streams=(stream,))


def sniff(path: Path) -> Dialect:
    """How a CSV file is written, from its first rows.

    Raises
    ------
    RecordingError
        If it is empty, not text, or its rows are not columns.
    """
    try:
        with open(path, "rb") as stream:
            head = stream.read(HEAD_BYTES)
    except OSError as problem:
        raise RecordingError(f"{path}: cannot be read: {problem.strerror or problem}") from problem
    if not head.strip():
        raise RecordingError(f"{path}: is empty")
    encoding, text = _decoded(path, head)
    lines = text.splitlines()
    if len(head) == HEAD_BYTES and len(lines) > 1:
        lines = lines[:-1]
    body = [line for line in lines if line.strip() and not line.startswith(COMMENTS)]
    if len(body) < 2:
        raise RecordingError(f"{path}: has {len(body)} rows; a recording needs at least 3")
    delimiter, width = _delimiter(path, body)
    rows = [(k, _cells(line, delimiter)) for k, line in enumerate(lines)]
    first = next(
        (k for k, cells in rows if len(cells) == width and _is_data(cells) and lines[k].strip()),
        None,
    )
    if first is None:
        raise RecordingError(f"{path}: no row of numbers in the first {len(lines)} lines")
    data = [cells for k, cells in rows[first:] if len(cells) == width]
    decimal, thousands = _decimal(path, data, delimiter)
    names, units = _header([c for _, c in rows[:first]], width)
    return Dialect(
        encoding=encoding, delimiter=delimiter, decimal=decimal, thousands=thousands, skip=first,
        names=names, units=units,
    )  # fmt: skip


def has_numbers(path: Path) -> bool:
    """Whether a file's first rows are columns with numbers besides a count or a time.

    Notes of events and lists of names have none.
    """
    try:
        dialect = sniff(path)
    except RecordingError:
        return False
    return len(dialect.names) > 1 and "event" not in path.stem.lower()


def _decoded(path: Path, head: bytes) -> tuple[str, str]:
    if head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "utf-16", head[: len(head) // 2 * 2].decode("utf-16", errors="ignore")
    if b"\0" in head:
        raise RecordingError(f"{path}: is not text, nor a log of a known format")
    with contextlib.suppress(UnicodeDecodeError):
        return "utf-8-sig", head.decode("utf-8-sig")
    for cut in range(1, 4):  # a character may be cut at the end of the head
        with contextlib.suppress(UnicodeDecodeError):
            return "utf-8-sig", head[:-cut].decode("utf-8-sig")
    text = head.decode("cp1252", errors="replace")
    odd = sum(ch < " " and ch not in "\t\r\n" for ch in text)
    if odd > 0.01 * len(text):
        raise RecordingError(f"{path}: is not text, nor a log of a known format")
    return "cp1252", text


def _cells(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return line.split()
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]
    except (csv.Error, StopIteration):
        return []


def _delimiter(path: Path, body: list[str]) -> tuple[str, int]:
    """The sign that gives most rows the same number of columns, with numbers in them."""
    sample = body[-min(len(body) - 1, 60) :]
    best = (0.0, ",", 1)
    for sign in DELIMITERS:
        widths = [len(_cells(line, sign)) for line in sample]
        width = max(set(widths), key=widths.count)
        same = widths.count(width) / len(widths)
        cells = [c for line in sample for c in _cells(line, sign)]
        numeric = np.mean([_is_value(c) for c in cells]) if cells else 0.0
        if sign == "," and numeric > 0.9 and _is_halved(body, width):
            continue
        score = same * (0.2 + numeric) * (1.0 if width > 1 else 0.3) * (0.9 if sign == " " else 1)
        if score > best[0] + 1e-9:
            best = (score, sign, width)
    if best[0] < 0.3:
        raise RecordingError(
            f"{path}: rows are not columns apart by a comma, semicolon, tab, bar or blank"
        )
    return best[1], best[2]


def _is_halved(body: list[str], width: int) -> bool:
    """Whether commas stand for decimals as well: the header has fewer columns than the rows."""
    head = _cells(body[0], ",")
    return not any(_is_value(c) for c in head) and 1 <= len(head) < width


def _is_value(cell: str) -> bool:
    cell = cell.strip()
    return bool(
        not cell
        or NUMBER.match(cell)
        or COMMA_NUMBER.match(cell)
        or POINT_THOUSANDS.match(cell)
        or DATE.match(cell)
        or cell.startswith("[")
        or cell.lower() in FLAGS
    )


def _is_data(cells: list[str]) -> bool:
    filled = [c for c in cells if c]
    return bool(filled) and sum(map(_is_value, filled)) > 0.5 * len(filled) - 1e-9


def _decimal(path: Path, data: list[list[str]], delimiter: str) -> tuple[str, str | None]:
    cells = [c for row in data[:200] for c in row if c and not c.startswith("[")]
    comma = [c for c in cells if "," in c and COMMA_NUMBER.match(c)]
    point = [c for c in cells if "." in c and NUMBER.match(c)]
    grouped = [c for c in cells if POINT_THOUSANDS.match(c)]
    if not comma and not grouped:
        return ".", None
    if point and len(grouped) >= len(comma) and len(grouped) > 0:
        return ".", ","
    if point and any(not re.match(r"^[+-]?\d{1,3}\.\d{3}$", c) for c in point):
        raise RecordingError(
            f"{path}: numbers have a decimal point ({point[0]}) and a decimal comma ({comma[0]})"
        )
    if comma and all(re.match(r"^[+-]?\d{1,3},\d{3}$", c) for c in comma) and not point:
        whole = [c for c in cells if NUMBER.match(c) and len(c.lstrip("+-")) > 3]
        if not whole and any("," not in c for c in cells):
            return ",", None
    return ",", "." if any(c.count(".") for c in comma) or point else None


def _header(lines: list[list[str]], width: int) -> tuple[tuple[str, ...], dict[str, str]]:
    """Names and units of the lines before the data; columns are numbered from 1 where none is."""
    above = [cells for cells in lines if len(cells) == width and any(cells)]
    if not above:
        commented = [c for c in lines if c and c[0].startswith(COMMENTS)]
        last = [c.lstrip("#%/ ").strip() for c in commented[-1]] if commented else []
        last = last[-width:] if len(last) == width else [c for c in last if c]
        if len(last) != width:
            return tuple(str(k + 1) for k in range(width)), {}
        above = [last]
    cells = above[-1]
    units: dict[str, str] = {}
    below = None
    if len(above) > 1 and all(UNIT_CELL.match(c) for c in cells) and len(set(above[-2])) == width:
        below, cells = cells, above[-2]
    names: list[str] = []
    for k, cell in enumerate(cells):
        name = cell.lstrip("#% ").strip() or f"column {k + 1}"
        names.append(name if name not in names else f"{name} ({k + 1})")
        inside = UNIT_IN_NAME.search(name)
        if below is not None and below[k].strip("[]() "):
            units[names[-1]] = below[k].strip("[]() ")
        elif inside:
            units[names[-1]] = inside.group(1)
    return tuple(names), units


def _chunks(path: Path, d: Dialect, report, wanted) -> dict[str, list[NDArray]]:
    pandas = library("pandas", path)
    all_named = wanted is not None and wanted <= set(d.names)  # else an error names all of them
    kept = [n for n in d.names if not all_named or n in wanted]
    parts: dict[str, list[NDArray]] = {name: [] for name in kept}
    size, rows = path.stat().st_size, 0
    options = {
        "sep": r"\s+" if d.delimiter == " " else d.delimiter, "decimal": d.decimal,
        "thousands": d.thousands, "header": None, "names": list(d.names), "usecols": kept,
        "skiprows": d.skip, "chunksize": CHUNK_ROWS, "index_col": False, "comment": "#",
        "skipinitialspace": True, "skip_blank_lines": True,
    }  # fmt: skip
    try:
        with (
            open(path, encoding=d.encoding, newline="") as stream,
            pandas.read_csv(stream, **options) as reader,
        ):
            for chunk in reader:
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
    if rows and d.delimiter != " ":
        _require_whole_end(path, d)
    return parts


def _require_whole_end(path: Path, d: Dialect) -> None:
    """Refuse a last row with fewer values: the file was cut off while it was written."""
    with open(path, "rb") as stream:
        stream.seek(0, io.SEEK_END)
        stream.seek(max(0, stream.tell() - 65536))
        tail = stream.read().decode("utf-16-le" if d.encoding == "utf-16" else d.encoding, "ignore")
    lines = [line for line in tail.splitlines() if line.strip()]
    found = len(_cells(lines[-1], d.delimiter)) if lines else 0
    if len(lines) > 1 and found < len(d.names):
        raise RecordingError(
            f"{path}: the last row has {found} of {len(d.names)} values: the file is cut off"
        )


def _converted(values: NDArray) -> NDArray | None:
    """Lists, dates and flags as numbers; None for other text. Text amid numbers is NaN's cause."""
    first = next((v for v in values if isinstance(v, str) and v.strip()), None)
    if first is None:
        return np.array([np.nan if v is None else v for v in values], dtype=float)
    if first.startswith("["):
        try:
            lists = [json.loads(v) for v in values]
            return np.array(lists, dtype=float)
        except (ValueError, TypeError):
            return None
    if DATE.match(first):
        try:
            stamps = np.array([str(v).rstrip("Z") for v in values], dtype="datetime64[ns]")
        except ValueError:
            return None
        return (stamps - stamps[0]).astype(np.int64) * 1e-9
    if first.lower() in FLAGS:
        return np.array([FLAGS.get(str(v).lower(), np.nan) for v in values])
    numbers = np.array([_number(v) for v in values])
    return numbers if np.mean(np.isfinite(numbers)) > 0.5 else None


def _number(value: object) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        return float("nan")


def _described(d: Dialect) -> str:
    signs = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar", " ": "blanks"}
    found = [signs[d.delimiter]]
    found += ["decimal comma"] if d.decimal == "," else []
    found += ["UTF-16"] if d.encoding == "utf-16" else []
    return ", ".join(found)
