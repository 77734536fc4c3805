"""Parquet tables, and LeRobot data sets, which are folders of them.

Source: Apache Parquet; LeRobot data set format 2 and 3 (`meta/info.json`, `data/**/*.parquet`).
"""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from rsea_core.errors import RecordingError
from rsea_core.recordings.readers.log import Log, Stream, damaged, flat_columns, library

INFO = Path("meta") / "info.json"


def read_parquet(path: Path) -> Log:
    """The numeric columns of a Parquet file; lists of one length become a column per element.

    Raises
    ------
    RecordingError
        If the file is damaged or has no column of numbers.
    """
    columns, units, text = _table(path, {})
    stream = Stream(columns=columns, units=units, text=text)
    return Log(path=path, format="Parquet", streams=(stream,))


def is_lerobot(path: Path) -> bool:
    """Whether a folder is a LeRobot data set."""
    return path.is_dir() and (path / INFO).is_file()


def read_lerobot(path: Path) -> Log:
    """Every episode file of a LeRobot data set, one stream each, joints by their names.

    Raises
    ------
    RecordingError
        If the folder's description or a file of it cannot be read.
    """
    try:
        info = json.loads((path / INFO).read_text(encoding="utf-8"))
        features = {name: f for name, f in info["features"].items() if isinstance(f, Mapping)}
    except (OSError, ValueError, KeyError, AttributeError, TypeError) as problem:
        raise damaged(path / INFO, "LeRobot description", problem) from problem
    names = {}
    for feature, description in features.items():
        labels = description.get("names")
        if isinstance(labels, Mapping):
            labels = next(iter(labels.values()), None)
        if isinstance(labels, list) and all(isinstance(n, str) for n in labels):
            names[feature] = tuple(label.removesuffix(".pos") for label in labels)
    files = sorted((path / "data").rglob("*.parquet"))
    if not files:
        raise RecordingError(f"{path}: is a LeRobot folder without data/**/*.parquet")
    streams = []
    for file in files:
        columns, units, text = _table(file, names)
        streams.append(Stream(name=file.stem, columns=columns, units=units, text=text))
    return Log(path=path, format="LeRobot data set", streams=tuple(streams))


def _table(path: Path, labels: Mapping[str, tuple[str, ...]]):
    arrow, parquet = library("pyarrow", path), library("pyarrow.parquet", path)
    columns, units, text = {}, {}, []
    try:
        table = parquet.read_table(path, partitioning=None)
        while any(arrow.types.is_struct(field.type) for field in table.schema):
            table = table.flatten()  # struct.field
        for field in table.schema:
            metadata = {k.decode(): v.decode() for k, v in (field.metadata or {}).items()}
            if metadata.get("unit", metadata.get("units")):
                units[field.name] = metadata.get("unit", metadata.get("units"))
            values = _values(arrow, table[field.name], field.type)
            found = {} if values is None else {field.name: values}
            own = flat_columns(found, labels.get(field.name, ()))
            columns |= own
            text += [] if own else [field.name]
    except (arrow.ArrowException, OSError, ValueError, UnicodeDecodeError) as problem:
        raise damaged(path, "Parquet", problem) from problem
    if not columns:
        raise RecordingError(f"{path}: has no column of numbers")
    return columns, units, tuple(text)


def _values(arrow, column, kind):
    types = arrow.types
    if types.is_timestamp(kind):
        stamps = column.to_numpy().astype("datetime64[ns]")
        return (stamps - stamps[0]).astype(np.int64) * 1e-9
    if types.is_list(kind) or types.is_fixed_size_list(kind) or types.is_large_list(kind):
        rows = column.to_pylist()
        return np.array(rows, dtype=float) if len({len(r or ()) for r in rows}) == 1 else None
    if types.is_integer(kind) or types.is_floating(kind):
        return column.to_numpy().astype(float)
    return np.array(column.to_pylist(), dtype=float) if types.is_boolean(kind) else None
