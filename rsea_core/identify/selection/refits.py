"""Fits run on: to their end, with richer laws, with fewer effects."""

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.motor_cogging import CYCLES_TRIED, MotorCogging, cogging
from rsea_core.effects.variant import Law
from rsea_core.identify.candidates.typical_magnitudes import typical_magnitudes_of
from rsea_core.identify.fitting.least_squares import Fit
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.selection.criteria import (
    CLOSE,
    PRICE,
    ROUGH_MSNI,
    WORTH,
    Search,
    far_from_prior,
    formatted,
    reset_to_prior,
    room,
    tempering_of,
)
from rsea_core.identify.selection.screening import screen

ROOM_FOR_LAWS = 1.1
SETTLED = 1.0  # log-likelihood units that a round of iterations must still gain
SAME_START = (("bristle_rad", "presliding_rad"), ("onset_backward_rad", "onset_rad"))


def finish(search: Search, rough: Fit, leader: float = -np.inf) -> Fit:
    """The fit after more rounds, its tempering renewed in between.

    Parameters
    ----------
    leader : float
        Best score so far: a fit that stays too far behind after a round gets no other.
    """
    fit = rough
    for _ in range(search.effort.rounds):
        before = search.score(fit)
        fit = search.fitter.fit(
            fit.hypothesis, fit.x, iterations=8, tempering=tempering_of(fit.msni)
        )
        after = search.score(fit)
        if after - before < SETTLED or after < leader - CLOSE:
            break
    return fit


def settle(search: Search, fit: Fit, say) -> Fit:
    """The fit run on until it no longer gains, from where it is and from the nominal values.

    What a fit that has not converged leaves would be taken for a further effect.
    """
    best, n = fit, len(search.problem.nominals)
    prior_mean = np.concatenate([np.zeros(n), fit.x[n:]])
    others = (prior_mean,) if search.effort.from_prior and room(search, fit) else ()
    far = far_from_prior(search.problem, fit)
    fine = float(np.median(fit.msni)) < ROUGH_MSNI  # else constants stand for all that is missing
    if others and fine and fit.hypothesis.laws and np.any(far):
        others += (reset_to_prior(fit, far),)
    for start in (fit.x, *others):
        x, last = start, -np.inf
        for _ in range(search.effort.settling):
            new = search.fitter.fit(
                fit.hypothesis, x, iterations=8, tempering=tempering_of(best.msni), central=True
            )
            if search.score(new) > search.score(best):
                best = new
            if search.score(new) - last < SETTLED:
                break
            x, last = new.x, search.score(new)
    if best is not fit:
        say(f"  settled {best.hypothesis.key}: MSNI {formatted(best.msni)}")
        search.keep(best)
    return best


def with_richer_laws(search: Search, fit: Fit, laws: dict[str, Law], done: set[str], say) -> Fit:
    """The fit with the last effect's richer laws where they are worth their values.

    Constants that have moved far from their priors tell of a law that is too simple as well as
    innovations do: it spends them on what it lacks, until nothing is left. A richer law begins with
    them at their prior means too.

    Parameters
    ----------
    done : set of str
        Hypotheses that were extended from a better fit and are left out; filled.
    """
    best = fit
    last = fit.hypothesis.laws[-1]
    far = far_from_prior(search.problem, fit)
    quiet = bool(np.all(fit.msni < ROOM_FOR_LAWS) and not np.any(far))
    if last.effect == MotorCogging.effect:
        return fit if quiet else more_harmonics(search, fit, say)
    for name in last.always if quiet else (*last.richer, *last.always):
        key = f"{last.effect}/{name}"
        if key not in laws:
            continue
        law = laws[key]
        hypothesis = Hypothesis(laws=(*fit.hypothesis.laws[:-1], law))
        if hypothesis.key in done:
            continue
        done.add(hypothesis.key)
        begins = _richer_starts(search.problem, fit, law, far)
        if len(begins) > search.effort.begins:
            costs = search.fitter.costs([(hypothesis, x0) for x0 in begins])
            begins = [begins[j] for j in np.argsort(costs)[: search.effort.begins]]
        for x0 in begins:
            rich = search.fitter.fit(hypothesis, x0, iterations=6, tempering=tempering_of(fit.msni))
            search.keep(rich)
        rich = search.fits[hypothesis.key]
        behind = search.score(best) + PRICE - search.score(rich)
        # one that has not converged looks no better than a simpler one
        if search.effort.from_prior and 0.0 <= behind < CLOSE:
            rich = search.keep(finish(search, rich))
        say(f"  richer {key}: MSNI {formatted(rich.msni)}, score {search.score(rich):.1f}")
        if search.score(rich) > search.score(best) + PRICE:
            best = rich
    return best


def _richer_starts(problem: Problem, fit: Fit, law: Law, far: NDArray) -> list[NDArray]:
    """Unknowns with a richer law in place of a fit's last one, from what that one found."""
    _, values = problem.values(fit.hypothesis, fit.x)
    known = values[-1]
    for new, old in SAME_START:
        if old in known:
            known[new] = known[old]
    starts = [
        tuple(
            known.get(parameter.name, v) for parameter, v in zip(law.unknowns, start, strict=True)
        )
        for start in law.starts
    ]
    n = sum(1 for parameter in fit.hypothesis.laws[-1].unknowns if parameter.scale > 0.0)
    begins = []
    for begin in dict.fromkeys((*starts, law.starts[0])):
        own = problem.start(Hypothesis(laws=(law,)), [begin])
        for x in (fit.x, reset_to_prior(fit, far)) if np.any(far) else (fit.x,):
            begins.append(np.concatenate([x[: x.size - n], own[len(problem.nominals) :]]))
    return begins


def more_harmonics(search: Search, fit: Fit, say) -> Fit:
    """A periodic torque with one wave more, and another, while each is worth its values."""
    typical, fitter = typical_magnitudes_of(search.problem.case), search.fitter
    best = fit
    for _ in range(2):
        last = best.hypothesis.laws[-1]
        cycles = tuple(int(v) for name, v in _known(search, best) if name.startswith("cycles"))
        others = [cogging(typical, (c,)) for c in CYCLES_TRIED if c not in cycles]
        tempering = tempering_of(best.msni)
        begun = fitter.fit(
            best.hypothesis, best.x, iterations=4, recordings=search.short, tempering=tempering
        )
        found = screen(
            fitter, best.hypothesis, begun.x, others, tempering=tempering_of(begun.msni),
            recordings=search.short,
        )  # fmt: skip
        if not found:
            return best
        wave = found[0]
        law = cogging(typical, (*cycles, int(wave.start[2])))
        hypothesis = Hypothesis(laws=(*best.hypothesis.laws[:-1], law))
        n = len(search.problem.nominals)
        own = search.problem.start(Hypothesis(laws=(wave.law,)), [wave.start])[n:]
        x = np.concatenate([begun.x + wave.shift, own])
        for recordings in (search.short, search.longer, None):
            rich = fitter.fit(
                hypothesis, x, iterations=5, recordings=recordings, tempering=tempering
            )
            x = rich.x
        search.keep(rich)
        say(f"  more waves {law.key}: MSNI {formatted(rich.msni)}, score {search.score(rich):.1f}")
        if search.score(rich) <= search.score(best) + PRICE:
            return best
        best = rich
        if last.key == law.key or not room(search, best):
            break
    return best


def _known(search: Search, fit: Fit) -> list[tuple[str, float]]:
    """Values of the last law of a fit."""
    return list(search.problem.values(fit.hypothesis, fit.x)[1][-1].items())


def revisit(search: Search, fit: Fit, say) -> Fit:
    """The fit with other laws of its earlier effects where these are worth their values.

    Alone, an effect's law also had to stand for what a further effect does: together with it
    another law may do better, that with the next best score alone first.
    """
    best, n = fit, len(search.problem.nominals)
    if np.all(fit.msni < ROOM_FOR_LAWS):
        return fit
    for j, law in enumerate(fit.hypothesis.laws[:-1]):
        place = Hypothesis(laws=(law,)).places
        alone = [f for f in search.ranked() if f.hypothesis.places == place]
        others = [f for f in alone if f.hypothesis.key != law.key]
        for other in others[: search.effort.revisits]:
            laws, parts = list(best.hypothesis.laws), parts_of(search.problem, best)
            laws[j], parts[j] = other.hypothesis.laws[0], other.x[n:]
            hypothesis = Hypothesis(laws=tuple(laws))
            again = search.fitter.fit(
                hypothesis, np.concatenate([best.x[:n], *parts]), iterations=6,
                tempering=tempering_of(best.msni),
            )  # fmt: skip
            search.keep(again)
            say(
                f"  again {hypothesis.key}: MSNI {formatted(again.msni)},"
                f" score {search.score(again):.1f}"
            )
            if search.score(again) > search.score(best) + PRICE:
                best = again
    return best


def drop(search: Search, fit: Fit, say) -> Fit:
    """The fit without every effect that it can do without, unless that is known to be far worse.

    Nothing is known of it where the fit as it is, only without the law, does better than the best
    known without it: that one had ended in a hollow, and the further effect has but led out of it.
    """
    best = fit
    for law in fit.hypothesis.laws:
        rest = tuple(other for other in best.hypothesis.laws if other.key != law.key)
        if not rest:
            continue
        hypothesis = Hypothesis(laws=rest)
        known = search.fits.get(hypothesis.key)
        x0 = _without(search.problem, best, law)
        if known is not None and search.score(known) < search.score(best) - CLOSE:
            _, msni, _ = search.fitter.evaluate(hypothesis, x0[None])
            if not search.likelihood(msni[0]) > search.likelihood(known.msni):
                continue
        less = search.keep(
            search.fitter.fit(hypothesis, x0, iterations=6, tempering=tempering_of(best.msni))
        )
        if search.score(less) > search.score(best) - WORTH:
            say(f"  dropped {law.key}")
            best = less
    return best


def _without(problem: Problem, fit: Fit, far: Law) -> NDArray:
    parts = zip(fit.hypothesis.laws, parts_of(problem, fit), strict=True)
    kept = [own for law, own in parts if law.key != far.key]
    return np.concatenate([fit.x[: len(problem.nominals)], *kept])


def parts_of(problem: Problem, fit: Fit) -> list[NDArray]:
    """The unknowns of each law."""
    free = [
        sum(1 for parameter in law.unknowns if parameter.scale > 0.0) for law in fit.hypothesis.laws
    ]
    return np.split(fit.x[len(problem.nominals) :], np.cumsum(free)[:-1])
