"""When recordings do not settle the answer: the pair that stays open, and what would split it.

`insufficient-data` is no exit for hard cases: it names two explanations that these recordings leave
open and an experiment that is predicted to split them (docs/diagnosis.md 7.4, 10). Two questions
are asked of recordings that last long enough to answer any.

Nothing was found: would it have been? Where most effects at a size that matters would stay
hidden, or all those of one part of the machine, the nominal model is not confirmed but untested.

Something was found: does it hang on one recording? A law chosen by the only recording is checked
by no other, and a bridge is not exactly repeatable; so where another effect, or none at all, leaves
less than three times the noise there, a second recording has to confirm it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rsea_core.identify.experiment.experiment_file import Judged, experiment_of
from rsea_core.identify.experiment.next_experiment import DECIDES, NextExperiment
from rsea_core.identify.fitting.least_squares import Fit
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.judgement.detectability import Amount, amounts
from rsea_core.identify.selection.criteria import Search
from rsea_core.recordings.quality_checks import SHORT_s
from rsea_core.recordings.sample_faults import FEW

MOST = 0.5  # share of effects that may stay hidden where nothing was found
PARTS = ("drive", "gear", "spring", "load")
NAMED = 3  # hidden effects that a sentence names


@dataclass(frozen=True, kw_only=True)
class OpenQuestion:
    """What recordings leave open.

    Attributes
    ----------
    words : str
        One sentence that a person can act on.
    pair : (Fit, Fit)
        The explanations that stay.
    experiment : NextExperiment
        Splits them by more than three standard errors.
    brief : bool
        All recordings are too short: what a fit names or moves is no claim.
    """

    words: str
    pair: tuple[Fit, Fit]
    experiment: NextExperiment
    brief: bool = False


def question_of(outcome: Judged, search: Search) -> OpenQuestion | None:
    """The open question of a search whose best fit is the outcome's; None where it is settled."""
    found = bool(outcome.fit.hypothesis.laws)
    brief = _too_brief(search)
    if brief is None and outcome.verdict not in (
        ("missing-physics",) if found else ("no-mismatch", "parameters-only")
    ):
        return None
    candidates = _unconfirmed(search, outcome.fit) if found else _untested(search)
    if brief is not None:
        every = sorted(amounts(search), key=lambda a: -a.least)
        candidates = [(brief, _pair(search, a)) for a in every]
    for words, pair in candidates:
        experiment = experiment_of(outcome, pair)
        if experiment is not None and experiment.decides:
            return OpenQuestion(
                words=words, pair=pair, experiment=experiment, brief=brief is not None
            )
    return None


def _too_brief(search: Search) -> str | None:
    """That no recording lasts long enough to tell anything, in words."""
    longest = max((b.recording for b in search.problem.fitted), key=lambda r: r.rows)
    length = float(np.ptp(longest.time_s))
    if any(
        b.recording.rows >= FEW or np.ptp(b.recording.time_s) >= SHORT_s
        for b in search.problem.fitted
    ):
        return None
    return (
        f"These recordings are too short to tell anything: the longest, {longest.file}, has"
        f" {longest.rows} rows in {length:.3g} s; record some seconds."
    )


def hidden(found: Sequence[Amount]) -> list[Amount]:
    """The amounts that say that nothing could have been found; empty where enough could.

    Those of a part of the machine in which nothing would be seen; else all that would not, where
    they are most.
    """
    unseen = [a for a in found if not a.seen]
    for part in PARTS:
        own = [a for a in found if a.law.subsystem == part]
        if len(own) > 1 and not any(a.seen for a in own):  # one effect is not a part
            return own
    return unseen if len(unseen) > MOST * len(found) else []


def hidden_words(found: Sequence[Amount]) -> str | None:
    """What these recordings would not show, in words; None where they would show everything."""
    said = []
    for a in sorted((a for a in found if not a.seen), key=lambda a: -a.least):
        more = "at any size" if np.isinf(a.least) else f"only from {a.least:.2g} times that on"
        said.append(f"{a.words} ({a.law.effect}, {more})")
    return f"these recordings would not show {'; '.join(said)}" if said else None


def _untested(search: Search) -> list[tuple[str, tuple[Fit, Fit]]]:
    """The questions of a search that found nothing, the most hidden effect first."""
    silent = sorted(hidden(amounts(search)), key=lambda a: -a.least)
    names = [a.words for a in silent[:NAMED]]
    return [
        (
            "The nominal model explains these recordings, but they would not show"
            f" {', '.join([a.words, *(n for n in names if n != a.words)][:NAMED])}"
            f"{' or more' if len(silent) > NAMED else ''}.",
            _pair(search, a),
        )
        for a in silent
    ]


def _pair(search: Search, amount: Amount) -> tuple[Fit, Fit]:
    base = search.parameters
    return _with(search.problem, base, amount), base


def _with(problem: Problem, base: Fit, amount: Amount) -> Fit:
    """The machine of a fit with an effect of the size that matters: what the fit cannot exclude."""
    law = amount.law
    own = problem.start(Hypothesis(laws=(law,)))[len(problem.nominals) :]
    return replace(
        base, hypothesis=Hypothesis(laws=(law,)), x=np.concatenate([base.x, own]), hessian=None,
        per_bench=(), gradients=(),
    )  # fmt: skip


def _unconfirmed(search: Search, best: Fit) -> list[tuple[str, tuple[Fit, Fit]]]:
    """The questions of a search whose effect one recording alone shows, the nearest rival first."""
    if len(search.problem.fitted) > 1:
        return []
    mine = set(best.hypothesis.effects)
    return [
        (
            f"Likely {' and '.join(best.hypothesis.effects)}, but one recording alone shows it, and"
            f" there {_called(rival)} leaves no more than {np.sqrt(rival.power[0]):.1f} times the"
            " noise: another one has to confirm it.",
            (best, rival),
        )
        for rival in search.ranked()
        if set(rival.hypothesis.effects) != mine
        and len(rival.hypothesis.effects) <= len(mine)
        and np.sqrt(rival.power[0]) < DECIDES
    ]


def _called(fit: Fit) -> str:
    return " and ".join(fit.hypothesis.effects) or "the model without it"
