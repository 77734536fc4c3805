"""What whole recordings show: complete laws, or one that is nearly all (docs/diagnosis.md 10.4)."""

from dataclasses import replace

import numpy as np

from rsea_core.effects.sensor_delay import SensorDelay
from rsea_core.identify.law_search.candidate_fits import count_values, far_from_rig
from rsea_core.identify.law_search.found import Found, Step
from rsea_core.identify.law_search.screening import Projection
from rsea_core.identify.law_search.search import begun, laws_of
from rsea_core.identify.law_search.shape_search import shapes
from rsea_core.identify.multistep.command_timing import timings
from rsea_core.identify.multistep.criteria import (
    COMPLETE,
    COMPLETE_SHARE,
    EXPLAINED,
    EXPLAINED_TOGETHER,
    LEAST_EXCESS,
    LEAST_OF_LEFT,
    LEFT_OF_EACH,
    NEARLY_EXPLAINED,
    PER_VALUE,
    RICHER_GAIN,
    SHAPE_SHARE,
    SOUND,
    SOUND_IN_LEFT_NOISE,
    UNPREDICTED,
    WHOLE_LAWS,
)
from rsea_core.identify.multistep.estimator import Estimate, Estimator, independent_share
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.horizons import with_best_delay, with_problem
from rsea_core.identify.whole_runs.parameters_alone import parameters_alone
from rsea_core.identify.whole_runs.search import WholeSearch, best_of_each_effect, worth
from rsea_core.identify.whole_runs.sensor_noise import (
    converged,
    excess,
    in_noise_left_by,
    in_sensor_noise,
    is_coloured,
    misfit,
)
from rsea_core.identify.whole_runs.single_zeros import with_single_zeros
from rsea_core.identify.whole_runs.taken_laws import Trial
from rsea_core.identify.whole_runs.unseen import needed, unseen_share, without


def with_whole_runs(found: Found, say, *, again: bool = True) -> tuple[Found, Found | None]:
    """What was found, or the laws that leave nothing but the sensors' noise of whole recordings.

    Parameters
    ----------
    again : bool
        Search once more where commands act at other times with laws that are not complete.

    Returns
    -------
    Found
    Found or None
        Where none does: the one law that leaves little more, for where windows show nothing.
    """
    own = in_sensor_noise(found.base_estimator, found.base)
    own, plain, left = parameters_alone(own, found.base, say)
    other = with_single_zeros(found, own, plain, say)
    if other is not found:
        return with_whole_runs(other, say, again=again)
    say(f"whole recordings: parameters alone leave {left:.2f} deviations of the sensors' noise")
    found = replace(found, left_by_parameters=left)
    if left <= SOUND and is_coloured(found.base_estimator):
        own, plain, left = _in_noise_of_best_law(found, own, plain, say)
        found = replace(found, left_by_parameters=left, sound_below=SOUND_IN_LEFT_NOISE)
    found = replace(found, excess=excess(own, plain.hypothesis, plain.x))
    say(f"whole recordings: these errors cost {found.excess:.0f} units more than noise")
    if (found.sound and not found.beyond_noise) or not left < np.inf:
        return found, None
    search = WholeSearch(own, plain, found, laws_of(found), _enough(left))
    for _ in range(1 if found.sound else WHOLE_LAWS):
        if search.left() <= search.enough or not search.add(say):
            break
        search.prune(say)
        other = with_single_zeros(found, own, search.fit, say)
        if other is not found:
            return with_whole_runs(other, say, again=again)
    if not found.sound:
        search = search.begun_at_bound(say) or search
    if search.left() <= search.enough:
        finished = _finished(found, search, say, again=again)
        if finished is not None:
            return finished
    if found.sound:  # an error that small is not evidence of a law that explains a part of it
        return found, None
    nearly = _nearly_complete(found, search, say)
    other = _with_other_timing(search, say) if again and search.taken else None
    if other is not None and (other[0].complete or (other[1] is not None and nearly is None)):
        return other
    return found, nearly


def _finished(
    found: Found, search: WholeSearch, say, *, again: bool
) -> tuple[Found, Found | None] | None:
    """Laws that leave little, in their best forms and compared with rivals, if they are complete.

    None where they do not predict rows unseen.
    """
    search.refine(say)
    search.seek_rivals(say)
    search.compare(say)
    search.predict(say)
    say(f"whole recordings: laws taken leave {search.excess():.0f} units more than noise")
    if not found.sound and search.excess() >= LEAST_EXCESS:
        other = _with_other_timing(search, say, least=NEARLY_EXPLAINED) if again else None
        if other is not None and other[0].complete:
            return other
        search.add_last(say)
    of_log = found.sound and _within_half_a_row(search)
    complete = not of_log and search.complete(say)
    if not (complete or found.sound or of_log):
        # faster recordings held out can show a further law that those fitted hardly do, as drag
        complete = search.add_last(say, NEARLY_EXPLAINED) and search.complete(say)
    return (_complete(found, search), None) if complete else None


def _in_noise_of_best_law(
    found: Found, own: Estimator, plain: Estimate, say
) -> tuple[Estimator, Estimate, float]:
    """Whole recordings in the noise that the best law leaves, parameters alone, and their misfit.

    Coloured noise estimated with parameters alone may be the error of a missing law, as of a late
    reading.
    """
    search = WholeSearch(own, plain, found, laws_of(found), COMPLETE)
    trials = search.trials()
    if not trials:
        return own, plain, found.left_by_parameters
    own = in_noise_left_by(own, trials[0].fit)
    own, plain, left = parameters_alone(own, plain, say)
    say(f"  whole recordings: in the noise left by {trials[0].law.key} parameters leave {left:.2f}")
    return own, plain, left


def _within_half_a_row(search: WholeSearch) -> bool:
    """Whether the law taken is a sensor's delay of less than half a row, as sampling causes."""
    _, values = search.own.problem.values(search.fit.hypothesis, search.fit.x)
    row_s = min(t.experiment.recording.sample_time_s for t in search.own.tracks)
    late = [v["delay_s"] for law, v in zip(search.fit.hypothesis.laws, values, strict=True)
            if law.kind is SensorDelay]  # fmt: skip
    return any(abs(delay_s) < 0.5 * row_s for delay_s in late)


def _with_other_timing(
    search: WholeSearch, say, least: float = 0.0
) -> tuple[Found, Found | None] | None:
    """The search (`with_whole_runs`) with commands at other times; None where it gains nothing.

    A drag that parameters lack can make a command that moves between its rows look held.

    Parameters
    ----------
    least : float
        Share of the cost beyond noise with the laws taken, that other times must explain.
    """
    own, h, case = search.own, search.fit.hypothesis, search.own.problem.case
    least *= search.excess()
    least = max(search.doubt(), least or LEAST_OF_LEFT * search.plain_excess())
    for timing in timings(case, own.problem.timing):
        problem = MultistepProblem(case, timing=timing, steps=own.problem.steps)
        fit = with_best_delay(with_problem(own, problem), h, search.fit.x)
        if fit.cost < search.fit.cost - least:
            say("searched again: with laws of whole recordings, commands act at other times")
            return with_whole_runs(begun(case, timing, say), say, again=False)
    return None


def _nearly_complete(found: Found, search: WholeSearch, say) -> Found | None:
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
            search.fit, search.taken = trial.fit, [trial.law]
            search.rivals, search.ratios = {trial.law.key: search.first}, {trial.law.key: ratio}
            return replace(_complete(found, search), explained=explained)
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
    return replace(_complete(found, search), explained=explained)


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


def confirmed_by_whole_runs(found: Found, nearly: Found | None, say) -> Found:
    """What windows showed, marked as complete if it leaves as little of whole recordings.

    Parameters
    ----------
    nearly : Found or None
        What stands instead where windows showed nothing, or what leaves more.
    """
    if found.sound or not found.left_by_parameters < np.inf:
        return found
    own = in_sensor_noise(found.base_estimator, found.base)
    h = found.best.hypothesis
    fit = converged(own, h, found.best.x) if found.steps else found.best
    left = misfit(own, h, fit.x) if found.steps else np.inf
    if nearly is not None:
        best = nearly.best
        # a torque that acts once is flexible: it must leave clearly less than a lasting law
        share = 1.0 / LEFT_OF_EACH if found.acts_once else LEFT_OF_EACH
        if misfit(nearly.estimator, best.hypothesis, best.x) < share * left:
            return nearly
    if not found.steps:
        return _with_shape(found, own, say)
    say(f"whole recordings: what windows showed leaves {left:.2f}")
    if far_from_rig(found.problem, found.best.x):
        found, fit, left = _closer_to_rig(found, own, fit, say)
    enough = _enough(found.left_by_parameters)
    if left <= enough:
        found, fit = _without_redundant(found, own, fit, enough, say)
    if left > enough or not all(
        needed(own, fit, step.law, without(own, fit, step.law))[0] for step in found.steps
    ):
        return found
    plain = converged(own, found.base.hypothesis, found.base.x)
    if unseen_share(found, own, fit, plain, say) >= UNPREDICTED:
        return found
    own, fit = _in_own_share(own, fit)
    return replace(found, complete=True, estimator=own, best=fit, horizon=None)


def _closer_to_rig(
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
    in_own_share, taken = _in_own_share(own, best)
    return replace(found, estimator=in_own_share, best=taken, horizon=None), best, left


def _with_shape(found: Found, own: Estimator, say) -> Found:
    """What was found, and the torque of unknown shape that explains most of what parameters leave.

    In windows a slow torque can pass for noise that whole recordings do not have.
    """
    own, plain, _ = parameters_alone(own, found.base, say)
    best = next(iter(shapes(Projection(own, plain))), None)
    had = excess(own, plain.hypothesis, plain.x)
    if best is None or had == 0.0:
        return found
    share = best.held_out / had
    say(f"whole recordings: {best.sentence()}, explains {share:.2f} of the excess")
    if share < SHAPE_SHARE:
        return found
    return replace(found, base_shapes=[best, *found.base_shapes])


def _without_redundant(
    found: Found, own: Estimator, fit: Estimate, enough: float, say
) -> tuple[Found, Estimate]:
    """The search and its fit of whole recordings, without laws that leave as little if removed."""
    for step in reversed(found.steps):
        less = without(own, fit, step.law)
        if len(found.steps) > 1 and misfit(own, less.hypothesis, less.x) <= enough:
            say(f"  whole recordings: {step.law.key} is redundant")
            fit = less
            best = found.estimator.fit(less.hypothesis, less.x, iterations=8)
            steps = [other for other in found.steps if other is not step]
            found = replace(found, best=best, steps=steps)
    return found, fit


def _enough(left: float) -> float:
    """Misfit below which laws are complete, by what parameters alone leave."""
    most = float(np.sqrt(1.0 + (1.0 - EXPLAINED) * max(left**2 - 1.0, 0.0)))
    return max(min(COMPLETE, most), COMPLETE_SHARE * left)


def _in_own_share(own: Estimator, fit: Estimate) -> tuple[Estimator, Estimate]:
    """A fit of whole recordings in its own share of independent innovations."""
    own = own.having(own.tracks)
    own.tempering = independent_share(own, fit.hypothesis, fit.x)
    return own, own.fit(fit.hypothesis, fit.x, iterations=4)


def _complete(found: Found, search: WholeSearch) -> Found:
    """The search's laws as what was found."""
    own, fit = _in_own_share(search.own, search.fit)
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
