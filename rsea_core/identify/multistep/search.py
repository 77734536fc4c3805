"""The search: parameters with the experiment's nuisances first, then law after law.

A law enters if it predicts rows that it was not fitted to, and by more than the spread between
blocks of rows; laws are compared by likelihood, each with the noise that it needs itself.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.variant import Law
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.multistep.error_filter import huber_squares
from rsea_core.identify.multistep.estimator import (
    Estimate,
    Estimator,
    independent_share,
    stretches_of,
)
from rsea_core.identify.multistep.experiment import MultistepProblem, nuisances
from rsea_core.identify.multistep.screening import Candidate, Projection, screen
from rsea_core.identify.multistep.shape_search import Shape, shapes
from rsea_core.identify.multistep.tracks import (
    NOISE_STEPS,
    Track,
    block_rows,
    estimated_noise,
    initial_track,
    prepared,
    resmoothed,
    windows_of,
)
from rsea_core.recordings.case import Case

HORIZONS = (
    0.1,
    0.3,
    1.0,
    4.0,
    16.0,
    None,
)  # in time scales of the motion; None: the whole recording
LOST = 0.3  # error over the spread of a reading beyond which a horizon is too long
LINEAR_GAIN = 3.0  # by which a linearly moving command must be better than a held one
LEAST_GAIN = 8.0  # of a law, log-likelihood units
PER_VALUE = 2.0  # more for each of its values
RICHER_GAIN = 5.0  # of a law with more values over the plainer one of its effect
ALIKE_GAIN, ALIKE_SHARE = 2.0, 0.03  # of one effect in two readings that cannot be told apart
FURTHER_GAIN = 12.0  # of a further law
FURTHER_SHARE, FURTHER_MOST = 0.02, 0.3  # and of what the first one gained, by dependence
FASTEST = 0.3  # cycles per row: a faster motion is not seen
BENT = 2.0  # tolerances from which values are fitted once more from the rig's
LEAST_RATIO = 2.5  # of the held-out gain to its deviation
FINE_STEPS = (2.0, 1.3)  # of noise that was estimated before
SHORT = 4.0  # time scales of the motion: windows in which candidates are fitted first
FINISHED_QUICK, LAWS_QUICK = 2, 2
SETTLING, SETTLED = 4, 2.0  # rounds of noise and fit at most; change of the cost that ends them
TRIED, FINISHED, LAWS = 7, 4, 3
LEAST_ROWS = 10  # of a window
QUIET = 5.0  # a reading that moves by fewer of its deviations says nothing of predictability
HOLDS_NO_CLAIM = ("drive-delay", "sensor-noise")  # nuisances, or no physics


@dataclass
class Found:
    """What a search found.

    Attributes
    ----------
    base, best : Estimate
        Parameters alone and with laws; the costs of `best` are with its own noise.
    steps : list of Step
        One for each law.
    """

    problem: MultistepProblem
    base_estimator: Estimator
    base: Estimate
    estimator: Estimator
    best: Estimate
    horizon: float | None
    steps: list = field(default_factory=list)
    base_shapes: list[Shape] = field(default_factory=list)
    shapes: list[Shape] = field(default_factory=list)
    screened: list[Candidate] = field(default_factory=list)


@dataclass(frozen=True, kw_only=True)
class Step:
    """One law taken, and those that it was compared with.

    Attributes
    ----------
    screened : float
        Held-out gain as the screening saw it, in the noise of the fit before.
    gain : float
        Fall of the cost, each with its own noise, less the price of its values.
    ratio : float
        Held-out gain over its deviation.
    tempering : float
        Share of independent innovations with the law.
    rivals : tuple of (Law, gain)
        Best of each other effect.
    """

    law: Law
    screened: float
    gain: float
    held_out: float
    ratio: float
    tempering: float
    rivals: tuple[tuple[Law, float], ...]


def with_windows(estimator: Estimator, horizon: float | None) -> list[Track]:
    """The tracks in windows of a length in time scales of the motion."""
    found = []
    for t in estimator.tracks:
        e = t.experiment
        rows = e.rows
        if horizon is not None:
            rows = int(horizon * t.scale.time_s / e.recording.sample_time_s)
        found.append(prepared(t, windows=windows_of(e.rows, rows, t.motion, t.block)))
    return found


def smooth(estimator: Estimator, h: Hypothesis, x: NDArray) -> None:
    """Take the motion that a fit and the readings show together."""
    found = []
    for t in estimator.tracks:
        e = t.experiment
        machine = [estimator.problem.trial_machine(e, h, x)]
        run = e.runs(machine, t.windows)
        residual = e.measured - e.readings(run, machine)[0]
        if np.all(np.isfinite(residual)) and np.max(np.abs(residual)) < 1e12:
            with suppress(np.linalg.LinAlgError):  # the motion before stays
                t = resmoothed(t, run[0], residual)
        found.append(t)
    estimator.tracks = found


def with_noise(
    estimator: Estimator, h: Hypothesis, x: NDArray, *, steps: Sequence[float] = FINE_STEPS
) -> Estimator:
    """Another estimator whose noise is that of a fit."""
    residuals = [r[0] for r in estimator.residuals([(h, x)])]
    if not all(np.all(np.isfinite(r)) for r in residuals):
        return estimator
    return estimator.having(estimated_noise(estimator.tracks, residuals, steps=steps))


def relative_error(estimator: Estimator, h: Hypothesis, x: NDArray) -> float:
    """Largest error of an angle over its spread, over all recordings."""
    worst = 0.0
    for t, r in zip(estimator.tracks, estimator.residuals([(h, x)]), strict=True):
        for j, name in enumerate(t.experiment.channels):
            moved = np.std(t.experiment.measured[:, j]) > QUIET * t.experiment.floor_of_each[j]
            if name.endswith("angle_rad") and moved:
                spread = np.std(t.experiment.measured[:, j]) or 1.0
                worst = max(worst, float(np.sqrt(np.mean(r[0, :, j] ** 2))) / spread)
    return worst if np.isfinite(worst) else np.inf


def parameters(problem: MultistepProblem, h: Hypothesis, say) -> tuple[Estimator, Estimate, float]:
    """Parameters and nuisances over growing horizons, as far as the machine is predictable."""
    blocks = block_rows(problem.fitted)
    estimator = Estimator(
        problem, [initial_track(e, b) for e, b in zip(problem.fitted, blocks, strict=True)]
    )
    x = problem.start(h)
    smooth(estimator, h, x)
    kept, known = None, False
    for horizon in HORIZONS:
        if horizon is not None and not _long_enough(estimator, horizon):
            continue
        trial = estimator.having(with_windows(estimator, horizon))
        fit = trial.fit(h, x, iterations=5)
        trial = with_noise(trial, h, fit.x, steps=NOISE_STEPS)
        trial.tempering = independent_share(trial, h, fit.x)
        fit = trial.fit(h, fit.x, iterations=5)
        error = relative_error(trial, h, fit.x)
        say(f"parameters over {horizon or 'all'} T: error {error:.3g} of the spread")
        if known and error > LOST:
            break
        x, estimator, kept, known = fit.x, trial, horizon, True
        smooth(estimator, h, x)
    estimator = with_noise(estimator.having(with_windows(estimator, kept)), h, x)
    fit = estimator.fit(h, x)
    estimator.tempering = independent_share(estimator, h, fit.x)
    say(f"independent share of the innovations: {estimator.tempering:.3g}")
    return estimator, estimator.fit(h, fit.x), kept


def _long_enough(estimator: Estimator, horizon: float) -> bool:
    """Whether windows of a length hold enough rows to tell a start from a motion."""
    return all(
        horizon * t.scale.time_s > LEAST_ROWS * t.block * t.experiment.recording.sample_time_s
        for t in estimator.tracks
    )


def extend(found: Found, say) -> None:
    """Take longer windows as far as the machine with its laws is predictable."""
    while found.horizon is not None:
        at = HORIZONS.index(found.horizon)
        trial = found.estimator.having(with_windows(found.estimator, HORIZONS[at + 1]))
        h = found.best.hypothesis
        fit = trial.fit(h, found.best.x, iterations=5)
        error = relative_error(trial, h, fit.x)
        say(f"with laws over {HORIZONS[at + 1] or 'all'} T: error {error:.3g} of the spread")
        if error > LOST:
            return
        smooth(trial, h, fit.x)
        trial = with_noise(trial.having([prepared(t) for t in trial.tracks]), h, fit.x)
        found.best, found.horizon = trial.fit(h, fit.x, iterations=4), HORIZONS[at + 1]
        found.estimator = trial


def investigate(
    case: Case, *, quick: bool = False, say: Callable[[str], None] = lambda _: None
) -> Found:
    """Search for what a case's recordings show.

    Parameters
    ----------
    quick : bool
        Finish fewer candidates and look for one effect more at most.
    """
    problem = MultistepProblem(case)
    h = Hypothesis(laws=nuisances(case))
    estimator, base, horizon = parameters(problem, h, say)
    estimator, base = _better_hold(estimator, base, case, say)
    problem = estimator.problem
    found = Found(problem=problem, base_estimator=estimator, base=base, estimator=estimator,
                  best=base, horizon=horizon)  # fmt: skip
    laws = [
        law for law in catalogue(case, relative=True).values()
        if law.effect not in HOLDS_NO_CLAIM and not law.follows and _observable(law, estimator)
    ]  # fmt: skip
    for number in range(LAWS_QUICK if quick else LAWS):
        step = _next_law(found, laws, say, first=number == 0, quick=quick)
        if step is None:
            break
        found.steps.append(step)
        extend(found, say)
    found.base_shapes = found.shapes = shapes(Projection(estimator, base))
    if found.steps:
        found.shapes = shapes(Projection(found.estimator, found.best))
    return found


def _better_hold(estimator, base, case, say) -> tuple[Estimator, Estimate]:
    """The command as it moves between rows: held, or linearly."""
    if not any(e.recording.command_name for e in estimator.problem.fitted):
        return estimator, base
    other = MultistepProblem(case, linear=True)
    tracks = [
        prepared(replace(t, experiment=e))
        for t, e in zip(estimator.tracks, other.fitted, strict=True)
    ]
    linear = Estimator(other, tracks, tempering=estimator.tempering)
    fit = linear.fit(base.hypothesis, base.x)
    better = fit.cost < base.cost - LINEAR_GAIN
    if not better and fit.cost < base.cost + 50.0:  # each with the noise that it needs
        own = with_noise(linear, base.hypothesis, fit.x)
        fit = own.fit(base.hypothesis, fit.x)
        better, linear = fit.cost < base.cost - LINEAR_GAIN, own
    say(f"command held {-base.cost:.1f}, linear {-fit.cost:.1f}")
    if not better:
        return estimator, base
    linear = with_noise(linear, base.hypothesis, fit.x)
    fit = linear.fit(base.hypothesis, fit.x)
    smooth(linear, base.hypothesis, fit.x)
    linear = with_noise(linear.having([prepared(t) for t in linear.tracks]),
                        base.hypothesis, fit.x)  # fmt: skip
    return linear, linear.fit(base.hypothesis, fit.x)


def _observable(law: Law, estimator: Estimator) -> bool:
    """Whether a law's fastest motion is one that rows can show."""
    single = all(len(t.experiment.channels) == 1 for t in estimator.tracks)
    return not (law.effect == "sensor-delay" and single)


def _next_law(found: Found, laws: Sequence[Law], say, *, first: bool, quick: bool) -> Step | None:
    """Take the best further law, if one is worth it."""
    estimator, base = found.estimator, found.best
    have = {(law.effect, law.sensor) for law in base.hypothesis.laws}
    open_laws = [law for law in laws if (law.effect, law.sensor) not in have]
    screened = screen(estimator, base, open_laws)
    if first:
        found.screened = screened
    for c in screened[:5]:
        say(f"  {c.law.key}: held-out gain {c.held_out:.1f} +- {c.deviation:.1f}")
    chosen, names = [], {}
    for c in screened:
        name = (c.law.effect, c.law.sensor)
        if c.held_out < 0.4 * LEAST_GAIN * estimator.tempering or c.held_out < 1.5 * c.deviation:
            continue
        if names.get(name, 0) < 1 and len(chosen) < TRIED:
            chosen.append(c)
            names[name] = names.get(name, 0) + 1
    short = None
    if found.horizon is None or found.horizon > SHORT:
        short = estimator.having(with_windows(estimator, SHORT))
    rough = [(c, _fitted(estimator, base, c, short)) for c in chosen]
    rough.sort(key=lambda pair: pair[1].cost)
    finished = []
    for c, fit in rough[: FINISHED_QUICK if quick else FINISHED]:
        fit = _from_prior(estimator, fit)
        own, fit = _settled(estimator, fit)
        bound = at_bound(own.problem, fit, c.law) or _too_fast(own, fit)
        say(f"  {c.law.key}: gain {gain_of(own, base, fit):.1f}{', at a bound' if bound else ''}")
        if not bound:
            finished.append((c, own, fit))
    if not finished:
        return None

    def worth(entry) -> float:
        c, own, fit = entry
        return gain_of(own, base, fit) - PER_VALUE * _values(c.law)

    finished.sort(key=worth, reverse=True)
    _prefer_load_reading(finished, worth)
    c, own, fit = finished[0]
    enough = LEAST_GAIN + np.log(max(sum(law.effect == c.law.effect for law in laws), 1))
    if not first:
        share = min(FURTHER_SHARE * len(found.steps) / own.tempering, FURTHER_MOST)
        enough = max(enough, FURTHER_GAIN, share * found.steps[0].gain)
    if worth(finished[0]) < enough:
        return None
    finished[0] = c, own, fit = _richer(finished[0], base, laws, say)
    ratio, held = _confirmed(own, base, fit)
    say(
        f"  best {c.law.key}: gain {gain_of(own, base, fit):.1f}, held-out {held:.1f},"
        f" ratio {ratio:.1f}"
    )
    if ratio < LEAST_RATIO:
        return None
    rivals = tuple((o.law, worth((o, p, q))) for o, p, q in finished[1:])
    found.estimator, found.best = own, fit
    smooth(own, fit.hypothesis, fit.x)
    found.estimator = own.having([prepared(t) for t in own.tracks])
    found.best = found.estimator.fit(fit.hypothesis, fit.x, iterations=3)
    return Step(
        law=c.law,
        screened=c.held_out,
        gain=worth((c, own, fit)),
        held_out=held,
        ratio=ratio,
        tempering=own.tempering,
        rivals=rivals,
    )


def _prefer_load_reading(finished: list, worth) -> None:
    """Only the difference of two angles shows what one of them misreads: name the load's."""
    first = finished[0]
    for j, other in enumerate(finished[1:], 1):
        alike = other[0].law.effect == first[0].law.effect and first[0].law.sensor is not None
        near = worth(first) - worth(other) < ALIKE_GAIN + ALIKE_SHARE * worth(first)
        if alike and near and other[0].law.sensor == "load_angle_rad":
            finished[0], finished[j] = other, first
            return


def _settled(estimator: Estimator, fit: Estimate) -> tuple[Estimator, Estimate]:
    """A fit in its own noise and with its own share of independent innovations."""
    own = estimator
    for _ in range(SETTLING):
        before = fit.cost
        own = with_noise(own, fit.hypothesis, fit.x)
        fit = own.fit(fit.hypothesis, fit.x, iterations=6)
        if abs(before - fit.cost) < SETTLED:
            break
    own.tempering = independent_share(own, fit.hypothesis, fit.x)
    return own, own.fit(fit.hypothesis, fit.x, iterations=4)


def gain_of(own: Estimator, base: Estimate, fit: Estimate) -> float:
    """Log-likelihood units that a fit gains over another, each in its own noise.

    Innovations count what they count for the better fit (`independent_share`).
    """
    return own.tempering * (base.likelihood - fit.likelihood) + base.prior_cost - fit.prior_cost


def _from_prior(estimator: Estimator, fit: Estimate) -> Estimate:
    """The fit, or one that begins at the rig's values: what lacked a law had bent them."""
    problem = estimator.problem
    count = len(problem.nominals)
    if np.all(np.abs(fit.x[:count]) < BENT):
        return fit
    x = fit.x.copy()
    x[:count] = 0.0
    other = estimator.fit(fit.hypothesis, x, iterations=8)
    return other if other.cost < fit.cost else fit


def _richer(entry, base: Estimate, laws: Sequence[Law], say):
    """The law of the same effect that is worth its further values, if one is."""
    c, own, fit = entry
    tried: set[str] = set()
    names = list(c.law.richer)
    while names:
        name = names.pop(0)
        law = next((w for w in laws if w.law == name and w.effect == c.law.effect
                    and w.sensor == c.law.sensor), None)  # fmt: skip
        if law is None or name in tried:
            continue
        tried.add(name)
        values = own.problem.values(fit.hypothesis, fit.x)[1][-1]
        start = tuple(
            values.get(p.name, first) for p, first in zip(law.unknowns, law.starts[0], strict=True)
        )
        more = _fitted(own, base, replace(c, law=law, start=start, size=1.0))
        better = fit.cost - more.cost - PER_VALUE * (_values(law) - _values(c.law))
        say(f"    richer {law.key}: {better:.1f}")
        if better > RICHER_GAIN and not at_bound(own.problem, more, law):
            own = with_noise(own, more.hypothesis, more.x)
            fit = own.fit(more.hypothesis, more.x, iterations=6)
            c = replace(c, law=law)
            names = [*names, *law.richer]
    return c, own, fit


def _too_fast(estimator: Estimator, fit: Estimate) -> bool:
    """Whether the last law's motion is faster than rows can show."""
    values = estimator.problem.values(fit.hypothesis, fit.x)[1][-1]
    row = max(t.experiment.recording.sample_time_s for t in estimator.tracks)
    return values.get("frequency_Hz", 0.0) > FASTEST / row


def _values(law: Law) -> int:
    return sum(p.scale > 0.0 for p in law.unknowns)


def _fitted(
    estimator: Estimator, base: Estimate, c: Candidate, short: Estimator | None = None
) -> Estimate:
    """A candidate fitted from its best size, beside what is fitted already.

    Parameters
    ----------
    short : Estimator or None
        In short windows, where a law that is far off still predicts in phase: a further start.
    """
    problem = estimator.problem
    h = Hypothesis(laws=(*base.hypothesis.laws, c.law))
    n = len(problem.nominals)
    trials = []
    for factor in (1.0, 0.5):
        start = c.law.scaled(c.start, min(max(c.size, 1e-3), 50.0) * factor)
        own = problem.start(Hypothesis(laws=(c.law,)), [start])[n:]
        trials.append((h, np.concatenate([base.x, own])))
    if short is not None:
        own_costs = short.costs(trials)
        begun = short.fit(h, trials[int(np.argmin(own_costs))][1], iterations=5)
        trials.append((h, begun.x))
    costs = estimator.costs(trials)
    return estimator.fit(h, trials[int(np.argmin(costs))][1], iterations=8)


def _confirmed(own: Estimator, base: Estimate, fit: Estimate) -> tuple[float, float]:
    """Gain of a fit over what it was added to, in the fit's noise, and its ratio to the deviation.

    The deviation is that of the sum over blocks of rows: what one stretch of a recording gains
    alone is no physics of the machine.
    """
    plain = own.fit(base.hypothesis, base.x, iterations=5)
    before, after = (
        own.innovations([(base.hypothesis, plain.x)]),
        own.innovations([(fit.hypothesis, fit.x)]),
    )
    falls = []
    for block, e, f in zip(stretches_of(own.tracks), before, after, strict=True):
        fall = 0.5 * own.tempering * (huber_squares(e[0]) - huber_squares(f[0])).sum(axis=1)
        falls.append(np.bincount(block, fall))
    each = np.concatenate(falls)
    deviation = float(np.std(each) * np.sqrt(each.size))
    return float(each.sum()) / max(deviation, 1e-9), float(each.sum())


def at_bound(problem: MultistepProblem, fit: Estimate, law: Law) -> bool:
    """Whether a value of the last law ran into a bound that is not its absence."""
    low, high = problem.bounds(fit.hypothesis)
    count = _values(law)
    x, low, high = fit.x[-count:], low[-count:], high[-count:]
    return bool(np.any(x >= high - 1e-6) or np.any((x <= low + 1e-6) & (low != 0.0)))
