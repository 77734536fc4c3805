"""NumPy's NPZ and NPY; arrays of objects, which are pickles, are refused."""

import zipfile
from pathlib import Path

import numpy as np

from rsea_core.errors import RecordingError
from rsea_core.recordings.readers.log import (
    Log,
    damaged,
    flat_columns,
    headings_of,
    rate_of,
    streams_by_length,
)


def read_npz(path: Path) -> Log:
    """The numeric arrays of an NPZ or NPY file.

    Raises
    ------
    RecordingError
        If the file is damaged, holds pickled objects, or has no array of three rows.
    """
    try:
        with open(path, "rb") as stream:
            content = np.load(stream, allow_pickle=False)
            if isinstance(content, np.ndarray):
                content = {path.stem: content}
            arrays = {}
            for name in content:
                arrays |= _fields(name, content[name])
            if not arrays:
                raise RecordingError(f"{path}: is a zip archive without NumPy arrays: unpack it")
    except ValueError as problem:
        if "pickle" in str(problem):
            raise RecordingError(
                f"{path}: holds pickled objects, which could run any program: not read; save plain"
                " arrays"
            ) from problem
        raise damaged(path, "NumPy", problem) from problem
    except (OSError, zipfile.BadZipFile, EOFError, KeyError) as problem:
        raise damaged(path, "NumPy", problem) from problem
    texts = [v for v in arrays.values() if v.dtype.kind in "SU"]
    streams = streams_by_length(flat_columns(arrays, headings=headings_of(texts)), {})
    if not streams:
        raise RecordingError(f"{path}: has no array of three rows or more")
    return Log(path=path, format="NumPy", streams=streams, rate=rate_of(arrays))


def _fields(name: str, values: np.ndarray) -> dict[str, np.ndarray]:
    if not isinstance(values, np.ndarray):  # any other file of a zip archive
        return {}
    if values.dtype.names:
        return {own: values[own] for own in values.dtype.names}
    return {name: values}
