"""Laws fitted to the first rows of each recording must predict the rows after them.

On an axis that nothing pulls back, the path that small unlogged torques cause can be followed by a
few flexible laws, as any curve can. Such laws say nothing of the rows that they were not fitted to;
a law of the machine does, by most of what parameters alone leave there (hold-out validation:
Ljung, System Identification (1999), section 16.6).
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.load_disturbance import LoadDisturbance
from rsea_core.effects.variant import Law
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.candidate_fits import count_values, even_ratio
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.law_search.hold_out import of_recordings, with_pause_shown
from rsea_core.identify.multistep.criteria import (
    FITTED_ROWS,
    KEPT_RATIO,
    NEGLIGIBLE_INCREASE,
    SOUND,
    UNPREDICTED,
)
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.multistep.kalman_filter import huber_squares
from rsea_core.identify.multistep.steps import normal_equations
from rsea_core.identify.multistep.tracks import prepared
from rsea_core.identify.whole_runs.sensor_noise import in_sensor_noise, misfit

PREDICTION_STEPS = 3  # of Gauss and Newton, in a prediction


def unseen_share(found: Found, own: Estimator, fit: Estimate, plain: Estimate, say) -> float:
    """Cost beyond noise of rows that a fit was not made of, over that of parameters alone.

    inf if recordings held out cost more than with parameters alone. If the fit adds only a torque
    that acted once, in another recording, they may cost up to `NEGLIGIBLE_INCREASE` times as much.

    Parameters
    ----------
    found : Found
        The search before laws of whole recordings: its case, problem and noise.
    own : Estimator
        Of whole recordings in the sensors' noise.
    plain : Estimate
        Parameters alone.
    """
    before, after = (max(_left_unseen(own, f), 0.0) for f in (plain, fit))
    share = after / before if before > 0.0 else 1.0
    say(f"  whole recordings: of rows unseen {share:.2f} of what parameters leave remains")
    unseen = [b for b in found.problem.prepared if b.recording.role == "validation"]
    added = [law for law in fit.hypothesis.laws if law not in plain.hypothesis.laws]
    if share >= UNPREDICTED or not unseen:
        return share
    once = all(law.effect == LoadDisturbance.effect for law in added)
    like = replace(found, estimator=own, horizon=None)
    rested = with_pause_shown(like, (fit.hypothesis, fit.x), None)
    trials = rested, (plain.hypothesis, plain.x)
    costs = [
        predicted_cost(recordings_held_out(found, own, trial), own, *trial) for trial in trials
    ]
    return share if costs[0] < (NEGLIGIBLE_INCREASE if once else 1.0) * costs[1] else np.inf


def unpredicted_recordings(found: Found) -> list[str]:
    """Files of recordings held out that sufficient parameters do not predict.

    Parameters suffice for what the recordings fitted show; a faster or larger motion may show more.
    """
    if not any(b.recording.role == "validation" for b in found.problem.prepared):
        return []
    own = in_sensor_noise(found.base_estimator, found.base)
    plain = own.fit(found.base.hypothesis, found.base.x, iterations=12)
    trial = plain.hypothesis, plain.x
    files, fitted = [], {b.recording.file for b in found.problem.fitted}
    for t in recordings_held_out(found, own, trial).tracks:
        if t.experiment.recording.file in fitted:  # the rest of one: `hold_out.predicts_rest`
            continue
        one, most = own.having([t]), 0.5 * SOUND**2 * t.blocks * len(t.experiment.channels)
        if _cost(one, *trial) > most and predicted_cost(one, own, *trial) > most:
            files.append(t.experiment.recording.file)
    return files


def recordings_held_out(
    found: Found, own: Estimator, trial: tuple[Hypothesis, NDArray]
) -> Estimator:
    """Recordings held out in the sensors' noise, begun as those fitted are.

    The start is smoothed in the noise of windows, unknown torques included: in the sensors' noise
    alone what the smoother's model lacks, as a flexible link, moves the start.
    """
    unseen = [b for b in found.problem.prepared if b.recording.role == "validation"]
    like = replace(found, estimator=found.base_estimator, horizon=None)
    begun = in_sensor_noise(of_recordings(like, unseen, trial, None))
    noises = {t.experiment.channels: t.noise for t in own.tracks}
    same = [noises.get(t.experiment.channels, t.noise) for t in begun.tracks]
    return own.having([prepared(t, noise=n) for t, n in zip(begun.tracks, same, strict=True)])


def needed(own: Estimator, fit: Estimate, law: Law, less: Estimate) -> tuple[bool, float]:
    """Whether a law of a fit predicts unseen rows, evenly; and how evenly it gains.

    Parameters
    ----------
    less : Estimate
        The fit without the law.

    Returns
    -------
    bool
    float
        Gain over its deviation between equal shares of rows; inf for a torque that acts once.
    """
    ratio = np.inf
    if law.effect != LoadDisturbance.effect:
        before, after = (own.innovations([(f.hypothesis, f.x)]) for f in (less, fit))
        ratio = even_ratio(own, before, after)
    return ratio >= KEPT_RATIO and _left_unseen(own, fit) < _left_unseen(own, less), ratio


def without(own: Estimator, fit: Estimate, law: Law) -> Estimate:
    """The fit with one law less."""
    kept = tuple(w for w in fit.hypothesis.laws if w is not law)
    return own.fit(Hypothesis(laws=kept), other_values(own, fit, law), iterations=12)


def other_values(own: Estimator, fit: Estimate, law: Law) -> NDArray:
    """All values of a fit but those of one law."""
    keep = [True] * len(own.problem.nominals)
    for other in fit.hypothesis.laws:
        keep += [other is not law] * count_values(other)
    return fit.x[np.array(keep)]


def _left_unseen(own: Estimator, fit: Estimate) -> float:
    """Cost, beyond that of noise, of rows after the first ones, to which alone the fit is made.

    It begins at the values found in all rows: those that the first rows do not show (a torque that
    acts later) stay as they were, and are not tested.
    """
    first = own.having([replace(t, seen=FITTED_ROWS) for t in own.tracks])
    trial = fit.hypothesis, first.fit(fit.hypothesis, fit.x, iterations=8).x
    rows = zip(own.innovations([trial]), first.innovations([trial]), strict=True)
    return sum(
        0.5 * float(np.sum(huber_squares(every[0][later]) - 1.0))
        for every, seen in rows
        for later in [(seen[0] == 0.0) & (every[0] != 0.0)]
    )


def predicted_cost(unseen: Estimator, own: Estimator, h: Hypothesis, x: NDArray) -> float:
    """Least cost of recordings held out, the values within the uncertainty of their fit.

    On an axis without a restoring torque, a value that is wrong by its standard deviation causes an
    angle error of many times the noise at the end of a recording. The values therefore move. The
    result is the least sum, over the values, of the cost of the recordings held out and of half the
    quadratic form of the fitted rows and the prior about the fit: the negative logarithm of a
    profile predictive likelihood (Bjornstad, Statistical Science 5 (1990) 242). It is not Laplace's
    approximation of a predictive density, which has a determinant too. Without that term a further
    value is not penalised: that it may move can only lower the minimum.

    Parameters
    ----------
    unseen, own : Estimator
        Of recordings held out and of those fitted.
    x : (n,) array
        The fit.
    """
    low, high = own.problem.bounds(h)
    level, columns = own.jacobian(h, x)
    power = max(float(np.mean([np.mean(huber_squares(e)) for e in level])), 1.0)
    _, weight = own.problem.prior(h)
    precision = np.diag(weight**2) + normal_equations(level, columns)[0] / power
    best, cost = x, _cost(unseen, h, x)
    for _ in range(PREDICTION_STEPS):
        A, g = normal_equations(*unseen.jacobian(h, best))
        step = np.linalg.lstsq(A + precision, g + precision @ (best - x), rcond=None)[0]
        trials = [np.clip(best - share * step, low, high) for share in (1.0, 0.3, 0.1)]
        costs = [
            _cost(unseen, h, trial) + 0.5 * float((trial - x) @ precision @ (trial - x))
            for trial in trials
        ]
        least = int(np.argmin(costs))
        if not costs[least] < cost:
            break
        best, cost = trials[least], costs[least]
    return cost


def _cost(own: Estimator, h: Hypothesis, x: NDArray) -> float:
    return sum(0.5 * float(np.sum(huber_squares(e))) for e in own.innovations([(h, x)]))


def without_redundant(
    found: Found, own: Estimator, fit: Estimate, enough: float, say
) -> tuple[Found, Estimate]:
    """The search and its fit of whole recordings, without laws that leave as little if removed."""
    for step in reversed(found.steps):
        less = without(own, fit, step.law)
        if len(found.steps) > 1 and misfit(own, less.hypothesis, less.x) <= enough:
            say(f"  whole recordings: {step.law.key} is redundant")
            fit = less
            best = found.estimator.fit(less.hypothesis, less.x, iterations=8)
            steps = [other for other in found.steps if other is not step]
            found = replace(found, best=best, steps=steps)
    return found, fit
