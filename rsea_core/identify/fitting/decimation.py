"""A case with fewer rows: what a quick look replays.

Replays take at least one step a row, so that a coarse step needs coarse rows. Readings are those
of every so manieth row; an input that is held from row to row becomes its mean until the next row
that is kept, which moves the machine as far. A current that is read after such a row follows the
row's last voltage more than its mean: by how much, the winding's time constant says, and that is
taken off. An input that jumps between kept rows is not so replaced: the current shows when it
jumped, and its recording stays whole.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.machine.rig import Rig
from rsea_core.numeric.arrays import read_only
from rsea_core.recordings.case import Case
from rsea_core.recordings.recording import HELD, Recording

FEWEST_ROWS = 400  # of a recording that is decimated
JUMP = 0.1  # of an input's range, within a kept row
SLACK = 1e-6  # of a row: sample times are rounded


def decimate(case: Case, row_s: float, *, jumps: bool = False) -> Case:
    """The case with rows as long as they may be, up to `row_s` [s].

    Parameters
    ----------
    jumps : bool
        Recordings whose inputs jump within such rows too.
    """
    return replace(
        case, recordings=tuple(_decimate(case.rig, r, row_s, jumps) for r in case.recordings)
    )


def _decimate(rig: Rig, r: Recording, row_s: float, jumps: bool) -> Recording:
    every = int(row_s / r.sample_time_s + SLACK)
    kept = r.rows // max(every, 1)
    if every < 2 or kept < FEWEST_ROWS or r.quasi_static:
        return r
    columns = {}
    for name, values in r.columns.items():
        rows = values[: kept * every].reshape(kept, every)
        held = name in HELD or name == r.command_name
        if held and not jumps and _jumps(rows):
            return r
        columns[name] = read_only(rows.mean(axis=1) if held else rows[:, 0].copy())
    if "current_A" in columns and r.command_name is not None:
        late = _unaveraged(rig, r, r[r.command_name][: kept * every].reshape(kept, every))
        columns["current_A"] = read_only(columns["current_A"] - late)
    return replace(r, columns=columns, sample_time_s=every * r.sample_time_s)


def _unaveraged(rig: Rig, r: Recording, command: NDArray) -> NDArray:
    """What a voltage held for each of the rows (kept, every) adds to the current at their end over
    what its mean adds, read at the next row that is kept [A].

    A winding's answer to each row decays until then (L di/dt + R i = u; the back-EMF is the same).
    """
    volts = {"duty": rig.supply_voltage_V, "voltage_V": 1.0}.get(r.command_name)
    resistance, inductance = rig.terminal_resistance_ohm, rig.terminal_inductance_H or 0.0
    if volts is None or resistance is None:
        return np.zeros(len(command))
    decay = np.exp(-r.sample_time_s * resistance / inductance) if inductance > 0.0 else 0.0
    weight = (1.0 - decay) * decay ** np.arange(command.shape[1])[::-1]
    off = (command - command.mean(axis=1, keepdims=True)) @ weight * volts / resistance
    return np.concatenate([[0.0], off[:-1]])


def _jumps(rows: NDArray) -> bool:
    return bool(np.ptp(rows, axis=1).max() > JUMP * np.ptp(rows))
