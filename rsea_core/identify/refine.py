"""The last fit of a diagnosis where the laws, not the sensors, decide what is left.

Innovations weigh errors as noise would make them: right down at the noise, wrong where a law is
only nearly right, because then its slow errors, which no sensor makes, count next to nothing and
nominal values are spent on the fast ones. Real machines always leave more than their sensors'
noise. There the values (not the choice of laws) are fitted once more to windows that start from
smoothed states, with the free run beside them: what a prediction is asked for.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RecordingError
from rsea_core.identify.fit import Fit, Fitter
from rsea_core.identify.problem import Bench, Hypothesis, Problem, predict_drafts
from rsea_core.identify.search_state import Search, tempering_of
from rsea_core.identify.slopes import slopes_at
from rsea_core.identify.windows import WINDOW_s, fit_windows, windowed

ROUGH = 25.0  # innovation power: errors five times the noise are the law's own
SHARE = 0.2  # longest window, of the shortest recording
FEWEST_ROWS = 50  # of a window
ROUNDS = 3  # of steps to the end of a fit
SHARES = (1.0, 0.5, 0.25, 0.1)  # of a step that are tried
LITTLE = 0.02  # nats below which a step is none


def window_for(problem: Problem) -> float:
    """Length of the windows that suit the identification recordings [s]."""
    shortest = min(float(np.ptp(b.recording.time_s)) for b in problem.fitted)
    row = max(b.recording.sample_time_s for b in problem.fitted)
    return max(min(WINDOW_s, SHARE * shortest), FEWEST_ROWS * row)


def refined(search: Search) -> Fit:
    """The chosen fit with values that predict windows and free runs, where laws leave the most.

    Power, prior cost and score stay those of the choice. A refinement that predicts the free runs
    of the identification recordings worse than before is thrown away.
    """
    fit = search.best or search.parameters
    power = fit.power
    if not np.all(np.isfinite(power)) or float(np.median(power)) < ROUGH:
        return fit
    problem = search.problem
    try:
        windows = windowed(problem, window_for(problem))
    except RecordingError:
        return fit
    found = fit_windows(windows, fit.hypothesis, fit.x)
    found = fit_windows(windows, fit.hypothesis, found.x, with_free_run=True)
    before = free_run_errors(problem, fit.hypothesis, fit.x, problem.fitted)
    after = free_run_errors(problem, fit.hypothesis, found.x, problem.fitted)
    if not np.all(np.isfinite(after)) or np.mean(np.log(after / before)) > 0.0:
        return fit
    return replace(fit, x=found.x)


def arrived(fitter: Fitter, fit: Fit) -> Fit:
    """The fit run to its end along what differences of single columns do not see.

    Where no reading tells (a common factor of volts, resistance, inductance and back-EMF), errors
    of the columns have pulled the values away from the owner's, at a price in prior cost that
    nothing paid for. Steps are taken only where they lower the cost.
    """
    problem = fitter.problem
    centre, weight = problem.prior(fit.hypothesis)
    low, high = problem.bounds(fit.hypothesis)
    for _ in range(ROUNDS):
        if not np.all(np.isfinite(fit.power)):
            return fit
        share = tempering_of(fit.power)
        found = slopes_at(fitter, fit)
        hessian = np.diag(weight**2 + 1e-9)
        pull = weight**2 * (fit.x - centre)
        for e, w, J in zip(found.innovations, found.weights, found.columns, strict=True):
            hessian = hessian + share * np.einsum("itc,tc,jtc->ij", J, w, J, optimize=True)
            pull = pull + share * np.einsum("itc,tc->i", J, w * e, optimize=True)
        way = -np.linalg.solve(hessian, pull)
        X = np.clip(fit.x + np.outer([0.0, *SHARES], way), low, high)
        costs, powers, _ = fitter.evaluate(fit.hypothesis, X)
        priors = 0.5 * np.sum((weight * (X - centre)) ** 2, axis=1)
        costs = share * (costs - priors) + priors
        best = int(np.argmin(costs))
        if not costs[best] < costs[0] - LITTLE:
            return fit
        fit = replace(
            fit, x=X[best], power=powers[best], prior_cost=float(priors[best]),
            cost=float((costs[best] - priors[best]) / share + priors[best]),
        )  # fmt: skip
    return fit


def free_run_errors(
    problem: Problem, hypothesis: Hypothesis, x: NDArray, benches: Sequence[Bench]
) -> NDArray:
    """Root mean square errors of every channel of recordings, over the channels' deviations."""
    found = []
    for bench in benches:
        draft = problem.draft(bench, hypothesis, x)
        y = predict_drafts(bench.replay, [draft], bench.channels, bench.where)[0]
        rms = np.sqrt(np.mean((y - bench.measured) ** 2, axis=0))
        found.append(rms / np.maximum(np.std(bench.measured, axis=0), 1e-12))
    return np.concatenate(found)
