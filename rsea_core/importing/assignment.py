"""Which readings the columns of a log may be: by names, by what the owner states, by numbers."""

import itertools
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rsea_core.importing.streams.column_names import NameEvidence
from rsea_core.importing.unit_evidence import correlation_of
from rsea_core.machine.inputs import COMMANDS, POSITION_COMMAND
from rsea_core.machine.rig import Rig
from rsea_core.recordings.column_map import ColumnSource
from rsea_core.recordings.recording import COLUMNS

SIDED = {"angle": "angle_rad", "velocity": "velocity_rad_per_s"}
PLAIN = {
    "time": "time_s", "duty": "duty", "voltage": "voltage_V", "supply": "supply_V",
    "current": "current_A", "torque": "torque_Nm", "temperature": "temperature_C",
    "enabled": "drive_enabled", "deflection": "spring_deflection_rad",
}  # fmt: skip
COMMANDED = {"current": "current_command_A", "voltage": "voltage_V", "duty": "duty"}
DRIVING = ("duty", "voltage", "current")
IS_DERIVATIVE = 0.9  # correlation of a velocity with the slope of its angle


def columns_by_name(
    names: Sequence[str],
    evidence: Mapping[str, NameEvidence],
    rig: Rig | None,
    stated: Mapping[str, ColumnSource | None],
) -> tuple[dict[str, list[str]], list[str], list[str]]:
    """Possible targets of each column; goals; columns that names say nothing about.

    Parameters
    ----------
    stated : mapping of column to its source, or None for a reference
        What the owner says: no other column can be what one is stated to be.
    """
    taken = {s.target for s in stated.values() if s is not None}
    is_servo = _is_servo(names, evidence, rig, taken)
    assigned: dict[str, list[str]] = {}
    goals, unknown = [], []
    for name in names:
        if name in stated:
            source = stated[name]
            (goals.append(name) if source is None else assigned.update({name: [source.target]}))
            continue
        if name not in COLUMNS and evidence[name].quantity == "time":
            continue
        targets = _targets(name, evidence[name], rig, is_servo)
        left = [t for t in targets if t not in taken and not (t in COMMANDS and _drives(taken))]
        if left:
            assigned[name] = left
        elif targets or evidence[name].is_goal or (is_servo and evidence[name].quantity):
            goals.append(name)
        else:
            unknown.append(name)
    commands = [n for n in assigned if assigned[n][0] in COMMANDS and evidence[n].is_goal]
    for name in [n for n in commands if n not in stated][0 if _drives(taken) else 1 :]:
        goals.append(name)
        del assigned[name]
    driven = _drives({t for ts in assigned.values() for t in ts} - {"motor_torque_Nm"})
    for name in [n for n in assigned if driven and assigned[n] == ["motor_torque_Nm"]]:
        if name not in stated and name not in COLUMNS:  # an estimate from what drives
            goals.append(name)
            del assigned[name]
    return assigned, goals, unknown


def _drives(targets: set[str]) -> bool:
    return bool(targets & set(COMMANDS))


def _is_servo(names, evidence: Mapping[str, NameEvidence], rig: Rig | None, taken) -> bool:
    """Whether a goal of the position is what drives: the rig says so, or nothing else can."""
    if rig is not None:
        return rig.servo is not None
    driven = _drives(taken) or any(evidence[n].quantity in DRIVING for n in names)
    return not driven and any(
        evidence[n].is_goal and evidence[n].quantity == "angle" for n in names
    )


def _targets(name: str, e: NameEvidence, rig: Rig | None, is_servo: bool) -> list[str]:
    """What one column may be by its name; nothing: a reference or unknown."""
    driven = rig is None or rig.has("drive")
    if name in COLUMNS:  # the contract's own name
        return [name]
    if e.quantity is None:
        return []
    if e.is_goal:
        own = dict(COMMANDED, angle=POSITION_COMMAND) if is_servo else COMMANDED
        target = own.get(e.quantity) if driven else None
        return [] if target is None else [target]
    if e.quantity in SIDED:
        sides = [e.side] if e.side else ["load"] if is_servo else ["motor", "load"]
        if rig is not None and not is_servo:
            owns = {"motor": rig.has("gear") or rig.has("drive"), "load": rig.has("load")}
            sides = [s for s in sides if owns[s]] or sides
            if len(sides) == 2 and rig.gear_ratio == 1.0 and not rig.has("spring"):
                counted = rig.load_encoder_counts_per_rev and not rig.motor_encoder_counts_per_rev
                sides = ["load" if counted else "motor"]  # one body
        return [f"{side}_{SIDED[e.quantity]}" for side in sides]
    if e.quantity == "torque" and (e.side == "motor" and not is_servo):
        return ["motor_torque_Nm"]
    if e.quantity == "torque" and is_servo and (rig is None or not rig.has("spring")):
        return []  # the servo's own estimate, which no sensor measured
    if e.quantity == "voltage" and e.side is None and not driven:
        return []
    if is_servo and e.quantity in ("duty", "voltage"):
        return []  # what the servo makes of its goal
    return [PLAIN[e.quantity]]


def columns_by_derivative(
    raw: Mapping[str, NDArray], time: str, rig: Rig | None
) -> dict[str, list[str]]:
    """An angle and its velocity in a log without names, by the one being the slope of the other."""
    sides = ["motor", "load"]
    if rig is not None:
        owns = {"motor": rig.has("gear") or rig.has("drive"), "load": rig.has("load")}
        sides = [s for s in sides if owns[s]] or sides
    best, pair = IS_DERIVATIVE, None
    for angle, speed in itertools.permutations((n for n in raw if n != time), 2):
        slope, own = _smooth(np.gradient(raw[angle], raw[time])), _smooth(raw[speed])
        together = abs(correlation_of(slope, own))
        if together > best:
            best, pair = together, (angle, speed)
    if pair is None:
        return {}
    kinds = ("angle", "velocity")
    return {n: [f"{s}_{SIDED[kind]}" for s in sides] for n, kind in zip(pair, kinds, strict=True)}


def _smooth(values: NDArray) -> NDArray:
    return np.convolve(values, np.full(5, 0.2), mode="valid")


def alternatives(assigned: Mapping[str, list[str]]) -> list[dict[str, str]]:
    """Assignments in which no target has two columns; as many columns as possible."""
    found, most = [], 0
    names = list(assigned)
    for combination in itertools.islice(itertools.product(*assigned.values()), 512):
        table: dict[str, str] = {}
        for name, target in zip(names, combination):
            if target not in table.values():
                table[name] = target
        if "duty" in table.values() and "voltage_V" in table.values():
            table = {n: t for n, t in table.items() if t != "voltage_V"}
        if _mixed_sides(table, assigned):
            continue
        most = max(most, len(table))
        found.append(table)
    unique: list[dict[str, str]] = []
    for table in found:
        if len(table) == most and table not in unique:
            unique.append(table)
    return unique


def _mixed_sides(table: Mapping[str, str], assigned: Mapping[str, list[str]]) -> bool:
    """Whether the only angle and the only velocity, both of no stated side, are put on two."""
    free = [n for n in table if len(assigned[n]) > 1]
    sides = {table[n].split("_")[0] for n in free}
    return len(free) == 2 and len({table[n].split("_")[1] for n in free}) == 2 and len(sides) > 1
