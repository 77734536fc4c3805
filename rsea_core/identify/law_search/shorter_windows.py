"""A second search in shorter windows, which parameters alone predict closely.

Near the longest horizon at which a machine is predictable, predictions are far from what is
measured: a law over the angle acts at the wrong angle there, and the unknown torques that such
errors show absorb what a law would explain. With a law found in shorter windows the machine may
be predictable for longer (`longer_windows`).
"""

from rsea_core.identify.law_search.candidate_fits import settled
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.multistep.coloured_noise import with_coloured_readings
from rsea_core.identify.multistep.criteria import CLOSER, DOUBTED_ERROR, HORIZONS
from rsea_core.identify.multistep.estimator import independent_share, initial_estimator
from rsea_core.identify.multistep.horizons import (
    long_enough,
    relative_error,
    smooth,
    with_noise,
    with_windows,
)
from rsea_core.identify.multistep.noise_estimate import NOISE_STEPS


def in_shorter_windows(found: Found, say) -> Found | None:
    """Parameters alone in the longest windows in which their error is below `DOUBTED_ERROR`.

    None if the error is below it at the horizon already, or in no windows.
    """
    h, x = found.base.hypothesis, found.base.x
    if not relative_error(found.base_estimator, h, x) > DOUBTED_ERROR:
        return None
    begun = initial_estimator(found.problem, [t.zeros for t in found.base_estimator.tracks])
    smooth(begun, h, x)
    for horizon in reversed(HORIZONS[: HORIZONS.index(found.base_horizon)]):
        if not long_enough(begun, horizon):
            return None
        own = begun.having(with_windows(begun, horizon))
        fit = own.fit(h, x, iterations=5)
        own = with_noise(own, h, fit.x, steps=NOISE_STEPS)
        fit = own.fit(h, fit.x, iterations=5)
        error = relative_error(own, h, fit.x)
        if error <= DOUBTED_ERROR:
            break
    else:
        return None
    say(f"parameters over {horizon} T again: error {error:.3g} of the spread")
    own = with_coloured_readings(with_noise(own, h, fit.x), h, fit.x, say)
    own.tempering = independent_share(own, h, fit.x)
    own, base = settled(own, own.fit(h, fit.x))
    return Found(problem=found.problem, base_estimator=own, base=base, estimator=own, best=base,
                 horizon=horizon, base_horizon=horizon, lost=DOUBTED_ERROR)  # fmt: skip


def predicts_closer(shorter: Found, found: Found) -> bool:
    """Whether the laws found in shorter windows halve the error of the first search there."""
    trial = found.estimator.having(with_windows(found.estimator, shorter.horizon))
    h = found.best.hypothesis
    error = relative_error(trial, h, trial.fit(h, found.best.x, iterations=5).x)
    own = relative_error(shorter.estimator, shorter.best.hypothesis, shorter.best.x)
    return bool(shorter.steps) and own < CLOSER * error
