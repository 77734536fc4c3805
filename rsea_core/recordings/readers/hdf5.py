"""HDF5: every numeric dataset, groups of equal length as streams; units from attributes."""

from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RecordingError
from rsea_core.recordings.readers.log import (
    Log,
    damaged,
    flat_columns,
    headings_of,
    library,
    rate_of,
    streams_by_length,
)

SIGNATURE = b"\x89HDF\r\n\x1a\n"
UNIT_KEYS = ("unit", "units", "Unit", "Units")
LABELS = ("label", "Name", "name")  # of the elements of a struct array
ONLY_MATLAB = (
    "tables and time series of MATLAB are objects that only MATLAB reads: save a table T by"
    " s = table2struct(T, 'ToScalar', true); save(file, '-struct', 's') or by writetable,"
    " a timetable by writetimetable, a timeseries ts as ts.Time and ts.Data"
)
MOST_ELEMENTS, DEEPEST = 10_000, 6  # of the cell and struct arrays of a file
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
    found = _Content(h5py, turned)
    try:
        with h5py.File(path, "r") as file:
            found.numbers |= dict(file.attrs)
            file.visititems(found.visit)
    except (OSError, ValueError, RuntimeError, KeyError) as problem:
        raise damaged(path, "HDF5", problem) from problem
    columns = flat_columns(found.arrays, headings=headings_of(found.texts))
    streams = streams_by_length(columns, found.units)
    if not streams and found.objects:
        raise RecordingError(f"{path}: {', '.join(found.objects[:3])}: {ONLY_MATLAB}")
    if not streams:
        raise RecordingError(f"{path}: has no dataset of three rows or more")
    return Log(path=path, format=format_name, streams=streams, rate=rate_of(found.numbers))


class _Content:
    """What a file's datasets hold, by their path."""

    def __init__(self, h5py: ModuleType, turned: bool):
        self.h5py, self.turned = h5py, turned
        self.arrays: dict[str, NDArray] = {}
        self.units: dict[str, str] = {}
        self.numbers: dict[str, object] = {}  # single ones
        self.texts: list[object] = []
        self.objects: list[str] = []  # of MATLAB, which it alone reads
        self.left = MOST_ELEMENTS

    def visit(self, name: str, item: object, depth: int = 0) -> None:
        """Keep a dataset; visit what it refers to."""
        if not isinstance(item, self.h5py.Dataset) or name.startswith("#"):
            return
        if "MATLAB_object_decode" in item.attrs:
            self.objects.append(name)
        elif _class_of(item) == "char" or "MATLAB_empty" in item.attrs:
            return
        elif self.h5py.check_ref_dtype(item.dtype) is self.h5py.Reference:
            self._visit_elements(name, item, depth)
        else:
            self._keep(name, item)

    def _visit_elements(self, name: str, item: object, depth: int) -> None:
        """Those of a cell array, or of one field of a struct array of MATLAB."""
        self.left -= item.size
        if self.left < 0 or depth >= DEEPEST:
            raise ValueError(f"{name} refers to too many datasets")
        elements = [item.file[own] for own in item[()].ravel()]
        if elements and all(_class_of(own) == "char" for own in elements):
            self.texts.append([_text(own) for own in elements])
            return
        folder, _, field = name.rpartition("/")
        for label, own in zip(_labels(item), elements):
            place = "/".join(part for part in (folder, label, field) if part)
            if isinstance(own, self.h5py.Group):
                for inner, x in own.items():
                    self.visit(f"{place}/{inner}", x, depth + 1)
            self.visit(place, own, depth + 1)

    def _keep(self, name: str, item: object) -> None:
        if item.dtype.kind == "V" and item.dtype.names and item.ndim == 1:
            table = item[()]
            self.arrays.update({f"{name}/{own}": table[own] for own in item.dtype.names})
        if item.dtype.kind in "SO" and item.ndim == 1 and self.h5py.check_string_dtype(item.dtype):
            self.texts.append(item[()])
        if item.dtype.kind in "fiu" and item.size == 1:
            self.numbers[name] = item[()]
        if item.dtype.kind not in "fiub" or item.ndim not in (1, 2) or item.size < 3:
            return
        if item.nbytes > LARGEST_BYTES:
            raise ValueError(f"{name} claims {item.nbytes} bytes")
        values = item[()]
        self.arrays[name] = values.T if self.turned and values.ndim == 2 else values
        unit = next((item.attrs[key] for key in UNIT_KEYS if key in item.attrs), None)
        if isinstance(unit, bytes | str | np.bytes_):
            self.units[name] = unit.decode() if isinstance(unit, bytes) else str(unit)


def _class_of(item: object) -> str:
    """MATLAB's class of an item; "" of a file that MATLAB did not write."""
    found = item.attrs.get("MATLAB_class", b"")
    return found.decode() if isinstance(found, bytes) else str(found)


def _text(item: object) -> str:
    """A text of MATLAB: characters as numbers, by columns."""
    return "".join(map(chr, np.asarray(item[()]).T.ravel()))


def _labels(item: object) -> list[str]:
    """Names of the elements of a struct or cell array: a label that all have, else their number."""
    counted = [str(k) for k in range(1, item.size + 1)]
    for key in LABELS if _class_of(item) != "cell" else ():
        other = item.parent.get(key)
        if other is not None and other.dtype == item.dtype and other.size == item.size:
            own = [other.file[ref] for ref in other[()].ravel()]
            if all(_class_of(x) == "char" for x in own):
                return [_text(x) or k for x, k in zip(own, counted)]
    return counted
