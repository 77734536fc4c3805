"""Reading TOML tables without letting anything pass unnoticed.

Every reader of both packages goes through here. A file is bounded in size, nesting and numbers
before a reader sees it. A misspelt key is an error that names it and the nearest known one, never
a value that is quietly ignored.
"""

import difflib
import math
import re
import tomllib
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path

from rsea_core.files.bounded_text import MOST_TOML_BYTES, read_bounded

DEEPEST = 16  # no file of the package nests more than four tables
WHOLE_NUMBERS = 2**63  # TOML's own bound of an integer
_MANY_DOTS = re.compile(rf"(?m)^\s*\[{{0,2}}\s*(?:[^\s.=\"'#]+\s*\.\s*){{{DEEPEST + 1}}}")


def read_toml(path: str | Path, error: type[Exception]) -> dict:
    """The tables of a TOML file.

    Raises
    ------
    error
        If the file cannot be read, is not TOML, or is beyond the bounds of `parse_toml`.
    """
    return parse_toml(read_bounded(path, error, most_bytes=MOST_TOML_BYTES), str(path), error)


def parse_toml(text: str, where: str, error: type[Exception]) -> dict:
    """The tables of a TOML text; `where` names its origin in messages.

    Raises
    ------
    error
        If it is not TOML, nests deeper than `DEEPEST`, has a whole number beyond 64 bits or a
        text with a NUL character.
    """
    too_deep = f"{where}: tables or lists are nested more than {DEEPEST} deep"
    if _MANY_DOTS.search(text):
        raise error(too_deep)
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as problem:
        raise error(f"{where}: is not TOML: {problem}") from problem
    except RecursionError:
        raise error(too_deep) from None
    except ValueError as problem:  # a number of thousands of digits, an impossible date
        reason = str(problem).partition(";")[0]
        raise error(f"{where}: a value cannot be used: {reason}") from None
    waiting: list[tuple[str, object, int]] = [("", tables, 0)]
    while waiting:
        name, value, depth = waiting.pop()
        if depth > DEEPEST:
            raise error(too_deep)
        waiting += [(f"{name}.{k}".lstrip("."), v, depth + 1) for k, v in _inside(value)]
        if isinstance(value, int) and not -WHOLE_NUMBERS <= value < WHOLE_NUMBERS:
            raise error(f"{where}: {name}: a whole number of {len(str(value))} digits is too large")
        if "\0" in name or (isinstance(value, str) and "\0" in value):
            raise error(f"{where}: {name!r} holds a NUL character")
    return tables


def _inside(value: object) -> Iterable[tuple[object, object]]:
    if isinstance(value, dict):
        return value.items()
    return enumerate(value) if isinstance(value, list) else ()


def require_known(
    table: Mapping, known: Collection[str], where: str, error: type[Exception]
) -> None:
    """Refuse a table with a key that is not in `known`, naming the nearest one.

    Raises
    ------
    error
        For the first unknown key.
    """
    for key in table:
        if key not in known:
            raise error(f"{where}: unknown key {key!r}; {nearest(key, known)}")


def nearest(name: object, known: Collection[str]) -> str:
    """The words that point from a misspelt name to the known one most like it."""
    match = difflib.get_close_matches(str(name)[:100], list(known), n=1, cutoff=0.0)
    return f"the nearest known one is {match[0]!r}" if match else "none is known here"


def number(value: object, where: str, error: type[Exception]) -> float:
    """A finite number as float.

    Raises
    ------
    error
        If the value is not a number, or is infinite, NaN or beyond what a float holds.
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise error(f"{where} = {short(value)} must be a number")
    if isinstance(value, int) and abs(value) >= WHOLE_NUMBERS:
        raise error(f"{where}: a whole number of this size cannot be used")
    if not math.isfinite(value):
        raise error(f"{where} = {value} must be finite")
    return float(value)


def table(value: object, where: str, error: type[Exception]) -> dict:
    """A sub-table.

    Raises
    ------
    error
        If the value is not a table.
    """
    if not isinstance(value, dict):
        raise error(f"{where} = {short(value)} must be a table, written [{where}]")
    return value


def word(value: object, where: str, error: type[Exception]) -> str:
    """A text.

    Raises
    ------
    error
        If the value is not one.
    """
    if not isinstance(value, str):
        raise error(f"{where} = {short(value)} must be a word in quotes")
    return value


def file_name(value: object, where: str, error: type[Exception]) -> str:
    """A name that result files may carry: never a path out of their folder.

    Raises
    ------
    error
        If it is not a text, is empty or too long, or holds a separator of folders, a quotation
        mark or a character that is not printed.
    """
    name = word(value, where, error)
    wrong = set(name) & set('/\\":') or {c for c in name if not c.isprintable()}
    if wrong or not 0 < len(name) <= 100 or name.startswith("."):
        raise error(
            f"{where} = {short(name)} names the result files: 1 to 100 characters, first no dot, "
            'without / \\ : " or line breaks'
        )
    return name


def toml_string(text: str) -> str:
    """A text as TOML writes it, in quotes."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in escaped) + '"'


def short(value: object) -> str:
    """A value as a message shows it: at most 80 characters."""
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."
