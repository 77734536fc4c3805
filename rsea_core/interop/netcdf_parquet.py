"""Trajectories as Parquet and NetCDF files that carry their units and their machine.

Every column is stored bit for bit under its own name with its unit as attribute. NetCDF is
classic NetCDF-3 with time_s as the coordinate, written by scipy, so that xarray, MATLAB and
ncdump read it as it is. Parquet needs pyarrow, which comes with the extra "interop".
"""

import importlib
import io
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.io import netcdf_file

from rsea_core.errors import InputError
from rsea_core.files.csv_columns import NO_UNIT, unit_of
from rsea_core.numeric.arrays import read_only
from rsea_core.simulation.trajectory import Trajectory

TIME = "time_s"
FORMAT = "rsea-trajectory-1"


@dataclass(frozen=True, kw_only=True)
class StoredTrajectory:
    """What a trajectory file holds.

    Attributes
    ----------
    columns : mapping of name to (n,) array
    units : mapping of name to unit
        "1" where a column has none.
    attributes : mapping of str to str
        "format", "rig" (its `rig.toml`), "load", "command_name", "equations" (as `describe`
        prints them, terms with their values included).
    """

    columns: Mapping[str, NDArray]
    units: Mapping[str, str]
    attributes: Mapping[str, str]


def trajectory_attributes(trajectory: Trajectory) -> dict[str, str]:
    """What a file says of the machine beside its columns, all text."""
    return {
        "format": FORMAT,
        "rig": trajectory.model.rig.to_toml(),
        "load": repr(trajectory.load),
        "command_name": trajectory.command_name or "",
        "equations": trajectory.model.describe(trajectory.command_name, trajectory.load),
    }


def write_netcdf(trajectory: Trajectory, path: str | Path) -> Path:
    """Write all columns as NetCDF-3; the file appears whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """

    def write(unfinished: Path) -> None:
        # text has no encoding of its own in NetCDF-3: UTF-8, as its users' guide advises
        with netcdf_file(unfinished, "w", version=2) as file:
            for name, text in trajectory_attributes(trajectory).items():
                setattr(file, name, text.encode())
            file.createDimension(TIME, trajectory.time_s.size)
            for name, values in trajectory.columns().items():
                kind = np.int32 if np.issubdtype(values.dtype, np.integer) else np.float64
                variable = file.createVariable(name, kind, (TIME,))
                variable[:] = values
                variable.units = unit_of(name).encode()

    return _write_whole(path, write)


def read_netcdf(path: str | Path) -> StoredTrajectory:
    """What `write_netcdf` wrote.

    Raises
    ------
    InputError
        If the file cannot be read or is not such a file.
    """
    content = io.BytesIO(_content(path))
    try:
        with netcdf_file(content, "r", mmap=False) as file:
            columns = {name: _native(v.data) for name, v in file.variables.items()}
            units = {
                name: _text(getattr(v, "units", NO_UNIT)) for name, v in file.variables.items()
            }
            attributes = {name: _text(value) for name, value in file._attributes.items()}
    except (TypeError, ValueError, LookupError) as problem:  # what scipy makes of damaged bytes
        message = f"{path}: is not a whole NetCDF-3 file: {type(problem).__name__} {problem}"
        raise InputError(message) from problem
    return _checked(path, columns, units, attributes)


def write_parquet(trajectory: Trajectory, path: str | Path) -> Path:
    """Write all columns as Parquet; the file appears whole or not at all.

    Raises
    ------
    InputError
        If pyarrow is not installed or the file cannot be written.
    """
    arrow, parquet = _arrow()
    columns = trajectory.columns()
    fields = [
        arrow.field(
            name, arrow.from_numpy_dtype(values.dtype), False, metadata={"unit": unit_of(name)}
        )
        for name, values in columns.items()
    ]
    schema = arrow.schema(fields, metadata=trajectory_attributes(trajectory))
    table = arrow.table([arrow.array(values) for values in columns.values()], schema=schema)
    return _write_whole(path, lambda unfinished: parquet.write_table(table, unfinished))


def read_parquet(path: str | Path) -> StoredTrajectory:
    """What `write_parquet` wrote.

    Raises
    ------
    InputError
        If pyarrow is not installed, or the file cannot be read or is not such a file.
    """
    arrow, parquet = _arrow()
    content = _content(path)
    try:
        table = parquet.read_table(arrow.BufferReader(content))
        columns = {name: table[name].to_numpy().copy() for name in table.column_names}
        units = {f.name: _text((f.metadata or {}).get(b"unit", NO_UNIT)) for f in table.schema}
        metadata = table.schema.metadata or {}
        attributes = {_text(name): _text(value) for name, value in metadata.items()}
    # pyarrow has an OSError for a damaged file
    except (arrow.ArrowException, OSError, ValueError) as problem:
        first = str(problem).splitlines()[0]
        raise InputError(f"{path}: is not a whole Parquet file: {first}") from problem
    attributes.pop("ARROW:schema", None)
    return _checked(path, columns, units, attributes)


def _content(path: str | Path) -> bytes:
    try:
        return Path(path).read_bytes()
    except OSError as problem:
        raise InputError(f"{path}: cannot be read: {problem.strerror or problem}") from problem


def _checked(path, columns, units, attributes) -> StoredTrajectory:
    if attributes.get("format") != FORMAT or TIME not in columns:
        raise InputError(f"{path}: is not a trajectory file ({FORMAT} with {TIME})")
    rows = columns[TIME].shape
    for name, values in columns.items():
        if values.shape != rows:
            raise InputError(f"{path}: {name} has shape {values.shape}, {TIME} has {rows}")
    return StoredTrajectory(
        columns=MappingProxyType({name: read_only(array) for name, array in columns.items()}),
        units=MappingProxyType(units),
        attributes=MappingProxyType(attributes),
    )


def _write_whole(path: str | Path, write: Callable[[Path], None]) -> Path:
    """Write to a temporary file first, then rename."""
    target = Path(path)
    unfinished = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        write(unfinished)
        unfinished.replace(target)
    except OSError as problem:
        raise InputError(f"{target}: cannot be written: {problem.strerror or problem}") from problem
    finally:
        unfinished.unlink(missing_ok=True)
    return target


def _arrow():
    """pyarrow and its Parquet module."""
    try:
        return importlib.import_module("pyarrow"), importlib.import_module("pyarrow.parquet")
    except ModuleNotFoundError as problem:
        raise InputError(
            'Parquet needs pyarrow, which is not installed: pip install "dftfs[interop]"'
        ) from problem


def _native(values: NDArray) -> NDArray:
    """A copy in the machine's own byte order."""
    return np.array(values, dtype=values.dtype.newbyteorder("="))


def _text(value: object) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)
