"""The search: parameters first, one effect, richer laws, more effects, and back.

Hypotheses are compared by a score in log-likelihood units: the logarithm of each recording's MSNI,
counted by how many independent blocks it holds, less the price of parameters that had to
leave their tolerance and of every free value. A law that is nearly right leaves innovations that
are small and dependent; their sheer number must not count.
"""

from collections.abc import Callable

import numpy as np

from rsea_core.effects.load_disturbance import LoadDisturbance
from rsea_core.effects.load_unbalance import LoadUnbalance
from rsea_core.effects.variant import Law
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.candidates.typical_magnitudes import typical_magnitudes_of
from rsea_core.identify.fitting.least_squares import Fit, Fitter
from rsea_core.identify.fitting.problem import Hypothesis, Problem, require_replays
from rsea_core.identify.fitting.short_windows import LONGER_s, SHORT_s, prepared_for_short_runs
from rsea_core.identify.locate.pulse_detection import disturbances
from rsea_core.identify.selection.common_scale_factor import reading_scale
from rsea_core.identify.selection.criteria import (
    CLOSE,
    DOUBTFUL_GAIN,
    EXPLAINED,
    FAR,
    FULL,
    LEFT_CLEAR,
    LEFT_MOST,
    LEFT_SOMEWHERE,
    NEAR_NOISE_MSNI,
    NOISE_MSNI,
    PRICE,
    QUICK,
    QUIET_MSNI,
    QUIET_PRIOR_COST,
    ROOM,
    ROUGH_MSNI,
    SHARE_OF_ALL,
    UNREACHABLE,
    UNREPEATABLE_GAIN,
    WORTH,
    WORTH_FURTHER,
    Search,
    excess_left,
    explained,
    formatted,
    room,
    share_of_all,
    tempering_of,
)
from rsea_core.identify.selection.false_alarm_rate import bootstrap_gains, false_alarm_threshold
from rsea_core.identify.selection.final_refinement import final_refinement, restore_prior
from rsea_core.identify.selection.refits import drop, finish, revisit, settle, with_richer_laws
from rsea_core.identify.selection.screened_promise import record_predictions
from rsea_core.identify.selection.screening import Candidate, screen
from rsea_core.identify.selection.starting_points import (
    align_on_grid,
    begun,
    chosen_of,
    drops,
    from_grids,
    from_short_runs,
)

PRIOR_RESTORING = 3  # laws that are tried for returning parameters to their priors


def investigate(
    problem: Problem,
    *,
    quick: bool = False,
    depth: int | None = None,
    say: Callable[[str], None] = lambda _: None,
) -> Search:
    """Search for what a case's recordings show.

    Parameters
    ----------
    quick : bool
        Try less, and look for a second effect only where one explains too little.
    depth : int or None
        Effects that are looked for at most; None: what `Effort` says.
    """
    effort = QUICK if quick else FULL
    fitter = Fitter(problem, far=FAR, reuses=effort.reuses)
    plain = Hypothesis()
    x = problem.start(plain)
    _, msni, _ = fitter.evaluate(plain, x[None])
    require_replays(problem, msni[0])
    first = fitter.fit(plain, x, iterations=20)
    first = fitter.fit(plain, first.x, iterations=6, tempering=tempering_of(first.msni))
    search = Search(
        problem=problem, fitter=fitter, nominal_msni=msni[0], parameters=first, effort=effort
    )
    if not np.all(first.msni < QUIET_MSNI):
        search.short, search.longer = prepared_for_short_runs(problem, SHORT_s, LONGER_s)
        first = search.parameters = _followed(search, first, say)
    first = settle(search, first, say)
    if effort.from_prior:
        first = final_refinement(fitter, first)
    search.parameters = search.fits[first.hypothesis.key] = first
    search.best = first
    say(f"parameters only: MSNI {formatted(first.msni)} (nominal {formatted(msni[0])})")
    laws = catalogue(problem.case)
    if np.all(first.msni < QUIET_MSNI) and first.prior_cost < QUIET_PRIOR_COST:
        say("nothing above the noise is left, every parameter is at its prior mean")
        search.best = reading_scale(search, first, laws, say)  # or all moved by a common factor
        return search
    if not search.short:
        search.short, search.longer = prepared_for_short_runs(problem, SHORT_s, LONGER_s)
    best = _first_effect(search, laws, say)
    if best is not first:
        best = _further_effects(search, best, laws, say, effort.effects if depth is None else depth)
    near = bool(np.all(first.msni < NOISE_MSNI))
    if near and best is not first and explained(first, best) < EXPLAINED:
        best = first  # parameters leave next to nothing, and the effect takes little of that
    search.best = reading_scale(search, best, laws, say)
    return search


def _first_effect(search: Search, laws: dict[str, Law], say) -> Fit:
    """The best fit with one effect; parameters alone where chance could gain as much."""
    first, effort = search.parameters, search.effort
    best = _add(search, first, laws, say, tried=effort.tried, short_tried=effort.short_tried)
    if best is first:
        return first
    gain = search.score(best) - search.score(first)
    if gain < DOUBTFUL_GAIN:
        search.false_alarm_gain = _false_alarm_threshold(search, best, laws, say)
        say(f"gain {gain:.1f}; by chance {search.false_alarm_gain:.1f}")
        if gain < search.false_alarm_gain:
            return first
    return best


def _further_effects(search: Search, best: Fit, laws: dict[str, Law], say, most: int) -> Fit:
    """Further effects, one by one, up to `most` in all, while the last fit leaves something."""
    first, effort = search.parameters, search.effort
    for _ in range(2, most + 1):
        if best is first:
            break
        if is_far_from_prior(best):
            best = restore_prior(search.fitter, best)
            if not leaves_more_than_noise(search, best):  # priors alone are left to gain
                best = reading_scale(search, best, laws, say)
        if not (leaves_more_than_noise(search, best) or is_far_from_prior(best)):
            break
        if effort.contented and explained(first, best) >= EXPLAINED:
            break
        tried = effort.tried_more
        better = _add(search, best, laws, say, tried=tried, short_tried=tried // 2)
        if better is best:
            break
        best = drop(search, revisit(search, better, say), say)
    return best


def leaves_more_than_noise(search: Search, fit: Fit) -> bool:
    """Whether laws leave more than noise of a recording, in its free run and in short ones.

    Where a joint sticks or a torque follows the motor's angle, a free run with a nearly right law
    still diverges from the recording, and many wrong laws reduce that error. Physics that the law
    lacks is missing in short runs too.
    """
    return room(search, fit) and bool(np.any((fit.msni > ROOM) & (search.short_msni(fit) > ROOM)))


def is_far_from_prior(fit: Fit) -> bool:
    """Whether parameters are so far from their priors that a law could be worth returning them.

    A torque sensor's wrong scale leaves no power together with another effect: it takes all torques
    of the machine along. A law of one value cannot be worth more than what their priors cost.
    """
    return fit.prior_cost > WORTH_FURTHER + PRICE


def _cannot_reach_threshold(base: Fit, fit: Fit) -> bool:
    """Whether a further effect has taken away so little that no settling will make it enough."""
    left, most = excess_left(base, fit)
    return (
        left > UNREACHABLE and most > LEFT_MOST and base.prior_cost - fit.prior_cost < WORTH_FURTHER
    )


def restores_prior(search: Search, base: Fit, fit: Fit) -> bool:
    """Whether a further effect takes away most of what the parameters cost."""
    gain = search.score(fit) - search.score(base)
    less = min(base.prior_cost - fit.prior_cost, gain)
    return less > WORTH_FURTHER and fit.prior_cost < LEFT_SOMEWHERE * base.prior_cost


def gains_in_short_runs(search: Search, base: Fit, fit: Fit, say) -> bool:
    """Whether a further effect is worth as much in short runs.

    A gain in free runs alone may be that of runs that had diverged and no longer do. Not asked of a
    sensor, whose readings short runs begin at, nor where every free run comes down to the noise. Of
    a part that swings by itself short runs do not know where it is when they begin: it must reduce
    the error of every free run that has more than noise, and bring the parameters nearer to their
    priors. An effect that stops one run from diverging by chance does neither.
    """
    last = fit.hypothesis.laws[-1]
    if last.sensor is not None or not room(search, fit):
        return True
    if last.swings:
        clear = base.msni > NOISE_MSNI
        return bool(np.all(fit.msni[clear] < base.msni[clear])) and fit.prior_cost < base.prior_cost
    gain = search.likelihood(search.short_msni(fit)) - search.likelihood(search.short_msni(base))
    say(f"  in short runs: gain {gain:.1f}")
    return gain > WORTH_FURTHER


def _false_alarm_threshold(search: Search, best: Fit, laws: dict[str, Law], say) -> float:
    """The gain that chance may reach; by replays of the null where they can decide."""
    first = search.parameters
    if np.all(first.msni < NEAR_NOISE_MSNI) and best.hypothesis.effects != (LoadUnbalance.effect,):
        return UNREPEATABLE_GAIN  # not below what is doubtful: no replay would make it less
    gains = bootstrap_gains(
        search.problem, first, _bootstrap_gain(search, laws), replays=search.effort.replays
    )
    found = false_alarm_threshold(gains)
    say(f"on replays of parameters alone {formatted(gains)}, 99 % {found:.1f}")
    return max(found, WORTH)


def _followed(search: Search, first: Fit, say) -> Fit:
    """Parameters alone, followed from short runs to free ones, where that ends better."""
    fitter = search.fitter
    fit = fitter.fit(first.hypothesis, first.x, iterations=8, recordings=search.short)
    for recordings, iterations in ((search.longer, 6), (None, 12)):
        fit = fitter.fit(
            first.hypothesis, fit.x, iterations=iterations, recordings=recordings,
            tempering=tempering_of(fit.msni),
        )  # fmt: skip
    better = search.score(fit) > search.score(first)
    say(f"parameters by short runs: MSNI {formatted(fit.msni)}{', taken' if better else ''}")
    return fit if better else first


def _bootstrap_gain(search: Search, laws: dict[str, Law]) -> Callable[[Problem, int], float]:
    """The gain of the best law on a replay of parameters alone, by the search's own steps."""
    first, reuses = search.parameters, search.effort.reuses

    def gain(problem: Problem, number: int) -> float:
        fitter = Fitter(problem, far=FAR, reuses=reuses)
        base = fitter.fit(first.hypothesis, first.x, iterations=5)
        search = Search(problem=problem, fitter=fitter, nominal_msni=base.msni, parameters=base)
        tempering = tempering_of(base.msni)
        seen = [law for law in laws.values() if not law.follows]
        found = screen(fitter, base.hypothesis, base.x, seen, tempering=tempering)
        best = 0.0
        for hypothesis, x0 in begun(search, base, chosen_of(found, 6), 3):
            fit = fitter.fit(hypothesis, x0, iterations=4, tempering=tempering)
            best = max(best, search.score(fit) - search.score(base))
        return best

    return gain


def _add(
    search: Search, base: Fit, laws: dict[str, Law], say, *, tried: int, short_tried: int
) -> Fit:
    """The best fit with one more effect, richer laws tried; the base if none is worth it."""
    effort, further = search.effort, bool(base.hypothesis.laws)
    open_laws = _open_laws(search, base, laws)
    found: list[Candidate] = []
    # a free run that has diverged says little of what comes next
    if not (further and effort.contented and np.median(base.msni) > ROUGH_MSNI):
        tempering = tempering_of(base.msni)
        found = screen(search.fitter, base.hypothesis, base.x, open_laws, tempering=tempering)
    if not search.candidates:
        search.candidates = found
    record_predictions(search, base, found)
    chosen = chosen_of(found, 2 * tried)
    say("screened: " + drops(chosen))
    count_restoring = PRIOR_RESTORING if further and is_far_from_prior(base) else 0
    priors_only = further and not leaves_more_than_noise(search, base)
    if priors_only:  # priors alone are left to gain
        chosen, short_tried = [], 0
    trials = []
    for hypothesis, x0 in begun(search, base, chosen, tried):
        tempering = tempering_of(base.msni)
        trials.append(search.fitter.fit(hypothesis, x0, iterations=3, tempering=tempering))
    if not priors_only and not (further and effort.contented):
        trials += from_grids(search, base, open_laws)
    trials += from_short_runs(
        search, base, open_laws, say, tried=short_tried, count_restoring=count_restoring
    )  # fmt: skip
    finished = _finished(search, trials, say)
    if not finished:
        return base
    finished = _with_richer(search, base, finished, laws, say, restore=count_restoring > 0)
    if further:
        return _worth_adding(search, base, finished, say)
    gain = search.score(finished[0]) - search.score(base)
    say(f"best {finished[0].hypothesis.key}: gain {gain:.1f}")
    return finished[0] if gain > WORTH else base


def _open_laws(search: Search, base: Fit, laws: dict[str, Law]) -> list[Law]:
    """The laws that a further effect may have, disturbances of the load where they show."""
    later = {f"{law.effect}/{name}" for law in laws.values() for name in law.always}
    found = [
        law for key, law in laws.items()
        if key not in later
        and not law.follows
        and (law.effect not in base.hypothesis.effects or law.sensor is not None)
    ]  # fmt: skip
    found = [law for law in found if law.key not in {o.key for o in base.hypothesis.laws}]
    if not any(law.effect == LoadDisturbance.effect for law in base.hypothesis.laws):
        load_torque = typical_magnitudes_of(search.problem.case).load_torque_Nm
        found += disturbances(search.fitter, base, load_torque)
    return found


def _finished(search: Search, trials: list[Fit], say) -> list[Fit]:
    """The best trials of different laws, fitted to their ends."""
    trials.sort(key=lambda f: -search.score(f))
    finished: list[Fit] = []
    seen: set[str] = set()
    for rough in trials:
        key = rough.hypothesis.key
        if key in seen:
            continue
        seen.add(key)
        if len(finished) < search.effort.kept:
            leader = max((search.score(fit) for fit in finished), default=-np.inf)
            rough = finish(search, rough, leader)
            finished.append(rough)
        search.keep(rough)
        say(f"  {key}: MSNI {formatted(rough.msni)}, score {search.score(rough):.1f}")
    return finished


def _with_richer(
    search: Search, base: Fit, finished: list[Fit], laws: dict[str, Law], say, *, restore: bool
) -> list[Fit]:
    """The fits with richer laws where they are near the best one, best first, those settled."""
    best = max(search.score(fit) for fit in finished)
    enough = search.score(base) + (WORTH if base.hypothesis.laws else 0.0)
    if restore:
        finished = [search.keep(restore_prior(search.fitter, fit)) for fit in finished]
    finished.sort(key=lambda f: -search.score(f))
    worth = [search.score(fit) > max(best - CLOSE, enough) for fit in finished]
    done: set[str] = set()
    finished = [
        with_richer_laws(search, fit, laws, done, say)
        if close and number < search.effort.richer
        else fit
        for number, (fit, close) in enumerate(zip(finished, worth, strict=True))
    ]
    # together with a law that is not quite the machine's, much likelihood is worth little prior
    judge = search.tempered if base.hypothesis.laws else search.score
    finished.sort(key=lambda f: -judge(f))
    likeliest = int(np.argmax([search.score(f) for f in finished]))
    for number in dict.fromkeys((0, likeliest)):
        if not (base.hypothesis.laws and _cannot_reach_threshold(base, finished[number])):
            fit = align_on_grid(search, finished[number], laws, say)
            finished[number] = settle(search, fit, say)
    return finished


def _worth_adding(search: Search, base: Fit, finished: list[Fit], say) -> Fit:
    """The first fit whose further effect is worth its place; the base if none is."""
    for fit in finished:
        gain, left, most = search.score(fit) - search.score(base), *excess_left(base, fit)
        share = share_of_all(search, base, fit)
        say(
            f"further {fit.hypothesis.key}: gain {gain:.1f}, left {left:.2f}, least {most:.2f},"
            f" share {share:.3f}, priors {base.prior_cost:.1f} to {fit.prior_cost:.1f}"
        )
        enough = share > SHARE_OF_ALL or left < LEFT_CLEAR
        enough = enough and left < LEFT_MOST and most < LEFT_SOMEWHERE and gain > WORTH_FURTHER
        if restores_prior(search, base, fit) or (
            enough and gains_in_short_runs(search, base, fit, say)
        ):
            return fit
    return base
