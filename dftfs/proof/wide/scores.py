"""From a run over a wide set to its figures; cases that did not finish are counted apart."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import beta

from dftfs.proof.judging import read_json, sealed_run
from dftfs.proof.labels import LABELS, answers
from dftfs.proof.running import FINISHED, OUTCOME, RunError, state_of
from dftfs.proof.scoring import CLAIM, Score, score_case
from dftfs.proof.summary import Rate, Summary, summarise
from dftfs.proof.writing import HIDDEN

LEVEL = 0.95  # of the bounds


@dataclass(frozen=True, kw_only=True)
class Bound:
    """A share with its exact bounds (Clopper and Pearson 1934), each one-sided at 95 %."""

    share: float
    events: int
    count: int
    low: float
    high: float

    @staticmethod
    def of(events: int, count: int) -> "Bound | None":
        """Bounds of a binomial share; None of nothing."""
        if count == 0:
            return None
        low = beta.ppf(1 - LEVEL, events, count - events + 1) if events else 0.0
        high = beta.ppf(LEVEL, events + 1, count - events) if events < count else 1.0
        return Bound(share=events / count, events=events, count=count, low=float(low),
                     high=float(high))  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Figures:
    """What a run over a wide set is judged by.

    ``null_claims``: sound machines with any claim; ``false_discoveries``: claims that are not
    true; ``empty_claims``: cases with a claim whose held-out error, on the case's own validation
    recordings as the diagnosis states it, is not below that of parameters only; ``unseen_claims``:
    the same on the hidden test, against the proof's own refit.
    """

    cases: int
    states: dict[str, int]
    null_claims: Bound | None
    null_alarms: Bound | None
    false_discoveries: Bound | None
    empty_claims: list[str]
    unseen_claims: list[str]
    without_validation: int
    f1: float | None
    by_machine: dict[str, dict[str, Rate | None]]
    summary: Summary


@dataclass(frozen=True, kw_only=True)
class WideJudgement:
    """Figures, the cases' scores, and what they were made from."""

    seal: str
    commands: list[str]
    figures: Figures
    scores: list[Score]
    machines: dict[str, str]


def as_labelled(label: Mapping, found: Mapping) -> dict:
    """A diagnosis with names that are as true as the truth replaced by it, and names that are
    true of the log alone left out."""
    best: dict[str, dict] = {}
    claimed = [e for e in found.get("effects") or [] if e.get("confidence", 1.0) >= CLAIM]
    for effect in found.get("effects") or []:
        name = effect["name"]
        if name in label["tolerated"] and name not in label["effects"]:
            continue
        if name in label["acceptable"] and name not in label["effects"]:
            effect = {**effect, "name": label["acceptable"][name], "parameters": {}}
        before = best.get(effect["name"])
        if before is None or effect.get("confidence", 1.0) > before.get("confidence", 1.0):
            best[effect["name"]] = effect
    verdict = found.get("verdict")
    only_log = claimed and all(e["name"] in label["tolerated"] for e in claimed)
    if label["level"] == "null" and verdict == "missing-physics" and only_log:
        verdict = "parameters-only"
    return {**found, "effects": list(best.values()), "verdict": verdict}


def held_out(found: Mapping, role: str = "validation") -> tuple[float, float] | None:
    """Stated nrmse of the model found and of parameters only on recordings of a role; means."""
    rows = [
        (r["nrmse_after"], r["nrmse_parameters_only"])
        for r in (found.get("fit") or {}).get("recordings") or []
        if r.get("role") == role
        and r.get("nrmse_after") is not None
        and r.get("nrmse_parameters_only") is not None
    ]
    if not rows:
        return None
    after, before = np.mean(rows, axis=0)
    return float(after), float(before)


def not_better(score: Score) -> bool:
    """Whether the prediction of the hidden test is nowhere better than the proof's refit."""
    rows = [r for r in score.channels.values() if "predicted" in r]
    return bool(rows) and all(r["predicted"] >= r["refit"] for r in rows)


def judge_wide(folder: Path, name: str = "diagnosis") -> WideJudgement:
    """Check the seal and score a run.

    Raises
    ------
    SealError
        If the labels are not the ones that were sealed.
    RunError
        If there is no such run, it was made under another seal or a diagnosis cannot be read.
    """
    seal, order = sealed_run(folder, name)
    place, sealed = folder / "runs" / name, answers(folder)
    labels = json.loads((sealed / LABELS).read_text(encoding="utf-8"))
    states: dict[str, int] = {}
    scores, documents = [], {}
    for case, label in labels.items():
        state = state_of(place / case) or "not run"
        states[state] = states.get(state, 0) + 1
        if state != FINISHED:
            continue
        try:
            found = as_labelled(label, read_json(place / case / "diagnosis.json") or {})
            score = scored(case, label, found, sealed / HIDDEN / case, place / case)
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise RunError(
                f"{place / case / 'diagnosis.json'}: not of the contract's form"
                f" ({type(error).__name__}: {error})"
            ) from None
        documents[case] = found
        scores.append(score)
    machines = {case: str(labels[case].get("machine", "-")) for case in labels}
    return WideJudgement(
        seal=seal, commands=order["commands"], scores=scores, machines=machines,
        figures=figures_of(scores, documents, states, machines),
    )  # fmt: skip


def scored(case: str, label: dict, found: dict, hidden: Path, run: Path) -> Score:
    """One case's score; a generator may have left no hidden test."""
    if not (hidden / "truth.csv").is_file():
        label = {**label, "hidden_test": {"nrmse": {}}}
    outcome = read_json(run / OUTCOME) or {}
    return score_case(case, label, found, hidden, run / "prediction.csv", outcome.get("diagnose_s"))


def figures_of(
    scores: list[Score], documents: dict[str, dict], states: dict[str, int], machines: dict
) -> Figures:
    """The figures of finished cases."""
    nulls = [s for s in scores if s.level == "null"]
    true = sum(len(s.hits) for s in scores)
    false = sum(len(s.false) for s in scores)
    missed = sum(len(s.missed) for s in scores)
    claiming = [s for s in scores if s.claimed and s.verdict == "missing-physics"]
    empty, unknown = [], 0
    for s in claiming:
        pair = held_out(documents[s.case])
        unknown += pair is None
        if pair is not None and not pair[0] < pair[1]:
            empty.append(s.case)
    kinds = sorted({machines[s.case] for s in scores})
    return Figures(
        cases=len(scores),
        states=states,
        null_claims=Bound.of(sum(bool(s.claimed) for s in nulls), len(nulls)),
        null_alarms=Bound.of(
            sum(s.verdict in ("missing-physics", "unexplained") for s in nulls), len(nulls)
        ),
        false_discoveries=Bound.of(false, true + false),
        empty_claims=empty,
        unseen_claims=[s.case for s in claiming if not_better(s)],
        without_validation=unknown,
        f1=2 * true / (2 * true + false + missed) if true + false + missed else None,
        by_machine={
            kind: {
                key: Rate.of([getattr(s, key) for s in scores
                              if machines[s.case] == kind and getattr(s, key) is not None])
                for key in ("verdict_credit", "location", "top1")
            }
            for kind in kinds
        },
        summary=summarise(scores),
    )  # fmt: skip
