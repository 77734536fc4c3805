"""What a simulation is given: the drive's command over time, the load, where it starts."""

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rsea_core.errors import InputError
from rsea_core.files.toml_tables import nearest, number, require_known, word
from rsea_core.numeric.arrays import read_only
from rsea_core.numeric.brief_repr import BriefRepr

POSITION_COMMAND = "position_command_rad"
COMMANDS = ("duty", "voltage_V", "current_command_A", "motor_torque_Nm", POSITION_COMMAND)
LOADS = ("pendulum", "free", "locked", "contact", "constant-torque", "imposed")
HELD_LOADS = ("locked", "imposed")
CONTACT_KEYS = (
    "contact_stiffness_Nm_per_rad",
    "contact_angle_rad",
    "contact_damping_Nms_per_rad",
)


@dataclass(frozen=True, kw_only=True)
class Load:
    """What the output side of the spring is joined to.

    Attributes
    ----------
    kind : str
        "pendulum" (the link with gravity), "free" (without), "locked" (held where it starts),
        "contact" (the pendulum against a spring and damper beyond an angle),
        "constant-torque" (a weight on a drum: no pendulum gravity, `load_torque_Nm` acts),
        "imposed" (its motion is given).
    contact_stiffness_Nm_per_rad, contact_angle_rad, contact_damping_Nms_per_rad : float or None
        tau_contact = K_e (theta_l - theta_e) + B_e w_l where theta_l > theta_e, else 0. The law
        is the file contract's: with damping it pulls for a moment before the load leaves.
    load_torque_Nm : float or None
        Positive helps positive motion.

    Raises
    ------
    InputError
        If a value that the kind needs is missing, one that it has no use for is given, or a
        value is out of range.
    """

    kind: str = "pendulum"
    contact_stiffness_Nm_per_rad: float | None = None
    contact_angle_rad: float | None = None
    contact_damping_Nms_per_rad: float | None = None
    load_torque_Nm: float | None = None

    def __post_init__(self):
        if word(self.kind, "load kind", InputError) not in LOADS:
            raise InputError(f"load {self.kind!r} is unknown; {nearest(self.kind, LOADS)}")
        needed = {"contact": CONTACT_KEYS, "constant-torque": ("load_torque_Nm",)}
        needed_here = needed.get(self.kind, ())
        for f in fields(self)[1:]:
            value = getattr(self, f.name)
            if value is None and f.name in needed_here:
                raise InputError(f"load {self.kind!r} needs {f.name}")
            if value is not None and f.name not in needed_here:
                raise InputError(f"load {self.kind!r} has no use for {f.name} = {value}")
            if value is not None:
                object.__setattr__(self, f.name, number(value, f"load {f.name}", InputError))
        if self.kind == "contact":
            if not self.contact_stiffness_Nm_per_rad > 0.0:
                raise InputError("load contact_stiffness_Nm_per_rad must be above 0")
            if self.contact_damping_Nms_per_rad < 0.0:
                raise InputError("load contact_damping_Nms_per_rad must not be below 0")

    @classmethod
    def from_table(cls, table: Mapping, where: str) -> "Load":
        """The load of a TOML table with the key `kind` and the values that it needs.

        Raises
        ------
        InputError
            For an unknown key or an unusable value; `where` names the table.
        """
        require_known(table, [f.name for f in fields(cls)], where, InputError)
        if "kind" not in table:
            raise InputError(f"{where} has no kind ({', '.join(LOADS)})")
        try:
            return cls(**table)
        except InputError as problem:
            raise InputError(f"{where}: {problem}") from problem

    @property
    def is_held(self) -> bool:
        """Whether the load's motion is given rather than computed."""
        return self.kind in HELD_LOADS


@dataclass(frozen=True, kw_only=True, repr=False)
class Inputs(BriefRepr):
    """Inputs of an open-loop simulation, one row a sample.

    Row k's readings are taken at time_s[k], before its command acts; the command is held from
    there to row k + 1. The machine starts at rest, without current.

    Attributes
    ----------
    time_s : (n,) array
        Increasing; rows need not be evenly spaced.
    duty, voltage_V, current_command_A, motor_torque_Nm : (n,) array or None
        The command, exactly one of them; none for a machine without a drive.
    position_command_rad : (n,) array or None
        The command of a servo: the goal of its inner position loop, at the gear's output.
    load : Load
    load_angle_rad : (n,) array or None
        The motion of an imposed load, a cubic between rows through central differences.
    initial_motor_angle_rad, initial_load_angle_rad : float
        A locked load stays at its initial angle.

    Raises
    ------
    InputError
        If rows do not increase, a value is not finite, lengths differ, a duty is outside
        -1..1, or more than one command is given.
    """

    time_s: ArrayLike
    duty: ArrayLike | None = None
    voltage_V: ArrayLike | None = None
    current_command_A: ArrayLike | None = None
    motor_torque_Nm: ArrayLike | None = None
    position_command_rad: ArrayLike | None = None
    load: Load = Load()
    load_angle_rad: ArrayLike | None = None
    initial_motor_angle_rad: float = 0.0
    initial_load_angle_rad: float = 0.0

    def __post_init__(self):
        time = checked_times(self.time_s)
        object.__setattr__(self, "time_s", time)
        given = [name for name in COMMANDS if getattr(self, name) is not None]
        if len(given) > 1:
            raise InputError(f"give one command, not {' and '.join(given)}")
        for name in (*given, *(["load_angle_rad"] if self.load_angle_rad is not None else [])):
            object.__setattr__(self, name, _row_values(name, getattr(self, name), time.size))
        if self.duty is not None and np.abs(self.duty).max() > 1.0:
            row = int(np.argmax(np.abs(self.duty)))
            raise InputError(f"duty[{row}] = {self.duty[row]:.6g} must lie in -1..1")
        if (self.load.kind == "imposed") != (self.load_angle_rad is not None):
            raise InputError('load_angle_rad is needed for the load "imposed", and only there')
        for name in ("initial_motor_angle_rad", "initial_load_angle_rad"):
            object.__setattr__(self, name, number(getattr(self, name), name, InputError))

    @property
    def command_name(self) -> str | None:
        """The column that drives the machine, None without one."""
        return next((name for name in COMMANDS if getattr(self, name) is not None), None)


def checked_times(time_s: ArrayLike) -> NDArray:
    """Row times as a read-only array.

    Raises
    ------
    InputError
        If there are fewer than two, or they do not increase.
    """
    time = np.array(time_s, dtype=float)
    if time.ndim != 1 or time.size < 2 or not np.all(np.isfinite(time)):
        raise InputError("time_s must be at least 2 finite numbers in a row")
    if not np.all(np.diff(time) > 0.0):
        row = int(np.argmax(np.diff(time) <= 0.0)) + 1
        raise InputError(f"time_s[{row}] = {time[row]:.9g} does not come after the row before")
    return read_only(time)


def _row_values(name: str, values: ArrayLike, rows: int) -> NDArray:
    array = np.array(values, dtype=float)
    if array.shape != (rows,):
        raise InputError(f"{name} has shape {array.shape}, time_s has {rows} rows")
    if not np.all(np.isfinite(array)):
        row = int(np.argmin(np.isfinite(array)))
        raise InputError(f"{name}[{row}] = {array[row]} must be finite")
    return read_only(array)
