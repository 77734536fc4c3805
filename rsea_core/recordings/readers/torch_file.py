"""Arrays of a PyTorch file, read without running anything that is in it.

A PyTorch file is a zip archive: a pickle that says which arrays there are, and their bytes. Only
the names that rebuild an array are known here; any other name in the pickle is refused (as
`torch.load(weights_only=True)` does). Source: PyTorch, Serialization semantics.
"""

import pickle
import zipfile
from collections import OrderedDict
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RecordingError
from rsea_core.recordings.readers.log import Log, damaged, flat_columns, streams_by_length

TYPES = {
    "FloatStorage": "<f4", "DoubleStorage": "<f8", "HalfStorage": "<f2", "LongStorage": "<i8",
    "IntStorage": "<i4", "ShortStorage": "<i2", "CharStorage": "i1", "ByteStorage": "u1",
    "BoolStorage": "?",
}  # fmt: skip
LARGEST_BYTES = 4 << 30


def read_torch(path: Path) -> Log:
    """The arrays of a PyTorch file by their names.

    Raises
    ------
    RecordingError
        If it holds anything but arrays in tables and lists, or is damaged.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            table = next(n for n in archive.namelist() if n.endswith("data.pkl"))
            with archive.open(table) as stream:
                content = _ArraysOnly(stream, archive, table.removesuffix("data.pkl")).load()
    except pickle.UnpicklingError as problem:
        raise RecordingError(
            f"{path}: is a pickle with more than arrays ({problem}), which could run any program"
            " when read: save the arrays as NPZ, Parquet or CSV"
        ) from problem
    except Exception as problem:  # untrusted bytes: the decoder raises anything
        raise damaged(path, "PyTorch", problem) from problem
    arrays: dict[str, NDArray] = {}
    _collect("", content, arrays)
    streams = streams_by_length(flat_columns(arrays), {})
    if not streams:
        raise RecordingError(f"{path}: has no array of three rows or more")
    return Log(path=path, format="PyTorch", streams=streams)


def _collect(name: str, value: object, arrays: dict[str, NDArray]) -> None:
    if isinstance(value, np.ndarray):
        arrays[name or "array"] = value
    elif isinstance(value, Mapping | list | tuple):
        items = value.items() if isinstance(value, Mapping) else enumerate(value)
        for key, own in items:
            _collect(f"{name}.{key}" if name else str(key), own, arrays)


class _ArraysOnly(pickle.Unpickler):
    """An unpickler that knows what rebuilds an array and nothing else."""

    def __init__(self, stream, archive: zipfile.ZipFile, folder: str):
        super().__init__(stream)
        self.archive, self.folder = archive, folder

    def find_class(self, module: str, name: str):
        known = {
            ("collections", "OrderedDict"): OrderedDict,
            ("torch._utils", "_rebuild_tensor_v2"): _rebuilt,
            ("torch._utils", "_rebuild_parameter"): lambda array, *_: array,
        }
        if (module, name) in known:
            return known[module, name]
        if module == "torch" and name in TYPES:
            return TYPES[name]
        raise pickle.UnpicklingError(f"{module}.{name}")

    def persistent_load(self, pid):
        kind, key, count = pid[1], pid[2], int(pid[4])
        info = self.archive.getinfo(f"{self.folder}data/{key}")
        size = count * np.dtype(kind).itemsize
        if info.file_size < size or size > LARGEST_BYTES:
            raise ValueError(f"array {key} has {info.file_size} of {size} bytes")
        return np.frombuffer(self.archive.read(info), dtype=kind, count=count)


def _rebuilt(storage: NDArray, offset: int, size: tuple, stride: tuple, *_: object) -> NDArray:
    last = offset + sum((n - 1) * s for n, s in zip(size, stride, strict=True))
    if min((offset, *size, *stride), default=0) < 0 or (storage.size and last >= storage.size):
        raise ValueError("an array reaches beyond its bytes")
    steps = tuple(s * storage.itemsize for s in stride)
    return np.lib.stride_tricks.as_strided(storage[offset:], size, steps).copy()
