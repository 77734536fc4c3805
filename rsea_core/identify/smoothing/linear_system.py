"""The nominal machine of one recording as a linear system with its ports, discretised exactly.

    x' = A x + B u + sum_p Gamma_p f_p,    y = C x + D u + sum_p D_p f_p

States are those of `linearise` that this machine has. What is not linear enters as a known input
computed from the measured angles: gravity, the contact's rest angle, the held load. A bridge that
is open and a current at its limit are modes in which the current is given.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
from rsea_core.engines.linear.linearise import linear_plant
from rsea_core.errors import InputError
from rsea_core.machine.inputs import COMMANDS, Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel

FREE, PINNED = 0, 1  # the current follows its equation, or is given
OUT, IN = 0, 2  # of contact
N_MODES = 4


@dataclass(frozen=True, kw_only=True)
class Machine:
    """A machine around zero, in continuous time, for one command and load.

    Attributes
    ----------
    plant : Plant
    states : tuple of str
        Of "current_A", "wheel_angle_rad", "wheel_velocity_rad_per_s", "load_angle_rad",
        "load_velocity_rad_per_s".
    A : (4, d, d) array
        By mode: `FREE` or `PINNED` plus `OUT` or `IN`.
    command, current, load_torque, held_angle : (d,) arrays
        What a unit of the command (current free), of a pinned current, of a known torque on the
        load and of a held load angle adds to x'.
    ports : mapping of str to ((d,) array)
        What a unit at each port adds to x'.
    rows : mapping of str to ((d,) array)
        The reading of each column by state; "spring_torque_Nm" is K times deflection.
    direct : mapping of str to mapping
        What a column reads directly: of "command", "held_angle", "V" or "S".
    """

    plant: mp.Plant
    states: tuple[str, ...]
    A: NDArray
    command: NDArray
    current: NDArray
    load_torque: NDArray
    held_angle: NDArray
    ports: Mapping[str, NDArray]
    rows: Mapping[str, NDArray]
    direct: Mapping[str, Mapping[str, float]]
    stiffness: float

    @property
    def elastic(self) -> bool:
        """Whether wheel and load are joined by the spring."""
        return self.plant.structure in (mp.ELASTIC_FREE, mp.ELASTIC_HELD)


NAMES = (
    "current_A",
    "wheel_angle_rad",
    "wheel_velocity_rad_per_s",
    "load_angle_rad",
    "load_velocity_rad_per_s",
)


def command_of(columns: Mapping[str, NDArray], rig: Rig) -> str | None:
    """The column that drives this recording's machine; `current_A` where no other is there."""
    if not rig.has("drive"):
        return None
    found = next((name for name in COMMANDS if name in columns), None)
    if found is None and "current_A" in columns:
        return "current_A"
    if found is None:
        raise InputError(f"rig {rig.name!r} has a drive: a column of {', '.join(COMMANDS)}")
    return found


def machine(rig: Rig, load: Load, command: str | None) -> Machine:
    """The linear machine of a rig.

    Raises
    ------
    RigError
        If the rig lacks a value that this drive and load need.
    InputError
        If nothing can move.
    """
    name = "current_command_A" if command == "current_A" else command
    plant = ActuatorModel(rig).plant(name, load)
    if plant.structure == mp.RIGID_HELD:
        raise InputError(f"rig {rig.name!r}: nothing moves where the load is {load.kind}")
    elastic = plant.structure in (mp.ELASTIC_FREE, mp.ELASTIC_HELD)
    K = rig.spring_stiffness_Nm_per_rad if elastic else 0.0
    if elastic:
        rig.need("the spring", "spring_stiffness_Nm_per_rad")
    full = [
        linear_plant(
            plant._replace(drive=drive), tangent=K, gravity_stiffness=0.0, in_contact=contact
        )
        for contact in (False, True)
        for drive in (plant.drive, mp.NO_DRIVE)
    ]
    winding = plant.drive in (mp.DUTY, mp.VOLTAGE) and plant.inductance > 0.0
    fold = _folding(plant.structure, winding)
    keep = np.argmax(fold, axis=0)
    A = np.array([(m.A @ fold)[keep] for m in full])
    unit = np.eye(k.N_STATES)
    to_wheel, to_load = _inertias(plant, unit)
    held = full[0].A[:, k.TL] if plant.structure == mp.ELASTIC_HELD else np.zeros(k.N_STATES)
    moving = plant.inertia + (plant.load_inertia if plant.structure == mp.RIGID_FREE else 0.0)
    driven = plant.torque_per_ampere / moving if plant.drive != mp.NO_DRIVE else 0.0
    rows, direct = _readings(plant, K, fold, winding)
    ports = {"G": to_wheel, "S": to_load - to_wheel, "L": to_load, "V": _drive_port(plant, unit)}
    if plant.structure == mp.ELASTIC_HELD:
        ports |= {"S": -to_wheel, "L": np.zeros(k.N_STATES)}
    return Machine(
        plant=plant,
        states=tuple(NAMES[j] for j in keep),
        A=A,
        command=full[0].b[keep],
        current=driven * unit[k.WW][keep],
        load_torque=to_load[keep],
        held_angle=held[keep],
        ports={p: v[keep] for p, v in ports.items()},
        rows=rows,
        direct=direct,
        stiffness=K,
    )


def discretise(m: Machine, row_s: float) -> tuple[NDArray, Mapping[str, NDArray]]:
    """Transitions (4, d, d) over a row and what each held input adds, (4, d) each.

    Inputs: "command", "load_torque", "held_angle" and the ports. In a pinned mode the command is
    the current itself, which is at its value over the whole row; the state of that name is not
    driven, the caller sets it.
    """
    inputs = {"command": m.command, "load_torque": m.load_torque, "held_angle": m.held_angle}
    inputs |= m.ports
    d = len(m.states)
    transitions = np.zeros((N_MODES, d, d))
    held = {name: np.zeros((N_MODES, d)) for name in inputs}
    for mode in range(N_MODES):
        block = np.zeros((d + len(inputs), d + len(inputs)))
        block[:d, :d] = m.A[mode]
        pinned = mode in (PINNED, PINNED + IN)
        for j, (name, column) in enumerate(inputs.items()):
            given = {"command": m.current, "V": np.zeros(d)}.get(name, column)
            block[:d, d + j] = given if pinned else column
        power = expm(block * row_s)
        transitions[mode] = power[:d, :d]
        if pinned and m.states[0] == "current_A":
            transitions[mode, 0] = transitions[mode, :, 0] = 0.0
        for j, name in enumerate(inputs):
            held[name][mode] = power[:d, d + j]
    return transitions, held


def _folding(structure: int, winding: bool) -> NDArray:
    """(5, d): the full states from those that this machine has."""
    fold = np.zeros((k.N_STATES, k.N_STATES))
    wanted = [k.IM] if winding else []
    wanted += [k.TW, k.WW] + ([k.TL, k.WL] if structure == mp.ELASTIC_FREE else [])
    fold[wanted, wanted] = 1.0
    if structure == mp.RIGID_FREE:
        fold[k.TL, k.TW] = fold[k.WL, k.WW] = 1.0
    return fold[:, wanted]


def _inertias(plant: mp.Plant, unit: NDArray) -> tuple[NDArray, NDArray]:
    """Rates that a unit torque on the wheel and on the load gives."""
    if plant.structure == mp.RIGID_FREE:
        both = unit[k.WW] / (plant.inertia + plant.load_inertia)
        return both, both
    wheel = unit[k.WW] / plant.inertia
    load = unit[k.WL] / plant.load_inertia if plant.load_inertia > 0.0 else 0.0 * unit[k.WL]
    return wheel, load


def _drive_port(plant: mp.Plant, unit: NDArray) -> NDArray:
    inertia = plant.inertia + (plant.load_inertia if plant.structure == mp.RIGID_FREE else 0.0)
    if plant.drive in (mp.DUTY, mp.VOLTAGE):
        if plant.inductance > 0.0:
            return unit[k.IM] / plant.inductance
        return unit[k.WW] * plant.torque_per_ampere / (plant.resistance * inertia)
    if plant.drive == mp.CURRENT:
        return unit[k.WW] * plant.torque_per_ampere / inertia
    return np.zeros(k.N_STATES)


def _readings(plant: mp.Plant, K: float, fold: NDArray, winding: bool):
    unit = np.eye(k.N_STATES)
    deflection = unit[k.TW] - (unit[k.TL] if plant.structure == mp.ELASTIC_FREE else 0.0)
    rows = {
        "motor_angle_rad": unit[k.TW] * plant.gear_ratio,
        "load_angle_rad": unit[k.TL],
        "wheel_angle_rad": unit[k.TW],
        "wheel_velocity_rad_per_s": unit[k.WW],
        "load_velocity_rad_per_s": unit[k.WL],
        "current_A": unit[k.IM],
    }
    direct: dict[str, dict[str, float]] = {}
    if plant.structure in (mp.ELASTIC_FREE, mp.ELASTIC_HELD):
        rows |= {"spring_deflection_rad": deflection, "torque_Nm": K * deflection}
        direct["torque_Nm"] = {"S": 1.0}
        if plant.structure == mp.ELASTIC_HELD:
            direct["spring_deflection_rad"] = {"held_angle": -1.0}
            direct["torque_Nm"]["held_angle"] = -K
            direct["load_angle_rad"] = {"held_angle": 1.0}
    if plant.drive in (mp.DUTY, mp.VOLTAGE) and not winding:
        rows["current_A"] = -unit[k.WW] * plant.volts_per_speed / plant.resistance
        volts = {"command": plant.volts_per_command, "V": 1.0}
        direct["current_A"] = {name: v / plant.resistance for name, v in volts.items()}
    if plant.drive == mp.CURRENT:
        direct["current_A"] = {"command": 1.0, "V": 1.0}
    return {name: row @ fold for name, row in rows.items()}, direct
