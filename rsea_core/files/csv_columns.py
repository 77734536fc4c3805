"""Reading and writing CSV files of named columns."""

import csv
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RseaError
from rsea_core.files.bounded_text import MOST_TABLE_BYTES, require_regular
from rsea_core.files.toml_tables import require_known

TEXT = "utf-8-sig"  # a mark of the byte order, as spreadsheets write it, is no part of a name
# the longest ending that fits is a column's unit
UNITS = {
    "_rad_per_s2": "rad/s^2",
    "_rad_per_s": "rad/s",
    "_Nm_per_s": "Nm/s",
    "_rad": "rad",
    "_Nm": "Nm",
    "_A": "A",
    "_V": "V",
    "_J": "J",
    "_s": "s",
}
NO_UNIT = "1"


def unit_of(column: str) -> str:
    """The unit that ends a column's name, "1" where none does."""
    fitting = [ending for ending in UNITS if column.endswith(ending)]
    return UNITS[max(fitting, key=len)] if fitting else NO_UNIT


def read_columns(
    path: str | Path, error: type[RseaError], *, required: tuple[str, ...], optional=()
) -> dict[str, NDArray]:
    """The columns of a CSV file with a header, as arrays of one length.

    Parameters
    ----------
    required, optional : tuple of str
        The columns that must and may be there; any other one is an error. Lines ``# key: value``
        before the header are notes (`read_notes`).

    Raises
    ------
    error
        If the file cannot be read, a column is missing or unknown, or a value is not a
        finite number; the message names file, column and row (the header is row 1).
    """
    require_regular(path, error, most_bytes=MOST_TABLE_BYTES)
    try:
        with open(path, newline="", encoding=TEXT) as stream:
            lines = enumerate(csv.reader(stream), start=1)
            rows = [(i, row) for i, row in lines if row and (len(row) > 1 or row[0].strip())]
            while rows and _note(",".join(rows[0][1])):
                del rows[0]
    except OSError as problem:
        raise error(f"{path}: cannot be read: {problem.strerror or problem}") from problem
    except (UnicodeDecodeError, csv.Error) as problem:
        raise error(f"{path}: is not CSV text: {problem}") from problem
    if not rows:
        raise error(f"{path}: is empty; expected columns {', '.join(required)}")
    header = header_names(rows[0][1], path, error)
    require_known(dict.fromkeys(header), (*required, *optional), str(path), error)
    for name in required:
        if header.count(name) != 1:
            raise error(f"{path}: needs the column {name} once, has {', '.join(header)}")
    values = np.empty((len(rows) - 1, len(header)))
    for k, (line, row) in enumerate(rows[1:]):
        if len(row) != len(header):
            hint = ""
            if len(row) > len(header) and not any("." in text for text in row):
                hint = "; decimals are written with a point, not a comma"
            raise error(f"{path}: row {line} has {len(row)} values, the header {len(header)}{hint}")
        for j, text in enumerate(row):
            values[k, j] = _finite(text, f"{path}: column {header[j]}, row {line}", error)
    return {name: values[:, j] for j, name in enumerate(header)}


def read_notes(path: str | Path, error: type[RseaError]) -> dict[str, str]:
    """The lines ``# key: value`` at the head of a CSV file.

    Raises
    ------
    error
        If the file cannot be read.
    """
    notes = {}
    try:
        with open(path, encoding=TEXT) as stream:
            for line in stream:
                note = _note(line)
                if note is None:
                    break
                notes[note[0]] = note[1]
    except OSError as problem:
        raise error(f"{path}: cannot be read: {problem.strerror or problem}") from problem
    except UnicodeDecodeError as problem:
        raise error(f"{path}: is not CSV text: {problem}") from problem
    return notes


def _note(line: str) -> tuple[str, str] | None:
    key, colon, value = line.lstrip("# ").partition(":")
    return (key.strip(), value.strip()) if line.startswith("#") and colon else None


def header_names(cells: Sequence[str], path: str | Path, error: type[RseaError]) -> list[str]:
    """Names of columns from the cells of a header.

    Raises
    ------
    error
        If the cells are numbers or a comment, have no name, or stand apart by something else than
        commas; a header with such a fault is not one with an unknown column.
    """
    names = [name.strip() for name in cells]
    for sign, called in ((";", "semicolons"), ("\t", "tabs")):
        if len(names) == 1 and sign in names[0]:
            raise error(
                f"{path}: row 1: columns stand apart by {called}; they have to by commas, and"
                " decimals have a point"
            )
    if names and names[0].startswith("#"):
        raise error(f"{path}: row 1 is a comment; it has to be the header, the columns' names")
    if all(_is_number(name) for name in names):
        raise error(f"{path}: row 1 is numbers; it has to be the header, the columns' names")
    if "" in names:
        raise error(f"{path}: row 1: column {names.index('') + 1} has no name")
    return names


def write_columns(path: str | Path, columns: Mapping[str, NDArray]) -> Path:
    """Write columns of one length as CSV: to a temporary file first, then renamed.

    Numbers are written with all their digits, so that reading gives the same bits.

    Raises
    ------
    RseaError
        If the file cannot be written.
    """
    target = Path(path)
    unfinished = target.with_name(f".{target.name}.{os.getpid()}.part")
    lists = [np.asarray(column).tolist() for column in columns.values()]
    if target.is_dir():
        raise RseaError(f"{path} is a folder; a file has to be written there")
    try:
        with open(unfinished, "w", newline="", encoding="utf-8") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(columns)
            writer.writerows(zip(*lists, strict=True))
        unfinished.replace(target)
    except OSError as problem:
        raise RseaError(f"{path}: cannot be written: {problem.strerror or problem}") from problem
    finally:
        unfinished.unlink(missing_ok=True)
    return target


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _finite(text: str, where: str, error: type[RseaError]) -> float:
    try:
        value = float(text)
    except ValueError:
        raise error(f"{where}: {text!r} is not a number") from None
    if not np.isfinite(value):
        raise error(f"{where}: {text.strip()} is not a finite number")
    return value
