"""When recordings do not settle the answer: the pair that stays open, and what would split it.

`insufficient-data` is no exit for hard cases: it names two explanations that these recordings leave
open and an experiment that is predicted to split them (docs/diagnosis.md 7.4, 10). Two questions
are asked of recordings that last long enough to answer any.

Nothing was found: would it have been? Where most effects at a size that matters would stay
hidden, or all those of one part of the machine, the nominal model is not confirmed but untested.

Something was found: does it hang on one recording? A law chosen by the only recording is checked
by no other, and a bridge is not exactly repeatable; so where another effect, or none at all, leaves
less than three times the noise there and is not three standard errors behind, a second recording
has to confirm it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rsea_core.identify.experiment.experiment_file import Judged, experiment_of
from rsea_core.identify.experiment.next_experiment import DECIDES, NextExperiment
from rsea_core.identify.fitting.least_squares import Fit
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.judgement.alternatives import distance_errors
from rsea_core.identify.judgement.criteria import MOST_UNDETECTABLE
from rsea_core.identify.judgement.detectability import DetectableSize, minimum_detectable_sizes
from rsea_core.identify.selection.criteria import Search
from rsea_core.recordings.quality_checks import SHORT_s
from rsea_core.recordings.sample_faults import FEW

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

    sentence: str
    pair: tuple[Fit, Fit]
    experiment: NextExperiment
    too_short: bool = False


def question_of(conclusion: Judged, search: Search) -> OpenQuestion | None:
    """The question that a search leaves open about its best fit; None where it is settled."""
    found = bool(conclusion.fit.hypothesis.laws)
    too_short = _too_short(search)
    if too_short is None and conclusion.verdict not in (
        ("missing-physics",) if found else ("no-mismatch", "parameters-only")
    ):
        return None
    candidates = _unconfirmed(search, conclusion.fit) if found else _untested(search)
    if too_short is not None:
        every = sorted(minimum_detectable_sizes(search), key=lambda a: -a.least)
        candidates = [(too_short, _pair(search, a)) for a in every]
    for sentence, pair in candidates:
        experiment = experiment_of(conclusion, pair)
        if experiment is not None and experiment.decides:
            return OpenQuestion(
                sentence=sentence, pair=pair, experiment=experiment, too_short=too_short is not None
            )
    return None


def _too_short(search: Search) -> str | None:
    """That no recording lasts long enough to tell anything, as text."""
    longest = max((b.recording for b in search.problem.fitted), key=lambda r: r.rows)
    length = float(np.ptp(longest.time_s))
    if any(
        b.recording.rows >= FEW or np.ptp(b.recording.time_s) >= SHORT_s
        for b in search.problem.fitted
    ):
        return None
    return (
        f"These recordings are too short for any conclusion: the longest, {longest.file}, has"
        f" {longest.rows} rows in {length:.3g} s; record some seconds."
    )


def undetectable(found: Sequence[DetectableSize]) -> list[DetectableSize]:
    """The amounts that say that nothing could have been found; empty where enough could.

    Those of a part of the machine in which nothing would be seen; else all that would not, where
    they are most.
    """
    unseen = [a for a in found if not a.seen]
    for part in PARTS:
        own = [a for a in found if a.law.subsystem == part]
        if len(own) > 1 and not any(a.seen for a in own):  # one effect is not a part
            return own
    return unseen if len(unseen) > MOST_UNDETECTABLE * len(found) else []


def undetectable_sentence(found: Sequence[DetectableSize]) -> str | None:
    """What these recordings would not show, as text; None where they would show everything."""
    phrases = []
    for a in sorted((a for a in found if not a.seen), key=lambda a: -a.least):
        more = "at any size" if np.isinf(a.least) else f"only from {a.least:.2g} times that on"
        phrases.append(f"{a.description} ({a.law.effect}, {more})")
    return f"these recordings would not show {'; '.join(phrases)}" if phrases else None


def _untested(search: Search) -> list[tuple[str, tuple[Fit, Fit]]]:
    """The questions of a search that found nothing, the most hidden effect first."""
    silent = sorted(undetectable(minimum_detectable_sizes(search)), key=lambda a: -a.least)
    names = [a.description for a in silent[:NAMED]]
    return [
        (
            "The nominal model explains these recordings, but they would not show"
            f" {', '.join([a.description, *(n for n in names if n != a.description)][:NAMED])}"
            f"{' or more' if len(silent) > NAMED else ''}.",
            _pair(search, a),
        )
        for a in silent
    ]


def _pair(search: Search, amount: DetectableSize) -> tuple[Fit, Fit]:
    base = search.parameters
    return _with(search.problem, base, amount), base


def _with(problem: Problem, base: Fit, amount: DetectableSize) -> Fit:
    """The machine of a fit with an effect of the size that matters: what the fit cannot exclude."""
    law = amount.law
    own = problem.start(Hypothesis(laws=(law,)))[len(problem.nominals) :]
    return replace(
        base, hypothesis=Hypothesis(laws=(law,)), x=np.concatenate([base.x, own]), hessian=None,
        per_recording=(), gradients=(),
    )  # fmt: skip


def _unconfirmed(search: Search, best: Fit) -> list[tuple[str, tuple[Fit, Fit]]]:
    """The questions of a search whose effect one recording alone shows, the nearest rival first."""
    if len(search.problem.fitted) > 1:
        return []
    mine = set(best.hypothesis.effects)
    near = [
        rival for rival in search.ranked()
        if set(rival.hypothesis.effects) != mine
        and len(rival.hypothesis.effects) <= len(mine)
        and np.sqrt(rival.msni[0]) < DECIDES
    ]  # fmt: skip
    return [
        (
            f"Likely {' and '.join(best.hypothesis.effects)}, but one recording alone shows it, and"
            f" there {_called(rival)} leaves no more than {np.sqrt(rival.msni[0]):.1f} times the"
            " noise: another one has to confirm it.",
            (best, rival),
        )
        for rival, error in zip(near, distance_errors(search, best, near), strict=True)
        if search.behind(best, rival) < DECIDES * error
    ]


def _called(fit: Fit) -> str:
    return " and ".join(fit.hypothesis.effects) or "the model without it"
