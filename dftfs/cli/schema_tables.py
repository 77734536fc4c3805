"""Pieces of JSON schemas: a table of known keys, lists, words."""

from collections.abc import Collection, Mapping

from rsea_core.files.csv_columns import NO_UNIT, unit_of

NUMBER, TEXT, TABLE = {"type": "number"}, {"type": "string"}, {"type": "object"}
TABLES = {"type": "array", "items": TABLE}


def closed(
    keys: Collection[str], required: Collection[str] = (), **known: Mapping
) -> dict[str, object]:
    """A table of these keys only; a key that ends with a unit is a number with that unit."""
    return {
        "type": "object",
        "properties": {key: known.get(key, of_unit(key)) for key in keys},
        "required": list(required),
        "additionalProperties": False,
    }


def of_unit(key: str) -> dict:
    unit = unit_of(key)
    return {} if unit == NO_UNIT else NUMBER | {"description": f"in {unit}"}


def list_of(table: Mapping) -> dict:
    """An array of such tables."""
    return {"type": "array", "items": table}


def words(*allowed: str) -> dict:
    """One of these words."""
    return TEXT | {"enum": list(allowed)}
