"""Laws of whole recordings, complete or nearly so, as the result of a search."""

from dataclasses import replace

import numpy as np

from rsea_core.identify.law_search.candidate_fits import count_values, far_from_rig
from rsea_core.identify.law_search.found import Found, Step
from rsea_core.identify.multistep.criteria import (
    EXPLAINED,
    EXPLAINED_TOGETHER,
    LEFT_OF_EACH,
    PER_VALUE,
    RICHER_GAIN,
)
from rsea_core.identify.multistep.estimator import Estimate, Estimator, independent_share
from rsea_core.identify.whole_runs.search import WholeSearch, worth
from rsea_core.identify.whole_runs.sensor_noise import converged, excess, misfit
from rsea_core.identify.whole_runs.taken_laws import Trial, best_of_each_effect
from rsea_core.identify.whole_runs.unseen import needed, unseen_share, without


def nearly_complete(found: Found, search: WholeSearch, say) -> Found | None:
    """Laws, or one alone, that explain most of what parameters leave, of rows unseen too."""
    own, plain = search.own, search.plain
    excess_before = excess(own, plain.hypothesis, plain.x)
    if excess_before == 0.0:  # one reading is not predicted, and others better than their noise
        return None
    together = _nearly_complete_together(found, search, excess_before, say)
    if together is not None:
        return together
    for trial in _alone(search):
        if trial.law.only is not None:
            continue  # a torque that acts once can fit the error of a law that is not known
        explained = 1.0 - excess(own, trial.fit.hypothesis, trial.fit.x) / excess_before
        if explained < EXPLAINED:
            continue
        predicts, ratio = needed(own, trial.fit, trial.law, plain)
        unseen = unseen_share(found, own, trial.fit, plain, say) if predicts else np.inf
        explained = min(explained, 1.0 - unseen)
        if explained > EXPLAINED:
            name = trial.law.key
            say(f"  whole recordings: {name} explains {explained:.2f} of what parameters leave")
            return _by_one_law(found, search, trial, ratio, explained)
    return None


def _nearly_complete_together(
    found: Found, search: WholeSearch, excess_before: float, say
) -> Found | None:
    """All laws taken, if they leave little and each explains most of what the others leave.

    What is left may be an error of the log that no law describes, as of uneven time stamps.
    """
    if not _leaves_little(search, excess_before):
        return None
    search.refine(say)
    search.compare(say)
    search.predict(say)
    if not _leaves_little(search, excess_before):
        return None
    own, left = search.own, search.excess()
    for law in search.taken:
        less = without(own, search.fit, law)
        if left > (1.0 - EXPLAINED) * excess(own, less.hypothesis, less.x):
            say(f"  whole recordings: {law.key} explains little of what the others leave")
            return None
    unseen = unseen_share(found, own, search.fit, search.plain, say)
    explained = 1.0 - max(left / excess_before, unseen)
    if explained < EXPLAINED:
        return None
    say(f"  whole recordings: together laws explain {explained:.3f} of what parameters leave")
    return replace(complete_by(found, search), explained=explained)


def _leaves_little(search: WholeSearch, excess_before: float) -> bool:
    """Whether several lasting laws leave a small share of what parameters leave."""
    lasting = all(law.only is None for law in search.taken)
    several = len(search.taken) > 1
    return several and lasting and search.excess() < (1.0 - EXPLAINED_TOGETHER) * excess_before


def _alone(search: WholeSearch) -> list[Trial]:
    """Trials of single laws: the one that made all others redundant, then those of the first round.

    A fit that began together with another law can reach a minimum that a direct fit misses.
    """
    if len(search.taken) != 1:
        return search.first
    law = search.taken[0]
    mine = next(t for t in search.rivals[law.key] if t.law is law)
    gain = search.plain.cost - search.fit.cost - PER_VALUE * count_values(law)
    mine = replace(mine, fit=search.fit, gain=gain, left=search.left())
    return [mine, *(t for t in search.first if t.law is not law)]


def first_law(found: Found, search: WholeSearch) -> Found | None:
    """The first law alone, if it explains most of what parameters leave of the rows fitted.

    Rows unseen may not confirm it: without a restoring torque, a random torque causes errors there
    that are as large as those of parameters alone.
    """
    for trial in search.first[:1]:
        left = excess(search.own, trial.fit.hypothesis, trial.fit.x)
        explained = 1.0 - left / max(found.excess, 1.0)
        if trial.law.only is None and explained > EXPLAINED:
            _, ratio = needed(search.own, trial.fit, trial.law, search.plain)
            return _by_one_law(found, search, trial, ratio, explained)
    return None


def _by_one_law(
    found: Found, search: WholeSearch, trial: Trial, ratio: float, explained: float
) -> Found:
    """One trial, with its law alone, as the result of a search."""
    search.fit, search.taken = trial.fit, [trial.law]
    search.rivals, search.ratios = {trial.law.key: search.first}, {trial.law.key: ratio}
    return replace(complete_by(found, search), explained=explained)


def complete_by(found: Found, search: WholeSearch) -> Found:
    """The search's laws as what was found."""
    own, fit = in_own_share(search.own, search.fit)
    steps = []
    for law in [w for w in fit.hypothesis.laws if any(w is other for other in search.taken)]:
        alone = len(search.taken) == 1
        less = search.plain if alone else without(search.own, search.fit, law)
        gain = less.cost - search.fit.cost - PER_VALUE * count_values(law)
        trials = best_of_each_effect(search.rivals[law.key])
        rivals = [t for t in trials if t.law is not law]
        mine = gain - RICHER_GAIN * count_values(law)
        mine = next((worth(t) for t in search.rivals[law.key] if t.law is law), mine)
        steps.append(
            Step(law=law, screened=gain, gain=gain, ratio=search.ratios[law.key],
                 tempering=own.tempering, doubt=search.doubt(),
                 rivals=tuple((t.law, gain + worth(t) - mine) for t in rivals))
        )  # fmt: skip
    return replace(
        found, estimator=own, best=fit, steps=steps, horizon=None, base_shapes=[], shapes=[],
        refused=None, complete=True,
    )  # fmt: skip


def in_own_share(own: Estimator, fit: Estimate) -> tuple[Estimator, Estimate]:
    """A fit of whole recordings in its own share of independent innovations."""
    own = own.having(own.tracks)
    own.tempering = independent_share(own, fit.hypothesis, fit.x)
    return own, own.fit(fit.hypothesis, fit.x, iterations=4)


def closer_to_rig(
    found: Found, own: Estimator, fit: Estimate, say
) -> tuple[Found, Estimate, float]:
    """The laws of windows with values of whole recordings, if these are nearer to the rig file's.

    Parameters alone can take the place of a delay, and its fit begins with their values. In windows
    an unknown torque compensates for these.

    Returns
    -------
    Found
    Estimate and float
        The fit of whole recordings, and its misfit.
    """
    h = fit.hypothesis
    count = len(h.laws) - len(found.steps)
    starts = [law.starts[0] for law in h.laws[:count]]
    x = own.problem.start(h, starts)
    laws = sum(map(count_values, h.laws[count:]))
    x[x.size - laws :] = fit.x[x.size - laws :]
    best = min(fit, converged(own, h, x), key=lambda f: f.cost)
    left, of_windows = misfit(own, h, best.x), misfit(own, h, found.best.x)
    if far_from_rig(own.problem, best.x) or not left < LEFT_OF_EACH * of_windows:
        return found, fit, misfit(own, h, fit.x)
    say(f"whole recordings: the same laws with values nearer to the rig file's leave {left:.2f}")
    own, taken = in_own_share(own, best)
    return replace(found, estimator=own, best=taken, horizon=None), best, left
