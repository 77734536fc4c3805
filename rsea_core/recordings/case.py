"""A case: a rig, the recordings made on it in their order, and test recordings to predict."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from rsea_core.errors import InputError, RecordingError, RigError
from rsea_core.files.csv_columns import read_columns
from rsea_core.files.toml_tables import nearest, number, read_toml, require_known
from rsea_core.machine.inputs import (
    COMMANDS,
    CONTACT_KEYS,
    LOADS,
    POSITION_COMMAND,
    Inputs,
    Load,
)
from rsea_core.machine.rig import Rig
from rsea_core.numeric.brief_repr import BriefRepr
from rsea_core.recordings.column_map import ColumnMap, column_map, for_rig, merged
from rsea_core.recordings.finding import Finding, Kind
from rsea_core.recordings.recording import COLUMNS, RESPONSES, ROLES, Recording, read_recording
from rsea_core.terms.known import KnownTerm, known_terms

FARTHEST_s, CLOSEST_s = 0.4, 5e-6  # rows of a motion
DEFLECTION = "spring_deflection_rad"
COARSER = 10.0  # times the noise of most rows: from there on steps are what a reading resolves
CLOCKS = (("milliseconds", 1e-3), ("microseconds", 1e-6), ("nanoseconds", 1e-9))
LOAD_KEYS = tuple(f.name for f in fields(Load))[1:]
RECORDING_KEYS = (
    "file",
    "role",
    "load",
    "description",
    "initial_rest",
    "quasi_static",
    "columns",
    "with_files",
    "start_s",
    "end_s",
    *LOAD_KEYS,
)
TEST_KEYS = ("file", "load", "description", "initial_motor_angle_rad", "initial_load_angle_rad",
             "initial_temperature_C", *LOAD_KEYS)  # fmt: skip


@dataclass(frozen=True, kw_only=True, repr=False)
class Case(BriefRepr):
    """A rig and its recordings, in the order in which they were made.

    Attributes
    ----------
    name : str
        The folder's.
    folder : Path
    rig : Rig
    recordings : tuple of Recording
    known : tuple of KnownTerm
        Physics that the file states beside the rig's values.
    """

    name: str
    folder: Path
    rig: Rig
    recordings: tuple[Recording, ...]
    known: tuple[KnownTerm, ...] = ()

    @property
    def identification(self) -> tuple[Recording, ...]:
        """The recordings that choices and fits may use."""
        return tuple(r for r in self.recordings if r.role == "identification")

    @property
    def validation(self) -> tuple[Recording, ...]:
        """The recordings that are only reported on."""
        return tuple(r for r in self.recordings if r.role == "validation")

    def notes(self) -> tuple[Finding, ...]:
        """What rig file and reader report before anything is computed."""
        rig = (Finding(kind=Kind.RIG_NOTE, text=text) for text in self.rig.findings())
        return (*rig, *(note for r in self.recordings for note in r.notes))


@dataclass(frozen=True, kw_only=True)
class InputRecording:
    """The inputs of a recording that is to be predicted.

    Attributes
    ----------
    file, description : str
    inputs : Inputs
    initial_temperature_C : float or None
    supply_V, drive_enabled : (n,) array or None
        Measured supply of a drive by duty; 1, or 0 while the bridge is open.
    """

    file: str
    description: str = ""
    inputs: Inputs
    initial_temperature_C: float | None = None
    supply_V: NDArray | None = None
    drive_enabled: NDArray | None = None


def read_case(folder: str | Path, report: Callable[[str], None] | None = None) -> Case:
    """Read a case folder: `rig.toml` and the recordings that it lists.

    Parameters
    ----------
    report : callable, optional
        Given a line now and then while a large log is read.

    Raises
    ------
    RecordingError, RigError, TermError
        If anything breaks the file contract: one line naming file, key or column, and row.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise RecordingError(f"{folder}: is not a folder with a rig.toml")
    path = folder / "rig.toml"
    tables = read_toml(path, RigError)
    rig = Rig.from_tables(tables, where=str(path)).with_both_constants()
    known, listed = known_terms(tables, rig, str(path)), _recording_tables(tables, path)
    where, common = f"{path}: recording", (tables.get("columns"), report)
    recordings = tuple(_recording(folder, rig, t, f"{where} {k}", *common) for k, t in listed)
    if not any(r.role == "identification" for r in recordings):
        raise RecordingError(f'{path}: no recording has the role "identification"')
    name = folder.resolve().name
    return Case(name=name, folder=folder, rig=rig, recordings=recordings, known=known)


def read_test(folder: str | Path, rig: Rig) -> tuple[InputRecording, ...]:
    """The test recordings of a folder with a `test.toml`.

    Raises
    ------
    RecordingError
        As `read_case`.
    """
    path = Path(folder) / "test.toml"
    tables = read_toml(path, RecordingError)
    require_known(tables, ("recording",), str(path), RecordingError)
    return tuple(
        _test(Path(folder), rig, t, f"{path}: recording {k}")
        for k, t in _recording_tables(tables, path)
    )


def _recording_tables(tables: Mapping, path: Path) -> list[tuple[int, Mapping]]:
    listed = tables.get("recording", [])
    if not isinstance(listed, list) or not all(isinstance(t, Mapping) for t in listed):
        raise RecordingError(f"{path}: recording must be written [[recording]]")
    if not listed:
        raise RecordingError(f"{path}: lists no [[recording]]")
    parts = [(t.get("file"), t.get("start_s"), t.get("end_s")) for t in listed]
    for k, part in enumerate(parts):
        if part[0] is not None and part in parts[:k]:
            raise RecordingError(
                f"{path}: recording {k + 1}: {part[0]} is listed already, as recording"
                f" {parts.index(part) + 1}"
            )
    return list(enumerate(listed, start=1))


def _load(table: Mapping, where: str) -> Load:
    kind = table.get("load", "pendulum")
    if kind not in LOADS:
        raise RecordingError(f"{where}: load {kind!r} is unknown; {nearest(str(kind), LOADS)}")
    values = {key: table[key] for key in LOAD_KEYS if key in table}
    if kind == "contact":
        values = {CONTACT_KEYS[2]: 0.0, **values}
    try:
        return Load(kind=kind, **values)
    except InputError as problem:
        raise RecordingError(f"{where}: {problem}") from problem


def _word(table: Mapping, key: str, where: str, default: str | None = None) -> str:
    value = table.get(key, default)
    if not isinstance(value, str):
        raise RecordingError(f"{where}: {key} = {value!r} must be a word")
    return value


def _flag(table: Mapping, key: str, where: str, default: bool) -> bool:
    value = table.get(key, default)
    if not isinstance(value, bool):
        raise RecordingError(f"{where}: {key} = {value!r} must be true or false")
    return value


def _map(table: Mapping | None, rig: Rig, where: str) -> ColumnMap | None:
    given = None if table is None else column_map(table, COLUMNS, f"{where}: [columns]")
    return None if given is None else for_rig(given, rig)


def _window(table: Mapping, where: str) -> tuple[float | None, float | None]:
    """First and last second of the part of a log that is the recording."""
    start, end = (
        None if key not in table else number(table[key], f"{where}: {key}", RecordingError)
        for key in ("start_s", "end_s")
    )
    if start is not None and end is not None and end <= start:
        raise RecordingError(f"{where}: end_s = {end:g} must be above start_s = {start:g}")
    return start, end


def _further_files(folder: Path, table: Mapping, where: str) -> tuple[Path, ...]:
    names = table.get("with_files", [])
    if not isinstance(names, list) or not all(isinstance(n, str) for n in names):
        raise RecordingError(f"{where}: with_files = {names!r} must be a list of files")
    return tuple(folder / name for name in names)


def _recording(
    folder: Path,
    rig: Rig,
    table: Mapping,
    where: str,
    shared: Mapping | None = None,
    report: Callable[[str], None] | None = None,
) -> Recording:
    require_known(table, RECORDING_KEYS, where, RecordingError)
    role = _word(table, "role", where, "identification")
    if role not in ROLES:
        raise RecordingError(f"{where}: role {role!r} is unknown; {nearest(role, ROLES)}")
    recording = read_recording(
        folder / _word(table, "file", where),
        gear_ratio=rig.gear_ratio if rig.has("gear") else None,
        role=role,
        load=_load(table, where),
        description=_word(table, "description", where, ""),
        initial_rest=_flag(table, "initial_rest", where, True),
        quasi_static=_flag(table, "quasi_static", where, False),
        column_map=_map(merged(shared, table.get("columns")), rig, where),
        with_files=_further_files(folder, table, where),
        window_s=_window(table, where),
        report=report,
    )
    path = folder / recording.file
    _require_columns(rig, recording, path)
    require_clock(rig, recording, path)
    return recording


def _require_columns(rig: Rig, recording: Recording, path: Path) -> None:
    if rig.has("drive") and recording.command_name is None:
        raise RecordingError(
            f"{path}: a rig with a drive needs one of the columns {', '.join(COMMANDS)} or"
            " current_A"
        )
    _require_torque_constant(rig, recording.command_name, path)
    if not recording.responses:
        raise RecordingError(f"{path}: needs a response column ({', '.join(RESPONSES)})")
    kind = recording.load.kind
    if kind == "imposed" and not {"load_angle_rad", DEFLECTION} & set(recording.columns):
        raise RecordingError(
            f'{path}: load "imposed" needs the column load_angle_rad or spring_deflection_rad'
        )


def _require_torque_constant(rig: Rig, command: str | None, path: Path) -> None:
    """Current and voltage drive a machine by its torque constant; torque and goals do not."""
    if rig.has("drive") and command not in (None, "motor_torque_Nm", POSITION_COMMAND):
        rig.need(f"{path.name}, driven by {command},", "torque_constant_Nm_per_A")


def require_clock(rig: Rig, recording: Recording, path: Path) -> None:
    """Refuse rows between which any motion has come and gone: a clock of another unit."""
    row_s = recording.sample_time_s
    moves = rig.has("drive") or rig.has("gear") or rig.has("load")
    if recording.quasi_static or not moves:
        return
    if row_s < CLOSEST_s:
        raise RecordingError(
            f"{path}: column time_s: rows are {row_s:.3g} s apart, closer than any logger's; are"
            " the times in seconds?"
        )
    if row_s < FARTHEST_s:
        return
    units = [word for word, per in CLOCKS if 1e-5 <= row_s * per < FARTHEST_s]
    guess = f"are they {' or '.join(units)}? " if units else ""
    raise RecordingError(
        f"{path}: column time_s: rows are {row_s:.6g} s apart, a motion is over between two of"
        f" them; {guess}A map or a loop without a clock says quasi_static = true"
    )


def _test(folder: Path, rig: Rig, table: Mapping, where: str) -> InputRecording:
    require_known(table, TEST_KEYS, where, RecordingError)
    name = _word(table, "file", where)
    load = _load(table, where)
    every = (*COMMANDS, "current_A", "load_angle_rad", "supply_V", "drive_enabled")
    optional = every if rig.parts != ("spring",) else ("load_angle_rad", DEFLECTION)
    columns = read_columns(folder / name, RecordingError, required=("time_s",), optional=optional)
    given = [column for column in (*COMMANDS, "current_A") if column in columns]
    if rig.has("drive") and not given:
        raise RecordingError(f"{folder / name}: needs one of the columns {', '.join(COMMANDS)}")
    _require_torque_constant(rig, next(iter(given), None), folder / name)
    values = {}
    if given:
        values["current_command_A" if given[0] == "current_A" else given[0]] = columns[given[0]]
    if load.kind == "imposed":
        if DEFLECTION in columns:  # of a spring alone: its hub is held
            columns.setdefault("load_angle_rad", -columns[DEFLECTION])
        if "load_angle_rad" not in columns:
            wanted = "load_angle_rad" if every is optional else f"load_angle_rad or {DEFLECTION}"
            raise RecordingError(f'{folder / name}: load "imposed" needs {wanted}')
        values["load_angle_rad"] = columns["load_angle_rad"]
    start = {
        key: number(table.get(key, 0.0), f"{where}: {key}", RecordingError)
        for key in ("initial_motor_angle_rad", "initial_load_angle_rad")
    }
    temperature = table.get("initial_temperature_C")
    if temperature is not None:
        temperature = number(temperature, f"{where}: initial_temperature_C", RecordingError)
    try:
        inputs = Inputs(time_s=columns["time_s"], load=load, **values, **start)
    except InputError as problem:
        raise RecordingError(f"{folder / name}: {problem}") from problem
    return InputRecording(
        file=name,
        description=_word(table, "description", where, ""),
        inputs=inputs,
        initial_temperature_C=temperature,
        supply_V=columns.get("supply_V") if inputs.command_name == "duty" else None,
        drive_enabled=columns.get("drive_enabled") if given else None,
    )


def noise_floor(rig: Rig, recording: Recording, *, order: int = 2) -> dict[str, float]:
    """Standard deviation of each response's sensor: quantisation by LSB / sqrt(12), noise, or
    what differences between neighbouring samples show.

    Parameters
    ----------
    order : int, of those differences; a higher one holds less of a fast motion

    Returns
    -------
    dict of column -> float, SI, above zero
    """
    counts = {
        "motor_angle_rad": rig.motor_encoder_counts_per_rev,
        "load_angle_rad": rig.load_encoder_counts_per_rev,
    }
    stated = {
        "torque_Nm": rig.torque_sensor_noise_Nm,
        "current_A": rig.current_sensor_noise_A,
    }
    floors = {}
    for name in recording.responses:
        values = recording[name]
        floor = 0.0
        if counts.get(name):
            floor = 2.0 * np.pi / counts[name] / np.sqrt(12.0)
        elif stated.get(name):
            floor = stated[name]
        else:
            floor = apparent_noise(values, recording.time_s, order)
            steps = 0.0 if recording.quasi_static else _apparent_steps(values, recording.time_s)
            floor = steps if steps > COARSER * floor else floor
        floors[name] = max(float(floor), 1e-9 * max(float(np.ptp(values)), 1.0))
    return floors


def apparent_noise(values: NDArray, time_s: NDArray | None = None, order: int = 2) -> float:
    """Noise from differences (median, so that motion counts little) or the resolution."""
    if values.size < 5:
        return 0.0
    noise = float(np.median(_differences(values, time_s, order))) / 0.6745
    levels = np.diff(np.unique(values))
    resolution = float(levels.min()) if levels.size else 0.0
    return max(noise, resolution / np.sqrt(12.0))


def _apparent_steps(values: NDArray, time_s: NDArray) -> float:
    """Noise of the rows that move, from third differences (of which motion leaves less).

    A counting encoder that rests shows none there, and the smallest difference may be no count.
    """
    third = _differences(values, time_s, 3)
    if third.size < 10 or not third.any():
        return 0.0
    top = float(np.percentile(third, 99.0)) or float(third.max())
    return float(np.median(third[third > 0.05 * top])) / 0.6745


def _differences(values: NDArray, time_s: NDArray | None, order: int) -> NDArray:
    """Magnitudes of divided differences, each scaled to the deviation of white noise."""
    rows = np.arange(values.size) if time_s is None else time_s
    at = sliding_window_view(rows, order + 1)
    weights = 1.0 / np.prod(at[:, :, None] - at[:, None, :] + np.eye(order + 1), axis=2)
    weights /= np.linalg.norm(weights, axis=1, keepdims=True)
    return np.abs(np.sum(weights * sliding_window_view(values, order + 1), axis=1))
