"""A proposal for `[columns]`: each column's meaning, unit, sign, with its reason and confidence.

Names come first, numbers decide: where two meanings explain a log equally well, the proposal has a
question instead of a guess. Signs make every law positive; which direction is called positive for
the whole machine is the owner's choice and cannot be seen.
"""

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RecordingError
from rsea_core.importing.column_names import NameEvidence, name_evidence
from rsea_core.importing.hypotheses import STATED, Choice, Posterior, best_hypothesis, choices_of
from rsea_core.machine.rig import Rig
from rsea_core.numeric.brief_repr import BriefRepr
from rsea_core.recordings.readers.log import LOG_TIME
from rsea_core.recordings.recording import COLUMNS

ASK_BELOW = 0.9
SIDED = {"angle": "angle_rad", "velocity": "velocity_rad_per_s"}
PLAIN = {
    "time": "time_s", "duty": "duty", "voltage": "voltage_V", "supply": "supply_V",
    "current": "current_A", "torque": "torque_Nm", "temperature": "temperature_C",
    "enabled": "drive_enabled", "deflection": "spring_deflection_rad",
}  # fmt: skip
COMMANDED = {"current": "current_command_A", "voltage": "voltage_V", "duty": "duty"}
LEAST_PART, CLEARLY, SMOOTHED_ROWS = 0.01, 5.0, 50.0  # of a current's part in the volts; in std
AGAINST_NOISE = 0.3  # correlation below which a sign is not seen


@dataclass(frozen=True, kw_only=True, repr=False)
class Proposal(BriefRepr):
    """What a log's columns are taken for.

    Attributes
    ----------
    columns : tuple of ProposedColumn
    references, ignored : tuple of str
    questions : tuple of str
        One line each; none: everything was decided.
    rate_needed : bool
        The log has no time.
    """

    columns: tuple["ProposedColumn", ...]
    references: tuple[str, ...]
    ignored: tuple[str, ...]
    questions: tuple[str, ...]
    rate_needed: bool

    def column(self, target: str) -> "ProposedColumn | None":
        """The column proposed for a target."""
        return next((c for c in self.columns if c.target == target), None)


@dataclass(frozen=True, kw_only=True)
class ProposedColumn:
    """A column's proposed meaning.

    Attributes
    ----------
    target, name, unit : str
    sign : 1 or -1
    side : str or None
    counts_per_rev : float or None
    confidence : float
    reason : str
    asks : bool
        Whether it is one of the questions.
    """

    target: str
    name: str
    unit: str
    sign: int = 1
    side: str | None = None
    counts_per_rev: float | None = None
    confidence: float
    reason: str
    asks: bool = False


def propose(
    raw: Mapping[str, NDArray], units: Mapping[str, str], rig: Rig | None = None
) -> Proposal:
    """What the columns of one log are.

    Parameters
    ----------
    raw : mapping of column name to (n,) array
        As logged, all of one length.
    units : mapping
        Units that the file states.

    Raises
    ------
    RecordingError
        If no column can be a reading.
    """
    evidence = {name: name_evidence(name, units.get(name)) for name in raw}
    whole = {n: v for n, v in raw.items() if np.all(np.isfinite(v))}
    time = _time_column(whole, evidence)
    if time is None:
        return Proposal(columns=(), references=(), ignored=(), questions=(), rate_needed=True)
    others = [n for n in whole if n != time]
    assigned, goals, unknown = _by_name(others, evidence, rig)
    if not assigned:
        raise RecordingError(f"no column is recognised as a reading: {', '.join(list(raw)[:8])}")
    assignments = []
    for targets in _alternatives(assigned, evidence, rig):
        table = {time: "time_s", **targets}
        assignments.append(
            {n: choices_of(n, t, evidence[n], whole[n], rig) for n, t in table.items()}
        )
    assignments = [a for a in assignments if all(a.values())]
    if not assignments:
        raise RecordingError("the units that the log states fit no reading that its names are of")
    best = best_hypothesis(rig, whole, assignments)
    named = {c.name for c in best.choices}
    unknown += [n for n in assigned if n not in named]
    columns = _with_signs(best, whole, rig, evidence)
    moving = [n for n in unknown if np.ptp(whole[n]) > 0.0]
    questions = [_question(c, best) for c in columns if c.asks]
    questions += [f"column {n!r}: what is it? Its name says nothing that is known" for n in moving]
    return Proposal(
        columns=columns,
        references=(*goals, *moving),
        ignored=tuple(n for n in raw if n not in named and n not in goals and n not in moving),
        questions=tuple(questions),
        rate_needed=False,
    )


def _time_column(raw: Mapping[str, NDArray], evidence: Mapping[str, NameEvidence]) -> str | None:
    rising = [n for n, v in raw.items() if v.size > 2 and np.all(np.diff(v) > 0.0)]
    named = [n for n in rising if evidence[n].quantity == "time"]
    if named:  # when a message was read is better known than when it was written
        stamps = [n for n in named if "stamp" in n] or [n for n in named if n != LOG_TIME]
        return (stamps or named)[0]
    even = [n for n in rising if np.std(np.diff(raw[n])) < 0.2 * np.mean(np.diff(raw[n]))]
    free = [n for n in even if evidence[n].quantity is None]
    first = next(iter(raw), None)
    return free[0] if free and free[0] == first else None


def _by_name(names, evidence: Mapping[str, NameEvidence], rig: Rig | None):
    """Possible targets of each column; goals; columns that names say nothing about."""
    assigned: dict[str, list[str]] = {}
    goals, unknown = [], []
    driven = rig is None or rig.has("drive")
    for name in names:
        e = evidence[name]
        if name in COLUMNS:  # the contract's own name
            assigned[name] = [name]
        elif e.quantity == "time":
            continue
        elif e.quantity is None:
            (goals if e.is_goal else unknown).append(name)
        elif e.is_goal:
            target = COMMANDED.get(e.quantity) if driven else None
            (goals.append(name) if target is None else assigned.setdefault(name, [target]))
        elif e.quantity in SIDED:
            sides = [e.side] if e.side else ["motor", "load"]
            if rig is not None:
                owns = {"motor": rig.has("gear") or rig.has("drive"), "load": rig.has("load")}
                sides = [s for s in sides if owns[s]] or sides
            assigned[name] = [f"{side}_{SIDED[e.quantity]}" for side in sides]
        elif e.quantity == "torque" and e.side == "motor" and rig and not rig.has("spring"):
            assigned[name] = ["motor_torque_Nm"]
        elif e.quantity == "voltage" and e.side is None and not driven:
            unknown.append(name)
        else:
            assigned[name] = [PLAIN[e.quantity]]
    commands = [n for n in assigned if assigned[n][0] in COMMANDED.values() and evidence[n].is_goal]
    if len(commands) > 1:
        for name in commands[1:]:
            goals.append(name)
            del assigned[name]
    return assigned, goals, unknown


def _alternatives(assigned: Mapping[str, list[str]], evidence, rig) -> list[dict[str, str]]:
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


def _with_signs(
    best: Posterior, raw: Mapping[str, NDArray], rig: Rig | None, evidence
) -> tuple[ProposedColumn, ...]:
    by_target = {c.target: c for c in best.choices}
    signs, seen = _signs(by_target, raw, rig, best.laws)
    columns = []
    for c in best.choices:
        still = _is_still(c, raw[c.name], rig)  # has neither sign nor unit to be seen
        sign_known = still or seen.get(c.target, True)
        confidence = 1.0 if still else best.confidence[c.name] * (1.0 if sign_known else 0.6)
        if c.prior <= STATED + 0.1:  # against what the log itself states
            confidence = min(confidence, 0.5)
        columns.append(
            ProposedColumn(
                target=c.target,
                name=c.name,
                unit=c.unit,
                sign=signs.get(c.target, 1),
                side=c.side,
                counts_per_rev=c.counts_per_rev,
                confidence=confidence,
                reason=_reason(c, best, evidence[c.name], sign_known),
                asks=confidence < ASK_BELOW,
            )
        )
    return tuple(columns)


def _is_still(c: Choice, raw: NDArray, rig: Rig | None) -> bool:
    """Whether a reading stays within a count or two of zero in any of its units."""
    if not np.any(raw):
        return True
    if c.target != "load_angle_rad":
        return False
    counts = None if rig is None else rig.load_encoder_counts_per_rev
    levels = np.unique(raw[:100_000])
    if levels.size > 3:
        return False
    resolution = 2.0 * np.pi / (counts or 4096.0)
    return bool(np.abs(c.factor * levels).max() <= 2.5 * resolution)


def _signs(by_target: Mapping[str, Choice], raw: Mapping[str, NDArray], rig: Rig | None, laws):
    """Signs that make the machine's laws positive, and whether each is seen."""
    data = {t: c.factor * raw[c.name] for t, c in by_target.items()}
    ratio = 1.0 if rig is None else rig.gear_ratio or 1.0
    signs, seen = {}, {}
    motor, load = data.get("motor_angle_rad"), data.get("load_angle_rad")
    time = data.get("time_s", np.arange(next(iter(data.values())).size, dtype=float))
    if motor is not None and load is not None:
        signs["load_angle_rad"], seen["load_angle_rad"] = _load_sign(motor / ratio, load, data)
        load = signs["load_angle_rad"] * load
    angle = motor if motor is not None else load
    for side, own in (("motor", motor), ("load", load)):
        speed = f"{side}_velocity_rad_per_s"
        if own is not None and speed in data:
            signs[speed], seen[speed] = _sign_of(np.gradient(own, time), data[speed], time)
    command = next((n for n in ("duty", "voltage_V", "current_command_A") if n in data), None)
    if command is not None and angle is not None:
        signs[command], seen[command] = _command_sign(data[command], angle, time)
        for law in laws:  # the winding's laws see signs without being misled by inertia
            if law.columns[:2] == (command, "motor_angle_rad"):
                signs[command], seen[command] = int(np.sign(law.ratio)) or 1, True
        if "current_A" in data:
            signs["current_A"], seen["current_A"] = _current_sign(
                signs[command] * data[command], data["current_A"], angle, time
            )
            for law in laws:
                if law.columns == (command, "current_A"):
                    turned = int(np.sign(law.ratio)) * signs[command]
                    signs["current_A"], seen["current_A"] = turned or 1, True
    if "torque_Nm" in data and motor is not None:
        bend = motor / ratio - (0.0 if load is None else load)
        signs["torque_Nm"], seen["torque_Nm"] = _sign_of(bend, data["torque_Nm"], time)
    return signs, seen


def _slow(values: NDArray, time: NDArray) -> NDArray:
    n = int(
        np.clip(0.05 / max(float(np.median(np.diff(time))), 1e-9), 1, max(1, values.size // 20))
    )
    sums = np.cumsum(np.concatenate(([0.0], values - values.mean())))
    return (sums[n:] - sums[:-n]) / n


def _sign_of(x: NDArray, y: NDArray, time: NDArray) -> tuple[int, bool]:
    x, y = _slow(x, time), _slow(y, time)
    if np.ptp(x) == 0.0 or np.ptp(y) == 0.0:
        return 1, False
    together = float(np.corrcoef(x, y)[0, 1])
    return (1 if together >= 0.0 else -1), abs(together) > AGAINST_NOISE


def _load_sign(output: NDArray, load: NDArray, data) -> tuple[int, bool]:
    """The load follows the motor; where it hardly moves, the spring's torque decides."""
    if np.ptp(load) == 0.0:
        return 1, True
    together = float(np.corrcoef(output, load)[0, 1]) if np.ptp(output) > 0.0 else 0.0
    if abs(together) > 0.8:
        return (1 if together > 0.0 else -1), True
    if "torque_Nm" in data and np.ptp(data["torque_Nm"]) > 0.0:
        fits = [abs(np.corrcoef(output - s * load, data["torque_Nm"])[0, 1]) for s in (1, -1)]
        better = 1 if fits[0] >= fits[1] else -1
        return better, max(fits) > 0.9 and max(fits) - min(fits) > 0.02
    return (1 if together >= 0.0 else -1), abs(together) > 0.5


def _command_sign(command, angle, time) -> tuple[int, bool]:
    """A drive puts work in: the command goes with the speed, over the whole record."""
    speed = np.gradient(angle, time)
    x, y = _slow(command, time), _slow(speed, time)
    work, size = float(np.sum(x * y)), float(np.sqrt(np.sum(x**2) * np.sum(y**2)))
    if size == 0.0:
        return 1, False
    return (1 if work >= 0.0 else -1), abs(work) > AGAINST_NOISE * size


def _current_sign(command, current, angle, time) -> tuple[int, bool]:
    """R i = V - k_e w: the part of the command that the speed does not explain goes with it."""
    speed = _slow(np.gradient(angle, time), time)
    x, y = _slow(command, time), _slow(current, time)
    A = np.stack([y, speed], axis=1)
    scale = np.std(A, axis=0)
    if np.any(scale == 0.0) or np.std(x) == 0.0:
        return 1, False
    B, y = A / scale, x / np.std(x)
    found, *_ = np.linalg.lstsq(B, y, rcond=None)
    left = float(np.mean((y - B @ found) ** 2))
    std = np.sqrt(left * np.linalg.pinv(B.T @ B)[0, 0] * SMOOTHED_ROWS)
    return (1 if found[0] >= 0.0 else -1), abs(found[0]) > max(LEAST_PART, CLEARLY * std)


def _reason(c: Choice, best: Posterior, e: NameEvidence, sign_known: bool) -> str:
    parts = []
    if e.unit is not None:
        parts.append(f"unit {e.unit} is stated")
    parts += [law.text for law in best.laws if c.target in law.columns][:2]
    if c.side is not None:
        parts.append(f"measured on the {c.side} side")
    if not sign_known:
        parts.append("its sign is not seen in this log")
    return "; ".join(parts) or "by its name and the size of its numbers"


def _question(c: ProposedColumn, best: Posterior) -> str:
    rival = best.rivals.get(c.name)
    text = f"column {c.name!r}: {c.target} in {c.unit} ({c.confidence:.0%})"
    if rival is not None and (rival.unit, rival.target, rival.side) != (c.unit, c.target, c.side):
        side = "" if rival.side is None else f" on the {rival.side} side"
        return f"{text} or {rival.target} in {rival.unit}{side}?"
    return f"{text}: its sign cannot be seen; is + the motor's + direction?"


def answered(proposal: Proposal, target: str, **changes) -> Proposal:
    """The proposal with a column as its owner says; its question is gone."""
    columns = tuple(
        replace(c, **changes, confidence=1.0, asks=False, reason="as its owner says")
        if c.target == target
        else c
        for c in proposal.columns
    )
    column = next(c for c in columns if c.target == target)
    left = tuple(q for q in proposal.questions if not q.startswith(f"column {column.name!r}:"))
    return replace(proposal, columns=columns, questions=left)
