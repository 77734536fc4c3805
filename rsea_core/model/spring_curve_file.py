"""A spring's torque-deflection curve from a file."""

import warnings
from pathlib import Path

import numpy as np

from rsea_core.effects.registry import SpringCurve
from rsea_core.errors import TermError
from rsea_core.files.csv_columns import read_columns, read_notes

SIGNS = ("winding", "actuator")
_SYMMETRIC = 0.005  # of the torque: a curve that differs less is the same in either sign


class SignWarning(UserWarning):
    """A curve whose sign is not stated and matters."""


def read_spring_curve(path: str | Path) -> SpringCurve:
    """The curve of a CSV file: deflection_rad, torque_Nm and optionally tangent_Nm_per_rad.

    Lines ``# key: value`` may stand before the columns' names. ``# sign: winding`` (as
    `dftfs study` writes: + tightens the arms on the hub) is mirrored to the actuator's sign, wheel
    angle minus load angle, in which + unwinds the arms; ``# sign: actuator`` is taken as it is.
    ``contact_negative_rad`` and ``contact_positive_rad`` are first contacts, in the file's sign.

    Raises
    ------
    TermError
        If the file cannot be read, its sign is unknown or its points cannot be used.

    Warns
    -----
    SignWarning
        If the two directions differ and the file states no sign: the actuator's is taken.
    """
    notes = read_notes(path, TermError)
    columns = read_columns(
        path,
        TermError,
        required=("deflection_rad", "torque_Nm"),
        optional=("tangent_Nm_per_rad",),
    )
    sign = notes.get("sign")
    if sign is not None and sign not in SIGNS:
        raise TermError(f"{path}: sign: {sign!r} is unknown; known are {', '.join(SIGNS)}")
    onset = [_onset(notes, f"contact_{side}_rad", path) for side in ("negative", "positive")]
    if sign == "winding":
        for name, values in columns.items():
            columns[name] = values[::-1] if name.startswith("tangent") else -values[::-1]
        onset = [None if value is None else -value for value in reversed(onset)]
    try:
        curve = SpringCurve(**columns, contact_onset_rad=tuple(onset), source=str(path))
    except TermError as problem:
        raise TermError(f"{path}: {problem}") from problem
    if sign is None and not _symmetric(curve):
        warnings.warn(
            f"{path}: its two directions differ and no line '# sign: winding' or '# sign: actuator'"
            " says which is which; + is taken as wheel angle minus load angle, which unwinds",
            SignWarning,
            stacklevel=2,
        )
    return curve


def _onset(notes: dict[str, str], key: str, path: str | Path) -> float | None:
    if key not in notes:
        return None
    try:
        return float(notes[key])
    except ValueError:
        raise TermError(f"{path}: {key}: {notes[key]!r} must be a number") from None


def _symmetric(curve: SpringCurve) -> bool:
    """Whether the torque at -d is that at d with its sign turned, as far as both are given."""
    d, torque = np.asarray(curve.deflection_rad), np.asarray(curve.torque_Nm)
    reach = min(-d[0], d[-1])
    if reach <= 0:
        return True
    look = np.linspace(0.0, reach, 21)[1:]
    up, down = np.interp(look, d, torque), -np.interp(-look, d, torque)
    return bool(np.all(np.abs(up - down) <= _SYMMETRIC * np.max(np.abs(up))))
