"""Laws without a name: tables over a state that what no known effect explains may follow.

A reading may err with its own value (an amplifier that clips or fades), with its place in the turn
(an eccentric disc), with its speed (counts that are lost): nodes with a prior, linear between them.
A torque on the load may depend on where the load is (a cable, a magnet): a smooth spline.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.curve import EffectCurve
from rsea_core.effects.load_base import draw_over_angle
from rsea_core.effects.load_position_torque import (
    N_POSITIONS,
    POSITION_FIRST,
    POSITION_STEP,
    POSITION_TORQUE,
    LoadPositionTorque,
)
from rsea_core.effects.sensor_table import SensorTable
from rsea_core.effects.variant import Law, RunConditions, TrialMachine, Unknown, Values, Write
from rsea_core.machine.rig import Rig

EFFECT = "unexplained"
VALUE, TURN, SPEED = "over its value", "over its turn", "over its speed"
PLACE = "over the load's angle"
TEXTS = {
    VALUE: "the reading's own value",
    TURN: "the place in the turn",
    SPEED: "the speed of the reading",
    PLACE: "where the load is",
}
OVER = {VALUE: "value", TURN: "turn", SPEED: "speed"}
NODES = {VALUE: (9, 17, 33), TURN: (12, 24), SPEED: (9, 17, 33)}  # of readings, tried in turn
MOST_NODES = max(n for counts in NODES.values() for n in counts)
SOFT = 3.0  # prior of a node, in peaks of the signal


def reading_law(column: str, over: str, nodes: int, span: tuple[float, float], peak: float) -> Law:
    """A table of a reading's error.

    Parameters
    ----------
    over : str
        `VALUE`, `TURN` or `SPEED`.
    span : (float, float)
        First and last node; a turn's are its own.
    peak : float
        Size that an entry may have: of the reading's unit, of `SPEED` a share of the motion.
    """
    return Law(
        effect=EFFECT, law=over, subsystem=f"sensor:{column}",
        unknowns=_unknowns(nodes, span, peak),
        starts=((*span, *(0.0 for _ in range(nodes))),), write=_writer(column, over), sensor=column,
        kind=SensorTable, parameters=lambda v, rig: _reading_parameters(over, v),
    )  # fmt: skip


def place_law(span: tuple[float, float], peak: float) -> Law:
    """A torque on the load over its angle, as the term `LoadPositionTorque` has it.

    Parameters
    ----------
    span : (float, float)
        Angles of the first and the last node.
    peak : float
        Torque [Nm] that it may have.
    """
    nodes = N_POSITIONS
    return Law(
        effect=EFFECT, law=PLACE, subsystem="load", unknowns=_unknowns(nodes, span, peak),
        starts=((*span, *(0.0 for _ in range(nodes))),), write=_write_place,
        kind=LoadPositionTorque, parameters=_place_parameters,
    )  # fmt: skip


def _unknowns(nodes: int, span: tuple[float, float], peak: float) -> tuple[Unknown, ...]:
    """Ends, which stay, and entries."""
    return (
        *(Unknown(name=name, unit="", low=end, high=end, scale=0.0)
          for name, end in zip(("first", "last"), span, strict=True)),
        *(Unknown(name=f"at_{j}", unit="", low=-20.0 * peak, high=20.0 * peak, scale=0.1 * peak,
                  prior=SOFT * peak)
          for j in range(1, nodes + 1)),
    )  # fmt: skip


def _reading_parameters(over: str, v: Values) -> Values:
    places, entries = nodes_of(v)
    return {"over": OVER[over], "first": places[0], "last": places[-1], "errors": entries}


def _place_parameters(v: Values, rig: Rig) -> Values:
    places, entries = nodes_of(v)
    return {"first_rad": places[0], "last_rad": places[-1], "node_Nm": entries}


def _write_place(v: Mapping[str, float], d: TrialMachine, w: RunConditions) -> None:
    places, entries = nodes_of(v)
    d.put(POSITION_FIRST, places[0])
    d.put(POSITION_STEP, places[1] - places[0])
    for j, entry in enumerate(entries):
        d.put(POSITION_TORQUE + j, entry)


def laws_to_read(columns: Sequence[str]) -> list[Law]:
    """The tables that a file may hold: the most nodes, any values."""
    return [
        place_law((0.0, 1.0), 1.0),
        *(reading_law(column, over, MOST_NODES, (0.0, 1.0), 1.0)
          for column in columns for over in NODES),
    ]  # fmt: skip


def _writer(column: str, over: str) -> Write:
    def write(v: Mapping[str, float], d: TrialMachine, w: RunConditions) -> None:
        table = nodes_of(v)
        grows = not column.endswith("angle_rad")  # an amplifier's error does, an encoder's not
        d.reads.append((column, lambda y: y + error_of(over, *table, y, w.time_s, grows=grows)))

    return write


def nodes_of(v: Mapping[str, float]) -> tuple[NDArray, NDArray]:
    """Places and entries of a table."""
    entries = np.array([v[f"at_{j}"] for j in range(1, 1 + sum(k.startswith("at_") for k in v))])
    return np.linspace(v["first"], v["last"], entries.size), entries


def fault_of(law: Law, v: Mapping[str, float]) -> str | None:
    """Why values are no table of a law, in words; None where they are one."""
    count = sum(name.startswith("at_") for name in v)
    least = N_POSITIONS if law.law == PLACE else 2
    needed = ("first", "last", *(f"at_{j}" for j in range(1, max(count, least) + 1)))
    lacking = next((name for name in needed if name not in v), None)
    if lacking is not None:
        return f"lacks {lacking} ({'exactly' if law.law == PLACE else 'at least'} {least} nodes)"
    if not v["first"] < v["last"]:
        return f"first = {v['first']} must be below last = {v['last']}"
    return None


def error_of(
    over: str,
    places: NDArray,
    entries: NDArray,
    signal: NDArray,
    time_s: NDArray,
    *,
    grows: bool = False,
) -> NDArray:
    """What a reading shows more than the truth (n,).

    Parameters
    ----------
    places, entries : (m,) arrays
    signal, time_s : (n,) arrays
        The true reading.
    grows : bool
        Whether an error over the value goes on straight outside its nodes, or stays.
    """
    if over == TURN:
        full = 2.0 * np.pi
        at = np.arange(entries.size + 1) * (full / entries.size)
        return np.interp(np.mod(signal, full), at, np.append(entries, entries[0]))
    if over == SPEED:
        # by the mean speed between two rows: second order, and a sensor knows nothing of later rows
        moved = np.diff(signal, prepend=signal[:1])
        speed = np.abs(moved) / np.diff(time_s, prepend=time_s[0] - 1.0)
        return np.cumsum(moved * np.interp(speed, places, entries))
    found = np.interp(signal, places, entries)
    if not grows:
        return found
    step = places[1] - places[0]
    below, above = np.minimum(signal - places[0], 0.0), np.maximum(signal - places[-1], 0.0)
    found += below * (entries[1] - entries[0]) / step
    return found + above * (entries[-1] - entries[-2]) / step


def draw_table(law: Law) -> EffectCurve:
    """A table of what no effect explains."""
    if law.law == PLACE:
        return draw_over_angle()
    unit = law.sensor.rsplit("_", 1)[-1]

    def error(d: TrialMachine, v: Values, x: NDArray) -> NDArray:
        if not v:
            return np.zeros(x.size)
        if law.law == SPEED:
            return np.interp(x, *nodes_of(v))
        return error_of(law.law, *nodes_of(v), x, x)

    if law.law == SPEED:
        return EffectCurve(
            title=f"Share of its motion that {law.sensor} shows too much",
            x_label="speed (rad/s)", y_label="share", over=f"rate of {law.sensor}", evaluate=error,
        )  # fmt: skip
    return EffectCurve(
        title=f"Error of the reading {law.sensor}" + (", each turn" if law.law == TURN else ""),
        x_label=f"true value ({unit})", y_label=f"error ({unit})", over=law.sensor, evaluate=error,
    )  # fmt: skip
