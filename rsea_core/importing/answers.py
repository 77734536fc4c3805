"""What the owner states about a column: `NAME=COLUMN:UNIT[:SIGN]`, or a table as in the map."""

import re
import tomllib
from collections.abc import Collection
from dataclasses import dataclass

from rsea_core.errors import RecordingError
from rsea_core.files.toml_tables import nearest
from rsea_core.recordings.column_map import ColumnSource, column_map
from rsea_core.recordings.recording import COLUMNS
from rsea_core.recordings.units import factor_and_offset, unit_of_column

REFERENCE = "reference"
FORM = 'NAME=COLUMN:UNIT[:SIGN], NAME={ name = "COLUMN", scale = 2.0 }, or reference=COLUMN'


@dataclass(frozen=True, kw_only=True)
class Answer:
    """One statement about a log.

    Attributes
    ----------
    source : ColumnSource or None
        Of a column of the contract; None: `name` is a reference.
    name : str
        The log's column; "" for a formula.
    """

    source: ColumnSource | None
    name: str


def parse_answer(text: str, known: Collection[str]) -> Answer:
    """A statement of the command line.

    Parameters
    ----------
    known : collection of str
        The log's columns.

    Raises
    ------
    RecordingError
        If it is written otherwise, or names an unknown column, reading or unit.
    """
    target, equals, value = (part.strip() for part in text.partition("="))
    if not equals or not value or target not in (*COLUMNS, REFERENCE):
        near = f"; {nearest(target, COLUMNS)}" if equals else ""
        raise RecordingError(f"answer {text!r}: write {FORM}{near}")
    if target == REFERENCE:
        return Answer(source=None, name=_known(value, known, text))
    source = _source(target, value, text, known)
    if source.formula is None:
        _known(source.name, known, text)
    if source.unit is not None:
        factor_and_offset(source.unit, unit_of_column(target), source.counts_per_rev or 1.0)
    return Answer(source=source, name=source.name)


def quoted(formula: str) -> list[str]:
    """The columns that a formula names."""
    return [a or b for a, b in re.findall(r"'([^']*)'|\"([^\"]*)\"", formula)]


def _source(target: str, value: str, text: str, known: Collection[str]) -> ColumnSource:
    if value.startswith("{"):
        try:
            entry: object = tomllib.loads(f"entry = {value}")["entry"]
        except tomllib.TOMLDecodeError as problem:
            raise RecordingError(f"answer {text!r}: is no table of TOML: {problem}") from problem
    else:
        entry = _short(value, known)
    return column_map({target: entry}, COLUMNS, f"answer {text!r}").sources[0]


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
