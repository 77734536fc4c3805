"""Longer windows once a law is in, near rivals ranked again there; shorter ones if in doubt.

A machine that is predictable for a short time without its law tells rivals apart in short windows
only; with the law it may be predictable to the end of the recordings.

Near the longest horizon at which a machine is predictable, predictions are far from what is
measured: a law over the angle acts at the wrong angle there, and the unknown torques that such
errors show absorb what a law would explain. A second search in shorter windows can find it.
"""

from dataclasses import replace

import numpy as np

from rsea_core.identify.law_search.candidate_fits import (
    at_bound,
    count_values,
    gain_of,
    settled,
)
from rsea_core.identify.law_search.found import Entry, Found, Step
from rsea_core.identify.law_search.hold_out import HeldOut
from rsea_core.identify.multistep.coloured_noise import with_coloured_readings
from rsea_core.identify.multistep.criteria import (
    CLOSER,
    DOUBTED_ERROR,
    HORIZONS,
    KEPT_RATIO,
    LOST,
    NO_PREDICTION,
    NOT_BEYOND,
    PER_VALUE,
    RIVAL_SCALE,
)
from rsea_core.identify.multistep.estimator import (
    Estimate,
    Estimator,
    independent_share,
    initial_estimator,
)
from rsea_core.identify.multistep.horizons import (
    likelier,
    long_enough,
    relative_error,
    smooth,
    with_noise,
    with_output_error,
    with_windows,
)
from rsea_core.identify.multistep.noise_estimate import NOISE_STEPS
from rsea_core.identify.multistep.tracks import from_rest, prepared

OUTPUT_ROUNDS = 2


def lengthened(found: Found, say, *, quick: bool = False) -> None:
    """Take longer windows as far as the machine with its laws is predictable."""
    before = found.horizon
    if not quick:
        _brought_near(found, say)
    lengthen(found, say, quick=quick)
    if found.horizon != before and not quick:
        _rank_again(found, say)


def lengthen(found: Found, say, *, quick: bool = False) -> None:
    """Longer windows, as long as the laws predict these in the noise that they leave."""
    while found.horizon is not None:
        at = HORIZONS.index(found.horizon)
        trial = found.estimator.having(with_windows(found.estimator, HORIZONS[at + 1]))
        h = found.best.hypothesis
        fit = trial.fit(h, found.best.x, iterations=5)
        error = relative_error(trial, h, fit.x)
        say(f"with laws over {HORIZONS[at + 1] or 'all'} T: error {error:.3g} of the spread")
        if found.lost == LOST < error and not quick:  # shorter windows end where they err by more
            trial, fit = _by_output_error(trial, fit, found)
            error = relative_error(trial, h, fit.x)
            say(f"  from output errors: {error:.3g}")
        if error > found.lost:
            break
        smooth(trial, h, fit.x)
        trial = with_noise(trial.having([prepared(t) for t in trial.tracks]), h, fit.x)
        own, best = settled(trial, trial.fit(h, fit.x, iterations=4), once=quick)
        error = relative_error(own, h, best.x)
        if error > NO_PREDICTION:  # in its own noise unknown torques explain what values did
            say(f"  settled in its own noise: {error:.3g}; the shorter windows are kept")
            break
        found.estimator, found.best = own, best
        found.horizon = HORIZONS[at + 1]


def _brought_near(found: Found, say) -> None:
    """A fit that predicts its own windows badly, fitted once more from output errors.

    Where nothing pulls the machine back, unknown torques hide a constant that is a little wrong.
    """
    error = relative_error(found.estimator, found.best.hypothesis, found.best.x)
    if not error > LOST:
        return
    resting = found.estimator.having([from_rest(t) for t in found.estimator.tracks])
    for trial in (found.estimator, resting):
        own, fit = _by_output_error(trial, found.best, found)
        own, fit = settled(own, fit, once=True)
        after = relative_error(own, fit.hypothesis, fit.x)
        say(f"  error {error:.3g} of the spread; from output errors: {after:.3g}")
        if after < error:
            found.estimator, found.best = likelier((found.estimator, found.best), (own, fit))
            error = relative_error(found.estimator, found.best.hypothesis, found.best.x)


def _by_output_error(trial: Estimator, fit: Estimate, found: Found) -> tuple[Estimator, Estimate]:
    """The fit that predicts the windows best: from its own values, the rig's, parameters alone.

    Unknown torques that were estimated beside wrong values explain what these do over long windows,
    and nothing moves the values any more.
    """
    h, best = fit.hypothesis, (relative_error(trial, fit.hypothesis, fit.x), trial, fit)
    without = found.base.x.size  # laws are last
    starts = [fit.x] + [
        np.concatenate([x[:without], fit.x[without:]])
        for x in (found.problem.start(h), found.base.x)
    ]
    for start in starts:
        output, x = trial, start
        for _ in range(OUTPUT_ROUNDS):  # the noise of the readings is first that of the start
            output = with_output_error(output, h, x)
            x = output.fit(h, x, iterations=8).x
        own = with_noise(trial, h, x, steps=NOISE_STEPS)
        end = own.fit(h, x, iterations=4)
        error = relative_error(own, h, end.x)
        if error < best[0]:
            best = (error, own, end)
    return best[1:]


def error_left_beyond(found: Found) -> float | None:
    """Share of the parameters' error in the next longer windows that the laws leave.

    A law of the machine holds beyond the windows that it was fitted in. None where it made these
    longer, where they hold whole recordings, or where nothing predicts the longer ones.
    """
    if found.horizon is None or found.predicts_longer or not found.steps:
        return None
    longer = HORIZONS[HORIZONS.index(found.horizon) + 1]
    errors = []
    for estimator, fit in ((found.base_estimator, found.base), (found.estimator, found.best)):
        trial = estimator.having(with_windows(estimator, longer))
        h = fit.hypothesis
        errors.append(relative_error(trial, h, trial.fit(h, fit.x, iterations=5).x))
    plain, left = errors
    return left / plain if plain < 1.0 else None


def fails_in_longer_windows(found: Found, unseen: HeldOut | None) -> bool:
    """Whether laws predict no better than parameters alone in longer windows than their own.

    Laws that gain evenly on recordings held out do not fail: the motion may not be predictable for
    so long.
    """
    if found.complete or (unseen is not None and unseen.ratio > KEPT_RATIO):
        return False
    return (error_left_beyond(found) or 0.0) > NOT_BEYOND


def _rank_again(found: Found, say) -> None:
    """The last law and its near rivals, compared in the windows that they now allow."""
    step, leads = found.steps[-1], {}
    best: Entry | None = None
    for c, _, fit in step.near:
        own, again = settled(
            found.estimator, found.estimator.fit(fit.hypothesis, fit.x, iterations=8), once=True
        )
        share = min(own.tempering, found.estimator.tempering)
        price = PER_VALUE * (count_values(c.law) - count_values(step.law))
        lead = gain_of(own, found.best, again, share) - price
        say(f"  {c.law.key}: {lead:.1f} over {step.law.key} in longer windows")
        leads[c.law.key] = lead
        if lead > max([RIVAL_SCALE, *(leads[k] for k in leads if k != c.law.key)]):
            best = None if at_bound(own.problem, again, c.law) else (c, own, again)
    rivals = [
        (law, step.gain + min(leads[law.key], 0.0) if law.key in leads else gain)
        for law, gain in step.rivals
    ]
    found.steps[-1] = replace(step, rivals=tuple(rivals))
    if best is not None:
        _take(found, step, best, leads, rivals)


def _take(found: Found, step: Step, entry: Entry, leads: dict, rivals: list) -> None:
    """The rival in the place of the last law, which becomes its rival."""
    c, found.estimator, found.best = entry
    lead = leads[c.law.key]
    others = [
        (law, step.gain + min(leads[law.key] - lead, 0.0) if law.key in leads else gain)
        for law, gain in rivals if law is not c.law
    ]  # fmt: skip
    found.steps[-1] = replace(
        step, law=c.law, rivals=((step.law, step.gain - lead), *others),
        tempering=found.estimator.tempering,
    )  # fmt: skip


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
