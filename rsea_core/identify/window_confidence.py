"""Probability that a law of the multistep search is there (docs/diagnosis-search.md 10.6)."""

import numpy as np

from rsea_core.identify.candidates.catalogue import of_one_body, rivals_of
from rsea_core.identify.law_search.candidate_fits import far_from_rig
from rsea_core.identify.law_search.found import Found, Step
from rsea_core.identify.law_search.hold_out import HeldOut
from rsea_core.identify.multistep.criteria import (
    FURTHER,
    FURTHER_RATIO_AT,
    FURTHER_RATIO_SCALE,
    GAIN_AT,
    GAIN_SCALE,
    HIGHEST,
    INDEPENDENT,
    LEAST_INDEPENDENT,
    NO_PREDICTION,
    PREDICTION,
    RATIO_AT,
    RATIO_SCALE,
    RIVAL_SCALE,
    RIVAL_SHARE,
    UNCLAIMED,
)
from rsea_core.identify.multistep.horizons import relative_error
from rsea_core.machine.rig import Rig


def step_confidence(found: Found, number: int, unseen: HeldOut | None) -> float:
    """Probability that a step's effect is there: that something is, and which of its rivals."""
    which = _among_rivals(found.steps[number], found.problem.case.rig)
    return float(min(HIGHEST, which * step_presence(found, number, unseen)))


def step_presence(found: Found, number: int, unseen: HeldOut | None) -> float:
    """Probability that a step's effect or one of its rivals is there.

    Parameters
    ----------
    number : int
        Of the step, from 0.
    unseen : HeldOut or None
        What all laws gain on rows held out; None where there are none.
    """
    if found.complete:  # little but the sensors' noise is left of whole recordings
        return found.explained
    step, ratio = found.steps[number], found.steps[number].ratio
    if number == 0 and unseen is not None:  # evidence of its own: the rows are others
        ratio = float(np.hypot(ratio, max(unseen.ratio, 0.0)))
    if number or not makes_predictable(found):  # what a law leaves dependent is not it
        ratio *= min(1.0, max(step.tempering, LEAST_INDEPENDENT) / INDEPENDENT)
    seen = 1.0 - np.exp(-max(ratio - RATIO_AT, 0.0) / RATIO_SCALE)
    seen *= _above(step.gain, GAIN_AT, GAIN_SCALE)
    if unseen is not None and unseen.gain <= 0.0:
        seen = min(seen, UNCLAIMED)  # no better than parameters where it was not fitted
    later = FURTHER[min(number, len(FURTHER) - 1)]
    if number:  # what a first law is not quite has names too, but scatters between stretches
        later *= _above(ratio, FURTHER_RATIO_AT, FURTHER_RATIO_SCALE)
    return float(seen * later)


def makes_predictable(found: Found) -> bool:
    """Whether laws predict, in the same windows, what parameters alone do not at all.

    No value that the rig file states may have moved far for it.
    """
    own, base, best = found.estimator, found.base, found.best
    if far_from_rig(found.problem, best.x):
        return False
    before = relative_error(own, base.hypothesis, base.x)
    return before > NO_PREDICTION and relative_error(own, best.hypothesis, best.x) < PREDICTION


def _among_rivals(step: Step, rig: Rig) -> float:
    """Probability of the step's effect, if it or a rival is there."""
    scale = RIVAL_SCALE + RIVAL_SHARE * step.gain if step.doubt is None else step.doubt
    own = step.law.effect  # in another reading it is the same effect elsewhere
    others = rivals_of(step.law, step.rivals)
    odds = [
        np.exp(min((gain - step.gain) / scale, 0.0)) for law, gain in others
        if law.effect != own and gain > 0.0
        and not {law.effect, step.law.effect} <= of_one_body(rig)
    ]  # fmt: skip
    return 1.0 / (1.0 + sum(odds))


def _above(value: float, middle: float, scale: float) -> float:
    """Logistic function: 0.5 in the middle."""
    return float(1.0 / (1.0 + np.exp(np.clip((middle - value) / scale, -50.0, 50.0))))
