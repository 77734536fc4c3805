"""JSON logs: an object on each line, a list of objects, or one object of lists."""

import json
from pathlib import Path

import numpy as np

from rsea_core.errors import RecordingError
from rsea_core.recordings.readers.log import Log, Stream, damaged, flat_columns, rate_of
from rsea_core.recordings.readers.messages import numbers_of

KIND = "JSON"


def is_json(path: Path, head: bytes) -> bool:
    """Whether a file's first bytes begin an object, or a list of objects."""
    text = head.lstrip(b"\xef\xbb\xbf \t\r\n")
    return text[:1] == b"{" or (text[:1] == b"[" and text[1:].lstrip()[:1] == b"{")


def read_json(path: Path) -> Log:
    """The numbers of a JSON log; NaN where a row has no such number.

    Raises
    ------
    RecordingError
        If the text is not JSON (with the line), or holds no rows of numbers.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as problem:
        raise damaged(path, KIND, problem) from problem
    whole, rate = _loaded(text), None
    if isinstance(whole, dict) and not any(isinstance(v, list) for v in whole.values()):
        whole = None  # a single line
    if isinstance(whole, dict):
        columns = flat_columns({k: v for k, v in whole.items() if _is_table(v)})
        rate = rate_of(whole)
        rows = max((v.size for v in columns.values()), default=0)
        columns = {k: v for k, v in columns.items() if v.size == rows}
    else:
        columns = _columns(_lines(path, text) if whole is None else whole)
    if len(next(iter(columns.values()), ())) < 3:
        raise RecordingError(f"{path}: is {KIND} without rows of numbers")
    return Log(path=path, format=KIND, streams=(Stream(columns=columns),), rate=rate)


def _loaded(text: str) -> object:
    """The whole text as one value; None where it is not one."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return None


def _lines(path: Path, text: str) -> list:
    """The value of each line."""
    lines = [(k, line) for k, line in enumerate(text.splitlines(), start=1) if line.strip()]
    found = []
    for k, line in lines:
        try:
            found.append(json.loads(line))
        except (ValueError, RecursionError) as problem:
            why = getattr(problem, "msg", "nested too deeply")
            raise RecordingError(f"{path}: line {k} is not {KIND}: {why}") from problem
    return found


def _columns(rows: object) -> dict:
    """Columns of the numbers of rows, by their path."""
    given = rows if isinstance(rows, list) else []
    table = [dict(numbers_of(row)) for row in given if isinstance(row, dict)]
    names = dict.fromkeys(name for row in table for name in row)
    return {name: np.array([row.get(name, np.nan) for row in table]) for name in names}


def _is_table(value: object) -> bool:
    """Whether a list holds numbers, or rows of as many numbers each."""
    if not isinstance(value, list) or not value:
        return False
    try:
        return np.asarray(value, dtype=float).ndim in (1, 2)
    except (TypeError, ValueError, OverflowError):
        return False
