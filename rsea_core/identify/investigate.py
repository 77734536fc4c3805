"""What a case's recordings show: whole recordings first, windows where these do not suffice.

In windows one search follows, and others where its end is in doubt.

Each further search begins elsewhere: with a law whose innovations are more independent, at other
times of the commands, or with the gear's mesh in place of a rigid train. The one whose model
predicts for longest stands, of equals the likeliest (docs/diagnosis-search.md 10.4).
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rsea_core.effects.gear_backlash import GearBacklash
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.found import Found, from_growth
from rsea_core.identify.law_search.gear_mesh import (
    encoders_disagree,
    shows_lost_motion,
    with_gear_mesh,
)
from rsea_core.identify.law_search.hold_out import with_pause_shown, with_shared_recordings
from rsea_core.identify.law_search.search import add_all, begun, laws_of, searched
from rsea_core.identify.law_search.window_lengths import in_shorter_windows, predicts_closer
from rsea_core.identify.multistep.criteria import (
    DOUBTED_ERROR,
    DOUBTED_SHARE,
    FIRST_SHARE,
    LEFT_OF_EACH,
    NEEDS_NO_WINDOWS,
    TIMING_SHARE,
)
from rsea_core.identify.multistep.horizons import likelier, relative_error
from rsea_core.identify.multistep.log_nuisances import nuisances
from rsea_core.identify.multistep.timing_choice import (
    first_growth,
    grown_again,
    in_better_timing,
    in_doubt,
    with_better_timing,
)
from rsea_core.identify.whole_runs.complete import (
    begins_no_better,
    concluded,
    confirmed_by_whole_runs,
    in_other_timing,
    laws_added,
    of_first_growth,
    with_whole_runs,
)
from rsea_core.identify.whole_runs.offset_drift import with_offset_drift
from rsea_core.identify.whole_runs.parameters_alone import found_sound
from rsea_core.identify.whole_runs.sensor_noise import (
    converged,
    in_noise_left_by,
    in_sensor_noise,
    misfit,
    refitted_from_rig,
)
from rsea_core.identify.whole_runs.unseen import unpredicted_recordings
from rsea_core.numeric.work_limit import no_work_left, share_of_work
from rsea_core.recordings.case import Case


def investigate(
    case: Case, *, quick: bool = False, first_share: float = FIRST_SHARE,
    say: Callable[[str], None] = lambda _: None,
) -> Found:  # fmt: skip
    """Search for what a case's recordings show.

    Parameters
    ----------
    quick : bool
        Finish fewer candidates, each from one start.
    first_share : float
        Of the limit of work, for growths and searches of whole recordings.
    """
    recorded = case
    case, shared = with_shared_recordings(recorded)
    for file, why in shared.items():
        say(f"{file}: two thirds are fitted: {why}")
    found = None if quick else _with_lost_motion(case, say)
    if found is None:
        found, shared = _searched(case, recorded, shared, say, quick=quick, first_share=first_share)
    found.shared = shared
    if not quick:
        own, best = found.estimator, found.best
        end = converged(own, best.hypothesis, best.x)
        best = end if end.cost < best.cost else best
        found.continue_from(own, refitted_from_rig(own, best))
    best = found.best
    _, x = with_pause_shown(found, (best.hypothesis, best.x), found.horizon)
    found.best, found.pause_shown = replace(best, x=x), x is not best.x
    return found


def _searched(
    case: Case, recorded: Case, shared: dict[str, str], say, *, quick: bool, first_share: float
) -> tuple[Found, dict[str, str]]:
    """What whole recordings show, or else windows, and which recordings were shared.

    Parameters
    ----------
    case, recorded : Case
        As searched, with `shared` recordings fitted by two thirds, and as given.
    """
    nearly = None
    if quick:
        found = found_sound(begun(case, None, say, quick=True), say)
    else:
        with share_of_work(first_share):
            found, nearly = _whole_recordings(case, say)
            missed = unpredicted_recordings(found) if found.sound and not found.complete else []
            other, more = with_shared_recordings(recorded, missed)
            if more.keys() - shared.keys():  # of those long enough to be shared
                case, shared = other, more
                say(f"not predicted, searched again with two thirds of them: {', '.join(missed)}")
                found, nearly = _whole_recordings(case, say)
            wanted = nearly is not None and nearly.explained > NEEDS_NO_WINDOWS
            if wanted and not no_work_left():
                found = _with_gear_mesh_in_whole_runs(case, nearly, say)
            if nearly is None and not found.complete:
                found = with_offset_drift(found, say)
    if not (found.complete or found.sound):
        brief = quick or no_work_left()
        add_all(found, laws_of(found), say, quick=brief)
        found = _in_doubt(case, found, say, quick=brief)
        if not quick:
            found = confirmed_by_whole_runs(found, nearly, say)
    return found, shared


def _whole_recordings(case: Case, say) -> tuple[Found, Found | None]:
    """What whole recordings show (`with_whole_runs`), of one growth of windows or of several.

    A missing law leaves the first growth in doubt. Where laws of whole recordings explain what it
    leaves, no other growth is needed.
    """
    h = Hypothesis(laws=nuisances(case))
    first = first_growth(case, h, say)
    if not in_doubt(first):
        return with_whole_runs(from_growth(first, say), say)
    better = in_better_timing(first, case, say)
    found, search = laws_added(from_growth(better, say), say)
    end, timing, doubted = of_first_growth(found, search, say)
    if end is not None and not doubted:
        return end, None
    if timing is not None and not no_work_left():
        say("searched again: whole recordings are likelier with commands at other times")
        other, _ = in_other_timing(search, timing, say)
        if other.complete or other.sound:
            return other, None
    if no_work_left():
        return concluded(found, search, say)
    again = from_growth(grown_again(first, case, say), say)
    if search.left() > search.enough and begins_no_better(search, again):
        say("whole recordings are no likelier with it: the laws added before stand")
        found, nearly = concluded(found, search, say)
        return (found if found.complete or found.sound else found.in_windows_of(again)), nearly
    found, nearly = concluded(*laws_added(again, say), say)
    if end is not None and end.complete and not (found.complete or found.sound):
        say("whole recordings: the laws of the first growth of windows are complete")
        return end, None
    return found, nearly


def _with_lost_motion(case: Case, say) -> Found | None:
    """The search with the gear's mesh as a spring, if the encoders alone show lost motion.

    None if they do not, or if no backlash is found.
    """
    elastic = with_gear_mesh(case) if shows_lost_motion(case) else None
    if elastic is None:
        return None
    say("the encoders of a rigid train show lost motion: searched with an elastic gear mesh")
    found = searched(elastic[0], None, say, mesh=elastic[1])
    if not any(step.law.effect == GearBacklash.effect for step in found.steps):
        return None
    own = in_sensor_noise(found.base_estimator, found.base)
    left = misfit(own, found.base.hypothesis, found.base.x)
    return confirmed_by_whole_runs(replace(found, left_by_parameters=left), None, say)


def _in_doubt(case: Case, found: Found, say, *, quick: bool) -> Found:
    """The best of further searches, where the end of the first is in doubt."""
    left, below = found.left_by_parameters, found.sound_below
    if found.steps and not quick and not no_work_left():
        found = _better_search(found, _begun_by_contender(found, say))
        # a missing law can pass for another timing of the command
        own, fit = with_better_timing(found.estimator, found.best, case, say)
        timing, gain = own.problem.timing, found.best.cost - fit.cost
        if gain > TIMING_SHARE * min(step.gain for step in found.steps):
            say("searched again: with the laws found, commands act at other times")
            again = searched(case, timing, say, quick=quick)
            found = _better_search(found, _begun_by_contender(again, say), again)
    if not quick and _doubtful(found) and not no_work_left():
        shorter = in_shorter_windows(found, say)
        if shorter is not None:
            add_all(shorter, laws_of(shorter), say)
            found = shorter if predicts_closer(shorter, found) else found
    if not quick and encoders_disagree(found) and not no_work_left():
        found = _better_search(found, _through_gear_mesh(case, found, say))
    return replace(found, left_by_parameters=left, sound_below=below)


def _through_gear_mesh(case: Case, found: Found, say) -> Found:
    """A search with the gear's mesh as a spring; the one given where no backlash is found so."""
    elastic = with_gear_mesh(case)
    if elastic is None:
        return found
    say("searched again: the encoders of a rigid train disagree; now with an elastic gear mesh")
    other = searched(elastic[0], found.problem.timing, say, mesh=elastic[1])
    return other if other.steps else found


def _with_gear_mesh_in_whole_runs(case: Case, nearly: Found, say) -> Found:
    """Laws that are nearly complete, with backlash where the encoders of a rigid train disagree.

    The laws given stand where backlash in an elastic mesh explains little of what they leave.
    """
    left_noise = in_noise_left_by(nearly.estimator, nearly.best, apart=True)
    disagree = encoders_disagree(replace(nearly, estimator=left_noise))
    elastic = with_gear_mesh(case) if disagree else None
    if elastic is None:
        return nearly
    say("whole recordings: the encoders of a rigid train disagree; now with an elastic gear mesh")
    found = begun(elastic[0], nearly.problem.timing, say, mesh=elastic[1])
    effects = frozenset((GearBacklash.effect, *(step.law.effect for step in nearly.steps)))
    end, more = concluded(*laws_added(found, say, effects=effects), say, again=False)
    for other in (end, more):
        if other is None or not any(s.law.effect == GearBacklash.effect for s in other.steps):
            continue
        left, before = (misfit(f.estimator, f.best.hypothesis, f.best.x) for f in (other, nearly))
        if left < LEFT_OF_EACH * before:
            return other
    return nearly


def _doubtful(found: Found) -> bool:
    """Whether laws leave a machine that is not predictable, or innovations that depend."""
    own, best = found.estimator, found.best
    error = relative_error(own, best.hypothesis, best.x)
    return found.horizon is not None or own.tempering < DOUBTED_SHARE or error > DOUBTED_ERROR


def _begun_by_contender(found: Found, say) -> Found:
    """A search that begins with the first law's contender; the one given where none is in doubt."""
    contender = found.steps[0].contender if found.steps else None
    if contender is None or not _doubtful(found):
        return found
    say(f"searched again: {contender.key} first, whose innovations are more independent")
    other = found.without_laws()
    add_all(other, [w for w in laws_of(other) if w.effect == contender.effect], say)
    other.screened = found.screened  # of all laws, for the nearest names
    return other if other.steps else found


def _better_search(*searches: Found) -> Found:
    """The search whose model predicts for longest; of equals the likeliest one."""
    lengths = [np.inf if f.horizon is None else f.horizon for f in searches]
    ends = [f for f, n in zip(searches, lengths, strict=True) if n == max(lengths)]
    _, best = likelier(*((f.estimator, f.best) for f in ends))
    return next(f for f in ends if f.best is best)
