"""The search: parameters with the experiment's nuisances first, then law after law.

A law enters if it predicts rows that it was not fitted to, and by more than the spread between
blocks of rows; laws are compared by likelihood, each with the noise that it needs itself.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rsea_core.effects.drive_delay import DriveDelay
from rsea_core.effects.load_disturbance import LoadDisturbance
from rsea_core.effects.sensor_delay import SensorDelay
from rsea_core.effects.sensor_noise import SensorNoise
from rsea_core.effects.variant import Law
from rsea_core.identify.candidates.catalogue import catalogue, of_one_body
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.multistep.candidate_fits import (
    at_bound,
    bent,
    close_to_rig,
    confirmed,
    cost_of_mass,
    count_values,
    fitted,
    from_prior,
    gain_of,
    prefer_load_reading,
    prefer_plainer,
    refitted_from_parent,
    restarted,
    settled,
    too_fast,
    with_richer_law,
)
from rsea_core.identify.multistep.criteria import (
    FEWER_FINISHED,
    FEWER_LAWS,
    FINISHED,
    FORMS,
    FURTHER_GAIN,
    FURTHER_MOST,
    FURTHER_SHARE,
    HORIZONS,
    LAWS,
    LEAST_GAIN,
    LEAST_RATIO,
    LOST,
    ONLY_PULSE,
    PARENT,
    PER_VALUE,
    PULSE_RATIO,
    PULSES,
    SECOND_STARTS,
    SHORT,
    TRIED,
    TRIED_SHORT,
)
from rsea_core.identify.multistep.estimator import (
    Estimate,
    Estimator,
)
from rsea_core.identify.multistep.experiment import MultistepProblem, nuisances
from rsea_core.identify.multistep.hold_out import with_moving_loads
from rsea_core.identify.multistep.horizons import (
    parameters,
    relative_error,
    smooth,
    with_better_hold,
    with_fine_steps,
    with_noise,
    with_windows,
    without_slow_torque,
)
from rsea_core.identify.multistep.pruning import pruned
from rsea_core.identify.multistep.pulses import pulse_ratio, pulses
from rsea_core.identify.multistep.screening import Candidate, Projection, screen
from rsea_core.identify.multistep.shape_search import Shape, shapes
from rsea_core.identify.multistep.tracks import (
    prepared,
)
from rsea_core.recordings.case import Case

Entry = tuple[Candidate, Estimator, Estimate]
HOLDS_NO_CLAIM = (DriveDelay.effect, SensorNoise.effect)  # nuisances, or no physics


@dataclass
class Found:
    """What a search found.

    Attributes
    ----------
    base, best : Estimate
        Parameters alone and with laws; the costs of `best` are with its own noise.
    steps : list of Step
        One for each law.
    refused : Step or None
        A law taken and taken out again, for it gained in too few stretches of rows.
    shared : tuple of str
        Recordings held out of which a part was fitted (`hold_out.with_moving_loads`).
    """

    problem: MultistepProblem
    base_estimator: Estimator
    base: Estimate
    estimator: Estimator
    best: Estimate
    horizon: float | None
    shared: tuple[str, ...] = ()
    steps: list = field(default_factory=list)
    refused: "Step | None" = None
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
        Gain over its deviation between stretches of rows.
    tempering : float
        Share of independent innovations with the law.
    rivals : tuple of (Law, gain)
        Best of each other effect; those too that have a value at a bound, and cannot be taken.
    """

    law: Law
    screened: float
    gain: float
    ratio: float
    tempering: float
    rivals: tuple[tuple[Law, float], ...]


def investigate(
    case: Case, *, quick: bool = False, say: Callable[[str], None] = lambda _: None
) -> Found:
    """Search for what a case's recordings show.

    Parameters
    ----------
    quick : bool
        Finish fewer candidates and look for one effect more at most.
    """
    case, shared = with_moving_loads(case)
    for file in shared:
        say(f"{file}: two thirds are fitted: no other recording lets the load move")
    problem = MultistepProblem(case)
    h = Hypothesis(laws=nuisances(case))
    estimator, base, horizon = parameters(problem, h, say)
    estimator, base = with_better_hold(estimator, base, case, say)
    estimator, base = with_fine_steps(estimator, base, case, say)
    if not quick:
        estimator, base = settled(estimator, base)
    problem = estimator.problem
    found = Found(problem=problem, base_estimator=estimator, base=base, estimator=estimator,
                  best=base, horizon=horizon, shared=shared)  # fmt: skip
    laws = [
        law for law in catalogue(case, relative=True).values()
        if law.effect not in HOLDS_NO_CLAIM and not law.follows and _observable(law, estimator)
    ]  # fmt: skip
    for number in range(FEWER_LAWS if quick else LAWS):
        step = _next_law(found, laws, say, first=number == 0, quick=quick)
        if step is None:
            break
        found.steps.append(step)
        extend(found, say, quick=quick)
    if found.steps:
        pruned(found, say)
    found.base_shapes = found.shapes = shapes(Projection(estimator, base))
    if found.steps:
        found.shapes = shapes(Projection(found.estimator, found.best))
    return found


def extend(found: Found, say, *, quick: bool = False) -> None:
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
        best = trial.fit(h, fit.x, iterations=4)
        found.estimator, found.best = settled(trial, best, once=quick)
        found.horizon = HORIZONS[at + 1]


def _observable(law: Law, estimator: Estimator) -> bool:
    """Whether a law's fastest motion is one that rows can show."""
    single = all(len(t.experiment.channels) == 1 for t in estimator.tracks)
    return not (law.kind is SensorDelay and single)


def _finished(
    estimator: Estimator, base: Estimate, chosen: Sequence[Candidate], short: Estimator | None,
    say, *, screened: Sequence[Candidate], quick: bool,
) -> tuple[list[Entry], list[Entry]]:  # fmt: skip
    """The best candidates fitted to their ends, each in its own noise; those at a bound apart."""
    rough = [(c, fitted(estimator, base, c, short)) for c in chosen]
    rough.sort(key=lambda pair: pair[1].cost)
    finished, beyond = [], []
    for place, (c, fit) in enumerate(rough[: FEWER_FINISHED if quick else FINISHED]):
        once = quick or place >= SECOND_STARTS
        entry, bound = _end(estimator, base, c, fit, say, once=once)
        for other in _other_forms(c, screened) if bound and not quick else ():
            beyond.append(entry)
            entry, bound = _end(estimator, base, other, fitted(estimator, base, other, short), say)
            if not bound:
                break
        (beyond if bound else finished).append(entry)
    return finished, beyond


def _end(estimator: Estimator, base: Estimate, c: Candidate, fit: Estimate, say, *, once=False):
    """The candidate with its noise and its fit, and whether a value ran into a bound."""
    own, fit = settled(estimator, from_prior(estimator, fit), once=once)
    if gain_of(own, base, fit) < 0.0:
        own, fit = refitted_from_parent(estimator, base, c)
    bound = at_bound(own.problem, fit, c.law) or too_fast(own, fit)
    say(f"  {c.law.key}: gain {gain_of(own, base, fit):.1f}{', at a bound' if bound else ''}")
    return (c, own, fit), bound


def _other_forms(c: Candidate, screened: Sequence[Candidate]) -> list[Candidate]:
    """Other laws of a candidate's effect that promise something, best first."""
    same = [o for o in screened if (o.law.effect, o.law.sensor) == (c.law.effect, c.law.sensor)]
    return [o for o in same if o.law.law != c.law.law and o.held_out > PARENT * c.held_out][:FORMS]


def _chosen(screened: Sequence[Candidate], tempering: float) -> list[Candidate]:
    """The best candidate of each effect in each reading, as far as it stands out."""
    chosen: list[Candidate] = []
    names: set[tuple] = set()
    for c in screened:
        c, name = _plainest(c, screened), (c.law.effect, c.law.sensor)
        faint = c.held_out < 0.4 * LEAST_GAIN * tempering or c.held_out < 1.5 * c.deviation
        if not faint and name not in names and len(chosen) < TRIED:
            chosen.append(c)
            names.add(name)
    return chosen


def _plainest(c: Candidate, screened: Sequence[Candidate]) -> Candidate:
    """The law that holds fewer values and has this one among its richer forms, if it is as good.

    The richer forms are tried once more when the effect is chosen (`with_richer_law`).
    """
    for other in screened:
        same = (other.law.effect, other.law.sensor) == (c.law.effect, c.law.sensor)
        if same and c.law.law in other.law.richer and other.held_out > PARENT * c.held_out:
            return other
    return c


def _promising(found: Found, laws: Sequence[Law], *, first: bool):
    """Candidates worth a fit, all that were screened, and the estimator in short windows."""
    estimator, base = found.estimator, found.best
    have = {(law.effect, law.sensor) for law in base.hypothesis.laws}
    same = of_one_body(found.problem.case.rig)
    if same & {effect for effect, _ in have}:
        have |= {(effect, None) for effect in same}
    left = [w for w in laws if (w.effect, w.sensor) not in have]
    screened = screen(estimator, base, left)
    if first:
        found.screened = screened
    short = None
    if found.horizon is None or found.horizon > SHORT:
        short = estimator.having(with_windows(estimator, SHORT))
    chosen = _chosen(screened, estimator.tempering)
    if not any(law.effect == LoadDisturbance.effect for law in base.hypothesis.laws):
        chosen += pulses(Projection(without_slow_torque(estimator), base))[:PULSES]
    if short is not None:  # in phase, where a law that is far off still shows
        names = {(c.law.effect, c.law.sensor) for c in chosen}
        further = [c for c in _chosen(screen(short, base, left), estimator.tempering)
                   if (c.law.effect, c.law.sensor) not in names]  # fmt: skip
        chosen += further[:TRIED_SHORT]
    if first and bent(found.problem, base.x):
        names = {(c.law.effect, c.law.sensor) for c in chosen}
        near, plain = close_to_rig(estimator, base)
        further = [replace(c, start_values=plain.x)
                   for c in _chosen(screen(near, plain, left), near.tempering)
                   if (c.law.effect, c.law.sensor) not in names]  # fmt: skip
        chosen += further[:TRIED_SHORT]
    return chosen, screened, short


def _next_law(found: Found, laws: Sequence[Law], say, *, first: bool, quick: bool) -> Step | None:
    """Take the best further law whose gain is even, if one is worth it."""
    estimator, base = found.estimator, found.best
    chosen, screened, short = _promising(found, laws, first=first)
    for c in chosen:
        say(f"  {c.law.key}: held-out gain {c.held_out:.1f} +- {c.deviation:.1f}")
    finished, beyond = _finished(
        estimator, base, chosen, short, say, screened=screened, quick=quick
    )
    if not finished:
        return None

    # one share for all: two laws that fit alike are alike, however dependent each seems
    share = min(finished, key=lambda entry: entry[2].likelihood)[1].tempering

    def worth(entry) -> float:
        c, own, fit = entry
        gain = gain_of(own, base, fit, share) - cost_of_mass(found.problem, entry)
        return gain - PER_VALUE * count_values(c.law)

    finished.sort(key=worth, reverse=True)
    finished = restarted(finished, worth, say)
    finished = prefer_plainer(finished, worth)
    prefer_load_reading(finished, worth)
    while finished:
        entry, *finished = finished
        if worth(entry) < _enough(found, laws, entry):
            return None
        c, own, fit = entry = with_richer_law(entry, base, laws, say)
        once = c.law.only is not None
        ratio = pulse_ratio(own, base, fit) if once else confirmed(own, base, fit)
        say(f"  best {c.law.key}: gain {gain_of(own, base, fit):.1f}, ratio {ratio:.1f}")
        if ratio >= (LEAST_RATIO if not once else _least_pulse_ratio(c)):
            break
    else:
        return None
    smooth(own, fit.hypothesis, fit.x)
    found.estimator = own.having([prepared(t) for t in own.tracks])
    found.best = found.estimator.fit(fit.hypothesis, fit.x, iterations=3)
    return Step(
        law=c.law,
        screened=next((s.held_out for s in screened if s.law is c.law), c.held_out),
        gain=worth(entry),
        ratio=ratio,
        tempering=own.tempering,
        rivals=tuple(
            (o.law, worth((o, p, q))) for o, p, q in finished + _best_of_each(beyond, worth)
        ),
    )


def _best_of_each(entries: list[Entry], worth) -> list[Entry]:
    """The best entry of each effect in each reading."""
    best: dict[tuple, Entry] = {}
    for entry in sorted(entries, key=worth):
        best[entry[0].law.effect, entry[0].law.sensor] = entry
    return list(best.values())


def _least_pulse_ratio(c: Candidate) -> float:
    """Of a torque that acts once: less where nothing like it is anywhere else."""
    return PULSE_RATIO * (1.0 if c.held_out < ONLY_PULSE * c.deviation else 0.5)


def _enough(found: Found, laws: Sequence[Law], entry) -> float:
    """Worth that a law must have to be taken: more of a further one, and of one of many forms."""
    c, own, _ = entry
    enough = LEAST_GAIN + np.log(max(sum(law.effect == c.law.effect for law in laws), 1))
    if not found.steps:
        return enough
    share = min(FURTHER_SHARE * len(found.steps) / own.tempering, FURTHER_MOST)
    return max(enough, FURTHER_GAIN, share * found.steps[0].gain)
