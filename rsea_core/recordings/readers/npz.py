"""NumPy's NPZ and NPY; arrays of objects, which are pickles, are refused."""

import zipfile
from pathlib import Path

import numpy as np

from rsea_core.errors import RecordingError
from rsea_core.recordings.readers.log import Log, damaged, flat_columns, streams_by_length


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
    except ValueError as problem:
        if "pickle" in str(problem):
            raise RecordingError(
                f"{path}: holds pickled objects, which could run any program: not read; save plain"
                " arrays"
            ) from problem
        raise damaged(path, "NumPy", problem) from problem
    except (OSError, zipfile.BadZipFile, EOFError, KeyError) as problem:
        raise damaged(path, "NumPy", problem) from problem
    streams = streams_by_length(flat_columns(arrays), {})
    if not streams:
        raise RecordingError(f"{path}: has no array of three rows or more")
    return Log(path=path, format="NumPy", streams=streams)


def _fields(name: str, values: np.ndarray) -> dict[str, np.ndarray]:
    if values.dtype.names:
        return {own: values[own] for own in values.dtype.names}
    return {name: values}
