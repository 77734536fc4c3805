"""A candidate law fitted to its end: start, noise, dependence, and its proof."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.drive_thermal import DriveThermal
from rsea_core.effects.load_unbalance import LoadUnbalance
from rsea_core.effects.sensor_offset import SensorOffset
from rsea_core.effects.variant import Law
from rsea_core.identify.fitting.peak_temperature import MOST_RISE_K, peak_rise_K
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.screening import Candidate
from rsea_core.identify.multistep.criteria import (
    ALONG,
    CLOSE_TO_RIG,
    EVEN,
    EVENT,
    FAR_FROM_RIG,
    FASTEST,
    MOST_FITTED_RISE,
    MOST_OF_ONE,
    MOVES,
    NEAR,
    NEARLY_ABSENT,
    SETTLED,
    SETTLING,
    STRAINED,
    UNCONVERGED,
    WIDER,
    WIDER_TIMES,
)
from rsea_core.identify.multistep.estimator import (
    STRETCHES,
    Estimate,
    Estimator,
    independent_share,
)
from rsea_core.identify.multistep.experiment import STATED_BOUND, MultistepProblem
from rsea_core.identify.multistep.horizons import (
    likelier,
    smooth,
    with_noise,
    with_output_error,
)
from rsea_core.identify.multistep.kalman_filter import huber_squares
from rsea_core.identify.multistep.noise_estimate import NOISE_STEPS
from rsea_core.identify.multistep.tracks import prepared


def fitted(
    estimator: Estimator, base: Estimate, c: Candidate, short: Estimator | None = None, *,
    factors: Sequence[float] = (1.0, 0.5), iterations: int = 8,
    target_cost: float = np.inf, shared: Sequence[NDArray] | None = None,
) -> Estimate:  # fmt: skip
    """A candidate fitted from its best size, beside what is fitted already.

    Parameters
    ----------
    short : Estimator or None
        In short windows, where a law that is far off still predicts in phase: a further start.
    factors : sequence of float
        Of the size that the screening saw: starts, beside its own.
    target_cost : float
        Cost that the fit must reach to be of use (`Estimator.fit`).
    shared : sequence of arrays or None
        Derivatives by the unknowns of the fit beside which it is fitted.
    """
    problem = estimator.problem
    h = Hypothesis(laws=(*base.hypothesis.laws, c.law))
    n = len(problem.nominals)
    trials = []
    others = base.x if c.start_values is None else c.start_values
    begun = [c.law.scaled(c.start, min(max(c.size, 1e-3), 1e3) * factor) for factor in factors]
    for start in (*begun, c.start):  # not every size acts in proportion
        own = problem.start(Hypothesis(laws=(c.law,)), [start])[n:]
        trials.append((h, np.concatenate([others, own])))
    if short is not None:
        own_costs = short.costs(trials)
        begun = short.fit(h, trials[int(np.argmin(own_costs))][1], iterations=5)
        trials.append((h, begun.x))
    costs = estimator.costs(trials)
    begin = trials[int(np.argmin(costs))][1]
    shared = shared if others is base.x else None
    return estimator.fit(h, begin, iterations=iterations, target_cost=target_cost, shared=shared)


def settled(
    estimator: Estimator, fit: Estimate, *, once: bool = False
) -> tuple[Estimator, Estimate]:
    """A fit in its own noise and with its own share of independent innovations.

    Noise that is estimated beside wrong values holds what they miss, and keeps them: a fit to
    whole predictions, whatever the unknown torque (`with_output_error`), is a second start.
    """
    end = _settled(estimator, fit)
    return end if once else likelier(end, settled_by_output_error(estimator, fit))


def settled_by_output_error(estimator: Estimator, fit: Estimate) -> tuple[Estimator, Estimate]:
    """The same from a fit to whole predictions."""
    h = fit.hypothesis
    output = with_output_error(estimator, h, fit.x)
    x = output.fit(h, fit.x, iterations=8).x
    own = with_noise(estimator, h, x, steps=NOISE_STEPS)
    return _settled(own, own.fit(h, x, iterations=6))


def refitted_from_parent(
    estimator: Estimator, base: Estimate, c: Candidate
) -> tuple[Estimator, Estimate]:
    """A law that begins as good as absent: no fit of it need be worse than the one without it."""
    return settled(estimator, fitted(estimator, base, c, factors=NEARLY_ABSENT), once=True)


def _settled(own: Estimator, fit: Estimate) -> tuple[Estimator, Estimate]:
    """Noise and fit in turns until neither changes the cost."""
    for _ in range(SETTLING):
        before = fit.cost
        own = with_noise(own, fit.hypothesis, fit.x)
        fit = own.fit(fit.hypothesis, fit.x, iterations=6)
        if abs(before - fit.cost) < SETTLED:
            break
    own.tempering = independent_share(own, fit.hypothesis, fit.x)
    return own, own.fit(fit.hypothesis, fit.x, iterations=4)


def resmoothed_fit(own: Estimator, fit: Estimate) -> tuple[Estimator, Estimate]:
    """A fit about the motion that it shows; the one given where that is less likely.

    Noise that was estimated about another motion may not be what this one leaves.
    """
    other = own.having(own.tracks)
    smooth(other, fit.hypothesis, fit.x)
    other = other.having([prepared(t) for t in other.tracks])
    again = other.fit(fit.hypothesis, fit.x, iterations=3)
    if gain_of(other, fit, again) < -UNCONVERGED:
        other, again = settled(other, again, once=True)
    return likelier((own, fit), (other, again))


def gain_of(own: Estimator, base: Estimate, fit: Estimate, share: float | None = None) -> float:
    """Log-likelihood units that a fit gains over another, each in its own noise.

    Innovations count `share`, or what they count for the better fit (`independent_share`).
    """
    share = own.tempering if share is None else share
    gain = base.negative_log_likelihood - fit.negative_log_likelihood
    return share * gain + base.prior_cost - fit.prior_cost


def from_prior(estimator: Estimator, fit: Estimate) -> Estimate:
    """The fit, or one that begins at the rig's values: the missing law had biased them."""
    problem = estimator.problem
    count = len(problem.nominals)
    if np.all(np.abs(fit.x[:count]) < FAR_FROM_RIG):
        return fit
    x = fit.x.copy()
    x[:count] = 0.0
    other = estimator.fit(fit.hypothesis, x, iterations=8)
    return other if other.cost < fit.cost else fit


def far_from_rig(problem: MultistepProblem, x: NDArray) -> bool:
    """Whether a value that the rig file states moved further than its tolerance can bear."""
    return bool(np.any(np.abs(x[: len(problem.nominals)])[problem.stated] > STRAINED))


def close_to_rig(estimator: Estimator, base: Estimate) -> tuple[Estimator, Estimate]:
    """Parameters fitted close to the rig file's values, in the noise that this leaves.

    Values that moved to take a law's part leave nothing that looks like the law.
    """
    problem = estimator.problem.within(CLOSE_TO_RIG)
    near = Estimator(
        problem, estimator.tracks, tempering=estimator.tempering, cache=estimator.cache
    )
    x = base.x.copy()
    x[: len(estimator.problem.nominals)] = 0.0
    fit = near.fit(base.hypothesis, x, iterations=8)
    near = with_noise(near, fit.hypothesis, fit.x, steps=NOISE_STEPS)
    near.tempering = independent_share(near, fit.hypothesis, fit.x)
    return near, near.fit(fit.hypothesis, fit.x, iterations=5)


def by_output_error(estimator: Estimator, base: Estimate) -> tuple[Estimator, Estimate]:
    """The same hypothesis fitted to whole predictions: no unknown torque absorbs the rest."""
    h = base.hypothesis
    output = with_output_error(estimator, h, base.x)
    fit = output.fit(h, base.x, iterations=8)
    output = with_output_error(output, h, fit.x)
    output.tempering = independent_share(output, h, fit.x)
    return output, output.fit(h, fit.x, iterations=5)


def continued_parent(base: Estimate, entry) -> tuple[Estimator, Estimate] | None:
    """The fit that a law was added to, continued from values and noise found with the law.

    None where this ends no lower.
    """
    c, own, fit = entry
    start = own.fit(base.hypothesis, fit.x[: -count_values(c.law)], iterations=8)
    own, further = settled(own, start, once=True)
    return (own, further) if gain_of(own, base, further) > 0.0 else None


def absent(c: Candidate, own: Estimator, fit: Estimate) -> bool:
    """Whether the last law, with its fitted values, moves no prediction."""
    less = Hypothesis(laws=fit.hypothesis.laws[:-1])
    trials = [(fit.hypothesis, fit.x), (less, fit.x[: -count_values(c.law)])]
    found = own.innovations(trials)
    return sum(float(np.sum((e[0] - e[1]) ** 2)) for e in found) < MOVES


def too_fast(estimator: Estimator, fit: Estimate) -> bool:
    """Whether the last law's motion is faster than rows can show."""
    values = estimator.problem.values(fit.hypothesis, fit.x)[1][-1]
    row = max(t.experiment.recording.sample_time_s for t in estimator.tracks)
    return values.get("frequency_Hz", 0.0) > FASTEST / row


def count_values(law: Law) -> int:
    return sum(p.scale > 0.0 for p in law.unknowns)


def confirmed(own: Estimator, base: Estimate, fit: Estimate) -> float:
    """Gain of a fit over what it was added to, in the fit's noise, over its deviation.

    The deviation is that of the sum over stretches in which the law moves the predictions by
    equal shares: what one short event of a recording gains alone is no physics of the machine.
    No stretch counts more than `MOST_OF_ONE`, so that recordings of which some show a law far
    better than others do not speak against it. A constant of a reading is seen once in each
    recording, which the filter takes for its zero (`start_variances`): recordings are its
    stretches.
    """
    plain = own.fit(base.hypothesis, base.x, iterations=5)
    before, after = (
        own.innovations([(base.hypothesis, plain.x)]),
        own.innovations([(fit.hypothesis, fit.x)]),
    )
    once_in_each = fit.hypothesis.laws[-1].kind is SensorOffset and len(own.tracks) > 1
    return even_ratio(own, before, after, whole=once_in_each)


def even_ratio(
    own: Estimator, before: Sequence[NDArray], after: Sequence[NDArray], *, whole: bool = False
) -> float:
    """Fall of the cost from innovations to others, over its deviation between equal shares.

    Parameters
    ----------
    whole : bool
        Each recording is one share.
    """
    moved = [((e[0] - f[0]) ** 2).sum(axis=1) for e, f in zip(before, after, strict=True)]
    total = sum(float(m.sum()) for m in moved) or 1.0
    falls = []
    for t, m, e, f in zip(own.tracks, moved, before, after, strict=True):
        fall = 0.5 * own.tempering * (huber_squares(e[0]) - huber_squares(f[0])).sum(axis=1)
        least = EVENT * t.scale.time_s / (t.block * t.experiment.recording.sample_time_s)
        shares = _equal_shares(m * STRETCHES / total, m.size if whole else int(least) + 1)
        falls.append(np.bincount(shares, fall))
    each = np.clip(np.concatenate(falls), -MOST_OF_ONE, MOST_OF_ONE)
    spread = max(float(np.std(each)), EVEN * abs(float(np.mean(each))), 1e-9)
    return float(each.sum()) / (spread * np.sqrt(each.size))


def _equal_shares(share: NDArray, least: int) -> NDArray:
    """Stretch (n,) of each row: of a share of one each, and of no fewer rows than the least."""
    found, begun, held, number = np.empty(share.size, int), 0, 0.0, 0
    for row, s in enumerate(share):
        if held >= 1.0 and row - begun >= least and share.size - row >= least:
            begun, held, number = row, 0.0, number + 1
        held += s
        found[row] = number
    return found


def at_bound(problem: MultistepProblem, fit: Estimate, law: Law) -> bool:
    """Whether a value of a law ran into a bound that is not its absence.

    A winding far above `MOST_RISE_K` counts as such: its resistance grows with its temperature
    without limit (thermal runaway), and the law can then follow any mismatch.
    """
    if values_at_bound(problem, fit, law):
        return True
    if law.effect != DriveThermal.effect:
        return False
    most_K = MOST_FITTED_RISE * MOST_RISE_K
    return not peak_rise_K(problem, fit.hypothesis, fit.x, problem.prepared) < most_K


def values_at_bound(problem: MultistepProblem, fit: Estimate, law: Law) -> tuple[str, ...]:
    """Names of a law's values that ran into a bound which is not its absence."""
    laws = fit.hypothesis.laws
    begin = len(problem.nominals) + sum(count_values(w) for w in laws[: laws.index(law)])
    own = slice(begin, begin + count_values(law))
    low, high = (limit[own] for limit in problem.bounds(fit.hypothesis))
    x = fit.x[own]
    stopped = (x >= high - 1e-6) | ((x <= low + 1e-6) & (low != 0.0))
    free = [p for p in law.unknowns if p.scale > 0.0]
    return tuple(p.name for p, at in zip(free, stopped, strict=True) if at and not p.closed)


def widened(c: Candidate, own: Estimator, fit: Estimate) -> tuple[Candidate, Estimator, Estimate]:
    """A candidate whose sizes ran into a bound, fitted on in wider ones.

    Bounds follow what is typical of the machine; a larger effect than that is no other effect.
    """
    for _ in range(WIDER_TIMES):
        law = c.law.widened(values_at_bound(own.problem, fit, c.law), WIDER)
        if law is c.law:
            break
        c = replace(c, law=law)
        h = Hypothesis(laws=(*fit.hypothesis.laws[:-1], law))
        own, fit = settled(own, own.fit(h, fit.x, iterations=8), once=True)
    return c, own, fit


def restarted(finished: list, worth, say) -> list:
    """Rivals of the best candidate fitted once more from its values of everything else.

    The missing law had biased the values from which each was fitted, and a fit may stay there.
    """
    c, noise, best = finished[0]
    found = [finished[0]]
    for entry in finished[1:]:
        o, own, fit = entry
        count = count_values(o.law)
        x = np.concatenate([best.x[: -count_values(c.law)], fit.x[-count:]])
        far = np.any(np.abs(x - fit.x)[: len(own.problem.nominals)] > 1.0)
        if far and worth(entry) > NEAR * worth(finished[0]):
            again = settled(noise, noise.fit(fit.hypothesis, x, iterations=8), once=True)
            if worth((o, *again)) > worth(entry) and not at_bound(own.problem, again[1], o.law):
                entry = (o, *again)
                say(f"  {o.law.key}: gain {worth(entry):.1f} from the best one's values")
        found.append(entry)
    return sorted(found, key=worth, reverse=True)


def cost_of_mass(problem: MultistepProblem, entry) -> float:
    """What an unbalance costs that acts as the gravity which the rig file states.

    It is a mass far outside of its tolerance: the prior's cost at the bound of a stated value.
    """
    c, _, fit = entry
    if c.law.effect != LoadUnbalance.effect:
        return 0.0
    if all(n.key != "load_mass_kg" for n in problem.nominals):
        return 0.0
    values = problem.values(fit.hypothesis, fit.x)[1][-1]
    along = abs(values["cos_Nm"]) < ALONG * abs(values["sin_Nm"])
    return 0.5 * STATED_BOUND**2 if along else 0.0
