"""HDF5: every numeric dataset, groups of equal length as streams; units from attributes."""

from pathlib import Path

import numpy as np

from rsea_core.errors import RecordingError
from rsea_core.recordings.readers.log import (
    Log,
    damaged,
    flat_columns,
    headings_of,
    library,
    streams_by_length,
)

SIGNATURE = b"\x89HDF\r\n\x1a\n"
UNIT_KEYS = ("unit", "units", "Unit", "Units")
LARGEST_BYTES = 8 << 30  # a dataset that claims more is not a log of readings


def is_hdf5(path: Path) -> bool:
    """Whether a file has HDF5's signature, at its begin or after MATLAB's 512 bytes."""
    with open(path, "rb") as stream:
        head = stream.read(520)
    return head.startswith(SIGNATURE) or head[512:520] == SIGNATURE


def read_hdf5(path: Path, format_name: str = "HDF5", *, turned: bool = False) -> Log:
    """The numeric datasets of an HDF5 file, named by their path.

    Parameters
    ----------
    turned : bool
        Matrices are stored with samples along the last axis, as MATLAB does.

    Raises
    ------
    RecordingError
        If the file is damaged or has no dataset of three rows.
    """
    h5py = library("h5py", path)
    arrays, units, texts = {}, {}, []

    def visit(name: str, item: object) -> None:
        if not isinstance(item, h5py.Dataset) or name.startswith("#"):
            return
        if item.dtype.kind == "V" and item.dtype.names and item.ndim == 1:
            table = item[()]
            arrays.update({f"{name}/{own}": table[own] for own in item.dtype.names})
        if item.dtype.kind in "SO" and item.ndim == 1 and h5py.check_string_dtype(item.dtype):
            texts.append(item[()])
        if item.dtype.kind not in "fiub" or item.ndim not in (1, 2) or item.size < 3:
            return
        if item.nbytes > LARGEST_BYTES:
            raise ValueError(f"{name} claims {item.nbytes} bytes")
        values = item[()]
        arrays[name] = values.T if turned and values.ndim == 2 else values
        unit = next((item.attrs[key] for key in UNIT_KEYS if key in item.attrs), None)
        if isinstance(unit, bytes | str | np.bytes_):
            units[name] = unit.decode() if isinstance(unit, bytes) else str(unit)

    try:
        with h5py.File(path, "r") as file:
            file.visititems(visit)
    except (OSError, ValueError, RuntimeError, KeyError) as problem:
        raise damaged(path, "HDF5", problem) from problem
    streams = streams_by_length(flat_columns(arrays, headings=headings_of(texts)), units)
    if not streams:
        raise RecordingError(f"{path}: has no dataset of three rows or more")
    return Log(path=path, format=format_name, streams=streams)
