"""A diagnosis in one or two sentences that a person can act on."""

from collections.abc import Mapping, Sequence
from typing import Protocol

from rsea_core.identify.candidates.sentences import effect_words
from rsea_core.identify.fitting.least_squares import Fit
from rsea_core.identify.fitting.problem import Problem
from rsea_core.identify.judgement.insufficient_data import OpenQuestion
from rsea_core.identify.judgement.residual import UnexplainedResidual
from rsea_core.identify.selection.common_scale_factor import constants_phrase
from rsea_core.identify.selection.criteria import TEMPERATURE

NEAR = 0.1  # belief from which a name that is not the answer is worth a word
CLAIMED = 0.5  # confidence from which an effect stands in the first sentence


class ReportedDiagnosis(Protocol):
    """What the sentences need of an outcome."""

    verdict: str
    fit: Fit
    problem: Problem
    nominal: Mapping[str, float]
    unbalance: Mapping | None
    residual: UnexplainedResidual | None
    nearest: Sequence[Mapping]
    question: OpenQuestion | None
    restored_constants: Sequence[str]

    def effects(self) -> Sequence[Mapping]:
        """The effects as they are reported, each with its confidence."""

    def reported_figures(self, x, j: int) -> Mapping[str, float | str]:
        """Figures of an effect."""

    def explained_excess(self) -> float:
        """Share of the MSNI that the effects take away."""

    def rivals(self) -> Sequence[tuple[Fit, float]]:
        """Fits that name other effects, and log-likelihood units behind the best."""


def summary_of(outcome: ReportedDiagnosis) -> str:
    """One or two sentences that a person can act on."""
    verdict = outcome.verdict
    own = [j for j, law in enumerate(outcome.fit.hypothesis.laws) if not law.nuisance]
    laws = [outcome.fit.hypothesis.laws[j] for j in own]
    if outcome.question is not None:
        return outcome.question.sentence
    if verdict == "no-mismatch":
        return "The rig file explains the recordings down to the sensors' noise."
    if verdict == "parameters-only":
        moved = [
            f"{p.key} {p.value:.4g} -> {outcome.nominal[p.key]:.4g}"
            for j, p in enumerate(outcome.problem.nominals)
            if abs(outcome.fit.x[j]) > 0.5
        ]
        return (
            "The nominal model with other values explains the recordings; no missing physics."
            + (f" Moved most: {', '.join(moved[:4])}." if moved else "")
        )
    shape = getattr(outcome, "unknown", None)
    if verdict == "unexplained" and shape is not None:
        return f"Something is missing that no known effect explains: {shape.sentence()}."
    if not laws and outcome.unbalance is not None:
        figures = outcome.unbalance["parameters"]
        return (
            "Missing physics: load-unbalance, a gravity torque of"
            f" {figures['torque_amplitude_Nm']['value']:.4g} Nm at"
            f" {figures['angle_rad']['value']:.3g} rad that the rig file does not state."
        )
    if outcome.residual is not None:
        near = ", ".join(e["name"] for e in outcome.nearest if e["confidence"] >= NEAR)
        return (
            f"Something is missing that no known effect explains: {outcome.residual.sentence()}."
            + (f" The nearest name is {near}." if near else "")
        )
    if not laws:
        return "Something is missing that no known effect explains; see the unexplained residual."
    what = _listed([_named(outcome, j) for j in own])
    share = f"{100 * outcome.explained_excess():.0f} %"
    if verdict == "unexplained":
        return f"Structure remains that no known effect explains; the nearest is {what}."
    if verdict == "insufficient-data":
        others = ", ".join(
            dict.fromkeys(
                o for f, gap in outcome.rivals() if gap < TEMPERATURE for o in f.hypothesis.effects
            )
        )  # fmt: skip
        return f"Likely {what}, but these recordings do not tell it from {others}."
    if outcome.restored_constants and len(laws) == 1:
        some = constants_phrase(outcome.restored_constants)
        return f"Missing physics: {what}; without it {some} share a common factor."
    named = "this explains" if len(laws) == 1 else "together they explain"
    claimed = {e["name"] for e in outcome.effects() if e["confidence"] >= CLAIMED}
    faint = [j for j, law in zip(own, laws, strict=True) if law.effect not in claimed]
    less = ""
    if 0 < len(faint) < len(own):
        what = _listed([_named(outcome, j) for j in own if j not in faint])
        named = "the laws found explain"
        less = f" Less sure: {_listed([_named(outcome, j) for j in faint])}."
    return f"Missing physics: {what}; {named} {share} of what re-estimated parameters leave.{less}"


def _listed(names: Sequence[str]) -> str:
    *most, last = names
    return f"{', '.join(most)} and {last}" if most else last


def _named(outcome: ReportedDiagnosis, j: int) -> str:
    """An effect and how large it is, its name in the contract beside it."""
    law = outcome.fit.hypothesis.laws[j]
    figures = outcome.reported_figures(outcome.fit.x, j)
    linear = outcome.problem.case.rig.axis == "linear"
    said = effect_words(law.effect, law.subsystem, figures, linear=linear)
    if said is not None:
        return f"{said} ({law.effect})"
    values = (f"{n} {v:.4g}" if not isinstance(v, str) else f"{n} {v}" for n, v in figures.items())
    return f"{law.effect} ({law.law}: {', '.join(values)})"
