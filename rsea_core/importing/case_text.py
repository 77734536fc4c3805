"""The rig file of an imported log, with a comment on every decision and every missing value."""

import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from rsea_core.importing.proposal import ProposedColumn
from rsea_core.machine.inputs import POSITION_COMMAND
from rsea_core.machine.rig import PARTS, QUANTITIES, Rig, is_linear
from rsea_core.recordings.column_map import PROPOSED
from rsea_core.terms.known import KnownTerm

NEEDED = {
    "supply_voltage_V": "volts from duty",
    "terminal_resistance_ohm": "current from volts",
    "terminal_inductance_H": "how fast current rises",
    "torque_constant_Nm_per_A": "torque from current (required unless the log has torque or goals)",
    "back_emf_constant_Vs_per_rad": "volts from speed; checks the clock and the encoder",
    "current_limit_A": "saturation; checks milliamperes",
    "motor_inertia_kgm2": "acceleration of the motor",
    "motor_viscous_Nms_per_rad": "0 says that there is none; leave it out if unknown",
    "gear_ratio": "both sides of the gear (required with a gear; 1 for a direct drive)",
    "output_inertia_kgm2": "wheel and hub behind the gear",
    "spring_stiffness_Nm_per_rad": "torque from deflection",
    "load_mass_kg": "gravity, with load_distance_m",
    "load_distance_m": "gravity, with load_mass_kg",
    "load_inertia_kgm2": "acceleration of the load",
    "motor_encoder_counts_per_rev": "resolution; checks the motor angle's unit",
    "load_encoder_counts_per_rev": "resolution; checks the load angle's unit",
    "torque_sensor_noise_Nm": "how far the torque can be trusted",
    "current_sensor_noise_A": "how far the current can be trusted",
}
_VOLTS = ("duty", "voltage_V")
COLUMNS_OF = {
    "supply_voltage_V": ("duty",),
    "terminal_resistance_ohm": _VOLTS,
    "terminal_inductance_H": _VOLTS,
    "back_emf_constant_Vs_per_rad": _VOLTS,
    "torque_constant_Nm_per_A": (*_VOLTS, "current_A", "current_command_A"),
    "current_limit_A": (*_VOLTS, "current_A", "current_command_A"),
    "motor_encoder_counts_per_rev": ("motor_angle_rad",),
    "load_encoder_counts_per_rev": ("load_angle_rad",),
    "torque_sensor_noise_Nm": ("torque_Nm",),
    "current_sensor_noise_A": ("current_A",),
}
"""Values that only these columns need."""
GRAVITY = {"load_mass_kg", "load_distance_m"}
FRICTION_HINT = """\
# Known dry friction is a term (gear-friction: at the motor; load-friction: at the load):
# [[term]]
# effect = "gear-friction"
# coulomb_Nm = ...
"""
PLACEHOLDER = "# {key} = ...  # {why}"


@dataclass(frozen=True, kw_only=True)
class ListedRecording:
    """One `[[recording]]` of the rig file.

    Attributes
    ----------
    file : str
        From the case's folder.
    with_files : tuple of str
    start_s, end_s : float or None
    load, role, description : str
    initial_rest : bool
    """

    file: str
    with_files: tuple[str, ...] = ()
    start_s: float | None = None
    end_s: float | None = None
    load: str = "pendulum"
    role: str = "identification"
    description: str = ""
    initial_rest: bool = True


def parts_of(targets: Sequence[str]) -> tuple[str, ...]:
    """The parts that the columns of a log show."""
    owns = {
        "drive": {
            "duty",
            "voltage_V",
            "current_command_A",
            "current_A",
            "motor_torque_Nm",
            POSITION_COMMAND,
        },
        "gear": {"motor_angle_rad", "motor_velocity_rad_per_s", "duty", "current_command_A"},
        "spring": {"torque_Nm", "spring_deflection_rad"},
        "load": {"load_angle_rad", "load_velocity_rad_per_s"},
    }
    return tuple(part for part in PARTS if owns[part] & set(targets))


def missing_values(
    rig: Rig | None, targets: Sequence[str], loads: Collection[str] | None = None
) -> list[str]:
    """Keys of `[rig]` that the columns and loads of a case need and that are not known.

    Parameters
    ----------
    loads : collection of str, optional
        Of its recordings; None: any.
    """
    parts = parts_of(targets) if rig is None else rig.parts
    unneeded = {key for key, names in COLUMNS_OF.items() if not set(names) & set(targets)}
    if (loads is not None and "pendulum" not in loads) or is_linear(rig):
        unneeded |= GRAVITY
    if "spring" not in parts:
        unneeded |= {"output_inertia_kgm2"}  # part of the load's
    if rig is not None and rig.torque_constant_Nm_per_A:
        unneeded |= {"back_emf_constant_Vs_per_rad"}  # one number
    return [
        key
        for key in NEEDED
        if QUANTITIES[key]["part"] in (*parts, "any")
        and key not in unneeded
        and (rig is None or getattr(rig, key) is None)
    ]


def rig_text(
    rig: Rig | None,
    name: str,
    parts: Sequence[str],
    columns: str,
    recordings: Sequence[ListedRecording],
    known: Mapping[str, tuple[float, str]],
    *,
    is_servo: bool = False,
    terms: Sequence[KnownTerm] = (),
    targets: Sequence[str] = (),
) -> str:
    """The whole rig file.

    Parameters
    ----------
    known : mapping of key to (value, where it comes from)
        Values of a robot model, where there is no rig.
    terms : sequence of KnownTerm
        Those of the rig's file.
    targets : sequence of str
        The columns of the contract that the log has.
    """
    lines = ["# Made by `dftfs import`. Values marked ... are missing: fill in what you know."]
    if rig is not None:
        lines.append(rig.to_toml().rstrip())
        head, *tail = lines[-1].split("\n\n")
        lines[-1] = head
    else:
        tail = []
        lines += ["[rig]", f"name = {json.dumps(name)}", f"parts = {json.dumps(list(parts))}"]
        lines += ['servo = "angle"  # its drive closes a position loop'] if is_servo else []
        lines += [f"{key} = {value!r}  # {source}" for key, (value, source) in known.items()]
    loads = {r.load for r in recordings}
    missing = [key for key in missing_values(rig, targets, loads) if key not in known]
    lines += [PLACEHOLDER.format(key=key, why=NEEDED[key]) for key in missing]
    lines += ["", *(term.to_toml() for term in terms)]
    lines += [FRICTION_HINT] if rig is None else []
    lines += [*tail, columns.rstrip(), ""]
    lines += [recording_text(r) for r in recordings]
    return "\n".join(lines)


def columns_text(
    columns: Sequence[tuple[ProposedColumn, str, str | None]],
    *,
    references: Sequence[str],
    rate_Hz: float | None,
    channels: Mapping[str, str] | None = None,
    proposed: bool = False,
) -> str:
    """The table `[columns]`.

    Parameters
    ----------
    columns : sequence of (column, name in the log, topic)
    proposed : bool
        Without values of the machine: to be decided by them.
    """
    lines = ["[columns]"]
    if proposed:
        lines.append(f"{PROPOSED} = true  # --rig decides anew; delete this line if it is right")
    if rate_Hz is not None:
        lines.append(f"rate_Hz = {rate_Hz!r}")
    if channels:
        text = ", ".join(f"{k} = {json.dumps(v)}" for k, v in channels.items())
        lines.append(f"channels = {{ {text} }}  # one reading a row, named by its channel")
    for c, name, topic in columns:
        source = {"name": name} if c.formula is None else {"formula": c.formula}
        entry = {**source, "unit": c.unit}
        if topic is not None:
            entry["topic"] = topic
        if c.sign != 1:
            entry["sign"] = c.sign
        if c.side is not None:
            entry["side"] = c.side
        entry |= {k: v for k, v, usual in (("scale", c.scale, 1.0), ("zero", c.zero, 0.0))
                  if v != usual}  # fmt: skip
        if c.wrap is not None:
            entry["wrap"] = c.wrap
        if c.counts_per_rev is not None and c.unit == "count":
            entry["counts_per_rev"] = c.counts_per_rev
        text = ", ".join(f"{k} = {json.dumps(v, ensure_ascii=False)}" for k, v in entry.items())
        lines.append(f"# {c.confidence:.0%}: {c.reason}")
        lines.append(f"{c.target} = {{ {text} }}")
    listed = json.dumps(list(references), ensure_ascii=False)
    lines += [f"reference = {listed}  # kept as logged, shown in reports, never fitted"]
    lines += ['ignore = ["*"]']
    return "\n".join(lines)


def recording_text(r: ListedRecording) -> str:
    """One `[[recording]]`."""
    lines = ["[[recording]]", f"file = {json.dumps(r.file, ensure_ascii=False)}"]
    if r.with_files:
        lines.append(f"with_files = {json.dumps(list(r.with_files), ensure_ascii=False)}")
    for key in ("start_s", "end_s"):
        if getattr(r, key) is not None:
            lines.append(f"{key} = {getattr(r, key):.9g}")
    lines.append(f'role = "{r.role}"')
    lines.append(f'load = "{r.load}"  # pendulum, free, locked, contact, constant-torque, imposed')
    if not r.initial_rest:
        lines.append("initial_rest = false  # it is in motion at its first row")
    lines.append(f"description = {json.dumps(r.description, ensure_ascii=False)}")
    return "\n".join(lines) + "\n"
