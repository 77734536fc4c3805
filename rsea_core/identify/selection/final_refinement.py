"""The last fit of a diagnosis where the laws, not the sensors, decide what is left.

Innovations weigh errors as noise would make them: right down at the noise, wrong where a law is
only nearly right, because then its slow errors, which no sensor makes, count next to nothing and
nominal values are spent on the fast ones. Real machines always leave more than their sensors'
noise. There the values (not the choice of laws) are fitted once more to windows that start from
smoothed states, with the free run together with them: what a prediction is asked for.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RecordingError
from rsea_core.identify.fitting.cross_validation import fit_windows, windowed
from rsea_core.identify.fitting.jacobian import free_factors, jacobian_at, moved_along
from rsea_core.identify.fitting.least_squares import Fit, Fitter
from rsea_core.identify.fitting.problem import (
    Hypothesis,
    PreparedRecording,
    Problem,
    predict_readings,
)
from rsea_core.identify.fitting.window_predictions import WINDOW_s
from rsea_core.identify.selection.criteria import (
    FREE_RUN_WORSE,
    NOISE_MSNI,
    ROUGH_MSNI,
    Search,
    tempering_of,
)

SHARE = 0.2  # longest window, of the shortest recording
FEWEST_ROWS = 50  # of a window
REFINEMENTS, SHARES = 3, (0.1, 0.3, 0.6, 1.0)  # steps at a fit's end, and how much of each is tried
WORTH_A_STEP = 0.5  # tempered log-likelihood units


def window_for(problem: Problem) -> float:
    """Length of the windows that suit the identification recordings [s]."""
    shortest = min(float(np.ptp(b.recording.time_s)) for b in problem.fitted)
    row = max(b.recording.sample_time_s for b in problem.fitted)
    return max(min(WINDOW_s, SHARE * shortest), FEWEST_ROWS * row)


def window_refinement(search: Search) -> Fit:
    """The chosen fit with values that predict windows and free runs, where laws leave the most.

    MSNI, prior cost and score stay those of the choice. A refinement that predicts the free runs
    of the identification recordings worse than before is thrown away.
    """
    fit = search.best or search.parameters
    msni = fit.msni
    if not np.all(np.isfinite(msni)) or float(np.median(msni)) < ROUGH_MSNI:
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
    return replace(fit, x=restore_prior(search.fitter, replace(fit, x=found.x)).x)


def final_refinement(fitter: Fitter, fit: Fit) -> Fit:
    """The fit after Gauss-Newton steps with derivatives taken twice.

    A ring-down knows (K + m g d) / J to a millionth: along the valley that it leaves, columns of
    plain differences do not cancel, and a fit ends where it first meets the valley instead of
    where priors and other recordings want it.
    """
    problem = fitter.problem
    centre, weight = problem.prior(fit.hypothesis)
    low, high = problem.bounds(fit.hypothesis)
    share = tempering_of(fit.msni)

    def judged(costs: NDArray, X: NDArray) -> NDArray:
        priors = 0.5 * np.sum((weight * (X - centre)) ** 2, axis=1)
        return share * (costs - priors) + priors

    for _ in range(REFINEMENTS):
        derivatives = jacobian_at(fitter, fit)
        hessian, gradient = np.diag(weight**2 + 1e-9), weight**2 * (fit.x - centre)
        for e, w, J in zip(
            derivatives.innovations, derivatives.weights, derivatives.columns, strict=True
        ):
            Jw = share * J * w
            hessian = hessian + np.einsum("itc,jtc->ij", Jw, J, optimize=True)
            gradient = gradient + np.einsum("itc,tc->i", Jw, e)
        step = -np.linalg.lstsq(hessian, gradient, rcond=None)[0]
        X = np.clip(fit.x + np.outer((0.0, *SHARES), step), low, high)
        costs, msnis, _ = fitter.evaluate(fit.hypothesis, X)
        found = judged(costs, X)
        best = int(np.argmin(found))
        if not found[0] - found[best] > WORTH_A_STEP:
            break
        prior = 0.5 * float(np.sum((weight * (X[best] - centre)) ** 2))
        fit = replace(
            fit, x=X[best], cost=float(costs[best]), msni=msnis[best], prior_cost=prior
        )  # fmt: skip
    return fit


def restore_prior(fitter: Fitter, fit: Fit) -> Fit:
    """The fit moved along what readings hardly show to where the stated tolerances want it.

    Errors of derivatives have pulled values along the common factor of volts, resistance,
    inductance and back-EMF (or of all torques, where nothing weighs them), at a price in prior
    cost that nothing paid for. No prediction changes (next to none where a winding warms: the
    step is then taken only if the cost falls).

    Parameters
    ----------
    fitter : Fitter
    fit : Fit

    Returns
    -------
    Fit
        The same where a reading does show the factor.
    """
    directions = free_factors(fitter, fit)
    moved = _restore_along(fitter, fit, directions)
    if moved is fit and len(directions) > 1:
        for direction in directions:
            moved = _restore_along(fitter, moved, [direction])
    return moved


def _restore_along(fitter: Fitter, fit: Fit, directions: Sequence[NDArray]) -> Fit:
    """The fit where along all ways at once, which may share constants, the priors cost least."""
    if not directions:
        return fit
    problem = fitter.problem
    centre, weight = problem.prior(fit.hypothesis)
    low, high = problem.bounds(fit.hypothesis)
    weighted = np.array(directions) * weight**2
    times = -np.linalg.lstsq(
        weighted @ np.array(directions).T, weighted @ (fit.x - centre), rcond=None
    )[0]
    moved = fit
    for direction, length in zip(directions, times, strict=True):
        moved = replace(moved, x=moved_along(problem, moved, direction, float(length)))
    x = moved.x
    if np.any((x < low) | (x > high)):
        return fit
    costs, msnis, _ = fitter.evaluate(fit.hypothesis, np.array([fit.x, x]))
    priors = 0.5 * np.sum((weight * (np.array([fit.x, x]) - centre)) ** 2, axis=1)
    share = tempering_of(fit.msni)
    if not share * (costs[1] - costs[0]) + (1.0 - share) * (priors[1] - priors[0]) < 0.0:
        return fit
    return replace(fit, x=x, cost=float(costs[1]), msni=msnis[1], prior_cost=float(priors[1]))


def worsens_free_runs(search: Search, fit: Fit) -> bool:
    """Whether effects make free runs worse than parameters alone do.

    Innovations forgive slow errors as the bridge's; a law that is not the machine's can spend
    that on fast ones, and then its free runs leave the recordings that it was fitted to. Not asked
    where all that is left is noise: slow errors beyond the bridge's would show there, and which of
    two fits has the smaller ones within them is chance. A scale that takes the place of constants
    leaves free runs as they are.
    """
    if not fit.hypothesis.laws or np.all(fit.msni < NOISE_MSNI):
        return False
    return has_smaller_free_run_errors(search.problem, search.parameters, fit, by=FREE_RUN_WORSE)


def has_smaller_free_run_errors(
    problem: Problem, one: Fit, other: Fit, *, without: str = "", by: float = 0.0
) -> bool:
    """Whether free runs of the fitted recordings come out better by one fit than by another.

    Parameters
    ----------
    by : float
        Share that they must come out better by.
    """
    errors = [
        free_run_errors(problem, fit.hypothesis, fit.x, problem.fitted, without=without)
        for fit in (one, other)
    ]
    if errors[0].size == 0:  # the one reading there is is left out
        return False
    return bool(np.mean(np.log(errors[0] / errors[1])) < -by)


def free_run_errors(
    problem: Problem,
    hypothesis: Hypothesis,
    x: NDArray,
    recordings: Sequence[PreparedRecording],
    *,
    without: str = "",
) -> NDArray:
    """Root mean square errors of every channel that moves, over the channels' deviations.

    The sensor's noise is in them: what it hides is no error.

    Parameters
    ----------
    without : str
        A column that is left out.
    """
    found = []
    for prepared in recordings:
        machine = problem.trial_machine(prepared, hypothesis, x)
        y = predict_readings(prepared.replay, [machine], prepared.channels, prepared.where)[0]
        floors = np.array([prepared.floors[name] for name in prepared.channels])
        rms = np.sqrt(np.mean((y - prepared.measured) ** 2, axis=0) + floors**2)
        spread = np.std(prepared.measured, axis=0)
        used = (spread > 0.0) & np.array([name != without for name in prepared.channels])
        found.append(rms[used] / spread[used])
    return np.concatenate(found)
