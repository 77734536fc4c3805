"""The forty slips of a log or rig file that `dftfs doctor` tries on copies of a case."""

import tempfile
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RseaError
from rsea_core.importing.doctor.slip_checks import slips
from rsea_core.machine.inputs import COMMANDS
from rsea_core.machine.rig import Rig
from rsea_core.recordings.case import Case, require_clock
from rsea_core.recordings.finding import Finding, Kind
from rsea_core.recordings.quality_checks import data_errors, data_warnings
from rsea_core.recordings.recording import Recording, check_values

Columns = dict[str, NDArray]
SHIFT_s = 0.1
DEGREES = 180.0 / np.pi
MOST = 3  # recordings of a case that are corrupted


@dataclass(frozen=True)
class Slip:
    """A slip: what it is, which columns or rig value it needs, and what it does.

    Attributes
    ----------
    name : str
    needs : tuple of str
        Columns, "command" for the one that drives, or `rig:` and a value's name.
    apply : function of the columns, or of the rig, that returns them changed
    """

    name: str
    needs: tuple[str, ...]
    apply: Callable


def scaled(column: str, factor: float) -> Callable:
    """A slip that multiplies one column."""
    return lambda c: {**c, column: factor * c[column]}


def _swapped(first: str, second: str) -> Callable:
    return lambda c: {**c, first: c[second], second: c[first]}


def _shifted(column: str) -> Callable:
    def apply(c: Columns) -> Columns:
        rows = max(1, round(SHIFT_s / (c["time_s"][1] - c["time_s"][0])))
        late = np.concatenate((np.full(rows, c[column][0]), c[column][:-rows]))
        return {**c, column: late}

    return apply


def _wrapped(column: str) -> Callable:
    return lambda c: {**c, column: (c[column] + np.pi) % (2.0 * np.pi) - np.pi}


def _rig_scaled(key: str, factor: float) -> Callable:
    return lambda rig: replace(rig, **{key: factor * getattr(rig, key)})


M, L, I, T = "motor_angle_rad", "load_angle_rad", "current_A", "torque_Nm"  # noqa: E741
CATALOGUE: tuple[Slip, ...] = (
    *(Slip(f"sign of {c}", (c,), scaled(c, -1.0)) for c in (M, L, I, T)),
    Slip("sign of the command", ("command",), scaled("command", -1.0)),
    Slip("motor angle in degrees", (M,), scaled(M, DEGREES)),
    Slip("load angle in degrees", (L,), scaled(L, DEGREES)),
    Slip("both angles in degrees", (M, L), lambda c: scaled(M, DEGREES)(scaled(L, DEGREES)(c))),
    Slip("motor angle converted twice from degrees", (M,), scaled(M, 1.0 / DEGREES)),
    Slip("load angle converted twice from degrees", (L,), scaled(L, 1.0 / DEGREES)),
    Slip("motor angle in turns", (M,), scaled(M, 0.5 / np.pi)),
    Slip("load angle in turns", (L,), scaled(L, 0.5 / np.pi)),
    Slip("motor angle in counts", (M, "rig:motor_encoder_counts_per_rev"), None),
    Slip("load angle in counts", (L, "rig:load_encoder_counts_per_rev"), None),
    Slip("motor encoder: four times the counts", (M,), scaled(M, 0.25)),
    Slip("load encoder: four times the counts", (L,), scaled(L, 0.25)),
    Slip("motor encoder: lines for counts", (M,), scaled(M, 4.0)),
    Slip("load encoder: lines for counts", (L,), scaled(L, 4.0)),
    Slip("motor angle behind the gear", (M, "rig:gear_ratio"), None),
    Slip("load angle before the gear", (L, "rig:gear_ratio"), None),
    Slip("motor angle wraps at a turn", (M,), _wrapped(M)),
    Slip("current in milliamperes", (I,), scaled(I, 1e3)),
    Slip("current converted twice from milliamperes", (I,), scaled(I, 1e-3)),
    Slip("torque in millinewton metres", (T,), scaled(T, 1e3)),
    Slip("torque converted twice from millinewton metres", (T,), scaled(T, 1e-3)),
    Slip("command in percent", ("command",), scaled("command", 100.0)),
    Slip("command divided by 100 twice", ("command",), scaled("command", 0.01)),
    Slip("time in milliseconds", (), scaled("time_s", 1e3)),
    Slip("time converted twice from milliseconds", (), scaled("time_s", 1e-3)),
    Slip("half the true rate", (), scaled("time_s", 2.0)),
    Slip("twice the true rate", (), scaled("time_s", 0.5)),
    Slip("motor and load angle swapped", (M, L), _swapped(M, L)),
    Slip("current and torque swapped", (I, T), _swapped(I, T)),
    Slip("command and current swapped", ("command", I), _swapped("command", I)),
    Slip("torque 0.1 s late", (T,), _shifted(T)),
    Slip("load angle 0.1 s late", (L,), _shifted(L)),
    Slip("current 0.1 s late", (I,), _shifted(I)),
    Slip("rig: half the gear ratio", ("rig:gear_ratio",), _rig_scaled("gear_ratio", 0.5)),
    Slip("rig: torque constant in mNm/A", ("rig:torque_constant_Nm_per_A",),
         _rig_scaled("torque_constant_Nm_per_A", 1e3)),
    Slip("rig: stiffness in Nm/degree", ("rig:spring_stiffness_Nm_per_rad",),
         _rig_scaled("spring_stiffness_Nm_per_rad", 1.0 / DEGREES)),
)  # fmt: skip
assert len(CATALOGUE) == 40


@dataclass(frozen=True, kw_only=True)
class SlipResult:
    """A slip tried on a case.

    Attributes
    ----------
    name : str
    noticed : bool or None
        None where the case has not what it needs.
    text : str
        The line that notices it.
    """

    name: str
    noticed: bool | None
    text: str = ""


def try_slips(case: Case) -> tuple[SlipResult, ...]:
    """Corrupt copies of a case and look whether a check reports what it did not before."""
    case = replace(case, recordings=case.recordings[:MOST])
    before = {_key(f) for f in _reported(case)}
    return tuple(_tried(case, slip, before) for slip in CATALOGUE)


def case_slips(case: Case) -> tuple[Finding, ...]:
    """The slips that the recordings of a case show as they are.

    A late column is reported if most recordings show it: one slow motion alone has a phase by
    friction, or by a resistance that is a little off, that looks like a delay.
    """
    found = [f for r in case.recordings for f in slips(case.rig, r)]
    late = Counter(f.column for f in found if f.kind is Kind.CLOCK)
    most = 0.5 * len(case.recordings)
    return tuple(f for f in found if f.kind is not Kind.CLOCK or late[f.column] >= most)


def _key(f: Finding) -> tuple:
    return f.kind, f.file, f.column


def _reported(case: Case) -> list[Finding]:
    return [*data_errors(case), *data_warnings(case), *case_slips(case)]


def _tried(case: Case, slip: Slip, before: set) -> SlipResult:
    try:
        changed = _corrupted(case, slip)
        if changed is None:
            return SlipResult(name=slip.name, noticed=None)
        found = [f for f in _reported(changed) if _key(f) not in before]
    except RseaError as problem:
        text = str(problem).replace(tempfile.gettempdir(), "")
        return SlipResult(name=slip.name, noticed=True, text=text)
    if not found:
        return SlipResult(name=slip.name, noticed=False)
    return SlipResult(name=slip.name, noticed=True, text=found[0].sentence())


def _corrupted(case: Case, slip: Slip) -> Case | None:
    """The case with the slip in it; None where it lacks a column or value.

    Raises
    ------
    RseaError
        Where a reader refuses what the slip makes.
    """
    needed = [n.removeprefix("rig:") for n in slip.needs if n.startswith("rig:")]
    if any(getattr(case.rig, key) is None for key in needed):
        return None
    if slip.name.startswith("rig:"):
        rig = slip.apply(case.rig)
        return replace(case, rig=rig)
    changed, any_one = [], False
    for r in case.recordings:
        wanted = [_column(r, n) for n in slip.needs if not n.startswith("rig:")]
        if any(n is None or n not in r for n in wanted):
            changed.append(r)
            continue
        any_one = True
        changed.append(_with_columns(case, r, _applied(case.rig, r, slip)))
    return replace(case, recordings=tuple(changed)) if any_one else None


def _column(r: Recording, name: str) -> str | None:
    if name != "command":
        return name
    return r.command_name if r.command_name in COMMANDS else None


def _applied(rig: Rig, r: Recording, slip: Slip) -> Columns:
    command = r.command_name or "command"
    columns = {("command" if n == command else n): np.asarray(v) for n, v in r.columns.items()}
    apply = slip.apply
    if apply is None:
        column = slip.needs[0]
        side = column.split("_")[0]
        ratio = rig.gear_ratio if side == "load" else 1.0 / rig.gear_ratio
        counts = getattr(rig, f"{side}_encoder_counts_per_rev")
        apply = scaled(column, counts / (2 * np.pi) if "counts" in slip.name else ratio)
    made: Mapping[str, NDArray] = apply(columns)
    return {(command if n == "command" else n): v for n, v in made.items()}


def _with_columns(case: Case, r: Recording, columns: Columns) -> Recording:
    """The recording as its reader would have made it of these columns."""
    path = Path(r.file)
    check_values(path, columns)
    time = columns["time_s"]
    step = float(time[-1] - time[0]) / (time.size - 1)
    changed = replace(r, columns=columns, sample_time_s=step, logged=None)
    require_clock(case.rig, changed, path)
    return changed
