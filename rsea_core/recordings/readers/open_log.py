"""A log of any format: what a file is, by its first bytes, and its reader."""

import zipfile
from collections.abc import Callable
from pathlib import Path

from rsea_core.errors import RecordingError
from rsea_core.recordings.readers import mcap_log, ros_bag
from rsea_core.recordings.readers.csv_table import read_csv
from rsea_core.recordings.readers.hdf5 import is_hdf5, read_hdf5
from rsea_core.recordings.readers.json_log import is_json, read_json
from rsea_core.recordings.readers.log import Log
from rsea_core.recordings.readers.matlab import read_matlab
from rsea_core.recordings.readers.npz import read_npz
from rsea_core.recordings.readers.parquet import is_lerobot, read_lerobot, read_parquet
from rsea_core.recordings.readers.tables.csv_dialect import has_numbers
from rsea_core.recordings.readers.tdms import read_tdms
from rsea_core.recordings.readers.torch_file import read_torch

PICKLES = (".pkl", ".pickle", ".joblib")
TABLES = (".csv", ".txt", ".dat", ".tsv", ".log")
SUFFIXES = (*TABLES, ".mat", ".h5", ".hdf5", ".parquet", ".npz", ".npy", ".mcap", ".bag",
            ".db3", ".tdms", ".pt", ".pth", ".jsonl", ".ndjson")  # fmt: skip
PACKED = {
    b"\x1f\x8b": "packed by gzip: unpack it", b"BZh": "packed by bzip2: unpack it",
    b"\xfd7zXZ": "packed by xz: unpack it", b"7z\xbc\xaf": "packed by 7-Zip: unpack it",
    b"\xd0\xcf\x11\xe0": "a workbook of Excel: save the sheet as CSV",
}  # fmt: skip
NPY = b"\x93NUMPY"


def open_log(
    path: str | Path,
    report: Callable[[str], None] | None = None,
    wanted: frozenset[str] | None = None,
) -> Log:
    """Read a log, whatever its format.

    Parameters
    ----------
    report : callable, optional
        Told how far a large file is read.
    wanted : set of str, optional
        Columns to keep of a table that is read in pieces; None keeps all.

    Raises
    ------
    RecordingError
        If it is missing, damaged, a pickle, or of no known format.
    """
    path = Path(path)
    if path.is_dir():
        return _folder(path)
    try:
        with open(path, "rb") as stream:
            head = stream.read(520)
    except OSError as problem:
        raise RecordingError(f"{path}: cannot be read: {problem.strerror or problem}") from problem
    reader = _binary_reader(path, head)
    return read_csv(path, report, wanted) if reader is None else reader(path)


def is_folder_of_logs(path: Path) -> bool:
    """Whether a path is a folder that is not a log by itself (ROS 2 bag, LeRobot data set)."""
    return path.is_dir() and not is_lerobot(path) and not ros_bag.is_ros2_folder(path)


def logs_of_folder(path: Path) -> list[Path]:
    """The files of a folder that are logs: those with a table of numbers.

    Raises
    ------
    RecordingError
        If there is none.
    """
    files = sorted(p for p in path.iterdir() if p.suffix.lower() in SUFFIXES)
    found = [p for p in files if p.suffix.lower() not in TABLES or has_numbers(p)]
    if not found:
        raise RecordingError(f"{path}: holds no log ({', '.join(SUFFIXES)})")
    return found


def _folder(path: Path) -> Log:
    if is_lerobot(path):
        return read_lerobot(path)
    if ros_bag.is_ros2_folder(path):
        return ros_bag.read_ros_bag(path)
    raise RecordingError(
        f"{path}: is a folder, but neither a ROS 2 bag (metadata.yaml) nor a LeRobot data set"
        " (meta/info.json); `dftfs import` takes the logs in it"
    )


def _binary_reader(path: Path, head: bytes) -> Callable[[Path], Log] | None:
    """The reader of a binary format; None for text."""
    pickled = path.suffix.lower() in PICKLES or (head[:1] == b"\x80" and head[1:2] in b"\2\3\4\5")
    if head.startswith(b"PK") and _holds_pickle(path):
        return read_torch
    packed = next((kind for start, kind in PACKED.items() if head.startswith(start)), None)
    if packed is not None:
        raise RecordingError(f"{path}: is {packed}")
    if pickled:
        raise RecordingError(
            f"{path}: is a pickle (pandas, joblib), which could run any program when read:"
            " save the arrays as NPZ, Parquet or CSV"
        )
    if head.startswith(mcap_log.SIGNATURE):
        return mcap_log.read_mcap
    if head.startswith(ros_bag.SIGNATURE) or path.suffix == ".db3":
        return ros_bag.read_ros_bag
    if head.startswith(b"PAR1"):
        return read_parquet
    if head.startswith(b"TDSm"):
        return read_tdms
    if head.startswith(b"MATLAB") or path.suffix.lower() == ".mat":
        return read_matlab
    if is_hdf5(path):
        return read_hdf5
    if is_json(path, head):
        return read_json
    if head.startswith(b"PK") and path.suffix.lower() in (".xlsx", ".xlsm", ".ods"):
        raise RecordingError(f"{path}: is a workbook of a spreadsheet: save the sheet as CSV")
    if head.startswith((b"PK", NPY)):
        return read_npz
    return None


def _holds_pickle(path: Path) -> bool:
    try:
        with zipfile.ZipFile(path) as archive:
            return any(name.endswith(".pkl") for name in archive.namelist())
    except (OSError, zipfile.BadZipFile):
        return False
