"""Pieces of JSON schemas: a table of known keys, lists, words."""

import dataclasses
import importlib
import types
import typing
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from rsea_core.files.csv_columns import NO_UNIT, unit_of

NUMBER, TEXT, TABLE = {"type": "number"}, {"type": "string"}, {"type": "object"}
FLAG = {"type": "boolean"}
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


def one_of(*allowed: str) -> dict:
    """One of these words."""
    return TEXT | {"enum": list(allowed)}


def nullable(schema: Mapping) -> dict:
    """What may also be null: a result that there is none of, a number that is not finite."""
    return {"anyOf": [schema, {"type": "null"}]}


def table_of(schema: Mapping) -> dict:
    """A table of any keys with such values."""
    return {"type": "object", "additionalProperties": schema}


def of_record(place: str) -> dict:
    """The schema of a record, `module:Class`, as `dftfs.files.as_plain` writes it."""
    module, _, name = place.partition(":")
    return _of_annotation(getattr(importlib.import_module(module), name))


def _of_annotation(kind: object) -> dict:
    origin, inner = typing.get_origin(kind), typing.get_args(kind)
    if dataclasses.is_dataclass(kind):
        hints = typing.get_type_hints(kind)
        own = {f.name: _of_annotation(hints[f.name]) for f in dataclasses.fields(kind)}
        return closed(tuple(own), tuple(own), **own)
    if origin in (typing.Union, types.UnionType):
        return {"anyOf": [_of_annotation(one) for one in inner]}
    if origin in (tuple, list, frozenset, Sequence) and inner and inner[-1] is Ellipsis:
        return list_of(_of_annotation(inner[0]))
    if origin is Mapping and inner[0] is str:
        return table_of(_of_annotation(inner[1]))
    plain = {str: TEXT, Path: TEXT, bool: FLAG, int: NUMBER, type(None): {"type": "null"}}
    return nullable(NUMBER) if kind is float else plain.get(kind, {})
