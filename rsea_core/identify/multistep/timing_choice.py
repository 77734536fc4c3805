"""Which timing of the commands a search uses, and mean commands in long recordings.

Held or linear commands, at the stamps of the rows or at even times, are compared by the likelihood
of the readings (docs/diagnosis-search.md 10.2). A command that moves linearly from row to row is
simulated in `FINER` parts of each row, which multiplies the steps: where a cycle of the machine has
thousands of rows (EMPS: 5900), the mean over each row is accurate enough.
"""

from dataclasses import replace

import numpy as np

from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.multistep.command_timing import (
    AS_LOGGED,
    CommandTiming,
    RowTimes,
    timings,
)
from rsea_core.identify.multistep.criteria import (
    DOUBTED_ERROR,
    DOUBTED_SHARE,
    LINEAR_GAIN,
    LONG_ROWS,
    LOST_IN_NOISE,
    SAME_END,
    UNLIKELY_TIMING,
)
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.horizons import (
    Growth,
    best_of,
    delay_of,
    in_steps,
    parameters,
    relative_error,
    smooth,
    with_best_delay,
    with_noise,
    with_problem,
)
from rsea_core.identify.multistep.tracks import prepared
from rsea_core.numeric.work_limit import no_work_left
from rsea_core.recordings.case import Case


def parameters_with_timing(
    case: Case, h: Hypothesis, say, *, timing: CommandTiming | None = None, quick: bool = False
) -> Growth:
    """The parameters, and when commands act: held or linear between rows, at the stamps or not.

    A timing that is given is not judged. Where parameters leave dependent innovations, the fit may
    have ended at wrong values, from which another timing cannot be judged either: the horizons are
    grown again from output errors (`grown_again`).
    """
    first = first_growth(case, h, say, timing=timing, quick=quick)
    return first if quick or not in_doubt(first) else grown_again(first, case, say, timing=timing)


def first_growth(
    case: Case, h: Hypothesis, say, *, timing: CommandTiming | None = None, quick: bool = False
) -> Growth:
    """The same without another growth where the fit is in doubt; its timing is not judged then.

    A quick look does not grow again with another timing: it goes on from the refitted end.
    """
    first = parameters(MultistepProblem(case, timing=timing or AS_LOGGED), h, say)
    if timing is not None or (in_doubt(first) and not quick):
        return first
    better = in_better_timing(first, case, say)
    timing = better[0].problem.timing
    if quick or timing == AS_LOGGED:
        return better
    problem = MultistepProblem(case, timing=timing, steps=better[0].problem.steps)
    again = parameters(problem, h, say)  # grown with this timing
    return in_better_timing(best_of(better, again), case, say)  # with the new values


def in_better_timing(growth: Growth, case: Case, say) -> Growth:
    """A growth's end, refitted with the timing of the commands that is likeliest there."""
    return (*with_better_timing(*growth[:2], case, say), growth[2])


def grown_again(
    first: Growth, case: Case, say, *, timing: CommandTiming | None = None
) -> Growth:  # fmt: skip
    """The best of a growth in doubt and of growths from output errors."""
    say("the fit may have ended at wrong values: grown again from output errors")
    return best_of(first, *_grown_from_output_errors(first, case, say, timing))


def _grown_from_output_errors(
    first: Growth, case: Case, say, timing: CommandTiming | None
) -> list[Growth]:
    """Growths from output errors with one timing, or with each that is likely enough.

    If the first of them ends where the fit in doubt did, the start does not matter, and another
    timing must be likelier when it is refitted from that end. Smoothed commands differ little from
    linear ones: they must be likelier when refitted from the end of the growth with these.
    """
    h, steps, used = first[1].hypothesis, first[0].problem.steps, first[0].problem.timing
    delay = delay_of(first)
    ends: dict[CommandTiming, Growth] = {}
    more: list[Growth] = []
    least = UNLIKELY_TIMING
    others = (AS_LOGGED, *timings(case, AS_LOGGED)) if timing is None else ()
    for each in (used, *(t for t in others if t != used)):
        problem = MultistepProblem(case, timing=each, steps=steps)
        if ends and no_work_left():
            break
        if ends:
            unsmoothed = ends.get(replace(each, fast_share=1.0)) if each.smooth else None
            most = least if unsmoothed is None else -LINEAR_GAIN
            if _behind(unsmoothed or ends[used], problem) > most:
                continue
        ends[each] = parameters(problem, h, say, output_errors=True, delay=delay)
        if each == used and _ends_alike(first, ends[used]):
            least = -LINEAR_GAIN
        if each.smooth:  # from output errors the noise may end in a local maximum
            more.append(parameters(problem, h, say, delay=delay))
    return [*ends.values(), *more]


def _ends_alike(a: Growth, b: Growth) -> bool:
    """Whether two growths reach the same horizon with almost the same cost."""
    share = min(a[0].tempering, b[0].tempering)
    costs = [share * fit.negative_log_likelihood + fit.prior_cost for _, fit, _ in (a, b)]
    return a[2] == b[2] and abs(costs[0] - costs[1]) < SAME_END


def _behind(growth: Growth, problem: MultistepProblem) -> float:
    """Units by which a problem with another timing is less likely, refitted from a growth's end."""
    estimator, fit, _ = growth
    h = fit.hypothesis
    other = with_problem(estimator, problem)
    other = with_noise(other, h, with_best_delay(other, h, fit.x).x)
    return other.fit(h, fit.x).cost - fit.cost


def in_doubt(growth: Growth) -> bool:
    """Whether unknown torques may explain what other values would."""
    estimator, fit, _ = growth
    error = relative_error(estimator, fit.hypothesis, fit.x)
    return estimator.tempering < DOUBTED_SHARE or error > DOUBTED_ERROR


def with_better_timing(estimator, base, case, say) -> tuple[Estimator, Estimate]:
    """The timing of the commands that makes the readings likeliest, if another one is better."""
    tried = {estimator.problem.timing}
    for _ in range(len(RowTimes) + 2):
        others = [t for t in timings(case, estimator.problem.timing) if t not in tried]
        if not others:
            break
        tried.add(others[0])
        estimator, base = _better_timing(estimator, base, case, others[0], say)
    return estimator, base


def _better_timing(estimator, base, case, timing, say) -> tuple[Estimator, Estimate]:
    """The likelier of two timings, each with the noise that it needs.

    That of the file contract stands unless another one is likelier by `LINEAR_GAIN`.
    """
    least = -LINEAR_GAIN if timing == AS_LOGGED else LINEAR_GAIN
    h, steps = base.hypothesis, estimator.problem.steps
    other = with_problem(estimator, MultistepProblem(case, timing=timing, steps=steps))
    fit = with_best_delay(other, h, base.x)
    better = fit.cost < base.cost - least
    if not better and fit.cost < base.cost + 50.0:
        other = with_noise(other, h, fit.x)
        fit = other.fit(h, fit.x)
        better = fit.cost < base.cost - least
    hold = "linear" if timing.linear else "held"
    if timing.smooth:
        hold += f", {timing.fast_share:g} of its fast part"
    gain = base.cost - fit.cost
    say(f"command {hold}, stamps are times of {timing.rows}: {gain:.1f} units likelier")
    return _resmoothed(other, fit) if better else (estimator, base)


def in_timing(
    estimator: Estimator, base: Estimate, case: Case, timing: CommandTiming
) -> tuple[Estimator, Estimate]:
    """A fit with another timing of the commands, in the same windows."""
    problem = MultistepProblem(case, timing=timing, steps=estimator.problem.steps)
    other = with_problem(estimator, problem)
    return _resmoothed(other, with_best_delay(other, base.hypothesis, base.x))


def _resmoothed(own: Estimator, fit: Estimate) -> tuple[Estimator, Estimate]:
    """A fit in its own noise, about the motion that it shows."""
    h = fit.hypothesis
    own = with_noise(own, h, fit.x)
    fit = own.fit(h, fit.x)
    smooth(own, h, fit.x)
    own = with_noise(own.having([prepared(t) for t in own.tracks]), h, fit.x)
    return own, own.fit(h, fit.x)


def with_mean_commands(estimator: Estimator, base: Estimate) -> Estimator:
    """The estimator with undivided rows, if a recording is long and innovations hardly change.

    Short recordings keep the parts of rows: they cost little, and a complete model of a machine
    with a fine encoder would show the difference in whole recordings.
    """
    problem, trials = estimator.problem, [(base.hypothesis, base.x)]
    long = max(t.experiment.rows for t in estimator.tracks) > LONG_ROWS
    if not (long and problem.timing.linear):
        return estimator
    other = in_steps(estimator, problem.steps._replace(parts_of_row=1))
    for before, after in zip(estimator.innovations(trials), other.innovations(trials), strict=True):
        moved = np.sqrt(np.mean((before - after) ** 2, axis=(0, 1)))
        if not np.all(moved < LOST_IN_NOISE):
            return estimator
    return other
