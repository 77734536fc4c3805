"""What candidates that were screened, but not fitted, would reach at best."""

from collections.abc import Sequence

import numpy as np

from rsea_core.identify.fitting.least_squares import Fit
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.selection.criteria import Search
from rsea_core.identify.selection.screening import Candidate


def record_predictions(search: Search, base: Fit, found: Sequence[Candidate]) -> None:
    """Remember what a screening of a fit predicts of each effect, the best law of each."""
    for candidate in found:
        fit = _predicted_fit(search, base, candidate)
        key = frozenset(fit.hypothesis.effects)
        known = search.predicted.get(key)
        if known is None or search.score(fit) > search.score(known):
            search.predicted[key] = fit


def _predicted_fit(search: Search, base: Fit, c: Candidate) -> Fit:
    """A candidate at its linear solution; at none of it where that predicts a loss."""
    problem = search.problem
    n = len(problem.nominals)
    hypothesis = Hypothesis(laws=(*base.hypothesis.laws, c.law))
    own = problem.start(Hypothesis(laws=(c.law,)), [c.law.scaled(c.start, c.size)])[n:]
    x = np.concatenate([base.x + c.shift, own])
    centre, weight = problem.prior(hypothesis)
    cost = 0.5 * float(np.sum((weight * (x - centre)) ** 2))
    msni = base.msni * c.kept
    gain = search.likelihood(msni) - cost - search.likelihood(base.msni) + base.prior_cost
    if not gain > 0.0:
        x, cost, msni = np.concatenate([base.x, own]), base.prior_cost, base.msni
    return Fit(hypothesis=hypothesis, x=x, cost=np.inf, prior_cost=cost, msni=msni)
