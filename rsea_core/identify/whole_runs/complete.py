"""Complete laws of whole recordings, or one that is nearly all (docs/diagnosis-search.md 10.4)."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.sensor_delay import SensorDelay
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.candidate_fits import far_from_rig
from rsea_core.identify.law_search.found import Found, from_growth
from rsea_core.identify.law_search.hold_out import held_out_in_short_windows
from rsea_core.identify.law_search.search import begun, laws_of
from rsea_core.identify.multistep.command_timing import CommandTiming, timings
from rsea_core.identify.multistep.criteria import (
    ALIKE_EXCESS,
    COMPLETE,
    LEAST_EXCESS,
    LEAST_GAIN,
    LEAST_OF_LEFT,
    LEFT_OF_EACH,
    MOST_LEFT,
    MUCH_LEFT,
    NEARLY_EXPLAINED,
    NOISE_RENEWED,
    OVERSTATED_NOISE,
    SAME_END,
    SOUND,
    SOUND_IN_LEFT_NOISE,
    UNPREDICTED,
    WHOLE_LAWS,
)
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.horizons import with_best_delay, with_problem
from rsea_core.identify.multistep.timing_choice import in_timing
from rsea_core.identify.whole_runs.nearly_complete import (
    closer_to_rig,
    complete_by,
    first_law,
    in_own_share,
    nearly_complete,
)
from rsea_core.identify.whole_runs.parameters_alone import parameters_alone, with_shape
from rsea_core.identify.whole_runs.search import WholeSearch, begun_with_rival, explained_once
from rsea_core.identify.whole_runs.sensor_noise import (
    complete_below,
    converged,
    excess,
    in_noise_left_by,
    in_sensor_noise,
    is_coloured,
    misfit,
)
from rsea_core.identify.whole_runs.single_zeros import with_single_zeros
from rsea_core.identify.whole_runs.unseen import needed, unseen_share, without, without_redundant
from rsea_core.numeric.work_limit import no_work_left


def with_whole_runs(
    found: Found, say, *, again: bool = True, effects: frozenset[str] | None = None
) -> tuple[Found, Found | None]:
    """What was found, or the laws that leave nothing but the sensors' noise of whole recordings.

    Parameters
    ----------
    again : bool
        Search once more where commands act at other times with laws that are not complete.
    effects : frozenset of str or None
        Of the laws tried; None: of all that the case can have.

    Returns
    -------
    Found
    Found or None
        Where none does: the one law that leaves little more, for where windows show nothing.
    """
    return concluded(*laws_added(found, say, effects=effects), say, again=again)


def laws_added(
    found: Found, say, *, effects: frozenset[str] | None = None
) -> tuple[Found, WholeSearch]:
    """Parameters alone over whole recordings, and laws added as long as they leave too much.

    Laws that leave far less than the noise are searched again in the noise that they leave: it was
    estimated without them, and too large a noise hides which of two laws is right.

    Parameters
    ----------
    effects : frozenset of str or None
        Of the laws tried; None: of all that the case can have.
    """
    own = in_sensor_noise(found.base_estimator, found.base)
    found, search = _laws_added(found, own, say, effects)
    for _ in range(NOISE_RENEWED):
        if not search.taken or search.left() > OVERSTATED_NOISE:
            break
        say(f"whole recordings: laws leave {search.left():.2f}: again in the noise that they leave")
        own = in_noise_left_by(search.own, search.fit, apart=True)
        found, search = _laws_added(found, own, say, effects)
    return found, search


def _laws_added(
    found: Found, own: Estimator, say, effects: frozenset[str] | None
) -> tuple[Found, WholeSearch]:
    """As `laws_added`, in the noise of an estimator of whole recordings."""
    own, plain, left = parameters_alone(own, found.base, say)
    other = with_single_zeros(found, own, plain, say)
    if other is not found:
        return laws_added(other, say, effects=effects)
    say(f"whole recordings: parameters alone leave {left:.2f} deviations of the sensors' noise")
    found = replace(found, left_by_parameters=left)
    if left <= SOUND and is_coloured(found.base_estimator):
        own, plain, left = _in_noise_of_best_law(found, own, plain, say)
        found = replace(found, left_by_parameters=left, sound_below=SOUND_IN_LEFT_NOISE)
    found = replace(found, excess=excess(own, plain.hypothesis, plain.x))
    say(f"whole recordings: these errors cost {found.excess:.0f} units more than noise")
    laws = [w for w in laws_of(found) if effects is None or w.effect in effects]
    search = WholeSearch(own, plain, found, laws, complete_below(left))
    if found.needs_no_law:
        return found, search
    for _ in range(1 if found.sound else WHOLE_LAWS):
        all_taken = effects is not None and effects <= {law.effect for law in search.taken}
        if search.left() <= search.enough or all_taken or (search.taken and no_work_left()):
            break
        if not search.add(say):
            break
        little = len(search.taken) == 1 and search.excess() > MOST_LEFT * found.excess
        if little or (found.unpredicted and search.left() > MUCH_LEFT * left):
            say("whole recordings: much is left; no further law is added")
            return found, search
        search.prune(say)
        other = with_single_zeros(found, own, search.fit, say)
        if other is not found:
            return laws_added(other, say, effects=effects)
    rival = None if found.sound else begun_with_rival(search, say)
    return found, rival or search


def concluded(
    found: Found, search: WholeSearch, say, *, again: bool = True
) -> tuple[Found, Found | None]:
    """What laws added to parameters alone show, as `with_whole_runs`."""
    if found.needs_no_law:
        return found, None
    if not found.sound:
        search = search.begun_at_bound(say) or search
    if search.left() <= search.enough:
        finished = _finished(found, search, say, again=again)
        if finished is not None:
            return finished
    if found.sound:  # an error that small is not evidence of a law that explains a part of it
        return found, None
    found = replace(found, explained_once=explained_once(search))
    nearly = nearly_complete(found, search, say)
    again = again and bool(search.taken) and not no_work_left()
    other = _with_other_timing(search, say) if again else None
    if other is not None and (other[0].complete or (other[1] is not None and nearly is None)):
        return other
    return (found if nearly else replace(found, by_whole_runs=first_law(found, search))), nearly


class FirstEnd(NamedTuple):
    """What laws added to the first growth of windows show.

    Attributes
    ----------
    found : Found or None
        None if parameters are not sufficient and laws not complete.
    timing : CommandTiming or None
        With which the recordings are likelier.
    doubted : bool
        Whether values are far from the rig file's without a law (those of laws were also fitted
        from there), or commands act at other times.
    """

    found: Found | None = None
    timing: CommandTiming | None = None
    doubted: bool = True


def of_first_growth(found: Found, search: WholeSearch, say) -> FirstEnd:
    """What laws added to the first growth of windows show."""
    finished = search.left() <= search.enough
    if not (finished or found.sound):
        return FirstEnd()
    if finished and not found.needs_no_law:
        end = _finished(found, search, say, again=False)
        if end is not None and end[0].complete:
            found = end[0]
        elif not found.sound:  # an error that small is not evidence of a law
            return FirstEnd()
    own, fit, case = search.own, search.fit, search.own.problem.case
    far = not found.complete and far_from_rig(own.problem, fit.x)
    for timing in timings(case, own.problem.timing):
        if _with_timing(own, timing, fit.hypothesis, fit.x).cost < fit.cost - search.doubt():
            return FirstEnd(found, timing)
    return FirstEnd(found, doubted=far)


def _finished(
    found: Found, search: WholeSearch, say, *, again: bool
) -> tuple[Found, Found | None] | None:
    """Laws that leave little, in their best forms and compared with rivals, if they are complete.

    None where they do not predict rows unseen.
    """
    other = _without_delayed_reading(search, say, again=again)
    if other is not None:
        return other
    search.refine(say)
    search.seek_rivals(say)
    search.compare(say)
    search.predict(say)
    say(f"whole recordings: laws taken leave {search.excess():.0f} units more than noise")
    if not found.sound and search.excess() >= LEAST_EXCESS and not no_work_left():
        other = _with_other_timing(search, say, least=NEARLY_EXPLAINED) if again else None
        if other is not None and other[0].complete:
            return other
        search.add_last(say)
        other = _without_delayed_reading(search, say, again=again)
        if other is not None:
            return other
    of_log = found.sound and _within_half_a_row(search)
    complete = not of_log and search.complete(say)
    if not (complete or found.sound or of_log):
        # faster recordings held out can show a further law that those fitted hardly do, as drag
        complete = search.add_last(say, NEARLY_EXPLAINED) and search.complete(say)
    return (complete_by(found, search), None) if complete else None


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


def _without_delayed_reading(
    search: WholeSearch, say, *, again: bool
) -> tuple[Found, Found | None] | None:
    """Remove delayed readings where another timing of the commands explains as much.

    A held command changes the current at once: if it is assumed to be linear between rows, the
    current seems delayed. A delayed reading that is the only law stays where commands act at the
    same times: the fit of parameters alone has estimated their delay already.

    Returns
    -------
    tuple or None
        The search (`with_whole_runs`) with another timing that explains as much, if parameters
        suffice there, or its laws are complete or nearly so.
    """
    own, case = search.own, search.own.problem.case
    for law in [w for w in search.taken if w.kind is SensorDelay]:
        less = without(own, search.fit, law)
        for timing in (own.problem.timing, *timings(case, own.problem.timing)):
            same = timing is own.problem.timing
            if not (len(search.taken) > 1 if same else again):
                continue
            fit = _with_timing(own, timing, less.hypothesis, less.x)
            if not fit.cost < search.fit.cost + LEAST_GAIN:
                continue
            say(f"  whole recordings: another timing of commands explains as much as {law.key}")
            if same:
                search.fit, search.taken = fit, [w for w in search.taken if w is not law]
                break
            found, nearly = with_whole_runs(begun(case, timing, say), say, again=False)
            if found.complete or found.sound or nearly is not None:
                return found, nearly
    return None


def _with_timing(own: Estimator, timing: CommandTiming, h: Hypothesis, x: NDArray) -> Estimate:
    """A fit of whole recordings with a timing of the commands, from their best delay."""
    problem = MultistepProblem(own.problem.case, timing=timing, steps=own.problem.steps)
    return with_best_delay(with_problem(own, problem), h, x)


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
        fit = _with_timing(own, timing, h, search.fit.x)
        if fit.cost < search.fit.cost - least:
            say("searched again: with laws of whole recordings, commands act at other times")
            if search.left() <= search.enough:
                return in_other_timing(search, timing, say)
            return with_whole_runs(begun(case, timing, say), say, again=False)
    return None


def begins_no_better(search: WholeSearch, found: Found) -> bool:
    """Whether whole recordings are no likelier with the timing and values of another growth.

    Parameters alone and the laws taken are compared, in the noise of the other growth.
    """
    own = in_sensor_noise(found.base_estimator, found.base)
    first = search.own.problem
    problem = MultistepProblem(first.case, timing=first.timing, steps=own.problem.steps)
    before, plain = with_problem(own, problem), found.base.hypothesis
    least = SAME_END + ALIKE_EXCESS * excess(before, plain, search.plain.x)
    for h, x in ((plain, search.plain.x), (search.fit.hypothesis, search.fit.x)):
        ends = [with_best_delay(own, h, x)]
        if h is plain:
            ends.append(own.fit(h, found.base.x))
        if min(end.cost for end in ends) < before.fit(h, x).cost - least:
            return False
        least = max(least, LEAST_OF_LEFT * search.plain_excess())
    return True


def in_other_timing(search: WholeSearch, timing: CommandTiming, say) -> tuple[Found, Found | None]:
    """The search (`with_whole_runs`) with commands at other times, of laws that gained something.

    For laws that are complete: the windows are those of the search, and no horizons are grown.
    """
    found, case = search.found, search.own.problem.case
    estimator, base = in_timing(found.base_estimator, found.base, case, timing)
    found = from_growth((estimator, base, found.base_horizon), say)
    return with_whole_runs(found, say, again=False, effects=search.shortlist())


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
        return with_shape(found, own, say)
    if found.confirms_whole_runs:
        unseen = held_out_in_short_windows(found.by_whole_runs)
        if unseen is not None and unseen.gain > 0.0:
            say(f"whole recordings: windows confirm {found.steps[0].law.key}")
            return found.by_whole_runs
    say(f"whole recordings: what windows showed leaves {left:.2f}")
    if far_from_rig(found.problem, found.best.x):
        found, fit, left = closer_to_rig(found, own, fit, say)
    enough = complete_below(found.left_by_parameters)
    if left <= enough:
        found, fit = without_redundant(found, own, fit, enough, say)
    if left > enough or not all(
        needed(own, fit, step.law, without(own, fit, step.law))[0] for step in found.steps
    ):
        return found
    plain = converged(own, found.base.hypothesis, found.base.x)
    if unseen_share(found, own, fit, plain, say) >= UNPREDICTED:
        return found
    own, fit = in_own_share(own, fit)
    return replace(found, complete=True, estimator=own, best=fit, horizon=None)
