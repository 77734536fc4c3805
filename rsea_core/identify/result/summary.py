"""A diagnosis in one or two sentences that a person can act on."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from rsea_core.identify.candidates.sentences import effect_text
from rsea_core.identify.fitting.least_squares import Fit
from rsea_core.identify.fitting.problem import Problem
from rsea_core.identify.judgement.insufficient_data import OpenQuestion
from rsea_core.identify.judgement.residual import UnexplainedResidual
from rsea_core.identify.result.known_values import known_values
from rsea_core.identify.selection.common_scale_factor import constants_phrase
from rsea_core.identify.selection.criteria import TEMPERATURE

NEAR = 0.1  # confidence from which an effect that is not claimed is mentioned
CLAIMED = 0.5  # confidence from which an effect stands in the first sentence
NAMELESS = "Something is missing that no known effect explains"


class ReportedDiagnosis(Protocol):
    """What the sentences need of a conclusion."""

    verdict: str
    fit: Fit
    problem: Problem
    nominal: Mapping[str, float]
    unbalance: Mapping | None
    residual: UnexplainedResidual | None
    nearest: Sequence[Mapping]
    question: OpenQuestion | None
    restored_constants: Sequence[str]
    unknown_torque: str | None

    def effects(self) -> Sequence[Mapping]:
        """The effects as they are reported, each with its confidence."""

    def reported_figures(self, x, j: int) -> Mapping[str, float | str]:
        """Figures of an effect."""

    def explained_excess(self) -> float:
        """Share of the MSNI that the effects take away."""

    def rivals(self) -> Sequence[tuple[Fit, float]]:
        """Fits that name other effects, and log-likelihood units behind the best."""


def summary_of(conclusion: ReportedDiagnosis) -> str:
    """One or two sentences that a person can act on."""
    verdict = conclusion.verdict
    own = [j for j, law in enumerate(conclusion.fit.hypothesis.laws) if not law.nuisance]
    laws = [conclusion.fit.hypothesis.laws[j] for j in own]
    if conclusion.question is not None:
        return conclusion.question.sentence
    if verdict == "no-mismatch":
        torque = conclusion.unknown_torque
        left = "" if torque is None else f" and {torque}"
        return f"The rig file explains the recordings down to the sensors' noise{left}."
    if verdict == "parameters-only":
        return _of_moved_values(conclusion)
    without = _without_law(conclusion)
    if without is not None:
        return without
    what = _listed([_named(conclusion, j) for j in own])
    share = f"{100 * conclusion.explained_excess():.0f} %"
    if verdict == "unexplained":
        return f"Structure remains that no known effect explains; the nearest is {what}."
    if verdict == "insufficient-data":
        near = [f.hypothesis for f, gap in conclusion.rivals() if gap < TEMPERATURE]
        others = ", ".join(dict.fromkeys(effect for h in near for effect in h.effects))
        if not others:
            return f"Likely {what}, but these recordings do not confirm it."
        return f"Likely {what}, but these recordings do not distinguish it from {others}."
    if conclusion.restored_constants and len(laws) == 1:
        some = constants_phrase(conclusion.restored_constants)
        return f"Missing physics: {what}; without it {some} share a common factor."
    named = "this explains" if len(laws) == 1 else "together they explain"
    confidence = {e["name"]: e["confidence"] for e in conclusion.effects()}
    of_each = [confidence.get(law.effect, 0.0) for law in laws]
    faint = [j for j, each in zip(own, of_each, strict=True) if each < CLAIMED]
    likely = [j for j, each in zip(own, of_each, strict=True) if NEAR <= each < CLAIMED]
    less, missing = "", "Missing physics"
    if faint and len(faint) == len(own):
        missing += " of uncertain name"
        laws_found = [e for e in conclusion.effects() if e["confidence"] < CLAIMED]
        others = [n for e in laws_found for n in e["class"] if n not in confidence]
        what = ", or ".join([what, *dict.fromkeys(others)])
        sure = [name for name, each in confidence.items() if each >= CLAIMED]
        missing = f"Missing physics: {_listed(sure)}. {missing}" if sure else missing
    elif faint:
        what = _listed([_named(conclusion, j) for j in own if j not in faint])
        named = "the laws found explain"
        if likely:
            less = f" Less sure: {_listed([_named(conclusion, j) for j in likely])}."
    return f"{missing}: {what}; {named} {share} of what re-estimated parameters leave.{less}"


def _of_moved_values(conclusion: ReportedDiagnosis) -> str:
    """That values of the rig file suffice, and which moved."""
    moved = [
        f"{p.key} {p.value:.4g} -> {conclusion.nominal[p.key]:.4g}"
        for j, p in enumerate(conclusion.problem.nominals)
        if abs(conclusion.fit.x[j]) > 0.5
    ]
    moved += [
        f"{v.key} {v.stated:.4g} -> {v.found:.4g}"
        for v in known_values(conclusion)
        if abs(v.moved) > 0.5
    ]
    torque = conclusion.unknown_torque
    what = (
        "explains the recordings; no missing physics." if torque is None
        else f"and {torque} explain the recordings; no missing physics was found."
    )  # fmt: skip
    more = f" Moved most: {', '.join(moved[:4])}." if moved else ""
    return f"The nominal model with other values {what}{more}"


def _without_law(conclusion: ReportedDiagnosis) -> str | None:
    """A verdict that no law carries; None where laws do."""
    unexplained = conclusion.verdict == "unexplained"
    for shape in (getattr(conclusion, name, None) for name in ("unknown", "formula")):
        if unexplained and shape is not None:
            return f"{NAMELESS}: {shape.sentence()}."
    named = any(not law.nuisance for law in conclusion.fit.hypothesis.laws)
    if not named and conclusion.unbalance is not None:
        figures = conclusion.unbalance["parameters"]
        return (
            "Missing physics: load-unbalance, a gravity torque of"
            f" {figures['torque_amplitude_Nm']['value']:.4g} Nm at"
            f" {figures['angle_rad']['value']:.3g} rad that the rig file does not state."
        )
    if conclusion.residual is not None:
        near = ", ".join(e["name"] for e in conclusion.nearest if e["confidence"] >= NEAR)
        return f"{NAMELESS}: {conclusion.residual.sentence()}." + (
            f" The nearest name is {near}." if near else ""
        )
    if named:
        return None
    delayed, reason = getattr(conclusion, "delayed", None), getattr(conclusion, "reason", None)
    if not unexplained and delayed is not None:
        late = delayed["parameters"]["delay_s"]["value"]
        return f"Missing physics: the command acts {1e3 * late:.3g} ms late ({delayed['name']})."
    return f"{NAMELESS}{'; see the unexplained residual' if reason is None else ': ' + reason}."


def _listed(names: Sequence[str]) -> str:
    *most, last = names
    return f"{', '.join(most)} and {last}" if most else last


def _named(conclusion: ReportedDiagnosis, j: int) -> str:
    """An effect and how large it is, its name in the contract beside it."""
    law = conclusion.fit.hypothesis.laws[j]
    figures = conclusion.reported_figures(conclusion.fit.x, j)
    case = conclusion.problem.case
    own_text = effect_text(
        law.effect, law.subsystem, figures, law=law.law, linear=case.rig.axis == "linear",
        command_unit=case.rig.unit_of_command(case.recordings[0].command_name),
    )  # fmt: skip
    if own_text is not None:
        return f"{own_text} ({law.effect})"
    values = (f"{n} {v:.4g}" if not isinstance(v, str) else f"{n} {v}" for n, v in figures.items())
    return f"{law.effect} ({law.law}: {', '.join(values)})"
