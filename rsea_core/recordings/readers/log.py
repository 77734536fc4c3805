"""What every reader of a log returns: streams of numeric columns, with the units of the file.

A stream is what was written together: a table, a topic, a group. Its columns have one length; rows
of different streams are at different times. Nothing is converted here.
"""

import importlib
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RecordingError

LOG_TIME = "log_time"  # seconds since the first message of a log of messages
RATES = ("fs", "f_s", "rate", "rate_hz", "ratehz", "sample_rate", "samplerate", "sampling_rate",
         "sample_rate_hz", "fs_hz", "sampling_frequency", "sample_frequency")  # fmt: skip
STEPS = ("dt", "ts", "dt_s", "ts_s", "sample_time", "sample_time_s", "sampling_time",
         "sample_period", "period_s")  # fmt: skip
SLOWEST_Hz, FASTEST_Hz = 1.0, 1e6  # of loggers of machines
WIDEST = 64  # elements of an array in one row; more is a picture or a map, not readings


@dataclass(frozen=True, kw_only=True)
class Stream:
    """Columns that were written together.

    Attributes
    ----------
    name : str
        Topic, group or table; "" where a file has only one.
    columns : mapping of name to (n,) float array
        As logged; an element of an array column is `name[index]` or `name[joint]`.
    units : mapping of name to str
        Where the file states them.
    text : tuple of str
        Columns without numbers, which are not read.
    """

    name: str = ""
    columns: Mapping[str, NDArray]
    units: Mapping[str, str] = field(default_factory=dict)
    text: tuple[str, ...] = ()

    @property
    def rows(self) -> int:
        """Number of rows."""
        return next((v.size for v in self.columns.values()), 0)


@dataclass(frozen=True, kw_only=True)
class Log:
    """A log file.

    Attributes
    ----------
    path : Path
    format : str
        What it is, for people.
    streams : tuple of Stream
    rate : (str, float) or None
        Name and rows per second of a single number beside the arrays that is their rate.
    """

    path: Path
    format: str
    streams: tuple[Stream, ...]
    rate: tuple[str, float] | None = None


def library(name: str, path: Path) -> ModuleType:
    """An optional library, imported where a log needs it.

    Raises
    ------
    RecordingError
        If it is not installed; the message says how to install it.
    """
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as problem:
        raise RecordingError(
            f'{path}: needs {name.split(".")[0]}, which is not installed: pip install "dftfs[logs]"'
        ) from problem


def damaged(path: Path, kind: str, problem: Exception) -> RecordingError:
    """The error for a file that its library cannot read."""
    text = str(problem).strip().splitlines() or [type(problem).__name__]
    return RecordingError(f"{path}: is not a whole {kind} file: {text[0][:200]}")


def headings_of(texts: Iterable[object]) -> tuple[tuple[str, ...], ...]:
    """Lists of names that a file holds, which can be those of a matrix's columns."""
    rows = [
        [t.decode() if isinstance(t, bytes) else t for t in np.ravel(x).tolist()] for x in texts
    ]
    kept = [tuple(t.strip() for t in row) for row in rows if all(isinstance(t, str) for t in row)]
    return tuple(row for row in dict.fromkeys(kept) if len(set(row)) == len(row) and all(row))


def rate_of(numbers: Mapping[str, object]) -> tuple[str, float] | None:
    """The name of a rate, and the rows per second; None where no number is one, or they differ.

    Parameters
    ----------
    numbers : mapping of name to anything
        What a file holds by name; arrays of more than one element are none.
    """
    found = {}
    for name, value in numbers.items():
        own = re.split(r"[./]", name)[-1].lower()
        if own not in RATES and own not in STEPS:
            continue
        try:
            values = np.asarray(value, dtype=float).ravel()
        except (TypeError, ValueError):
            continue
        if values.size != 1 or not values[0] > 0.0:
            continue
        rate = float(values[0] if own in RATES else 1.0 / values[0])
        if SLOWEST_Hz <= rate <= FASTEST_Hz:
            found[name] = rate
    rates = list(found.values())
    if not rates or max(rates) > 1.001 * min(rates):
        return None
    return next(iter(found.items()))


def flat_columns(
    arrays: Mapping[str, object],
    joints: tuple[str, ...] = (),
    headings: tuple[tuple[str, ...], ...] = (),
) -> dict[str, NDArray]:
    """Numeric columns of arrays by name; a two-dimensional one becomes one column per element.

    Parameters
    ----------
    joints : tuple of str
        Names of the elements of arrays that have as many.
    headings : tuple of tuples of str
        Names of the columns of a matrix that has as many, where one list has.
    """
    found: dict[str, NDArray] = {}
    for name, given in arrays.items():
        values = np.asarray(given)
        if values.dtype.kind not in "fiub" or values.ndim not in (1, 2) or values.size == 0:
            continue
        values = values.astype(float)
        if values.ndim == 2 and 1 in values.shape:
            values = values.ravel()
        if values.ndim == 1:
            found[name] = values
        elif len(own := [h for h in headings if len(h) == values.shape[1]]) == 1:
            for k, label in enumerate(own[0]):
                label = label if label not in (*arrays, *found) else f"{name}.{label}"
                found[label] = np.ascontiguousarray(values[:, k])
        elif values.shape[1] <= WIDEST:
            names = joints if len(joints) == values.shape[1] else range(values.shape[1])
            for k, label in enumerate(names):
                found[f"{name}[{label}]"] = np.ascontiguousarray(values[:, k])
    return found


def streams_by_length(columns: Mapping[str, NDArray], units: Mapping[str, str]) -> tuple:
    """Columns grouped by their length, the longest group first; scalars are left out."""
    groups: dict[int, dict[str, NDArray]] = {}
    for name, values in columns.items():
        groups.setdefault(values.size, {})[name] = values
    kept = [(n, own) for n, own in groups.items() if n >= 3]
    kept.sort(key=lambda group: -group[0] * len(group[1]))
    folders = _folders([list(own) for _, own in kept])
    names = folders or ["" if k == 0 else f"{n} rows" for k, (n, _) in enumerate(kept)]
    return tuple(
        Stream(
            name=name,
            columns={own[len(name) + 1 if folders else 0 :]: v for own, v in table.items()},
            units={
                own[len(name) + 1 if folders else 0 :]: unit
                for own, unit in units.items() if own in table
            },
        )
        for name, (_, table) in zip(names, kept)
    )  # fmt: skip


def _folders(groups: list[list[str]]) -> list[str]:
    """The folder or struct of each group where these are topics: each with its own clock."""
    found = []
    for names in groups:
        parents = {
            re.split(r"[/.](?=[^/.]*$)", n)[0] if re.search(r"[/.]", n) else "" for n in names
        }
        found.append(parents.pop() if len(parents) == 1 else "")
    if len(groups) < 2 or not all(found) or len(set(found)) < len(found):
        return []
    leaves = [{n[len(own) + 1 :] for n in names} for own, names in zip(found, groups)]
    return found if set.intersection(*leaves) else []
