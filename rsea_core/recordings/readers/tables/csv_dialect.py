"""How a CSV file of any dialect is written: encoding, delimiter, decimal sign, header, units.

What is decided comes from the first rows; every later row has to agree.
"""

import contextlib
import csv
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rsea_core.errors import RecordingError
from rsea_core.recordings.readers.tables.cells import (
    COMMA_NUMBER,
    LIST,
    NUMBER,
    POINT_THOUSANDS,
    is_value,
)

HEAD_BYTES, LONGEST_HEAD = 1 << 16, 1 << 26
MOST_COLUMNS = 10_000  # more in a row is a matrix or a picture, not readings
DELIMITERS = (",", ";", "\t", "|", " ")
NAMES = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar", " ": "blanks"}
UNIT_CELL = re.compile(r"^[\[(]?[A-Za-zµμ°%/·*^0-9 .-]{0,12}[\])]?$")
UNIT_IN_NAME = re.compile(r"[\[(]\s*([^\[\]()]+?)\s*[\])]\s*$")
COMMENTS = ("#", "%", "//")
OPEN_LINES = 4  # that a quoted name may go over
INDEX = "row"


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
    heading : tuple of str
        The lines of names and units, as written.
    """

    encoding: str
    delimiter: str
    decimal: str
    thousands: str | None
    skip: int
    names: tuple[str, ...]
    units: dict[str, str]
    heading: tuple[str, ...] = field(default=())

    def described(self) -> str:
        """The dialect for people."""
        found = [NAMES[self.delimiter]]
        found += ["decimal comma"] if self.decimal == "," else []
        found += ["UTF-16"] if self.encoding.startswith("utf-16") else []
        return ", ".join(found)


def sniff(path: Path) -> Dialect:
    """How a CSV file is written, from its first rows.

    Raises
    ------
    RecordingError
        If it is empty, not text, or its rows are not columns.
    """
    head, is_whole = _head(path)
    encoding, text = _decoded(path, head)
    if text.lstrip()[:1] == "<":
        raise RecordingError(
            f"{path}: is XML or HTML, which is not read: save it as CSV or Parquet"
        )
    lines, starts = _logical_lines(text.replace("\u2212", "-"))
    if not is_whole and len(lines) > 1:
        lines = lines[:-1]
    widest = max(line.count(sign) for line in lines[-3:] for sign in DELIMITERS)
    if widest > MOST_COLUMNS:
        raise RecordingError(f"{path}: has {widest + 1} columns in a row; {MOST_COLUMNS} are read")
    body = [line for line in lines if line.strip() and not line.startswith(COMMENTS)]
    if len(body) < 2:
        raise RecordingError(f"{path}: has {len(body)} rows; a recording needs at least 3")
    delimiter, width = _delimiter(path, body)
    rows = [cells_of(line, delimiter) for line in lines]
    first = _first_row(rows, lines, width)
    if first is None:
        raise RecordingError(f"{path}: no row of numbers in the first {len(lines)} lines")
    data = [cells for cells in rows[first:] if len(cells) == width]
    decimal, thousands = _decimal(path, data)
    names, units = _header(path, rows[:first], data)
    return Dialect(
        encoding=encoding, delimiter=delimiter, decimal=decimal, thousands=thousands,
        skip=starts[first], names=names, units=units,
        heading=tuple(line for line in lines[max(0, first - 2) : first] if delimiter in line),
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


def cells_of(line: str, delimiter: str) -> list[str]:
    """The cells of a row, without quotes and blanks around them."""
    if delimiter == " ":
        return line.split()
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter))]
    except (csv.Error, StopIteration):
        return []


def _head(path: Path) -> tuple[bytes, bool]:
    """The first lines, at least four of them, and whether that is the whole file."""
    try:
        with open(path, "rb") as stream:
            head = stream.read(HEAD_BYTES)
            while head.count(b"\n") + head.count(b"\r") < 4 and len(head) < LONGEST_HEAD:
                more = stream.read(len(head))
                if not more:
                    break
                head += more
            is_whole = not stream.read(1)
    except OSError as problem:
        raise RecordingError(f"{path}: cannot be read: {problem.strerror or problem}") from problem
    if not head.strip():
        raise RecordingError(f"{path}: is empty")
    return head, is_whole


def _logical_lines(text: str) -> tuple[list[str], list[int]]:
    """Lines, those of an open quote as one, and the number of the line each begins at."""
    given = re.split(r"\r\n|\n|\r", text)
    lines, starts, k = [], [], 0
    while k < len(given):
        last = k + 1
        if given[k].count('"') % 2:
            closed = (
                m for m in range(k + 2, min(k + OPEN_LINES, len(given)) + 1)
                if sum(line.count('"') for line in given[k:m]) % 2 == 0
            )  # fmt: skip
            last = next(closed, last)
        lines.append(" ".join(given[k:last]))
        starts.append(k)
        k = last
    return lines, starts


def _decoded(path: Path, head: bytes) -> tuple[str, str]:
    if head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return "utf-16", head[: len(head) // 2 * 2].decode("utf-16", errors="ignore")
    for encoding, zeros in (("utf-16-le", head[1::2]), ("utf-16-be", head[::2])):
        if zeros.count(b"\0") > 0.7 * len(zeros) > 2:
            return encoding, head[: len(head) // 2 * 2].decode(encoding, errors="ignore")
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


def _delimiter(path: Path, body: list[str]) -> tuple[str, int]:
    """The sign that gives most rows the same number of columns, with numbers in them."""
    sample = body[-min(len(body) - 1, 60) :]
    best = (0.0, ",", 1)
    for sign in DELIMITERS:
        rows = [cells_of(line, sign) for line in sample]
        widths = [len(row) for row in rows]
        width = max(set(widths), key=widths.count)
        same = widths.count(width) / len(widths)
        cells = [c for row in rows for c in row]
        numeric = np.mean([is_value(c) for c in cells]) if cells else 0.0
        if sign == "," and numeric > 0.9 and _is_halved(body, cells, width):
            continue
        score = same * (0.2 + numeric) * (1.0 if width > 1 else 0.3) * (0.9 if sign == " " else 1)
        if score > best[0] + 1e-9:
            best = (score, sign, width)
    if best[0] < 0.3:
        raise RecordingError(
            f"{path}: rows are not columns apart by a comma, semicolon, tab, bar or blank"
        )
    return best[1], best[2]


def _is_halved(body: list[str], cells: list[str], width: int) -> bool:
    """Whether commas stand for decimals as well: no points, and fewer names than cells."""
    if any("." in c for c in cells):
        return False
    heads = [cells_of(line, ",") for line in body]
    titles = [h for h in heads if not any(is_value(c) for c in h)]
    return bool(titles) and 1 <= len(titles[-1]) < width


def _first_row(rows: list[list[str]], lines: list[str], width: int) -> int | None:
    """The first row with values wherever the rows of the table have them."""
    table = [cells for cells in rows if len(cells) == width]
    table = table[len(table) // 2 :][-60:]
    solid = [j for j in range(width) if np.mean([is_value(cells[j]) for cells in table]) > 0.8]
    return next(
        (
            k for k, cells in enumerate(rows)
            if len(cells) == width and lines[k].strip() and any(cells) and solid
            and all(is_value(cells[j]) for j in solid) and any(cells[j] for j in solid)
        ),
        None,
    )  # fmt: skip


def _decimal(path: Path, data: list[list[str]]) -> tuple[str, str | None]:
    cells = [c for row in data[:200] for c in row if c and not LIST.match(c)]
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


def _header(
    path: Path, lines: list[list[str]], data: list[list[str]]
) -> tuple[tuple[str, ...], dict[str, str]]:
    """Names and units of the lines before the data; columns are numbered from 1 where none is."""
    width = len(data[0])
    lines = [c[1:] if c and c[0] in COMMENTS else c for c in lines]
    at = [k for k, cells in enumerate(lines) if len(cells) == width and any(cells)]
    above = [lines[k] for k in at]
    if not above:
        commented = [c for c in lines if c and c[0].startswith(COMMENTS)]
        last = [c.lstrip("#%/ ").strip() for c in commented[-1]] if commented else []
        last = last[-width:] if len(last) == width else [c for c in last if c]
        if not last:
            last = next((c for c in reversed(lines) if len(c) > 1), [])
        if len(last) == width - 1 > 0 and all(not row[-1] for row in data):
            last = [*last, ""]  # a delimiter at the end of every row
        elif len(last) == width - 1 > 0 and all(row[0].isdigit() for row in data):
            last = [INDEX, *last]  # as R and pandas write a table
        if len(last) != width:
            if len(last) > max(1, width // 2):
                raise RecordingError(f"{path}: {len(last)} names above rows of {width} values")
            return tuple(str(k + 1) for k in range(width)), {}
        above = [last]
    cells = above[-1]
    below = None
    two_lines = len(at) > 1 and at[-1] == at[-2] + 1
    if two_lines and all(UNIT_CELL.match(c) for c in cells) and len(set(above[-2])) == width:
        below, cells = cells, above[-2]
    names: list[str] = []
    units: dict[str, str] = {}
    for k, cell in enumerate(cells):
        name = cell.lstrip("#% ").strip() or f"column {k + 1}"
        names.append(name if name not in names else f"{name} ({k + 1})")
        inside = UNIT_IN_NAME.search(name)
        if below is not None and below[k].strip("[]() "):
            units[names[-1]] = below[k].strip("[]() ")
        elif inside:
            units[names[-1]] = inside.group(1)
    return tuple(names), units
