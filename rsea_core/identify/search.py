"""The search: parameters first, one effect, richer laws, more effects, and back.

Hypotheses are compared by a score in nats: the logarithm of each recording's innovation power,
counted by how many independent stretches it holds, less the price of parameters that had to
leave their tolerance and of every free value. A law that is nearly right leaves innovations that
are small and dependent; their sheer number must not count.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.catalogue import COGGING_CYCLES, catalogue, cogging, scales_of
from rsea_core.identify.disturbances import disturbances
from rsea_core.identify.fit import Fit, Fitter
from rsea_core.identify.laws import Law
from rsea_core.identify.null_replay import REPLAYS, chance_gain, null_gains
from rsea_core.identify.problem import Bench, Hypothesis, Problem
from rsea_core.identify.screen import Candidate, screen
from rsea_core.identify.short_runs import LONGER_s, SHORT_s, short_benches

FAR = 10.0
STRETCH_s = 0.1  # innovations of a wrong law are dependent for about this long
PRICE = 2.0  # nats of each free value of a law
WORTH = 12.0  # nats that an effect must bring over parameters alone
WORTH_MORE = 20.0  # and a second one
TRIED, KEPT, LAWS_TRIED = 7, 3, 2
BACKTRACK = (1.0, 0.4, 0.15, 0.05)  # shares of a linear solution that are tried as starts
ROOM = 1.7  # power above which a further effect is looked for; for a richer law less will do
ROOM_FOR_LAWS = 1.1
CLOSE = 400.0  # nats behind the best within which a richer law could still turn it round
QUIET, AT_HOME = 1.2, 6.0  # power and prior cost of parameters that leave nothing to search for
DEPTH = 3
SETTLING, SETTLED = 5, 1.0  # rounds of iterations, and nats that one must still gain
DOUBTFUL = 60.0  # nats of gain below which chance is asked
QUICK_REPLAYS = 3
SAME_START = (("bristle_rad", "presliding_rad"), ("onset_backward_rad", "onset_rad"))
LEAST_DROP = 4.0  # nats that the screening must promise
# a further effect must take away most of what the first one left, or it only mends its law
LEFT_MOST, LEFT_SOMEWHERE = 0.7, 0.4
SHARE_OF_ALL, LEFT_CLEAR = 0.05, 0.3  # and be a part of the whole, or leave almost nothing
NOISE_POWER = 2.0  # innovation power that the noise model may leave without a mismatch
EXPLAINED = 0.35  # share of the excess (rms) that effects must explain to be the answer
NOISE_SPREAD = 0.15  # power above one that the noise model itself may be wrong by


@dataclass
class Search:
    """What a search knows; `best` is the chosen fit, `ladder` every fit with its score."""

    problem: Problem
    fitter: Fitter
    nominal_power: NDArray
    parameters: Fit
    short: list[Bench] = field(default_factory=list)
    longer: list[Bench] = field(default_factory=list)
    candidates: list[Candidate] = field(default_factory=list)
    fits: dict[str, Fit] = field(default_factory=dict)
    best: Fit | None = None
    _short_powers: dict[str, NDArray] = field(default_factory=dict)
    chance: float | None = None  # gain that chance alone reaches, where it was asked for

    def stretches(self) -> NDArray:
        """Independent stretches of each recording, times channels."""
        return np.array(
            [
                len(b.channels) * (b.recording.time_s[-1] - b.recording.time_s[0]) / STRETCH_s
                for b in self.problem.fitted
            ]
        )

    def score(self, fit: Fit) -> float:
        """Nats; larger is better."""
        power = np.maximum(fit.power, 0.8)
        if not np.all(np.isfinite(power)):
            return -np.inf
        likelihood = -0.5 * float(np.sum(self.stretches() * np.log(power)))
        free = fit.x.size - len(self.problem.nominals)
        return likelihood - fit.prior_cost - PRICE * free

    def short_power(self, fit: Fit) -> NDArray:
        """Powers (benches,) of a hypothesis fitted to short runs, from a fit to free ones."""
        known = self._short_powers.get(fit.hypothesis.key)
        if known is None:
            begun = self.fitter.fit(fit.hypothesis, fit.x, iterations=6, benches=self.short)
            _, there, _ = self.fitter.evaluate(fit.hypothesis, fit.x[None], self.short)
            known = begun.power if begun.power.sum() < there[0].sum() else there[0]
            self._short_powers[fit.hypothesis.key] = known
        return known

    def keep(self, fit: Fit) -> Fit:
        """Remember a fit if it is the best of its hypothesis."""
        known = self.fits.get(fit.hypothesis.key)
        if known is None or self.score(fit) > self.score(known):
            self.fits[fit.hypothesis.key] = fit
        return self.fits[fit.hypothesis.key]

    def ranked(self) -> list[Fit]:
        """Fits by score."""
        return sorted(self.fits.values(), key=lambda f: -self.score(f))


def excess_left(before: Fit, after: Fit) -> tuple[float, float]:
    """Shares of the excess power left by more effects: mean over recordings, and the least."""
    a = np.maximum(before.power - 1.0, 0.0) + NOISE_SPREAD
    b = np.maximum(after.power - 1.0, 0.0) + NOISE_SPREAD
    return float(np.exp(np.mean(np.log(b / a)))), float(np.min(b / a))


def explained(before: Fit, after: Fit) -> float:
    """Share of the excess that effects take away, as rms, mean over recordings."""
    had = np.maximum(before.power - 1.0, 0.0) + NOISE_SPREAD
    left = np.maximum(after.power - 1.0, 0.0) + NOISE_SPREAD
    weight = np.sqrt(had) - np.sqrt(NOISE_SPREAD)
    if np.sum(weight) < 0.3:
        return 1.0
    gone = 1.0 - np.sqrt(np.minimum(left / had, 1.0))
    return float(np.sum(weight * gone) / np.sum(weight))


def _share_of_all(search: Search, before: Fit, after: Fit) -> float:
    """Part of all that parameters left which the further effect takes away."""
    whole = np.maximum(search.parameters.power - 1.0, 0.0) + NOISE_SPREAD
    return float(np.max((before.power - after.power) / whole))


def tempering_of(power: NDArray) -> float:
    """The share that innovations count where the law at hand leaves more than noise."""
    return 1.0 / max(1.0, float(np.median(power)))


def investigate(
    problem: Problem,
    *,
    quick: bool = False,
    depth: int = DEPTH,
    say: Callable[[str], None] = lambda _: None,
) -> Search:
    """Search for what a case's recordings show."""
    fitter = Fitter(problem, far=FAR)
    plain = Hypothesis()
    x = problem.start(plain)
    _, power, _ = fitter.evaluate(plain, x[None])
    first = fitter.fit(plain, x, iterations=20)
    first = fitter.fit(plain, first.x, iterations=6, tempering=tempering_of(first.power))
    search = Search(problem=problem, fitter=fitter, nominal_power=power[0], parameters=first)
    if not np.all(first.power < QUIET):
        search.short, search.longer = short_benches(problem, SHORT_s, LONGER_s)
        first = search.parameters = _followed(search, first, say)
    first = search.parameters = _settled(search, first, say)
    search.keep(first)
    search.best = first
    say(f"parameters only: power {_words(first.power)} (nominal {_words(power[0])})")
    if np.all(first.power < QUIET) and first.prior_cost < AT_HOME:
        say("nothing above the noise is left, every parameter is at home")
        return search
    laws = catalogue(problem.case)
    if not search.short:
        search.short, search.longer = short_benches(problem, SHORT_s, LONGER_s)
    best = _add(search, first, laws, say, tried=4 if quick else TRIED)
    if best is not first:
        gain = search.score(best) - search.score(first)
        if gain < DOUBTFUL:
            replays = QUICK_REPLAYS if quick else REPLAYS
            gains = null_gains(problem, first, _null_gain(first, laws), replays=replays)
            search.chance = max(chance_gain(gains), WORTH)
            say(f"gain {gain:.1f}; on replays of parameters alone {_words(gains)},"
                f" 99 % {search.chance:.1f}")  # fmt: skip
            if gain < search.chance:
                best = first
    if not quick and best is not first:
        for _ in range(2, depth + 1):
            if best is None or best is first or not _room(search, best):
                break
            better = _add(search, best, laws, say, tried=4)
            if better is None or better is best:
                break
            best = _drop(search, better, say)
    near = bool(np.all(first.power < NOISE_POWER))
    if near and best is not first and explained(first, best) < EXPLAINED:
        best = first  # parameters leave next to nothing, and the effect takes little of that
    search.best = best
    return search


def _followed(search: Search, first: Fit, say) -> Fit:
    """Parameters alone, followed from short runs to free ones, where that ends better."""
    fitter = search.fitter
    fit = fitter.fit(first.hypothesis, first.x, iterations=8, benches=search.short)
    for benches, iterations in ((search.longer, 6), (None, 12)):
        fit = fitter.fit(
            first.hypothesis, fit.x, iterations=iterations, benches=benches,
            tempering=tempering_of(fit.power),
        )  # fmt: skip
    better = search.score(fit) > search.score(first)
    say(f"parameters by short runs: power {_words(fit.power)}{', taken' if better else ''}")
    return fit if better else first


def _null_gain(first: Fit, laws: dict[str, Law]) -> Callable[[Problem, int], float]:
    """The gain of the best law on a replay of parameters alone, by the search's own steps."""

    def gain(problem: Problem, number: int) -> float:
        fitter = Fitter(problem, far=FAR)
        base = fitter.fit(first.hypothesis, first.x, iterations=5)
        search = Search(problem=problem, fitter=fitter, nominal_power=base.power, parameters=base)
        tempering = tempering_of(base.power)
        found = screen(fitter, base.hypothesis, base.x, list(laws.values()), tempering=tempering)
        best = 0.0
        for hypothesis, x0 in _begun(search, base, _chosen(found, 6), 3):
            fit = fitter.fit(hypothesis, x0, iterations=4, tempering=tempering)
            best = max(best, search.score(fit) - search.score(base))
        return best

    return gain


def _room(search: Search, fit: Fit) -> bool:
    """Whether more than noise is left."""
    return bool(np.any(fit.power > ROOM))


def _words(power: NDArray) -> str:
    return ", ".join(f"{p:.3g}" for p in power)


def _add(search: Search, base: Fit, laws: dict[str, Law], say, *, tried: int) -> Fit:
    """The best fit with one more effect, richer laws tried; the base if none is worth it."""
    fitter, problem = search.fitter, search.problem
    open_laws = [
        law for law in laws.values()
        if law.effect not in base.hypothesis.effects or law.sensor is not None
    ]  # fmt: skip
    open_laws = [law for law in open_laws if law.key not in {o.key for o in base.hypothesis.laws}]
    if not any(law.effect == "load-disturbance" for law in base.hypothesis.laws):
        load_torque = scales_of(problem.case).load_torque_Nm
        open_laws += disturbances(fitter, base, load_torque)
    found = screen(fitter, base.hypothesis, base.x, open_laws, tempering=tempering_of(base.power))
    if not search.candidates:
        search.candidates = found
    chosen = _chosen(found, 2 * tried)
    say("screened: " + _drops(chosen))
    trials = []
    for hypothesis, x0 in _begun(search, base, chosen, tried):
        rough = fitter.fit(hypothesis, x0, iterations=3, tempering=tempering_of(base.power))
        trials.append(rough)
    trials += _from_short_runs(search, base, open_laws, say, tried=max(tried // 2, 2))
    trials.sort(key=lambda f: -search.score(f))
    finished: list[Fit] = []
    seen: set[str] = set()
    for rough in trials:
        key = rough.hypothesis.key
        if key in seen:
            continue
        seen.add(key)
        if len(finished) < KEPT:
            rough = _finish(search, rough)
            finished.append(rough)
        search.keep(rough)
        say(f"  {key}: power {_words(rough.power)}, score {search.score(rough):.1f}")
    if not finished:
        return base
    best = max(search.score(fit) for fit in finished)
    enough = search.score(base) + (WORTH if base.hypothesis.laws else 0.0)
    finished = [
        _enriched(search, fit, laws, say) if search.score(fit) > max(best - CLOSE, enough) else fit
        for fit in finished
    ]
    finished.sort(key=lambda f: -search.score(f))
    finished[0] = _settled(search, finished[0], say)
    if not base.hypothesis.laws:
        gain = search.score(finished[0]) - search.score(base)
        say(f"best {finished[0].hypothesis.key}: gain {gain:.1f}")
        return finished[0] if gain > WORTH else base
    for fit in finished:
        gain, left, most = search.score(fit) - search.score(base), *excess_left(base, fit)
        share = _share_of_all(search, base, fit)
        say(
            f"further {fit.hypothesis.key}: gain {gain:.1f}, left {left:.2f}, least {most:.2f},"
            f" share {share:.3f}"
        )
        enough = share > SHARE_OF_ALL or left < LEFT_CLEAR
        if gain > WORTH_MORE and left < LEFT_MOST and most < LEFT_SOMEWHERE and enough:
            return fit
    return base


def _drops(chosen: Sequence[Candidate]) -> str:
    return ", ".join(f"{c.law.key} {c.drop:.3g}" for c in chosen)


def _from_short_runs(
    search: Search, base: Fit, open_laws: Sequence[Law], say, *, tried: int
) -> list[Fit]:
    """Fits of the laws that short runs propose, followed from short runs to free ones."""
    fitter = search.fitter
    start = fitter.fit(base.hypothesis, base.x, iterations=8, benches=search.short)
    tempering = tempering_of(start.power)
    start = fitter.fit(
        base.hypothesis, start.x, iterations=4, benches=search.short, tempering=tempering
    )
    found = screen(
        fitter, base.hypothesis, start.x, open_laws, tempering=tempering, benches=search.short
    )
    chosen = _chosen(found, 2 * tried)
    say(f"short runs: power {_words(start.power)}; {_drops(chosen)}")
    fits = []
    for hypothesis, x0 in _begun(search, start, chosen, tried, search.short):
        fit = fitter.fit(hypothesis, x0, iterations=5, benches=search.short, tempering=tempering)
        words = f"  {hypothesis.key}: short {_words(fit.power)}"
        fit = fitter.fit(
            hypothesis, fit.x, iterations=4, benches=search.longer, tempering=tempering
        )
        words += f", longer {_words(fit.power)}"
        fit = fitter.fit(hypothesis, fit.x, iterations=3, tempering=tempering_of(base.power))
        say(f"{words}, free {_words(fit.power)}")
        fits.append(fit)
    return fits


def _finish(search: Search, rough: Fit) -> Fit:
    fit = rough
    for _ in range(2):
        fit = search.fitter.fit(
            fit.hypothesis, fit.x, iterations=8, tempering=tempering_of(fit.power)
        )
    return fit


def _settled(search: Search, fit: Fit, say) -> Fit:
    """The fit run on until it no longer gains, from where it is and from the owner's values.

    What a fit that has not arrived leaves would be taken for a further effect.
    """
    best, n = fit, len(search.problem.nominals)
    home = np.concatenate([np.zeros(n), fit.x[n:]])
    for start in (fit.x, home) if _room(search, fit) else (fit.x,):
        x, last = start, -np.inf
        for _ in range(SETTLING):
            new = search.fitter.fit(
                fit.hypothesis, x, iterations=8, tempering=tempering_of(best.power), central=True
            )
            if search.score(new) > search.score(best):
                best = new
            if search.score(new) - last < SETTLED:
                break
            x, last = new.x, search.score(new)
    if best is not fit:
        say(f"  settled {best.hypothesis.key}: power {_words(best.power)}")
        search.keep(best)
    return best


def _chosen(found: Sequence[Candidate], tried: int) -> list[Candidate]:
    """The best candidates, a few of each effect and place, best first."""
    seen: dict[tuple, int] = {}
    chosen = []
    for c in found:
        place = (c.law.effect, c.law.sensor)
        if seen.get(place, 0) == LAWS_TRIED or c.drop <= LEAST_DROP:
            continue
        seen[place] = seen.get(place, 0) + 1
        chosen.append(c)
        if len(chosen) == tried:
            break
    return chosen


def _begun(
    search: Search,
    base: Fit,
    chosen: Sequence[Candidate],
    tried: int,
    benches: Sequence[Bench] | None = None,
) -> list[tuple[Hypothesis, NDArray]]:
    """Where the best candidates' fits begin: at their linear solution or a part of it."""
    if not chosen:
        return []
    problem, fitter = search.problem, search.fitter
    n = len(problem.nominals)
    trials, owners = [], []
    for c in chosen:
        hypothesis = Hypothesis(laws=(*base.hypothesis.laws, c.law))
        low, high = problem.bounds(hypothesis)
        for factor in BACKTRACK:
            start = c.law.scaled(c.start, factor * c.size)
            own = problem.start(Hypothesis(laws=(c.law,)), [start])[n:]
            x = np.clip(np.concatenate([base.x + factor * c.shift, own]), low, high)
            trials.append((hypothesis, x))
            owners.append(c.law.key)
        # missing physics may have driven the parameters far away: the owner's values again
        home = np.concatenate([np.zeros(n), base.x[n:]])
        for start in dict.fromkeys((c.start, *c.law.starts)):
            own = problem.start(Hypothesis(laws=(c.law,)), [start])[n:]
            trials.append((hypothesis, np.clip(np.concatenate([home, own]), low, high)))
            owners.append(c.law.key)
    costs = fitter.costs(trials, benches)
    best: dict[str, int] = {}
    for j in np.argsort(costs):
        best.setdefault(owners[j], int(j))
    return [trials[j] for j in list(best.values())[:tried]]


def _enriched(search: Search, fit: Fit, laws: dict[str, Law], say) -> Fit:
    """The fit with the last effect's richer laws where they are worth their values."""
    best = fit
    last = fit.hypothesis.laws[-1]
    if np.all(fit.power < ROOM_FOR_LAWS):
        return fit
    if last.effect == "motor-cogging":
        return _more_waves(search, fit, say)
    for name in last.richer:
        key = f"{last.effect}/{name}"
        if key not in laws:
            continue
        law = laws[key]
        _, values = search.problem.values(fit.hypothesis, fit.x)
        known = values[-1]
        for new, old in SAME_START:
            if old in known:
                known[new] = known[old]
        start = tuple(
            known.get(knob.name, value)
            for knob, value in zip(law.knobs, law.starts[0], strict=True)
        )
        hypothesis = Hypothesis(laws=(*fit.hypothesis.laws[:-1], law))
        for begin in dict.fromkeys((start, law.starts[0])):
            own = search.problem.start(Hypothesis(laws=(law,)), [begin])
            n = sum(1 for knob in last.knobs if knob.scale > 0.0)
            x0 = np.concatenate([fit.x[: fit.x.size - n], own[len(search.problem.nominals) :]])
            rich = search.fitter.fit(
                hypothesis, x0, iterations=6, tempering=tempering_of(fit.power)
            )
            search.keep(rich)
        rich = search.fits[hypothesis.key]
        say(f"  richer {key}: power {_words(rich.power)}, score {search.score(rich):.1f}")
        if search.score(rich) > search.score(best) + PRICE:
            best = rich
    return best


def _more_waves(search: Search, fit: Fit, say) -> Fit:
    """A periodic torque with one wave more, and another, while each is worth its values."""
    scales, fitter = scales_of(search.problem.case), search.fitter
    best = fit
    for _ in range(2):
        last = best.hypothesis.laws[-1]
        cycles = tuple(int(v) for name, v in _known(search, best) if name.startswith("cycles"))
        others = [cogging(scales, (c,)) for c in COGGING_CYCLES if c not in cycles]
        tempering = tempering_of(best.power)
        begun = fitter.fit(
            best.hypothesis, best.x, iterations=4, benches=search.short, tempering=tempering
        )
        found = screen(
            fitter, best.hypothesis, begun.x, others, tempering=tempering_of(begun.power),
            benches=search.short,
        )  # fmt: skip
        if not found:
            return best
        wave = found[0]
        law = cogging(scales, (*cycles, int(wave.start[2])))
        hypothesis = Hypothesis(laws=(*best.hypothesis.laws[:-1], law))
        n = len(search.problem.nominals)
        own = search.problem.start(Hypothesis(laws=(wave.law,)), [wave.start])[n:]
        x = np.concatenate([begun.x + wave.shift, own])
        for benches in (search.short, search.longer, None):
            rich = fitter.fit(hypothesis, x, iterations=5, benches=benches, tempering=tempering)
            x = rich.x
        search.keep(rich)
        say(f"  more waves {law.key}: power {_words(rich.power)}, score {search.score(rich):.1f}")
        if search.score(rich) <= search.score(best) + PRICE:
            return best
        best = rich
        if last.key == law.key or not _room(search, best):
            break
    return best


def _known(search: Search, fit: Fit) -> list[tuple[str, float]]:
    """Values of the last law of a fit."""
    return list(search.problem.values(fit.hypothesis, fit.x)[1][-1].items())


def _drop(search: Search, fit: Fit, say) -> Fit:
    """The fit without every effect that it can do without."""
    best = fit
    for law in fit.hypothesis.laws:
        rest = tuple(other for other in best.hypothesis.laws if other.key != law.key)
        if not rest:
            continue
        hypothesis = Hypothesis(laws=rest)
        x0 = _without(search.problem, best, law)
        less = search.keep(
            search.fitter.fit(hypothesis, x0, iterations=6, tempering=tempering_of(best.power))
        )
        if search.score(less) > search.score(best) - WORTH:
            say(f"  dropped {law.key}")
            best = less
    return best


def _without(problem: Problem, fit: Fit, gone: Law) -> NDArray:
    parts, at = [fit.x[: len(problem.nominals)]], len(problem.nominals)
    for law in fit.hypothesis.laws:
        n = sum(1 for knob in law.knobs if knob.scale > 0.0)
        if law.key != gone.key:
            parts.append(fit.x[at : at + n])
        at += n
    return np.concatenate(parts)
