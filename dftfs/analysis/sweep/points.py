"""The points of a sweep: a grid of fields, or the rows of a list, as changes to one design."""

import csv
import io
import itertools
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from dftfs.errors import DesignError
from rsea_core.files.bounded_text import read_bounded

_MOST_POINTS = 100_000
_DASHED = re.compile(r"([0-9.]+) *(?:-|to) *([0-9.]+)")


@dataclass(frozen=True, kw_only=True)
class SweepPoint:
    """One point: its number from 0, and the fields of the design that it sets, as text."""

    index: int
    changes: tuple[tuple[str, str], ...]


def read_points(varies: Sequence[str], list_file: Path | None) -> tuple[SweepPoint, ...]:
    """The grid of the ``FIELD=VALUES`` texts, or the points of a list: one of the two.

    Raises
    ------
    DesignError
        If both or neither are given, or one cannot be read.
    """
    if bool(varies) == (list_file is not None):
        raise DesignError("give --vary FIELD=VALUES (repeatable) or --list FILE.csv")
    if list_file is not None:
        return list_points(list_file)
    return grid_points([parse_vary(text) for text in varies])


def parse_vary(text: str) -> tuple[str, tuple[str, ...]]:
    """Read ``field=a,b,c`` or ``field=start:stop:count`` (both ends included).

    Raises
    ------
    DesignError
        If it is neither.
    """
    field, sign, values = (part.strip() for part in text.partition("="))
    if not (sign and field and values):
        raise DesignError(
            f"--vary {text}: write FIELD=A,B,C or FIELD=START:STOP:COUNT, e.g. width_mm=4:13:10"
        )
    if ":" in values:
        return field, _range(text, values)
    listed = tuple(value.strip() for value in values.split(","))
    if not all(listed):
        raise DesignError(
            f"--vary {text}: a value is missing between two commas, e.g. width_mm=4,6,8"
        )
    for dashed in filter(None, map(_DASHED.fullmatch, listed)):
        ends = ":".join(dashed.groups())
        raise DesignError(f"--vary {text}: a range is START:STOP:COUNT, e.g. {field}={ends}:10")
    return field, listed


def _range(text: str, values: str) -> tuple[str, ...]:
    try:
        start, stop, count = values.split(":")
        first, last, number = float(start), float(stop), int(count)
    except ValueError:
        raise DesignError(
            f"--vary {text}: a range is START:STOP:COUNT, e.g. width_mm=4:13:10"
        ) from None
    if not (math.isfinite(first) and math.isfinite(last) and 2 <= number <= _MOST_POINTS):
        raise DesignError(
            f"--vary {text}: the ends must be finite and the count from 2 to {_MOST_POINTS},"
            " e.g. width_mm=4:13:10"
        )
    step = (last - first) / (number - 1)
    return tuple(f"{first + k * step:.12g}" for k in range(number))


def grid_points(varies: Sequence[tuple[str, tuple[str, ...]]]) -> tuple[SweepPoint, ...]:
    """Every combination, the last field running fastest.

    Raises
    ------
    DesignError
        If a field is named twice, or there are more than 100000 points.
    """
    names = [name for name, _ in varies]
    for name in names:
        if names.count(name) > 1:
            raise DesignError(f"--vary {name}: named twice; put all its values into one")
    count = math.prod(len(values) for _, values in varies)
    if count > _MOST_POINTS:
        raise DesignError(f"--vary: {count} points are more than {_MOST_POINTS}")
    combined = itertools.product(*(values for _, values in varies))
    return tuple(
        SweepPoint(index=k, changes=tuple(zip(names, values))) for k, values in enumerate(combined)
    )


def list_points(path: Path) -> tuple[SweepPoint, ...]:
    """Read points from a CSV file: the header names the fields, each row is a point.

    An empty cell leaves the field as the design has it.

    Raises
    ------
    DesignError
        If the file cannot be read, has no rows, or a row has another number of cells.
    """
    text = read_bounded(path, DesignError)
    try:
        rows = [row for row in csv.reader(io.StringIO(text)) if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise DesignError(f"list {path}: is not CSV text: {error}") from None
    if len(rows) < 2:
        raise DesignError(f"list {path}: a header of field names and one row or more are needed")
    header = [name.strip() for name in rows[0]]
    if not all(header) or len(set(header)) != len(header):
        raise DesignError(f"list {path}: the header must name each field once")
    points = []
    for index, row in enumerate(rows[1:]):
        if len(row) != len(header):
            raise DesignError(
                f"list {path}: row {index + 1} has {len(row)} cells; the header has {len(header)}"
            )
        cells = [(name, cell.strip()) for name, cell in zip(header, row)]
        points.append(SweepPoint(index=index, changes=tuple(c for c in cells if c[1])))
    return tuple(points)


def varied_fields(points: Sequence[SweepPoint]) -> tuple[str, ...]:
    """Names of the fields that any point sets, in the order in which they first appear."""
    return tuple(dict.fromkeys(name for point in points for name, _ in point.changes))
