"""Laws taken first that the laws taken later explain: backward elimination.

A search that adds one law after the other takes what is nearest to several first (Draper & Smith,
Applied Regression Analysis, 1998, chapter 15: stepwise regression takes terms out again).
"""

from dataclasses import replace

import numpy as np

from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.candidate_fits import (
    confirmed,
    count_values,
    gain_of,
    settled,
)
from rsea_core.identify.multistep.criteria import KEPT_RATIO, LEAST_GAIN, PER_VALUE
from rsea_core.identify.multistep.estimator import Estimate, Estimator


def pruned(found, say) -> bool:
    """Take out laws that the later ones make needless; whether there was one.

    Parameters
    ----------
    found : search.Found
        Changed in place.
    """
    count = len(found.steps)
    for step in found.steps[:-1]:
        own, fit = _without(found, step.law)
        price = PER_VALUE * count_values(step.law)
        lost = gain_of(found.estimator, fit, found.best) - price
        say(f"  without {step.law.key}: loses {lost:.1f}")
        if lost < LEAST_GAIN:
            found.steps = [s for s in found.steps if s is not step]
            found.estimator, found.best = own, fit
    if len(found.steps) == 1 < count:
        found.steps = [_alone(found, found.steps[0])]
    return len(found.steps) < count


def without_weak_end(found) -> None:
    """Remove last laws that gain unevenly; the first of them is kept as refused.

    A single law stays if it also explains most of the errors of whole recordings, where no unknown
    torque compensates for it: windows may show a delayed reading only where a motion begins.
    """
    while found.steps and found.steps[-1].law.only is None and found.steps[-1].ratio < KEPT_RATIO:
        if found.confirms_whole_runs:
            break
        own, fit = _without(found, found.steps[-1].law)
        found.estimator, found.best = own, fit
        found.refused, found.steps = found.steps[-1], found.steps[:-1]


def _without(found, law) -> tuple[Estimator, Estimate]:
    """The fit with one law less."""
    estimator, h = found.estimator, found.best.hypothesis
    begin = len(estimator.problem.nominals)
    kept, keep = [], [True] * begin
    for other in h.laws:
        stays = other is not law
        kept += [other] if stays else []
        keep += [stays] * count_values(other)
    less = Hypothesis(laws=tuple(kept))
    fit = estimator.fit(less, found.best.x[np.array(keep)], iterations=8)
    return settled(estimator, fit, once=True)


def _alone(found, step):
    """A step whose law alone is left, judged against parameters."""
    own, base, fit = found.estimator, found.base, found.best
    gain = gain_of(own, base, fit) - PER_VALUE * count_values(step.law)
    ratio = step.ratio if step.law.only is not None else confirmed(own, base, fit)
    return replace(step, gain=gain, ratio=ratio, tempering=own.tempering)
