"""Where fits begin: what the screening predicts, in free runs and in short ones."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.variant import Law
from rsea_core.identify.fitting.least_squares import Fit
from rsea_core.identify.fitting.problem import Hypothesis, PreparedRecording, Problem
from rsea_core.identify.selection.criteria import (
    CLOSE,
    LAWS_TRIED,
    Search,
    far_from_prior,
    formatted,
    reset_to_prior,
    room,
    tempering_of,
)
from rsea_core.identify.selection.screening import Candidate, screen

BACKTRACK = (1.0, 0.4, 0.15, 0.05)  # shares of a linear solution that are tried as starts
SAME = 0.02  # relative difference of MSNI below which two fits have met
LEFT_FROM_PRIOR = (
    0.7  # of the parameters' prior cost, with a law that may return them to their priors
)
LEAST_DROP = 4.0  # log-likelihood units that the screening must predict
NEAR = (0.85, 0.9, 0.95, 1.0, 1.05, 1.1, 1.15)  # of a value that a fit whose run diverged has found
ALIGNED = 0.8  # of the cost at the nominal values: what a start must leave to have met a valley


def drops(chosen: Sequence[Candidate]) -> str:
    """What the screening predicts, as text."""
    return ", ".join(f"{c.law.key} {c.drop:.3g}" for c in chosen)


def chosen_of(found: Sequence[Candidate], tried: int) -> list[Candidate]:
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


def begun(
    search: Search,
    base: Fit,
    chosen: Sequence[Candidate],
    tried: int,
    recordings: Sequence[PreparedRecording] | None = None,
) -> list[tuple[Hypothesis, NDArray]]:
    """Where the best candidates' fits begin.

    The first half by what the screening predicts begins twice: at its linear solution or a part of
    it, and at the nominal values with the law's own start, for missing physics may have driven the
    parameters far away. The rest is taken by what it costs to begin with, and so is a further
    effect of a quick look.
    """
    if not chosen:
        return []
    problem, fitter = search.problem, search.fitter
    n = len(problem.nominals)
    trials, labels = [], []
    for c in chosen:
        hypothesis = Hypothesis(laws=(*base.hypothesis.laws, c.law))
        low, high = problem.bounds(hypothesis)
        for factor in BACKTRACK:
            start = c.law.scaled(c.start, factor * c.size)
            own = problem.start(Hypothesis(laws=(c.law,)), [start])[n:]
            x = np.clip(np.concatenate([base.x + factor * c.shift, own]), low, high)
            trials.append((hypothesis, x))
            labels.append((c.law.key, "linear"))
        prior_mean = np.concatenate([np.zeros(n), base.x[n:]])
        for start in dict.fromkeys((c.start, *c.law.starts)):
            own = problem.start(Hypothesis(laws=(c.law,)), [start])[n:]
            trials.append((hypothesis, np.clip(np.concatenate([prior_mean, own]), low, high)))
            labels.append((c.law.key, "prior"))
    costs = fitter.costs(trials, recordings)
    best: dict[tuple[str, str], int] = {}
    for j in np.argsort(costs):
        if np.isfinite(costs[j]):
            best.setdefault(labels[j], int(j))
    twice = search.effort.from_prior or not base.hypothesis.laws
    first = [c.law.key for c in chosen[: -(-tried // 2) if twice else 0]]
    taken = [
        best[key, begin_kind]
        for key in first
        for begin_kind in ("linear", "prior")
        if (key, begin_kind) in best
    ]
    seen = set(first)
    for (key, _direction), j in best.items():
        if len(seen) >= tried:
            break
        if key not in seen:
            seen.add(key)
            taken.append(j)
    return [trials[j] for j in taken]


def from_grids(search: Search, base: Fit, laws: Sequence[Law]) -> list[Fit]:
    """Rough fits of the laws that bring replays into step at their right values alone.

    A mode that the machine lacks shifts the beat of all that rings, a play the time at which a
    wheel meets its flanks. Parameters fitted without it have gone far to beat as the recording
    does: around them the law, right or wrong, only puts the replay out of step again. Nor is its
    effect in proportion to any value, so that no column of a screening shows where it lies. At
    the owner's values the costs of a grid do: those of a narrow valley stay in step.

    Parameters
    ----------
    base : Fit
        Its laws stay as they are, its nominal values begin at the nominal ones.
    laws : sequence of Law
        Those without a grid are passed over.
    """
    problem, fitter = search.problem, search.fitter
    n = len(problem.nominals)
    prior_mean = np.concatenate([np.zeros(n), base.x[n:]])
    tempering = tempering_of(base.msni)
    found = []
    for law in laws:
        if not law.grid:
            continue
        hypothesis = Hypothesis(laws=(*base.hypothesis.laws, law))
        low, high = problem.bounds(hypothesis)
        owns = [problem.start(Hypothesis(laws=(law,)), [values])[n:] for values in law.grid]
        starts = [np.clip(np.concatenate([prior_mean, own]), low, high) for own in owns]
        without, *costs = fitter.costs(
            [(base.hypothesis, prior_mean), *((hypothesis, x) for x in starts)]
        )
        apart: dict[tuple, int] = {}
        for j in np.argsort(costs):  # the valley where it is crossed at other values than before
            if costs[j] < ALIGNED * without:
                apart.setdefault(law.grid[j][1:], int(j))
        for j in list(apart.values())[: search.effort.kept]:
            found.append(fitter.fit(hypothesis, starts[j], iterations=4, tempering=tempering))
    return found


def align_on_grid(search: Search, fit: Fit, laws: Mapping[str, Law], say) -> Fit:
    """The fit, or one that begins near its values and is in step with the recordings.

    A law of which replays at its right values alone keep step (`from_grids`) is found by the runs
    that stay in step anyway, and by short ones: nearly right in its first value, but ending in the
    nearest minimum of the others' cost, its further values at a bound and constants far from their
    priors. Its grid is laid once more, narrow about that first value, where the machine is now
    known: at the fit's constants, and with those that moved far from their priors at their prior
    means.

    Parameters
    ----------
    laws : mapping
        All of the case, by key: the last law's richer ones with a grid are tried as well.
    """
    last = fit.hypothesis.laws[-1]
    wider = [laws.get(f"{last.effect}/{name}") for name in last.richer]
    gridded = [law for law in (last, *wider) if law is not None and law.grid]
    if not gridded or not room(search, fit):
        return fit
    problem, fitter = search.problem, search.fitter
    n, own = len(problem.nominals), sum(1 for parameter in last.unknowns if parameter.scale > 0.0)
    _, values = problem.values(fit.hypothesis, fit.x)
    far = far_from_prior(problem, fit)
    begins = (fit.x, reset_to_prior(fit, far)) if np.any(far) else (fit.x,)
    best, tempering = fit, tempering_of(fit.msni)
    for law in gridded:
        hypothesis = Hypothesis(laws=(*fit.hypothesis.laws[:-1], law))
        low, high = problem.bounds(hypothesis)
        first = values[-1][law.unknowns[0].name]
        rests = list(dict.fromkeys(point[1:] for point in law.grid))
        points = [(factor * first, *rest) for rest in rests for factor in NEAR]
        parts = [problem.start(Hypothesis(laws=(law,)), [point])[n:] for point in points]
        starts = [
            np.clip(np.concatenate([x[: x.size - own], part]), low, high)
            for x in begins for part in parts
        ]  # fmt: skip
        costs = fitter.costs([(hypothesis, x) for x in starts])
        for j in np.argsort(costs)[: search.effort.kept]:
            new = fitter.fit(hypothesis, starts[j], iterations=8, tempering=tempering)
            if search.score(new) > search.score(best):
                best = new
    if best is not fit:
        say(f"  stepped in {best.hypothesis.key}: MSNI {formatted(best.msni)}")
        search.keep(best)
    return best


def prior_restoring_candidates(
    problem: Problem, base: Fit, found: Sequence[Candidate]
) -> list[Candidate]:
    """The candidates with which parameters return to their priors, the nearest first."""
    centre, weight = problem.prior(base.hypothesis)

    def cost(x: NDArray) -> float:
        return 0.5 * float(np.sum((weight * (x - centre)) ** 2))

    near = [(cost(base.x + c.shift), j) for j, c in enumerate(found)]
    return [found[j] for after, j in sorted(near) if after < LEFT_FROM_PRIOR * cost(base.x)]


def from_short_runs(
    search: Search,
    base: Fit,
    open_laws: Sequence[Law],
    say,
    *,
    tried: int,
    count_restoring: int = 0,
) -> list[Fit]:
    """Fits of the laws that short runs propose, followed from short runs to free ones.

    Parameters
    ----------
    tried, count_restoring : int
        Laws that begin for what they explain, and for returning parameters to their priors.
    """
    fitter = search.fitter
    start = fitter.fit(base.hypothesis, base.x, iterations=8, recordings=search.short)
    tempering = tempering_of(start.msni)
    start = fitter.fit(
        base.hypothesis, start.x, iterations=4, recordings=search.short, tempering=tempering
    )
    found = screen(
        fitter, base.hypothesis, start.x, open_laws, tempering=tempering, recordings=search.short
    )
    chosen = chosen_of(found, 2 * tried) if tried else []
    restoring = (
        prior_restoring_candidates(search.problem, start, found)[:count_restoring]
        if count_restoring
        else []
    )
    say(f"short runs: MSNI {formatted(start.msni)}; {drops(chosen)}")
    if restoring:
        say("bring parameters home: " + ", ".join(c.law.key for c in restoring))
    begins: list[Fit] = []
    firsts = begun(search, start, chosen, tried, search.short)
    if restoring:
        firsts = firsts + begun(search, start, restoring, count_restoring, search.short)
    for hypothesis, x0 in firsts:
        fit = fitter.fit(hypothesis, x0, iterations=5, recordings=search.short, tempering=tempering)
        met = next((j for j, other in enumerate(begins) if _met(fit, other)), None)
        if met is None:
            begins.append(fit)
        elif fit.cost < begins[met].cost:
            begins[met] = fit
    levels = [search.likelihood(fit.msni) for fit in begins]
    fits = []
    for begin, level in zip(begins, levels, strict=True):
        line = f"  {begin.hypothesis.key}: short {formatted(begin.msni)}"
        if not level > max(levels) - CLOSE:
            say(f"{line}, not followed")
            continue
        fit = fitter.fit(
            begin.hypothesis, begin.x, iterations=4, recordings=search.longer, tempering=tempering
        )
        line += f", longer {formatted(fit.msni)}"
        fit = fitter.fit(fit.hypothesis, fit.x, iterations=3, tempering=tempering_of(base.msni))
        say(f"{line}, free {formatted(fit.msni)}")
        fits.append(fit)
    return fits


def _met(one: Fit, other: Fit) -> bool:
    """Whether two starts of a law have led to one place, as far as recordings can tell."""
    same = one.hypothesis.key == other.hypothesis.key
    return same and bool(np.allclose(one.msni, other.msni, rtol=SAME))
