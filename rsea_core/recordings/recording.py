"""A recording: columns of one experiment on a rig, on an even grid, checked row by row.

Row k's readings are taken at time_s[k], before row k's input acts; the input is held from there
to row k + 1. Nothing is dropped or changed without a note: jitter is resampled and reported, what
breaks the contract is an error that names file, column and row.
"""

import csv
import os
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import InputError, RecordingError
from rsea_core.files.bounded_text import MOST_TABLE_BYTES, require_regular
from rsea_core.files.column_views import ColumnViews
from rsea_core.files.csv_columns import TEXT, header_names, read_columns
from rsea_core.files.toml_tables import nearest
from rsea_core.machine.inputs import COMMANDS, Inputs, Load
from rsea_core.numeric.arrays import read_only
from rsea_core.numeric.brief_repr import BriefRepr
from rsea_core.recordings.bench_log import is_bench_log, read_bench_log
from rsea_core.recordings.column_map import ColumnMap
from rsea_core.recordings.finding import Finding, Kind
from rsea_core.recordings.log_clock import EVEN, longest_step, lost_rows, places_of_rows, tick_hint
from rsea_core.recordings.mapped_log import columns_of_log, identity_map

RESPONSES = (
    "motor_angle_rad",
    "load_angle_rad",
    "spring_deflection_rad",
    "current_A",
    "torque_Nm",
    "motor_velocity_rad_per_s",
    "load_velocity_rad_per_s",
)
CONDITIONS = ("temperature_C", "supply_V", "drive_enabled")
COLUMNS = ("time_s", *COMMANDS, *RESPONSES, *CONDITIONS)
HELD = (*COMMANDS, "drive_enabled")  # held from row to row; the others are sampled signals
ROLES = ("identification", "validation")
LARGEST = 1e9  # in SI no reading of a machine is larger
COLDEST_C = -273.15


@dataclass(frozen=True, kw_only=True, repr=False)
class Recording(ColumnViews, BriefRepr):
    """One experiment on an even grid.

    Attributes
    ----------
    file : str
        Name that messages and results use.
    role : "identification" or "validation"
        A validation recording is never used for a choice or a fit, only to report.
    load : Load
    description : str
    initial_rest : bool
        It starts at rest; else a simulation takes the speed from the first rows.
    quasi_static : bool
        Samples in order, time_s only an index: a loop or a map, not a motion.
    columns : mapping of name -> (n,) read-only array
        SI, time_s included.
    sample_time_s : float
    notes : tuple of Finding
        What the reader did to the columns (resampled, derived, decided).
    derived : tuple of str
        Columns that were computed from others by the logger and are no sensors.
    logged : mapping or None
        The columns at the times of the log, where `columns` are on an even grid instead.
    references : mapping of name -> (n,) array
        Goals, flags and the like, as logged: for reports, never fitted.
    """

    file: str
    role: str = "identification"
    load: Load = Load()  # noqa: RUF009
    description: str = ""
    initial_rest: bool = True
    quasi_static: bool = False
    columns: Mapping[str, NDArray]
    sample_time_s: float
    notes: tuple[Finding, ...] = ()
    derived: tuple[str, ...] = ()
    logged: Mapping[str, NDArray] | None = None
    references: Mapping[str, NDArray] = field(default_factory=dict)

    @property
    def rows(self) -> int:
        """Number of samples."""
        return self.columns["time_s"].size

    @property
    def time_s(self) -> NDArray:
        """(n,) times of the samples."""
        return self.columns["time_s"]

    @property
    def command_name(self) -> str | None:
        """The column that drives the machine: a command, else the measured current."""
        given = next((name for name in COMMANDS if name in self.columns), None)
        return given or ("current_A" if "current_A" in self.columns else None)

    @property
    def responses(self) -> tuple[str, ...]:
        """Columns that a sensor read, in the order of `RESPONSES`; without derived ones."""
        return tuple(
            name
            for name in RESPONSES
            if name in self.columns and name not in self.derived and name != self.command_name
        )

    def named_columns(self) -> Mapping[str, NDArray]:
        """`columns` with the time first, for tables, data sets and figures."""
        return {"time_s": self.time_s, **self.columns}

    def __getitem__(self, name: str) -> NDArray:
        return self.columns[name]

    def __contains__(self, name: str) -> bool:
        return name in self.columns

    def inputs(self) -> Inputs:
        """The inputs of a simulation of this recording, from the first row's readings.

        Raises
        ------
        InputError
            If the columns cannot be simulated (no load angle of an imposed load).
        """
        name = self.command_name
        kwargs = {}
        if name is not None:
            kwargs["current_command_A" if name == "current_A" else name] = self.columns[name]
        if self.load.kind == "imposed":
            if "load_angle_rad" not in self.columns:
                raise InputError(f"{self.file}: an imposed load needs load_angle_rad")
            kwargs["load_angle_rad"] = self.columns["load_angle_rad"]
        return Inputs(
            time_s=self.time_s,
            load=self.load,
            initial_motor_angle_rad=self.first("motor_angle_rad"),
            initial_load_angle_rad=self.first("load_angle_rad"),
            **kwargs,
        )

    def first(self, name: str) -> float:
        """The first reading of a column, 0 where it is absent."""
        return float(self.columns[name][0]) if name in self.columns else 0.0

    def held_angle_rad(self) -> float:
        """The mean angle of a locked load, the first one of another; 0 where none is read."""
        if self.load.kind == "locked" and "load_angle_rad" in self.columns:
            return float(np.mean(self.columns["load_angle_rad"]))
        return self.first("load_angle_rad")


def read_recording(
    path: str | Path,
    *,
    gear_ratio: float | None = None,
    role: str = "identification",
    load: Load = Load(),  # noqa: B008
    description: str = "",
    initial_rest: bool = True,
    quasi_static: bool = False,
    column_map: ColumnMap | None = None,
    with_files: tuple[Path, ...] = (),
    window_s: tuple[float | None, float | None] = (None, None),
    report: Callable[[str], None] | None = None,
) -> Recording:
    """Read a recording: a file of the contract, the bench program's own log, or any other log.

    Parameters
    ----------
    gear_ratio : float or None
        Of the rig, for an angle from the other side of the gear.
    column_map : ColumnMap or None
        Which column of the log is which; None: its columns have the contract's names.
    with_files, window_s, report
        Further files of the same clock, seconds since the first row to keep, progress.

    Raises
    ------
    RecordingError
        If the file breaks the contract; the message names file, column and row.
    """
    path = Path(path)
    columns, references, notes, derived = _columns(
        path,
        column_map,
        gear_ratio=gear_ratio,
        with_files=with_files,
        window_s=window_s,
        report=report,
    )
    check_values(path, columns)
    given = columns
    columns, sample_time, resampled = _even(path, columns, quasi_static)
    return Recording(
        file=path.name + _window_label(window_s),
        role=role,
        load=load,
        description=description,
        initial_rest=initial_rest,
        quasi_static=quasi_static,
        columns={name: read_only(values) for name, values in columns.items()},
        sample_time_s=sample_time,
        notes=(*notes, *resampled),
        derived=derived,
        logged={name: read_only(values) for name, values in given.items()}
        if _moved(given["time_s"], columns["time_s"], sample_time)
        else None,
        references={name: read_only(values) for name, values in references.items()},
    )


def _columns(path: Path, column_map: ColumnMap | None, *, gear_ratio, with_files, window_s, report):
    """Columns in SI, references, notes, and the columns that are no sensors'."""
    plain = path.suffix.lower() in ("", ".csv") and not os.path.isdir(path)  # of any length
    if column_map is None and is_bench_log(path):
        return *_with_no_references(read_bench_log(path, gear_ratio=gear_ratio)), ("torque_Nm",)
    if column_map is None and plain and window_s == (None, None):
        return _read_csv(path), {}, (), ()
    if column_map is None:
        column_map = identity_map(path, COLUMNS)
    files = (path, *with_files)
    found = columns_of_log(
        files, column_map, gear_ratio=gear_ratio, held=HELD, window_s=window_s, report=report
    )
    return *found, ()


def _with_no_references(found):
    columns, notes = found
    return columns, {}, notes


def _window_label(window_s: tuple[float | None, float | None]) -> str:
    """What tells two parts of one log apart in messages."""
    start, end = ("" if edge is None else f"{edge:g}" for edge in window_s)
    return f" [{start}..{end} s]" if start or end else ""


def _moved(logged: NDArray, grid: NDArray, step_s: float) -> bool:
    """Whether the times of the log were other than those of the grid, but for printed digits.

    Times of an even grid with a few rows filled are the grid's.
    """
    return logged.size == grid.size and bool(np.max(np.abs(logged - grid)) > 2e-3 * step_s)


def _read_csv(path: Path) -> dict[str, NDArray]:
    header = _header(path)
    for name in header:
        if name not in COLUMNS:
            raise RecordingError(
                f"{path}: unknown column {name!r}; {nearest(name, COLUMNS)}"
                " (the end of a column's name is its unit; `dftfs import` maps own names)"
            )
    doubled = next((name for name in header if header.count(name) > 1), None)
    if doubled is not None:
        raise RecordingError(f"{path}: column {doubled} is there twice")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a file without rows is reported below
            values = np.loadtxt(
                path, delimiter=",", skiprows=1, ndmin=2, encoding="utf-8", comments=None
            )
    except (ValueError, OSError):
        values = None
    if values is None or values.shape[1:] != (len(header),) or not np.all(np.isfinite(values)):
        # the slow reader finds the row and the column that are wrong
        optional = tuple(name for name in COLUMNS if name != "time_s")
        columns = read_columns(path, RecordingError, required=("time_s",), optional=optional)
    else:
        columns = {name: np.ascontiguousarray(values[:, j]) for j, name in enumerate(header)}
    if "time_s" not in columns:
        raise RecordingError(f"{path}: has no column time_s")
    return columns


def _header(path: Path) -> list[str]:
    require_regular(path, RecordingError, most_bytes=MOST_TABLE_BYTES)
    try:
        with open(path, encoding=TEXT, newline="") as stream:
            lines = csv.reader(stream)
            first = next(lines, None)
            rest = next(lines, None) if not first else None
    except OSError as problem:
        raise RecordingError(f"{path}: cannot be read: {problem.strerror or problem}") from problem
    except UnicodeDecodeError as problem:
        raise RecordingError(f"{path}: is not UTF-8 text (byte {problem.start})") from problem
    except csv.Error as problem:
        raise RecordingError(f"{path}: is not CSV text: {problem}") from problem
    if not first or not any(cell.strip() for cell in first):
        what = "is empty" if not rest else "row 1 is empty"
        raise RecordingError(f"{path}: {what}; expected a header with time_s")
    return header_names(first, path, RecordingError)


def check_values(path: Path, columns: Mapping[str, NDArray]) -> None:
    """Refuse values that no recording of the contract has.

    Raises
    ------
    RecordingError
        Naming file, column and row of the first one.
    """
    time = columns["time_s"]
    if time.size < 3:
        raise RecordingError(f"{path}: has {time.size} rows; a recording needs at least 3")
    steps = np.diff(time)
    if not np.all(steps > 0.0):
        k = int(np.argmax(steps <= 0.0)) + 1
        what = "repeats" if steps[k - 1] == 0.0 else "goes back from"
        pair = f"{time[k]:.15g} {what} {time[k - 1]:.15g}{tick_hint(time)}"
        raise RecordingError(f"{path}: column time_s, row {k + 2}: {pair}")
    for name, values in columns.items():
        if name != "time_s":
            _require(path, name, np.abs(values) <= LARGEST, columns, f"is beyond {LARGEST:g}")
    if "temperature_C" in columns:
        warm = columns["temperature_C"] > COLDEST_C
        _require(path, "temperature_C", warm, columns, f"must be above {COLDEST_C} (degrees C)")
    given = [name for name in COMMANDS if name in columns]
    if len(given) > 1:
        raise RecordingError(f"{path}: has {' and '.join(given)}; a recording has one input")
    if "duty" in columns:
        top = float(np.abs(columns["duty"]).max())
        hint = f" (the largest is {top:.4g}: percent?)" if 2.0 < top <= 100.0 else ""
        ok = np.abs(columns["duty"]) <= 1.0
        _require(path, "duty", ok, columns, f"must lie in -1..1{hint}")
    if "supply_V" in columns:
        _require(path, "supply_V", columns["supply_V"] > 0.0, columns, "must be above 0")
    if "drive_enabled" in columns:
        ok = np.isin(columns["drive_enabled"], (0.0, 1.0))
        _require(path, "drive_enabled", ok, columns, "must be 0 or 1")


def _require(path: Path, name: str, ok: NDArray, columns: Mapping, what: str) -> None:
    if not np.all(ok):
        k = int(np.argmin(ok))
        raise RecordingError(f"{path}: column {name}, row {k + 2}: {columns[name][k]:.9g} {what}")


def _even(path: Path, columns: Mapping[str, NDArray], quasi_static: bool):
    """The columns on an even grid, the sample time, and what was done."""
    time = columns["time_s"]
    steps = np.diff(time)
    mean = float(time[-1] - time[0]) / steps.size
    if quasi_static:
        return dict(columns), mean, ()
    limit = longest_step(steps)
    if steps.max() > limit:
        k = int(np.argmax(steps > limit))
        raise RecordingError(
            f"{path}: column time_s, row {k + 3}: gap of {steps[k]:.6g} s where samples are"
            f" {np.median(steps):.6g} s apart; split the recording there (dftfs import --split)"
        )
    lost = lost_rows(steps)
    if lost.any():
        return _filled(path, columns, lost)
    grid = time[0] + mean * np.arange(time.size)
    if np.max(np.abs(steps - mean)) <= EVEN * mean and np.max(np.abs(grid - time)) <= 0.5 * mean:
        return {**columns, "time_s": grid}, mean, ()
    grid[-1] = time[-1]
    resampled = {**_at(grid, time, columns, 1e-9 * mean), "time_s": grid}
    text = (
        f"sample times vary by {100 * np.std(steps) / mean:.1f} % (largest step"
        f" {steps.max() * 1e3:.3g} ms); resampled to {mean * 1e3:.4g} ms"
    )
    note = Finding(kind=Kind.RESAMPLED, text=text, file=path.name, column="time_s")
    return resampled, mean, (note,)


def _at(grid: NDArray, at: NDArray, columns: Mapping[str, NDArray], least: float):
    """The columns on a grid: held from row to row, or by straight lines."""
    before = np.searchsorted(at, grid + least, side="right") - 1
    return {
        name: values[before] if name in HELD else np.interp(grid, at, values)
        for name, values in columns.items()
    }


def _filled(path: Path, columns: Mapping[str, NDArray], lost: NDArray):
    """As `_even`, for an even clock that lacks a row now and then: these are filled."""
    time = columns["time_s"]
    at, rows, mean = places_of_rows(time, lost)
    filled = _at(rows, at, columns, 1e-9) | {"time_s": time[0] + mean * rows}
    text = (
        f"{lost.sum()} of {rows.size} rows were lost, {lost.max()} in a row at most; filled from"
        f" their neighbours, {mean * 1e3:.4g} ms apart"
    )
    note = Finding(kind=Kind.READER, text=text, file=path.name, column="time_s")
    return filled, mean, (note,)
