"""How a load is held, where it rests, and recordings that begin in motion."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.importing.proposal import Proposal
from rsea_core.machine.rig import Rig, is_linear
from rsea_core.recordings.case import noise_floor
from rsea_core.recordings.initial_speed import start_speeds
from rsea_core.recordings.recording import Recording
from rsea_core.recordings.units import factor_and_offset

HELD_SPAN = 0.01  # of the motor behind the gear: a load that moves less was held
LAST = 0.05  # of a log's rows, in which a released pendulum swings least
AROUND_rad = 0.1  # a mean this close to half a turn is one
SURE = 5.0  # standard deviations of the first speed
SHARE = 0.05  # of the largest speed


def with_rest_as_zero(proposal: Proposal, raw: Mapping[str, NDArray], rig: Rig | None) -> Proposal:
    """A free pendulum hangs where it ends: its zero, asked where the log counts from another one.

    The nominal model counts the load's angle from hanging down (docs/recordings.md).
    """
    column = proposal.column("load_angle_rad")
    if rig is None or rig.parts != ("load",) or not rig.load_mass_kg or column is None:
        return proposal
    if is_linear(rig):
        return proposal
    factor, _ = factor_and_offset(column.unit, "rad", column.counts_per_rev or 1.0)
    angle = factor * raw[column.name]
    end = float(np.mean(angle[-max(3, round(LAST * angle.size)) :]))
    half_turns = round(end / np.pi)
    if half_turns == 0 or abs(end - half_turns * np.pi) > AROUND_rad:
        return proposal
    zero = half_turns * np.pi / factor
    question = (
        f"column {column.name!r}: it comes to rest at {end / factor:.4g} {column.unit}: is that"
        f" hanging down? Then zero = {zero:.6g}"
    )
    changed = replace(column, zero=zero, reason=f"{column.reason}; it rests at {zero:.6g}")
    columns = tuple(changed if c is column else c for c in proposal.columns)
    return replace(proposal, columns=columns, questions=(*proposal.questions, question))


def usual_load(rig: Rig | None) -> str:
    """The load of a recording that says nothing of it: with gravity where the rig file has it."""
    if rig is None:
        return "pendulum"
    hangs = bool(rig.load_mass_kg and rig.load_distance_m)
    return ("pendulum" if hangs else "free") if rig.has("load") else "locked"


def is_held(rig: Rig, r: Recording) -> bool:
    """Whether the load hardly moves while the motor does."""
    if not {"motor_angle_rad", "load_angle_rad"} <= set(r.columns) or not rig.gear_ratio:
        return False
    moved = float(np.ptp(r["motor_angle_rad"])) / rig.gear_ratio
    return float(np.ptp(r["load_angle_rad"])) < HELD_SPAN * moved


def load_of(rig: Rig, r: Recording) -> str:
    """The load of a recording as its angles show it, as it is listed where they do not."""
    if is_held(rig, r):
        return "locked"
    both = {"motor_angle_rad", "load_angle_rad"} <= set(r.columns)
    return usual_load(rig) if both and r.load.kind == "locked" else r.load.kind


def starts_in_motion(rig: Rig, r: Recording) -> bool:
    """Whether the machine moves clearly at the first row of a recording."""
    angle = next((n for n in ("motor_angle_rad", "load_angle_rad") if n in r), None)
    if r.quasi_static or angle is None or r.rows < 50:
        return False
    motor, load = start_speeds(r, rig.gear_ratio or 1.0, noise_floor(rig, r))
    first = motor if angle.startswith("motor") else load
    rows = max(2, r.rows // 100)
    usual = float(np.abs(r[angle][rows:] - r[angle][:-rows]).max()) / (rows * r.sample_time_s)
    return abs(first.speed) > max(SURE * first.std, SHARE * usual)
