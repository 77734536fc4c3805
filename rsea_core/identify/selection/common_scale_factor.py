"""Constants that all had to move by a common factor: the scale of a reading.

A scale error of a reading is mimicked by the machine's own constants: a torque sensor that reads 19
% too much looks like a motor, wheel, spring, mass and friction that are all 19 % too large, and
nothing is left in the innovations to look for. What tells is what that costs: each constant leaves
its tolerance, and all return to their priors where the one scale is freed. So it is asked after the
search, by the priors, where the thresholds for innovations (MSNI that is left, gains that chance
reaches) cannot see it. Only scales are: an effect that stands in for a single constant would always
find one.

A smaller scale costs the constants less than their tolerances forgive, all the more one of the
current, which only resistance, inductance and torque constant pay for. What still tells is that
they share their factor, and that the owner knows the other constants better (`prior_accuracy`). At
odds of a thousand to one a scale is named for that; at less the two are both said.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.sensor_scale import SensorScale
from rsea_core.effects.variant import Law
from rsea_core.identify.fitting.jacobian import (
    ELECTRIC,
    FACTOR,
    LED,
    SENSED,
    current_direction,
    current_factor,
    torque_direction,
    torque_factor,
)
from rsea_core.identify.fitting.least_squares import Fit
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.selection.criteria import (
    NOISE_MSNI,
    SCALE_FARTHEST,
    SCALE_GAIN,
    SCALE_LOG_ODDS,
    SCALE_OVER_OTHER_CAUSE,
    SCALE_PRIOR_SHARE,
    SCALE_REPORTED,
    Search,
    SharedFactor,
    tempering_of,
)
from rsea_core.identify.selection.final_refinement import restore_prior
from rsea_core.identify.selection.prior_accuracy import KNOWN, shared_factor
from rsea_core.identify.selection.screening import Candidate, screen

SLACK = 2.0  # log-likelihood units that the line of a scale may be out by before it is fitted
PASSES = 2
TOGETHER: tuple[dict[str, float], ...] = (
    {  # a winding of more turns
        "terminal_resistance_ohm": 2.0, "terminal_inductance_H": 2.0,
        "torque_constant_Nm_per_A": 1.0, "back_emf_constant_Vs_per_rad": 1.0,
    },
    {"torque_constant_Nm_per_A": 1.0, "back_emf_constant_Vs_per_rad": 1.0},  # a stronger magnet
    {"load_mass_kg": 1.0, "load_inertia_kgm2": 1.0},  # a heavier load
)  # fmt: skip
"""Other causes, and the powers of their factor that constants move by."""
FEWEST = 3  # constants that a factor is read from
NAMED = 3  # that a sentence names
MOST_REPORTED = 14.0  # log odds that are written, at most


def returned_to_prior(before: Fit, after: Fit, constants: int) -> bool:
    """Whether a fit's constants returned to their priors in another: their moves cost little now.

    And none left their priors for it. A heavier load has more mass and more inertia, but the
    motor's and the spring's constants stay where they are; a scale of the torque would take them
    along.

    Parameters
    ----------
    constants : int
        How many of the unknowns are the rig's own.
    """
    saved = before.prior_cost - after.prior_cost
    return (
        _none_left_prior(before, after, constants)
        and saved > SCALE_GAIN
        and after.prior_cost < SCALE_PRIOR_SHARE * before.prior_cost
    )


def _none_left_prior(before: Fit, after: Fit, constants: int) -> bool:
    was, now = (np.abs(fit.x[:constants]) for fit in (before, after))
    return bool(np.all(now <= np.maximum(was, SCALE_FARTHEST)))


def reading_scale(search: Search, best: Fit, laws: Mapping[str, Law], say) -> Fit:
    """The fit with the scale of one reading more, if that returns its constants to their priors.

    What the constants say of a scale is left in `Search.shared`.
    """
    mine = {law.key for law in best.hypothesis.laws}
    scale_laws = [
        law for law in laws.values() if law.effect == SensorScale.effect and law.key not in mine
    ]
    suspects = {law.sensor: shared_by(search, best, law) for law in scale_laws}
    likely = {
        c for c, shared in suspects.items() if shared and shared.log_odds > SCALE_LOG_ODDS - SLACK
    }
    if best.prior_cost < SCALE_GAIN:
        scale_laws = [law for law in scale_laws if law.sensor in likely]
    if named_scale(search, best) is None:
        phrase = [shared for shared in suspects.values() if shared is not None]
        search.shared = max(phrase, key=lambda shared: shared.log_odds, default=None)
    fitter, problem, tempering = search.fitter, search.problem, tempering_of(best.msni)
    n = len(problem.nominals)
    best_gain, chosen = 0.0, best
    for start, direction in _scale_starts(search, best, scale_laws, tempering):
        hypothesis = start.hypothesis
        x = _restored(search, start, direction)
        column = hypothesis.laws[-1].sensor
        costs = 0.0 if column in likely else max(SCALE_GAIN, best_gain)
        if best.prior_cost - _cost(problem, hypothesis, x) < costs:
            continue
        fit = fitter.fit(hypothesis, x, iterations=4, tempering=tempering, central=True)
        for _ in range(PASSES):  # what priors alone settle is below what ends a fit
            if not search.score(fit) > search.score(best):
                break
            x = _restored(search, fit, direction)
            new = fitter.fit(hypothesis, x, iterations=8, tempering=tempering, central=True)
            fit = max(fit, new, key=search.score)
        fit = search.keep(fit)  # or the search's own, where that ended better
        gain = search.score(fit) - search.score(best)
        odds = _odds(search, best, fit) if column in likely else -np.inf
        say(
            f"scale {fit.hypothesis.key}: gain {gain:.1f}, constants cost {best.prior_cost:.1f},"
            f" then {fit.prior_cost:.1f}; odds {odds:.1f}"
        )
        named = gain > SCALE_GAIN and returned_to_prior(best, fit, n)
        named |= odds > SCALE_LOG_ODDS and _none_left_prior(best, fit, n)
        if named and max(gain, odds) > best_gain:
            best_gain, chosen = max(gain, odds), fit
            if odds > SCALE_LOG_ODDS:
                factor = float(np.log(problem.values(fit.hypothesis, fit.x)[1][-1]["scale"]))
                search.shared = replace(suspects[column], log_odds=odds, factor=factor)
        elif column in likely and search.shared is suspects[column]:  # the fit knows better
            search.shared = replace(suspects[column], log_odds=odds)
    return chosen


def named_scale(search: Search, fit: Fit) -> SharedFactor | None:
    """What the constants say of a scale that a fit names, where they alone would name it."""
    shared = search.shared
    named = {law.sensor for law in fit.hypothesis.laws if law.effect == SensorScale.effect}
    if shared is None or shared.column not in named or not shared.log_odds > SCALE_LOG_ODDS:
        return None
    return shared


def scale_sentence(search: Search, fit: Fit) -> str | None:
    """What these recordings do not tell from a reading's scale, or a scale from; None: nothing."""
    shared = search.shared
    if shared is None or not (shared.alone > SCALE_REPORTED and shared.log_odds > 0.0):
        return None
    named = named_scale(search, fit)
    if named is None and shared.log_odds > SCALE_LOG_ODDS:
        return None  # it was fitted, and it is not that
    scale, odds = f"{np.exp(shared.factor):.3g}", np.exp(min(shared.log_odds, MOST_REPORTED))
    phrase = f"{float(f'{odds:.0e}'):,.0f} times less likely" + ("" if named else ", not enough")
    return (
        f"{shared.column} in a scale of {scale} leaves the same readings as a common factor of all"
        f" of {constants_phrase(shared.constants)}; by what the constants say, that or what else"
        f" moves them together is {phrase}; one of these constants measured (and named under"
        " [anchor]),"
        " or the sensor compared with another, settles it"
    )


def constants_phrase(names: Sequence[str]) -> str:
    """Some constants by name, and how many more."""
    more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return ", ".join(names[:NAMED]) + more


def shared_by(search: Search, fit: Fit, law: Law) -> SharedFactor | None:
    """What a fit's constants alone say of a reading's scale; None where they cannot tell.

    They can where nothing is left that they stand in for, and enough of them are known: three, as
    two bad ones are nothing rare, and of a torque sensor's two at least of motor and spring, as
    mass, inertia and friction of another load share a factor too.
    """
    problem, n = search.problem, len(search.problem.nominals)
    line = {SENSED: torque_direction, LED: current_direction}.get((law.effect, law.sensor))
    if line is None or fit.hessian is None or fit.hessian.shape != (fit.x.size, fit.x.size):
        return None
    direction, std = line(problem, fit)[:n] / FACTOR, _known(search, fit)
    seen = (direction != 0.0) & (std < KNOWN)
    names = tuple(p.key for p, one in zip(problem.nominals, seen, strict=True) if one)
    own = [name for name in names if not name.startswith(("load_", "contact_"))]
    if len(names) < FEWEST or len(own) < FEWEST - 1 or np.any(fit.msni > NOISE_MSNI):
        return None
    log_odds, alone, factor = scale_odds(problem, fit.x[:n], std, direction)
    return SharedFactor(
        column=law.sensor, log_odds=log_odds, alone=alone, factor=factor, constants=names
    )


def scale_odds(
    problem: Problem, moves: NDArray, std: NDArray, direction: NDArray
) -> tuple[float, float, float]:
    """Odds [log-likelihood] of a scale, those against errors alone, and its logarithm
    (`shared_factor`).

    Another cause that is not clearly less likely leaves only the odds against it.
    """
    alone, factor = shared_factor(moves, std, direction)
    log_odds = alone
    for cause in TOGETHER:
        other = [cause.get(p.key, 0.0) / p.tolerance for p in problem.nominals]
        ahead = alone - shared_factor(moves, std, np.array(other))[0]
        log_odds = log_odds if ahead > SCALE_OVER_OTHER_CAUSE else min(log_odds, ahead)
    return log_odds, alone, factor


def _known(search: Search, fit: Fit) -> NDArray:
    """Standard deviations (n,) of the constants, in tolerances, by the fit's own derivatives.

    Those say too much along the common factor of volts, resistance, inductance and back-EMF, which
    no reading shows: what they say of it is left out.
    """
    problem, n = search.problem, len(search.problem.nominals)
    _, weight = problem.prior(fit.hypothesis)
    hessian = fit.hessian
    direction = np.zeros(fit.x.size)
    for j, p in enumerate(problem.nominals):
        if p.key in ELECTRIC and not p.additive:
            direction[j] = 1.0 / p.tolerance
    curvature = hessian @ direction
    if direction @ curvature > 0.0:
        hessian = hessian - np.outer(curvature, curvature) / (direction @ curvature)
    wide = np.linalg.pinv(hessian + np.diag(weight**2 + 1e-9), hermitian=True)
    return np.sqrt(np.maximum(np.diag(wide), 0.0))[:n]


def _odds(search: Search, before: Fit, after: Fit) -> float:
    """Log-likelihood units by which a scale is likelier than constants that all have their own
    errors."""
    n = len(search.problem.nominals)
    if before.hessian is None or before.hessian.shape != (before.x.size, before.x.size):
        return -np.inf
    factor = after.x[-1] * after.hypothesis.laws[-1].unknowns[0].scale
    if factor == 0.0:
        return -np.inf
    direction = (before.x[:n] - after.x[:n]) / factor
    log_odds, _, _ = scale_odds(search.problem, before.x[:n], _known(search, before), direction)
    return log_odds + search.likelihood(after.msni) - search.likelihood(before.msni)


def _scale_starts(
    search: Search, best: Fit, scale_laws: Sequence[Law], tempering: float
) -> list[tuple[Fit, NDArray | None]]:
    """The fit with each scale, at one, and the line along which it takes the constants' place."""
    if not scale_laws:
        return []
    found = screen(search.fitter, best.hypothesis, best.x, scale_laws, tempering=tempering)
    return [_along(search, best, c) for c in found]


def _cost(problem: Problem, hypothesis: Hypothesis, x: NDArray) -> float:
    """What the priors of unknowns (n,) cost, in log-likelihood units."""
    centre, weight = problem.prior(hypothesis)
    return 0.5 * float(np.sum((weight * (x - centre)) ** 2))


def _along(search: Search, best: Fit, c: Candidate) -> tuple[Fit, NDArray | None]:
    """The fit with a scale of one, and the line (n,) along which the scale takes its place.

    All torques by a common factor are known to be such a line, and what makes and turns the current
    (None: `refine.from_prior` goes along it). For any other scale it is the screening's shift:
    innovations stay along it, whatever the length, for constants and scales are logarithms both.
    Where cogging or play throw a replay out, differences are too coarse for that.
    """
    problem = search.problem
    hypothesis = Hypothesis(laws=(*best.hypothesis.laws, c.law))
    start = replace(best, hypothesis=hypothesis, x=np.append(best.x, 0.0), hessian=None)
    known = {SENSED: torque_factor, LED: current_factor}.get((c.law.effect, c.law.sensor))
    if known is not None and known(search.fitter, start) is not None:
        return start, None
    own = problem.start(Hypothesis(laws=(c.law,)))[len(problem.nominals) :]
    shift = c.shift / c.size if c.size else np.zeros_like(c.shift)
    return start, np.concatenate([shift, own])


def _restored(search: Search, fit: Fit, direction: NDArray | None) -> NDArray:
    """Unknowns (n,) along a line from a fit where the priors cost least."""
    if direction is None:
        return restore_prior(search.fitter, fit).x
    low, high = search.problem.bounds(fit.hypothesis)
    size = _restoring_size(search.problem, fit.hypothesis, fit.x, direction)
    return np.clip(fit.x + size * direction, low, high)


def _restoring_size(
    problem: Problem, hypothesis: Hypothesis, x: NDArray, direction: NDArray
) -> float:
    """How far along a line (n,) from x the priors cost least."""
    centre, weight = problem.prior(hypothesis)
    stiffness = float(weight**2 @ direction**2)
    return -float(weight**2 @ ((x - centre) * direction)) / stiffness if stiffness > 0.0 else 0.0
