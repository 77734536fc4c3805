"""A proposal for `[columns]`: each column's meaning, unit, sign, with its reason and confidence.

Names come first, numbers decide: where two meanings explain a log equally well, the proposal has a
question instead of a guess. Signs make every law positive; which direction is called positive for
the whole machine is the owner's choice and cannot be seen.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RecordingError
from rsea_core.importing.answers import Answer, answer_text, typed
from rsea_core.importing.assignment import (
    alternatives,
    columns_by_derivative,
    columns_by_name,
)
from rsea_core.importing.hypotheses import STATED, Choice, Posterior, best_hypothesis, choices_of
from rsea_core.importing.signs import signs_of
from rsea_core.importing.streams.column_names import NameEvidence, name_evidence
from rsea_core.importing.unit_evidence import Law
from rsea_core.machine.rig import Rig, is_linear
from rsea_core.numeric.brief_repr import BriefRepr
from rsea_core.recordings.column_map import ColumnSource
from rsea_core.recordings.readers.log import LOG_TIME
from rsea_core.recordings.recording import COLUMNS
from rsea_core.recordings.units import unit_of_column
from rsea_core.terms.known import KnownTerm

ASK_BELOW = 0.9
BROKEN, BROKEN_ALONE = 2.5, 4.0  # standard deviations of a law, of one of a single reading
SOURCES = ("motor_angle_rad", "load_angle_rad", "spring_deflection_rad", "current_A")
EXACTLY = 1e-4  # of its scatter: no sensor follows an angle as closely
LENGTHS = ("m", "mm", "um")  # what a scale counts in can only be seen beside another reading
GUESSED = ("torque_Nm", "motor_torque_Nm")  # what a drive calls torque is often a current in %
STAMPS = ("ts", "tstamp", "t_stamp")  # a time where it rises evenly, a spring's torque elsewhere
COMPUTED = "computed, no sensor measured it; kept as a reference"


@dataclass(frozen=True, kw_only=True, repr=False)
class Proposal(BriefRepr):
    """What a log's columns are taken for.

    Attributes
    ----------
    columns : tuple of ProposedColumn
    references, ignored : tuple of str
    questions, notes : tuple of str
        One line each; no question: everything was decided.
    rate_needed : bool
        The log has no time.
    """

    columns: tuple["ProposedColumn", ...]
    references: tuple[str, ...]
    ignored: tuple[str, ...]
    questions: tuple[str, ...]
    rate_needed: bool
    notes: tuple[str, ...] = ()

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
    scale, zero : float
    formula : str or None
    wrap : float or None
        As in `[columns]`; only what the owner states has them, but for the zero of a pendulum.
    confidence : float
    reason : str
    asks : bool
        Whether it is one of the questions.
    sign_known : bool
        Whether the sign is seen in the log.
    """

    target: str
    name: str
    unit: str
    sign: int = 1
    side: str | None = None
    counts_per_rev: float | None = None
    scale: float = 1.0
    zero: float = 0.0
    formula: str | None = None
    wrap: float | None = None
    confidence: float
    reason: str
    asks: bool = False
    sign_known: bool = True


def propose(
    raw: Mapping[str, NDArray],
    units: Mapping[str, str],
    rig: Rig | None = None,
    stated: Mapping[str, ColumnSource | None] | None = None,
    terms: Sequence[KnownTerm] = (),
) -> Proposal:
    """What the columns of one log are.

    Parameters
    ----------
    raw : mapping of column name to (n,) array
        As logged, all of one length.
    units : mapping of column name to the unit that the file states
    stated : mapping of column name to its source (the column is scaled so), None for a reference
    terms : sequence of KnownTerm
        Friction and springs that the rig file states.

    Raises
    ------
    RecordingError
        If no column can be a reading.
    """
    stated = stated or {}
    evidence = _evidence(raw, units, rig, stated)
    whole = {n: v for n, v in raw.items() if np.all(np.isfinite(v))}
    time = _time_column(whole, evidence, stated)
    if time is None:
        return Proposal(columns=(), references=(), ignored=(), questions=(), rate_needed=True)
    others = [n for n in whole if n != time and (n in stated or not _counts_rows(whole[n]))]
    assigned, goals, unknown = columns_by_name(others, evidence, rig, stated)
    assigned = assigned or columns_by_derivative(whole, time, rig)
    unknown = [n for n in unknown if n not in assigned]
    if not assigned:
        raise RecordingError(f"no column is recognised as a reading: {', '.join(list(raw)[:8])}")

    def choices(name: str, target: str) -> list[Choice]:
        found = choices_of(name, target, evidence[name], whole[name], rig)
        return _as_stated(found, stated.get(name))

    fitting = {n: ts for n, ts in assigned.items() if any(choices(n, t) for t in ts)}
    tables = [{time: "time_s", **targets} for targets in alternatives(fitting)]
    assignments = [{n: choices(n, t) for n, t in table.items()} for table in tables]
    best = best_hypothesis(rig, whole, [a for a in assignments if all(a.values())], terms)
    named = {c.name for c in best.choices}
    unknown += [n for n in assigned if n not in named]  # some, as their units are of no reading
    made = {c.name: c.target for c in best.choices if _is_computed(c, best, whole, stated)}
    best = best.without(set(made.values()))
    columns = [c for c in _with_signs(best, whole, rig, evidence, stated) if c.name not in made]
    moving = [n for n in unknown if np.ptp(whole[n]) > 0.0 and not _counts_rows(whole[n])]
    questions = [_question(c, best) for c in columns if c.asks]
    questions += [_unknown(n) for n in moving]
    return Proposal(
        columns=tuple(columns),
        references=(*goals, *moving, *made),
        notes=tuple(f"{name} is a sum of other columns: {COMPUTED}" for name in made),
        ignored=tuple(n for n in raw if n not in named and n not in goals and n not in moving),
        questions=tuple(questions),
        rate_needed=False,
    )


def _evidence(
    raw: Mapping[str, NDArray], units: Mapping[str, str], rig: Rig | None, stated
) -> dict[str, NameEvidence]:
    """What each column's name says, with the unit that its owner or the file states."""
    own = {n: s.unit for n, s in stated.items() if s is not None and s.unit}
    linear = is_linear(rig)
    return {n: name_evidence(n, own.get(n, units.get(n)), linear=linear) for n in raw}


def _time_column(
    raw: Mapping[str, NDArray], evidence: Mapping[str, NameEvidence], stated
) -> str | None:
    stated_time = [n for n, s in stated.items() if s is not None and s.target == "time_s"]
    if stated_time:
        return stated_time[0]
    rising = [n for n, v in raw.items() if v.size > 2 and np.all(np.diff(v) > 0.0)]
    named = [n for n in rising if evidence[n].quantity == "time"]
    if named:  # when a message was read is better known than when it was written
        stamps = [n for n in named if "stamp" in n] or [n for n in named if n != LOG_TIME]
        return (stamps or named)[0]
    even = [n for n in rising if np.std(np.diff(raw[n])) < 0.2 * np.mean(np.diff(raw[n]))]
    free = [n for n in even if evidence[n].quantity is None and not _counts_rows(raw[n])]
    free += [n for n in even if n.lower() in STAMPS]
    first = next(iter(raw), None)
    return free[0] if free and free[0] == first else None


def _counts_rows(values: NDArray) -> bool:
    """Whether a column is the number of its row."""
    steps = np.diff(values)
    return bool(steps.size and np.all(steps == 1.0) and np.all(values == np.round(values)))


def why_no_time(raw: Mapping[str, NDArray], units: Mapping[str, str]) -> str:
    """Why no column of a log can be its clock."""
    for name in (n for n in raw if name_evidence(n, units.get(n)).quantity == "time"):
        values = raw[name]
        steps = np.diff(values)
        if not np.all(np.isfinite(values)):
            return f"column {name!r} has no time in row {int(np.argmin(np.isfinite(values))) + 1}"
        if not np.any(steps):
            return f"column {name!r} stands still"
        k = int(np.argmin(steps > 0.0))
        verb = "stands still" if steps[k] == 0.0 else "goes back"
        return f"column {name!r} {verb} in row {k + 2} ({values[k]:.9g} to {values[k + 1]:.9g})"
    return "no column is a time"


def _is_computed(c: Choice, best: Posterior, raw, stated) -> bool:
    """Whether a torque is angles and currents times constants, to the digits of the log."""
    angles = [raw[o.name] for o in best.choices if o.target in SOURCES]
    if c.target != "torque_Nm" or c.name in stated or not angles or np.ptp(raw[c.name]) == 0.0:
        return False
    table = np.stack([np.ones(angles[0].size), *angles], axis=1)
    x, *_ = np.linalg.lstsq(table, raw[c.name], rcond=None)
    return float(np.std(raw[c.name] - table @ x)) < EXACTLY * float(np.std(raw[c.name]))


def _as_stated(choices: list[Choice], source: ColumnSource | None) -> list[Choice]:
    """The choices that agree with what the owner says."""
    if source is None:
        return choices
    kept = [c for c in choices if c.side == source.side and source.unit in (None, c.unit)]
    return [replace(c, prior=0.0) for c in kept] or choices


def _with_signs(
    best: Posterior, raw: Mapping[str, NDArray], rig: Rig | None, evidence, stated
) -> tuple[ProposedColumn, ...]:
    by_target = {c.target: c for c in best.choices}
    signs, seen = signs_of(by_target, raw, rig, best.laws)
    columns = []
    for c in best.choices:
        still = _is_still(c, raw[c.name], rig)  # has neither sign nor unit to be seen
        sign_known = still or seen.get(c.target, True)
        confidence = 1.0 if still else best.confidence[c.name] * (1.0 if sign_known else 0.6)
        against = c.prior <= STATED + 0.1  # what the log itself states, or any size it can have
        tied = any(c.target in law.columns for law in best.laws)
        against |= c.unit in LENGTHS and evidence[c.name].unit is None and not tied
        broken = _broken_law(c.target, best)
        if broken is not None and broken.is_excess and evidence[c.name].unit is not None:
            broken = None  # friction that nobody stated may need it
        by_name = rig is not None and c.target in GUESSED and c.name not in (*stated, *COLUMNS)
        against |= by_name and evidence[c.name].unit is None and not tied
        if (against or broken is not None) and not still:
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
                sign_known=sign_known,
            )
        )
    return tuple(columns)


def _broken_law(target: str, best: Posterior) -> Law | None:
    """The law by which a reading agrees in no unit with the others that it is tied to."""
    broken = []
    for law in best.laws:
        most = BROKEN if len(law.columns) > 1 else BROKEN_ALONE
        broken += [law] if law.size_score() - law.held < -0.5 * most**2 else []
    return next((x for x in broken if target == [n for n in x.columns if n != "time_s"][-1]), None)


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


def _reason(c: Choice, best: Posterior, e: NameEvidence, sign_known: bool) -> str:
    parts = []
    if e.unit is not None:
        parts.append(f"unit {e.unit} is stated")
    parts += [law.text for law in best.laws if c.target in law.columns][:2]
    if c.side is not None:
        parts.append(f"measured on the {c.side} side")
    if not sign_known:
        parts.append("its sign cannot be determined from this log")
    return "; ".join(parts) or "by its name and the size of its numbers"


def _unknown(name: str) -> str:
    return (
        f"column {name!r}: what is it? Its name says nothing that is known:"
        f" {typed(f'READING={name}:UNIT')}, or {typed(f'reference={name}')} if it is not to be"
        " fitted"
    )


def _question(c: ProposedColumn, best: Posterior) -> str:
    """What is not decided of a column, with the answers as they are typed."""
    rival = best.rivals.get(c.name)
    broken = _broken_law(c.target, best)
    known = {"sign": c.sign, "side": c.side, "counts_per_rev": c.counts_per_rev}
    own = answer_text(c.target, c.name, c.unit, **known)
    if broken is not None:
        scale = float(f"{broken.missing_scale:.3g}")
        fits = answer_text(c.target, c.name, c.unit, scale=scale, **known)
        return f"column {c.name!r}: {c.target}? In no unit: {broken.text}; state its scale: {fits}"
    text = f"column {c.name!r}: {c.target} in {c.unit} ({c.confidence:.0%})"
    differs = rival and (rival.unit, rival.target, rival.side) != (c.unit, c.target, c.side)
    if differs and best.confidence[c.name] < ASK_BELOW:
        side = "" if rival.side is None else f" on the {rival.side} side"
        known |= {"side": rival.side, "counts_per_rev": rival.counts_per_rev}
        other = answer_text(rival.target, c.name, rival.unit, **known)
        return f"{text} or {rival.target} in {rival.unit}{side}? {own}, or {other}"
    if c.sign_known:
        return f"{text}: nothing else in the log confirms it; if it is right: {own}"
    return (
        f"{text}: its sign cannot be determined; is + the motor's + direction?"
        f" {own}, or with sign {-c.sign:+d}"
    )


def answered(proposal: Proposal, answer: Answer) -> Proposal:
    """The proposal with a column as its owner says; its question is gone."""
    source, name = answer.source, answer.name
    kept = [c for c in proposal.columns if name == "" or c.name != name]
    if source is not None:
        before = proposal.column(source.target)
        kept = [c for c in kept if c.target != source.target]
        unit = source.unit or (before.unit if before is not None and before.name == name else None)
        kept.append(
            ProposedColumn(
                target=source.target, name=name, unit=unit or unit_of_column(source.target),
                sign=source.sign, side=source.side, counts_per_rev=source.counts_per_rev,
                scale=source.scale, zero=source.zero, formula=source.formula, wrap=source.wrap,
                confidence=1.0, reason="as its owner says",
            )
        )  # fmt: skip
    named = {c.name for c in kept}
    left = tuple(q for q in proposal.questions if not q.startswith(f"column {name!r}:"))
    references = [n for n in proposal.references if n not in named and n != name]
    references += [name] if source is None and not answer.is_left_out else []
    return replace(
        proposal, columns=tuple(kept), questions=left, references=tuple(references),
        ignored=tuple(n for n in proposal.ignored if n not in named),
    )  # fmt: skip
