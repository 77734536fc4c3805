"""What the owner states about a column: `NAME=COLUMN:UNIT[:SIGN]`, or a table as in the map."""

import json
import re
import shlex
import tomllib
from collections.abc import Collection
from dataclasses import dataclass

from rsea_core.errors import RecordingError
from rsea_core.files.toml_tables import nearest
from rsea_core.machine.rig import Rig, is_linear
from rsea_core.recordings.column_map import ColumnSource, column_map, for_rig
from rsea_core.recordings.recording import COLUMNS
from rsea_core.recordings.units import factor_and_offset, unit_of_column

REFERENCE, LEFT_OUT = "reference", "ignore"
FORM = (
    'NAME=COLUMN:UNIT[:SIGN], NAME={ name = "COLUMN", scale = 2.0 }, reference=COLUMN, or'
    " ignore=COLUMN"
)
PERCENT = ("percent", "%", "pct", "permille")


@dataclass(frozen=True, kw_only=True)
class Answer:
    """One statement about a log.

    Attributes
    ----------
    source : ColumnSource or None
        Of a column of the contract; None: `name` is a reference.
    name : str
        The log's column; "" for a formula.
    is_left_out : bool
        It is no reference either.
    """

    source: ColumnSource | None
    name: str
    is_left_out: bool = False


def parse_answer(text: str, known: Collection[str], rig: Rig | None = None) -> Answer:
    """A statement of the command line.

    Parameters
    ----------
    known : collection of str
        The log's columns.
    rig : Rig or None
        What knows the counts of encoders, and whether the axis is linear.

    Raises
    ------
    RecordingError
        If it is written otherwise, or names an unknown column, reading or unit.
    """
    target, equals, value = (part.strip() for part in text.partition("="))
    if not equals or not value or target not in (*COLUMNS, REFERENCE, LEFT_OUT):
        near = f"; {nearest(target, COLUMNS)}" if equals else ""
        raise RecordingError(f"answer {text!r}: write {FORM}{near}")
    if target in (REFERENCE, LEFT_OUT):
        left_out = target == LEFT_OUT
        return Answer(source=None, name=_known(value, known, text), is_left_out=left_out)
    source = _source(target, value, text, known, rig)
    if source.formula is None:
        _known(source.name, known, text)
    if source.unit is not None:
        linear, counts = is_linear(rig), source.counts_per_rev or 1.0
        try:
            factor_and_offset(source.unit, unit_of_column(target), counts, linear=linear)
        except RecordingError as problem:
            if source.unit.lower() not in PERCENT:
                raise
            raise RecordingError(f"{problem}; {_of_range(source, rig)}") from problem
    return Answer(source=source, name=source.name)


def answer_text(
    target: str, name: str, unit: str, *, sign: int = 1, side: str | None = None,
    scale: float = 1.0, counts_per_rev: float | None = None,
) -> str:  # fmt: skip
    """A statement as it is typed on the command line of a shell."""
    more = {"side": side, "scale": scale if scale != 1.0 else None}
    more["counts_per_rev"] = counts_per_rev if unit == "count" else None
    more = {key: value for key, value in more.items() if value is not None}
    if not more:
        return typed(f"{target}={name}:{unit}" + (":-1" if sign < 0 else ""))
    entry = {"name": name, "unit": unit, **more, **({"sign": sign} if sign < 0 else {})}
    text = ", ".join(f"{k} = {json.dumps(v, ensure_ascii=False)}" for k, v in entry.items())
    return typed(f"{target}={{ {text} }}")


def typed(statement: str) -> str:
    """The option of a statement, quoted for a shell."""
    return f"--column {shlex.quote(statement)}"


def _of_range(source: ColumnSource, rig: Rig | None) -> str:
    """How a column in percent of a range is stated."""
    limit = None if rig is None else rig.current_limit_A
    one = 0.01 * limit if limit and source.target.startswith("current") else 0.08
    entry = answer_text(source.target, source.name, unit_of_column(source.target), scale=one)
    return f"percent of a range: {entry}, where {one:g} is what 1 % is"


def quoted(formula: str) -> list[str]:
    """The columns that a formula names."""
    return [a or b for a, b in re.findall(r"'([^']*)'|\"([^\"]*)\"", formula)]


def _source(
    target: str, value: str, text: str, known: Collection[str], rig: Rig | None
) -> ColumnSource:
    if value.startswith("{"):
        try:
            entry: object = tomllib.loads(f"entry = {value}")["entry"]
        except tomllib.TOMLDecodeError as problem:
            raise RecordingError(f"answer {text!r}: is no table of TOML: {problem}") from problem
    else:
        entry = _short(value, known)
    columns = column_map({target: entry}, COLUMNS, f"answer {text!r}")
    return (columns if rig is None else for_rig(columns, rig)).sources[0]


def _short(value: str, known: Collection[str]) -> dict[str, object]:
    """`COLUMN[:UNIT[:SIGN]]`; a column's own name may hold colons."""
    if value in known:
        return {"name": value}
    signed = re.fullmatch(r"(.+):([^:]+):([+-]?1)", value)
    if signed:
        name, unit, sign = signed.groups()
        return {"name": name, "unit": unit, "sign": int(sign)}
    name, apart, unit = value.rpartition(":")
    return {"name": name, "unit": unit} if apart else {"name": value}


def _known(name: str, known: Collection[str], text: str) -> str:
    if name not in known:
        raise RecordingError(f"answer {text!r}: no column {name!r}; {nearest(name, list(known))}")
    return name
