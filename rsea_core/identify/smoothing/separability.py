"""Which ports of the machine these sensors and this load can tell apart, by structure alone.

A port is where missing physics can act: V (volts at the winding), G (torque on the wheel), S
(torque in the spring), L (torque on the load), E (the contact) or Y:<column> (a reading). Every
port leaves a direction in the residual relations of the machine once the signals that nobody
measures are eliminated; ports with one direction cannot be told apart by direction, whatever the
recording. The relations are linear in the ports with coefficients that are rational in s, so the
generic rank is that of the numbers at an arbitrary s, here at two of them.

    u - R i - L s i - k_e s theta_w           = -V
    k_t i - (J s^2 + B s) theta_w - tau_s     = -G
    tau_s - K (theta_w - theta_l)             =  S
    tau_s - (J_l s^2 + B_l s + g) theta_l     = -L - E
    reading - signal                          =  Y

Source: docs/diagnosis.md 4; the fault signature matrix of structural diagnosis (Krysander, Aslund &
Nyberg, IEEE Trans. SMC-A 38 (2008)) with coefficients instead of a pattern.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import InputError
from rsea_core.machine.inputs import LOADS
from rsea_core.machine.rig import PARTS

SENSED = {
    "current_A": "i",
    "motor_angle_rad": "w",
    "load_angle_rad": "l",
    "spring_deflection_rad": "d",
    "torque_Nm": "t",
}
"""Columns that are readings of a signal, and which: logged velocities are not trusted."""

COMMANDED = ("duty", "voltage_V")  # the winding's own equation stands between command and torque
PORTS = ("V", "G", "S", "L", "E")
SUBSYSTEM = {"V": "drive", "G": "gear", "S": "spring", "L": "load", "E": "environment"}
LATENT_ORDER = ("G", "L", "V", "S", "E")  # whose torque an ambiguous one is written to first
_AT = (0.37 + 1.31j, 1.9 - 0.43j)  # arbitrary complex frequencies, in units of the numbers below
_TOLERANCE = 1e-9


@dataclass(frozen=True, kw_only=True)
class Separability:
    """What a set of sensors can tell apart on one load.

    Attributes
    ----------
    equations : int
        Independent residual relations.
    ports : tuple of str
        The ports that exist here, readings included ("Y:torque_Nm").
    classes : tuple of tuple of str
        Ports that share one direction; ports of different classes differ in direction.
    isolated : tuple of str
        Machine ports whose direction no combination of the other classes can imitate.
    latents : tuple of str
        Machine ports of which the smoother can carry a torque each, one of a class, upstream
        first: the unknown torque of the class stands in its first member.
    merged : tuple of (str, tuple of str)
        For each latent port, the machine ports whose torque it carries besides its own.
    """

    equations: int
    ports: tuple[str, ...]
    classes: tuple[tuple[str, ...], ...]
    isolated: tuple[str, ...]
    latents: tuple[str, ...]
    merged: tuple[tuple[str, tuple[str, ...]], ...]

    def sentence(self) -> str:
        """What can be located by direction, as text."""
        machine = [tuple(p for p in c if p in PORTS) for c in self.classes]
        names = [" or ".join(SUBSYSTEM[p] for p in c) for c in machine if c]
        head = f"{self.equations} independent relation{'s' * (self.equations != 1)}: "
        if len(names) <= 1:
            return head + "nothing is located by direction, only by the shape of the mismatch"
        if all(set(c) & set(self.isolated) for c in machine if c):
            return head + "distinguishable in any combination: " + " | ".join(names)
        alone = [SUBSYSTEM[p] for p in self.isolated]
        always = f"; in any combination: {', '.join(alone)}" if alone else ""
        return head + "distinguishable one at a time: " + " | ".join(names) + always


def separability(
    *,
    parts: tuple[str, ...] = PARTS,
    load: str,
    command: str | None,
    sensors: tuple[str, ...],
) -> Separability:
    """What can be located on a machine with these parts, load, command and readings.

    Parameters
    ----------
    parts : tuple of str
    load : str
        Kind of the load, as `Load.kind`.
    command : str or None
        The column that drives the machine.
    sensors : tuple of str
        Columns read; those that are no signal of the nominal machine are ignored.

    Raises
    ------
    InputError
        For an unknown load, or if nothing is read.
    """
    if load not in LOADS:
        raise InputError(f"load {load!r} is unknown; one of {', '.join(LOADS)}")
    read = [s for s in SENSED if s in sensors]
    held = load in ("locked", "imposed")
    if held and "load_angle_rad" in read:
        read.remove("load_angle_rad")  # it is what is held, not a response
    if not read:
        raise InputError(f"no response is read: one of {', '.join(SENSED)} is needed")
    directions = [_directions(parts, load, command, read, s) for s in _AT]
    names, equations = directions[0][0], directions[0][1].shape[0]
    columns = [d[1] for d in directions]
    present = [j for j in range(len(names)) if all(_size(c[:, j]) > _TOLERANCE for c in columns)]
    classes = _parallel_classes(columns, present)
    machine = [j for j in present if names[j] in PORTS]
    latents = _independent(columns[0], [j for p in LATENT_ORDER for j in machine if names[j] == p])
    isolated = [j for j in machine if _is_isolated(columns[0], j, machine, classes)]
    kept = sorted(names[j] for j in latents)
    merged = []
    for name in (p for p in PORTS if p in kept):
        own_class = next(c for c in classes if names.index(name) in c)
        merged.append(
            (name, tuple(names[j] for j in own_class if j in machine and names[j] != name))
        )
    return Separability(
        equations=equations,
        ports=tuple(names[j] for j in present),
        classes=tuple(tuple(names[j] for j in c) for c in classes),
        isolated=tuple(names[j] for j in isolated),
        latents=tuple(name for name, _ in merged),
        merged=tuple(merged),
    )


def _directions(
    parts: tuple[str, ...], load: str, command: str | None, read: list[str], s: complex
) -> tuple[list[str], NDArray]:
    """Names of the ports and their columns in the relations without unknown signals."""
    relations, ports = _relations(parts, load, command, s)
    signals = sorted({name for relation in relations for name in relation})
    seen = [c for c in read if SENSED[c] in signals]
    known = np.zeros((len(relations) + len(seen), len(signals)), dtype=complex)
    act = np.zeros((len(known), len(ports) + len(seen)), dtype=complex)
    for row, relation in enumerate(relations):
        for name, value in relation.items():
            known[row, signals.index(name)] = value
    for column, (_, where) in enumerate(ports):
        for row, value in where.items():
            act[row, column] = value
    for k, name in enumerate(seen):
        row = len(relations) + k
        known[row, signals.index(SENSED[name])] = 1.0
        act[row, len(ports) + k] = 1.0
    left, singular, _ = np.linalg.svd(known)
    null = left[:, int(np.sum(singular > _TOLERANCE)) :]
    return [name for name, _ in ports] + [f"Y:{c}" for c in seen], null.conj().T @ act


def _relations(parts: tuple[str, ...], load: str, command: str | None, s: complex):
    """Rows of the machine as {signal: coefficient}, and per port {row: coefficient}."""
    held, drive = load in ("locked", "imposed"), "drive" in parts and command is not None
    gear, spring = "gear" in parts, "spring" in parts
    link = "load" in parts and not held
    rows: list[dict[str, complex]] = []
    ports: list[tuple[str, dict[int, complex]]] = []

    def add(row: dict[str, complex], *acting: tuple[str, complex]) -> None:
        for name, value in acting:
            ports.append((name, {len(rows): value}))
        rows.append(row)

    if drive and command in COMMANDED:
        add({"i": -(1.3 + 0.21 * s), **({"w": -0.7 * s} if gear else {})}, ("V", 1.0))
    elif drive and command == "current_command_A":
        add({"i": 1.0}, ("V", 1.0))
    if gear:
        torque = {"i": 0.83} if drive and command != "motor_torque_Nm" else {}
        add({**torque, "w": -(1.1 * s * s + 0.31 * s), "t": -1.0}, ("G", 1.0))
    if spring:
        deflection = {"w": 1.0} if gear else {"d": 1.0}
        unloaded = not (link or held)
        angle = {**deflection, **({} if held or not gear else {"l": -1.0})}
        add({"t": 1.0, **{k: -2.3 * v for k, v in angle.items()}}, ("S", -1.0))
        if unloaded and gear:
            add({"t": 1.0})
        if gear:
            add({"d": -1.0, **angle})
    elif gear and link:
        add({"w": 1.0, "l": -1.0})
    elif gear and not held:
        add({"t": 1.0})
    if link:
        acting = (("L", 1.0), ("E", 1.0)) if load == "contact" else (("L", 1.0),)
        inertia = -(0.9 * s * s + 0.17 * s + 0.43)
        add({"l": inertia, **({"t": 1.0} if gear else {})}, *acting)
    return rows, ports


def _size(column: NDArray) -> float:
    return float(np.linalg.norm(column))


def _rank(columns: NDArray) -> int:
    scaled = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    return int(np.linalg.matrix_rank(scaled, tol=1e-7)) if columns.size else 0


def _parallel_classes(columns: list[NDArray], present: list[int]) -> list[list[int]]:
    classes: list[list[int]] = []
    for j in present:
        own_class = next(
            (c for c in classes if all(_rank(f[:, [c[0], j]]) < 2 for f in columns)), None
        )
        if own_class is None:
            classes.append([j])
        else:
            own_class.append(j)
    return classes


def _independent(columns: NDArray, candidates: list[int]) -> list[int]:
    kept: list[int] = []
    for j in candidates:
        if _rank(columns[:, [*kept, j]]) == len(kept) + 1:
            kept.append(j)
    return kept


def _is_isolated(columns: NDArray, j: int, machine: list[int], classes: list[list[int]]) -> bool:
    own_class = next(c for c in classes if j in c)
    others = [k for k in machine if k not in own_class]
    return not others or _rank(columns[:, [*others, j]]) == _rank(columns[:, others]) + 1
