"""MATLAB files: versions 4 to 7 by scipy, 7.3 (HDF5) by h5py."""

from pathlib import Path

import numpy as np

from rsea_core.errors import RecordingError
from rsea_core.recordings.readers.hdf5 import LABELS, ONLY_MATLAB, is_hdf5, read_hdf5
from rsea_core.recordings.readers.log import (
    Log,
    damaged,
    flat_columns,
    headings_of,
    rate_of,
    streams_by_length,
)

SMALLEST_BYTES = 128  # the header of version 5; no version 4 file of three columns is shorter


def read_matlab(path: Path) -> Log:
    """The numeric arrays of a `.mat` file; fields of a struct are `struct.field`.

    Raises
    ------
    RecordingError
        If the file is damaged or has no arrays of three rows.
    """
    from scipy.io import loadmat  # takes a third of a second to import, rarely needed
    from scipy.io.matlab import MatlabOpaque, MatReadError

    if is_hdf5(path):
        return read_hdf5(path, "MATLAB 7.3", turned=True)
    if path.stat().st_size < SMALLEST_BYTES:  # scipy does not come to an end on a stump of a header
        raise RecordingError(f"{path}: is not a whole MATLAB file: it is shorter than its header")
    try:
        content = loadmat(path, struct_as_record=False, squeeze_me=True)
    except (MatReadError, ValueError, TypeError, OSError, NotImplementedError, KeyError) as problem:
        raise damaged(path, "MATLAB", problem) from problem
    arrays: dict[str, object] = {}
    for name, value in content.items():
        if not name.startswith("__"):
            _collect(name, value, arrays, depth=0)
    texts = [v for v in content.values() if isinstance(v, np.ndarray) and v.dtype.kind in "OU"]
    turned = {name: _rows_down(np.asarray(value)) for name, value in arrays.items()}
    streams = streams_by_length(flat_columns(turned, headings=headings_of(texts)), {})
    if not streams:
        opaque = [n for n, v in content.items() if isinstance(v, MatlabOpaque)]
        if opaque:
            raise RecordingError(f"{path}: {', '.join(opaque[:3])}: {ONLY_MATLAB}")
        raise RecordingError(f"{path}: has no array of three rows or more")
    return Log(path=path, format="MATLAB", streams=streams, rate=rate_of(arrays))


def _collect(name: str, value: object, arrays: dict, depth: int) -> None:
    fields = getattr(value, "_fieldnames", None)
    if fields is not None and depth < 6:
        for own in fields:
            _collect(f"{name}.{own}", getattr(value, own), arrays, depth + 1)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "fiub":
        arrays[name] = value
    elif isinstance(value, int | float):
        arrays[name] = np.asarray(value)
    elif isinstance(value, np.ndarray) and value.dtype == object and value.ndim == 1 and depth < 6:
        for k, own in enumerate(value):  # signals of Simulink (label), channels of dSPACE (Name)
            label = next((getattr(own, key) for key in LABELS if _is_text(own, key)), str(k + 1))
            _collect(f"{name}.{label}", own, arrays, depth + 1)


def _is_text(struct: object, key: str) -> bool:
    value = getattr(struct, key, None)
    return isinstance(value, str) and value != ""


def _rows_down(values: np.ndarray) -> np.ndarray:
    """A matrix with its samples down the rows."""
    wide = values.ndim == 2 and values.shape[0] < values.shape[1]
    return values.T if wide else values
