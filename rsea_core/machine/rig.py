"""The rig: what its owner believes of the machine, read from and written to `rig.toml`.

A value that is not known is None; nothing is filled in. Which values a computation needs is
the computation's to say (`Rig.need`), because a rig without an inertia can still be studied
quasi-statically. Absorbed from python-control and the Compliant Joint Toolbox: motor, gear,
spring and load side are named in words, and an unknown key is an error.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from importlib import resources
from pathlib import Path

from rsea_core.errors import RigError
from rsea_core.files.toml_tables import (
    nearest,
    number,
    parse_toml,
    read_toml,
    require_known,
    table,
    toml_string,
)

PARTS = ("drive", "gear", "spring", "load")
AXES = ("rotary", "linear")
DRY_FRICTION = re.compile("coulomb|friction|stribeck|stiction", re.I)
NO_DRY_FRICTION = (
    'dry friction that is known is a term: write [[term]] effect = "gear-friction" (at the motor)'
    ' or "load-friction" with coulomb_Nm = ...'
)
SERVOS = ("angle", "angle-and-rate")
TABLES = ("rig", "tolerances", "anchor", "term", "recording", "columns")
CONSTANT_MISMATCH = 0.02  # k_t and k_e further apart than this are reported
MISMATCH_HINT = "rms and peak, or phase and line, conventions mixed?"

POSITIVE, NOT_NEGATIVE, ANY, COUNT = "positive", "not negative", "any", "count"


def _value(unit: str, part: str, allowed: str):
    return field(default=None, metadata={"unit": unit, "part": part, "allowed": allowed})


@dataclass(frozen=True, kw_only=True)
class Rig:
    """The nominal machine. SI units; a field is None where the value is not known.

    Attributes
    ----------
    name : str
    parts : tuple of str
        What the machine has, of "drive", "gear", "spring", "load". Without "spring" the
        wheel and the link are one rigid body.
    axis : "rotary" or "linear"
        "linear": 1 m is written as 1 rad and 1 N as 1 Nm.
    servo : None, "angle" or "angle-and-rate"
        What an inner position loop follows (`position_command_rad`): the goal with a speed of
        zero, or with the goal's own rate. Its gains, torque limit and dead band are meant at the
        gear's output; a gain that is not known is fitted by a diagnosis.
    tolerances : tuple of (field, relative standard deviation)
    anchors : tuple of str
        The quantities that the owner trusts (weighed, calibrated).

    Raises
    ------
    RigError
        If a value is out of its range or a value that the parts require is missing.
    """

    name: str
    parts: tuple[str, ...] = PARTS
    axis: str = "rotary"
    servo: str | None = None
    supply_voltage_V: float | None = _value("V", "drive", POSITIVE)
    terminal_resistance_ohm: float | None = _value("ohm", "drive", POSITIVE)
    terminal_inductance_H: float | None = _value("H", "drive", NOT_NEGATIVE)
    torque_constant_Nm_per_A: float | None = _value("Nm/A", "drive", POSITIVE)
    back_emf_constant_Vs_per_rad: float | None = _value("Vs/rad", "drive", NOT_NEGATIVE)
    current_limit_A: float | None = _value("A", "drive", POSITIVE)
    servo_proportional_Nm_per_rad: float | None = _value("Nm/rad", "drive", POSITIVE)
    servo_derivative_Nms_per_rad: float | None = _value("Nms/rad", "drive", NOT_NEGATIVE)
    servo_torque_limit_Nm: float | None = _value("Nm", "drive", POSITIVE)
    servo_dead_band_rad: float | None = _value("rad", "drive", NOT_NEGATIVE)
    servo_delay_s: float | None = _value("s", "drive", NOT_NEGATIVE)
    motor_inertia_kgm2: float | None = _value("kg m^2", "gear", NOT_NEGATIVE)
    motor_viscous_Nms_per_rad: float | None = _value("Nms/rad", "gear", NOT_NEGATIVE)
    gear_ratio: float | None = _value("-", "gear", POSITIVE)
    output_inertia_kgm2: float | None = _value("kg m^2", "gear", NOT_NEGATIVE)
    output_viscous_Nms_per_rad: float | None = _value("Nms/rad", "gear", NOT_NEGATIVE)
    spring_stiffness_Nm_per_rad: float | None = _value("Nm/rad", "spring", POSITIVE)
    load_mass_kg: float | None = _value("kg", "load", NOT_NEGATIVE)
    load_distance_m: float | None = _value("m", "load", NOT_NEGATIVE)
    load_inertia_kgm2: float | None = _value("kg m^2", "load", POSITIVE)
    load_viscous_Nms_per_rad: float | None = _value("Nms/rad", "load", NOT_NEGATIVE)
    gravity_angle_offset_rad: float | None = _value("rad", "load", ANY)
    motor_encoder_counts_per_rev: float | None = _value("counts", "gear", COUNT)
    load_encoder_counts_per_rev: float | None = _value("counts", "load", COUNT)
    torque_sensor_noise_Nm: float | None = _value("Nm", "any", NOT_NEGATIVE)
    current_sensor_noise_A: float | None = _value("A", "any", NOT_NEGATIVE)
    tolerances: tuple[tuple[str, float], ...] = ()
    anchors: tuple[str, ...] = ()

    def __post_init__(self):
        if not isinstance(self.name, str) or not self.name:
            raise RigError(f"[rig] name = {self.name!r} must be a word")
        object.__setattr__(self, "parts", _checked_parts(self.parts))
        if self.axis not in AXES:
            raise RigError(f"[rig] axis = {self.axis!r} must be one of {', '.join(AXES)}")
        if self.servo is not None and self.servo not in SERVOS:
            raise RigError(f"[rig] servo = {self.servo!r} must be one of {', '.join(SERVOS)}")
        for key in QUANTITIES:
            value = getattr(self, key)
            if value is not None:
                object.__setattr__(self, key, _checked_value(key, value))
        if "gear" in self.parts and self.gear_ratio is None:
            raise RigError(
                f'rig {self.name!r}: parts with "gear" needs gear_ratio in [rig]'
                " (1 where the motor turns the output directly)"
            )
        for key, share in self.tolerances:
            _require_quantity(key, "[tolerances]")
            if not number(share, f"[tolerances] {key}", RigError) > 0.0:
                raise RigError(f"[tolerances] {key} = {share} must be above 0 (0.1 is 10 %)")
        for key in self.anchors:
            _require_quantity(key, "[anchor] quantities")

    def need(self, purpose: str, *keys: str) -> None:
        """State what a computation needs of the rig.

        Raises
        ------
        RigError
            If one of the keys is not known; the message names all that are missing.
        """
        missing = [key for key in keys if getattr(self, key) is None]
        if missing:
            raise RigError(f"rig {self.name!r}: {purpose} needs {', '.join(missing)} in [rig]")

    def has(self, part: str) -> bool:
        """Whether the machine has this part ("drive", "gear", "spring" or "load")."""
        return part in self.parts

    def with_both_constants(self) -> "Rig":
        """The rig with an absent torque or back-EMF constant set to the stated one of the two.

        In SI units they are one number. Without a resistance of the winding no back-EMF constant is
        set: where the current is given, none is needed.
        """
        k_t, k_e = self.torque_constant_Nm_per_A, self.back_emf_constant_Vs_per_rad
        if k_t is None and k_e is not None:
            return replace(self, torque_constant_Nm_per_A=k_e)
        if k_e is None and k_t is not None and self.terminal_resistance_ohm is not None:
            return replace(self, back_emf_constant_Vs_per_rad=k_t)
        return self

    def full_command(self, name: str | None) -> float:
        """Largest command of a drive in the command's own unit; 1 where no value states it."""
        return self._stated_command(name) or 1.0

    def unit_of_command(self, name: str | None) -> str:
        """Unit of a command over `full_command`; empty where this makes it a share."""
        whole = name in (None, "duty") or self._stated_command(name)
        return "" if whole else name.rpartition("_")[2]

    def _stated_command(self, name: str | None) -> float | None:
        full = {"voltage_V": self.supply_voltage_V, "current_command_A": self.current_limit_A}
        return full.get(name)

    def findings(self) -> tuple[str, ...]:
        """What is legal but worth knowing before believing the numbers, a sentence each."""
        found = []
        k_t, k_e = self.torque_constant_Nm_per_A, self.back_emf_constant_Vs_per_rad
        if k_t and k_e and abs(k_t - k_e) > CONSTANT_MISMATCH * max(k_t, k_e):
            creates = "; with k_t > k_e the motor creates energy" if k_t > k_e else ""
            found.append(
                f"torque_constant ({k_t:g} Nm/A) and back_emf_constant ({k_e:g} Vs/rad) differ"
                f" by {abs(k_t - k_e) / min(k_t, k_e):.1%}: {MISMATCH_HINT}{creates}"
            )
        found += [
            f"[tolerances] {key} = {share:g} is a standard deviation of {share:.0%}:"
            f" {share:g} % is {share / 100:g}"
            for key, share in self.tolerances if share > 1.0
        ]  # fmt: skip
        for key, info in QUANTITIES.items():
            unused = info["part"] in PARTS and info["part"] not in self.parts
            if unused and getattr(self, key) is not None:
                found.append(f'{key} is given but not used: parts has no "{info["part"]}"')
        return tuple(found)

    @classmethod
    def preset(cls, name: str) -> "Rig":
        """A rig that comes with the package.

        Raises
        ------
        RigError
            If there is none of that name.
        """
        known = [path.name.removesuffix(".toml") for path in _data().iterdir()]
        if name not in known:
            raise RigError(f"no rig preset {name!r}; {nearest(name, known)}")
        text = _data().joinpath(f"{name}.toml").read_text(encoding="utf-8")
        where = f"preset {name}"
        return cls.from_tables(parse_toml(text, where, RigError), where=where)

    @classmethod
    def from_toml(cls, path: str | Path) -> "Rig":
        """The rig of a rig or case file; the recordings listed in it are the case reader's.

        Raises
        ------
        RigError
            If the file cannot be read, has an unknown key or an impossible value.
        """
        return cls.from_tables(read_toml(path, RigError), where=str(path))

    @classmethod
    def from_tables(cls, tables: Mapping, *, where: str) -> "Rig":
        """The rig of parsed TOML tables; `where` names their origin in messages.

        Raises
        ------
        RigError
            As `from_toml`.
        """
        require_known(tables, TABLES, where, RigError)
        if "rig" not in tables:
            raise RigError(f"{where}: has no [rig] table")
        try:
            rig = table(tables["rig"], "rig", RigError)
            dry = next((k for k in rig if DRY_FRICTION.search(k) and k not in QUANTITIES), None)
            if dry is not None:
                raise RigError(f"[rig] {dry}: {NO_DRY_FRICTION}")
            require_known(rig, ("name", "parts", "axis", "servo", *QUANTITIES), "[rig]", RigError)
            if "name" not in rig:
                raise RigError("[rig] has no name")
            tolerances = table(tables.get("tolerances", {}), "tolerances", RigError)
            anchor = table(tables.get("anchor", {}), "anchor", RigError)
            require_known(anchor, ("quantities",), "[anchor]", RigError)
            anchors = _texts(anchor.get("quantities", []), "[anchor] quantities")
            return cls(**rig, tolerances=tuple(tolerances.items()), anchors=anchors)
        except RigError as problem:
            raise RigError(f"{where}: {problem}") from problem

    def to_toml(self) -> str:
        """The rig as the text of a `rig.toml`; reading it back gives an equal rig."""
        lines = ["[rig]", f"name = {_toml(self.name)}", f"parts = {_toml(self.parts)}"]
        if self.axis != "rotary":
            lines.append(f"axis = {_toml(self.axis)}")
        if self.servo is not None:
            lines.append(f"servo = {_toml(self.servo)}")
        for key, info in QUANTITIES.items():
            value = getattr(self, key)
            if value is not None:
                lines.append(f"{key} = {int(value) if info['allowed'] == COUNT else _toml(value)}")
        if self.tolerances:
            lines += ["", "[tolerances]", *(f"{key} = {_toml(v)}" for key, v in self.tolerances)]
        if self.anchors:
            lines += ["", "[anchor]", f"quantities = {_toml(self.anchors)}"]
        return "\n".join(lines) + "\n"


QUANTITIES: dict[str, Mapping] = {f.name: f.metadata for f in fields(Rig) if f.metadata}


def _data():
    return resources.files("rsea_core").joinpath("data")


def _texts(value: object, where: str) -> tuple[str, ...]:
    if not isinstance(value, list | tuple) or not all(isinstance(v, str) for v in value):
        raise RigError(f"{where} = {value!r} must be a list of words")
    return tuple(value)


def _checked_parts(parts: object) -> tuple[str, ...]:
    given = _texts(parts, "[rig] parts")
    for part in given:
        if part not in PARTS:
            raise RigError(f"[rig] parts: unknown part {part!r}; {nearest(part, PARTS)}")
    if not given or len(set(given)) != len(given):
        raise RigError(f"[rig] parts = {list(given)} must name at least one part, each once")
    return tuple(part for part in PARTS if part in given)


def _checked_value(key: str, value: object) -> float:
    unit, allowed = QUANTITIES[key]["unit"], QUANTITIES[key]["allowed"]
    result = number(value, f"[rig] {key}", RigError)
    if allowed == POSITIVE and not result > 0.0:
        raise RigError(f"[rig] {key} = {value} {unit} must be above 0")
    if allowed == NOT_NEGATIVE and result < 0.0:
        raise RigError(f"[rig] {key} = {value} {unit} must not be below 0")
    if allowed == COUNT and (result < 1.0 or result != math.floor(result)):
        raise RigError(f"[rig] {key} = {value} must be a whole number of counts, at least 1")
    return result


def _require_quantity(key: str, where: str) -> None:
    if key not in QUANTITIES:
        raise RigError(f"{where}: unknown quantity {key!r}; {nearest(key, QUANTITIES)}")


def _toml(value: object) -> str:
    if isinstance(value, str):
        return toml_string(value)
    if isinstance(value, tuple):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    return repr(float(value))


def is_linear(rig: Rig | None) -> bool:
    """Whether the axis is known to be linear: 1 m is written as 1 rad and 1 N as 1 Nm."""
    return rig is not None and rig.axis == "linear"
