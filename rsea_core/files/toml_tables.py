"""Reading TOML tables without letting anything pass unnoticed.

Every reader of the package (rig, load, scenario) goes through here: a misspelt key is an
error that names it and the nearest known one, never a value that is quietly ignored.
"""

import difflib
import math
import tomllib
from collections.abc import Collection, Mapping
from pathlib import Path

from rsea_core.errors import RseaError


def read_toml(path: str | Path, error: type[RseaError]) -> dict:
    """The tables of a TOML file.

    Raises
    ------
    error
        If the file cannot be read or is not TOML.
    """
    try:
        return tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except OSError as problem:
        raise error(f"{path}: cannot be read: {problem.strerror or problem}") from problem
    except UnicodeDecodeError as problem:
        raise error(f"{path}: is not UTF-8 text (byte {problem.start})") from problem
    except tomllib.TOMLDecodeError as problem:
        raise error(f"{path}: is not TOML: {problem}") from problem


def require_known(
    table: Mapping, known: Collection[str], where: str, error: type[RseaError]
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


def nearest(name: str, known: Collection[str]) -> str:
    """The words that point from a misspelt name to the known one most like it."""
    match = difflib.get_close_matches(str(name), list(known), n=1, cutoff=0.0)
    return f"the nearest known one is {match[0]!r}" if match else "none is known here"


def number(value: object, where: str, error: type[RseaError]) -> float:
    """A finite number as float.

    Raises
    ------
    error
        If the value is not a number, or is infinite or NaN.
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise error(f"{where} = {value!r} must be a number")
    if not math.isfinite(value):
        raise error(f"{where} = {value} must be finite")
    return float(value)


def table(value: object, where: str, error: type[RseaError]) -> dict:
    """A sub-table.

    Raises
    ------
    error
        If the value is not a table.
    """
    if not isinstance(value, dict):
        raise error(f"{where} = {value!r} must be a table, written [{where}]")
    return value
