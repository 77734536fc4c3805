"""Cells of text as numbers: grouped digits, dates, flags, lists, units behind the number."""

import datetime
import json
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

NUMBER = re.compile(
    r"^[+-]?(\d+\.?\d*|\.\d+)([eEdD][+-]?\d+)?$|^[+-]?(nan|inf)$|^0x[\da-f]+$", re.I
)
COMMA_NUMBER = re.compile(r"^[+-]?(\d{1,3}(\.\d{3})+|\d+)(,\d+)?([eEdD][+-]?\d+)?$")
POINT_THOUSANDS = re.compile(r"^[+-]?\d{1,3}(,\d{3})+(\.\d+)?$")
GROUPS = re.compile(r"(?<=\d)['\u00a0\u2009\u202f ](?=\d{3}(\D|$))")
WITH_UNIT = re.compile(r"^([+-]?[\d.,]*\d[\d.,eE+-]*?)\s*([A-Za-z%°µμ/*·^]+\d?)$")
LIST = re.compile(r"^\[\s*([\]\[+.-]|\d|nan)", re.I)
FLAGS = {"true": 1.0, "false": 0.0, "on": 1.0, "off": 0.0, "yes": 1.0, "no": 0.0}
MISSING = ("-", "--", "---", "----", "?", "*", "**", "***", ".", "n.a.", "1.#INF", "-1.#INF",
           "#DIV/0!", "#VALUE!", "#NUM!", "#REF!")  # fmt: skip
"""Signs for no reading, besides those of pandas ("", NA, nan, null, None, 1.#QNAN ...)."""
MOST_MARKS = 2  # words that may stand for no reading in a column of numbers

_CLOCK = r"(?P<h>\d{1,2}):(?P<m>\d\d)(?::(?P<s>\d\d(?:[.,:]\d+)?))?"
_DAY = r"\d{4}[-/.]\d\d?[-/.]\d\d?|\d\d?[-/.](?:\d\d?|[A-Za-z]{3})[-/.]\d{2,4}"
_END = r"\s*(?P<half>[AaPp]\.?[Mm]\.?)?\s*(?P<zone>Z|UTC|[+-]\d\d:?\d\d)?$"
STAMPS = (
    re.compile(rf"^(?P<day>{_DAY})(?:T|\s+|_){_CLOCK}{_END}"),
    re.compile(rf"^(?P<day>\d{{8}})[T_ ](?P<h>\d\d)(?P<m>\d\d)(?P<s>\d\d(?:[.,]\d+)?){_END}"),
    re.compile(rf"^(?P<h>\d{{1,2}}):(?P<m>\d\d):(?P<s>\d\d(?:[.,:]\d+)?){_END}"),
    re.compile(r"^(?P<m>\d{1,2}):(?P<s>\d\d[.,]\d+)$"),
)
DAYS = ("%Y-%m-%d", "%Y/%m/%d", "%Y.%m.%d", "%Y%m%d", "%d.%m.%Y", "%d.%m.%y", "%d-%b-%Y",
        "%d-%m-%Y", "%d/%m/%Y", "%m/%d/%Y", "%d/%m/%y", "%m/%d/%y")  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Numbers:
    """A column of text as numbers, NaN where a cell is none, and the unit that its cells state."""

    values: NDArray
    unit: str | None = None


def is_value(cell: str) -> bool:
    """Whether a cell can be a reading: empty, a number of any spelling, a date, flag or list."""
    cell = GROUPS.sub("", cell.strip())
    return bool(
        not cell
        or NUMBER.match(cell)
        or COMMA_NUMBER.match(cell)
        or POINT_THOUSANDS.match(cell)
        or WITH_UNIT.match(cell)
        or cell in MISSING
        or LIST.match(cell)
        or cell.lower() in FLAGS
        or any(form.match(cell) for form in STAMPS)
    )


def numbers_of(values: NDArray, decimal: str) -> Numbers | None:
    """The numbers of a column with text in it; None for other text.

    Parameters
    ----------
    values : (n,) array of objects
        Text, numbers, and NaN for empty cells.
    decimal : "." or ","
    """
    first = next((v.strip() for v in values if isinstance(v, str) and v.strip()), None)
    if first is None:
        return Numbers(values=np.array([np.nan if v is None else v for v in values], dtype=float))
    if LIST.match(first):
        return _lists(values)
    form = next((form for form in STAMPS if form.match(first)), None)
    if form is not None:
        seconds = _seconds(values, form)
        return None if seconds is None else Numbers(values=seconds, unit="s")
    if first.lower() in FLAGS:
        flags = [FLAGS.get(str(v).strip().lower(), np.nan) for v in values]
        return Numbers(values=np.array(flags))
    found = np.array([_number(v, decimal) for v in values])
    good = np.isfinite(found)
    if good.mean() > 0.5:
        return Numbers(values=found)
    marks = {v.strip() for v in values[~good] if isinstance(v, str)}
    if good.sum() >= 3 and len(marks) <= MOST_MARKS:
        return Numbers(values=found)
    return _with_units(values, decimal)


def _lists(values: NDArray) -> Numbers | None:
    try:
        return Numbers(values=np.array([json.loads(v) for v in values], dtype=float))
    except (ValueError, TypeError):
        return None


def _number(value: object, decimal: str) -> float:
    """A number of any spelling; NaN for what is none."""
    if isinstance(value, float):
        return value
    text = GROUPS.sub("", str(value).strip())
    try:
        if decimal == "." and "," not in text:
            return float(text)
        if decimal == "," and COMMA_NUMBER.match(text):
            text = text.replace(".", "").replace(",", ".")
        elif POINT_THOUSANDS.match(text):
            text = text.replace(",", "")
        return float(text)
    except ValueError:
        pass
    try:
        is_hex = text[:2].lower() == "0x"
        return float(int(text, 16)) if is_hex else float(re.sub("[dD]", "e", text))
    except ValueError:
        return float("nan")


def _with_units(values: NDArray, decimal: str) -> Numbers | None:
    """Cells with one unit behind every number."""
    cut = [WITH_UNIT.match(v.strip()) if isinstance(v, str) else None for v in values]
    units = {c.group(2) for c in cut if c}
    if len(units) != 1 or sum(c is None for c in cut) > 0.5 * values.size:
        return None
    found = np.array([np.nan if c is None else _number(c.group(1), decimal) for c in cut])
    return Numbers(values=found, unit=units.pop())


def _seconds(values: NDArray, form: re.Pattern) -> NDArray | None:
    """Seconds since the first stamp, over midnights; None where most cells are of another form."""
    found = [form.match(v.strip()) if isinstance(v, str) else None for v in values]
    if sum(m is None for m in found) > 0.5 * values.size:
        return None
    parts = [{} if m is None else m.groupdict() for m in found]
    days = _day_seconds({p["day"] for p in parts if p.get("day")})
    if days is None:
        return None
    seconds = np.array([_second_of_day(p) + days.get(p.get("day"), 0.0) for p in parts])
    if not days:  # the clock begins anew at midnight, or after an hour
        turn = 86400.0 if "h" in form.groupindex else 3600.0
        back = np.diff(seconds, prepend=seconds[0]) < -0.5 * turn
        seconds = seconds + turn * np.cumsum(back)
    return seconds - seconds[np.flatnonzero(np.isfinite(seconds))[0]]


def _second_of_day(p: dict) -> float:
    if not p:
        return float("nan")
    hour = float(p.get("h") or 0.0)
    if p.get("half"):
        hour = hour % 12.0 + (12.0 if p["half"][0] in "pP" else 0.0)
    second = float(re.sub("[,:]", ".", p["s"])) if p.get("s") else 0.0
    zone = re.match(r"([+-])(\d\d):?(\d\d)", p.get("zone") or "")
    shift = int(f"{zone[1]}1") * (60 * int(zone[2]) + int(zone[3])) if zone else 0
    return 3600.0 * hour + 60.0 * (float(p["m"]) - shift) + second


def _day_seconds(days: set[str]) -> dict[str, float] | None:
    """Seconds from the earliest day to each; None where no way of writing days fits all of them."""
    for form in DAYS:
        try:
            read = {day: datetime.datetime.strptime(day, form) for day in days}
        except ValueError:
            continue
        zero = min(read.values(), default=None)
        return {day: (at - zero).total_seconds() for day, at in read.items()}
    return None
