"""Constants that all had to move by one factor: the scale of a reading.

A reading in another scale is mimicked by the machine's own constants: a torque sensor that reads
19 % too much looks like a motor, wheel, spring, mass and friction that are all 19 % too large, and
nothing is left in the innovations to look for. What tells is what that costs: each constant leaves
its tolerance, and all come home where the one scale is freed. So it is asked after the search, by
the priors, where the bars for innovations (power that is left, gains that chance reaches) cannot
see it. Only scales are: an effect that stands in for a single constant would always find one.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.fit import Fit
from rsea_core.identify.law import Law
from rsea_core.identify.problem import Hypothesis, Problem
from rsea_core.identify.refine import at_home
from rsea_core.identify.screen import Candidate, screen
from rsea_core.identify.search_state import Search, tempering_of
from rsea_core.identify.slopes import SENSED, torque_factor

COSTS, AT_HOME = 20.0, 0.2
"""Nats that must be saved, and the share of the constants' cost that may stay."""
STRAY = 1.4  # tolerances from home that a constant may be: a nat
PASSES = 2


def came_home(before: Fit, after: Fit, constants: int) -> bool:
    """Whether the constants of a fit went home in another: the cost of their moves fell away.

    And none left home for it. A heavier load has more mass and more inertia, but the motor's and
    the spring's constants stay where they are; a scale of the torque would take them along.

    Parameters
    ----------
    constants : int
        How many of the unknowns are the rig's own.
    """
    saved = before.prior_cost - after.prior_cost
    was, now = (np.abs(fit.x[:constants]) for fit in (before, after))
    stayed = bool(np.all(now <= np.maximum(was, STRAY)))
    return stayed and saved > COSTS and after.prior_cost < AT_HOME * before.prior_cost


def reading_scale(search: Search, best: Fit, laws: Mapping[str, Law], say) -> Fit:
    """The fit with the scale of one reading more, if that brings its constants home."""
    mine = {law.key for law in best.hypothesis.laws}
    scales = [law for law in laws.values() if law.effect == "sensor-scale" and law.key not in mine]
    if best.prior_cost < COSTS or not scales:
        return best
    fitter, problem, tempering = search.fitter, search.problem, tempering_of(best.power)
    home, chosen = 0.0, best
    for c in screen(fitter, best.hypothesis, best.x, scales, tempering=tempering):
        start, way = _way(search, best, c)
        hypothesis = start.hypothesis
        x = _at_home(search, start, way)
        if best.prior_cost - _cost(problem, hypothesis, x) < max(COSTS, home):
            continue
        fit = fitter.fit(hypothesis, x, iterations=4, tempering=tempering, central=True)
        for _ in range(PASSES):  # what priors alone settle is below what ends a fit
            if not search.score(fit) > search.score(best):
                break
            x = _at_home(search, fit, way)
            new = fitter.fit(hypothesis, x, iterations=8, tempering=tempering, central=True)
            fit = max(fit, new, key=search.score)
        fit = search.keep(fit)  # or the search's own, where that ended better
        gain = search.score(fit) - search.score(best)
        say(
            f"scale {fit.hypothesis.key}: gain {gain:.1f}, constants cost {best.prior_cost:.1f},"
            f" then {fit.prior_cost:.1f}"
        )
        if gain > max(COSTS, home) and came_home(best, fit, len(problem.nominals)):
            home, chosen = gain, fit
    return chosen


def _cost(problem: Problem, hypothesis: Hypothesis, x: NDArray) -> float:
    """What the priors of unknowns (n,) cost, in nats."""
    centre, weight = problem.prior(hypothesis)
    return 0.5 * float(np.sum((weight * (x - centre)) ** 2))


def _way(search: Search, best: Fit, c: Candidate) -> tuple[Fit, NDArray | None]:
    """The fit with a scale of one, and the line (n,) along which the scale takes its place.

    All torques by one factor are known to be such a line (None: `refine.at_home` goes along it).
    For any other scale it is the screening's shift: innovations stay along it, whatever the
    length, for constants and scales are logarithms both. Where cogging or play throw a replay
    out, differences are too coarse for that.
    """
    problem = search.problem
    hypothesis = Hypothesis(laws=(*best.hypothesis.laws, c.law))
    start = replace(best, hypothesis=hypothesis, x=np.append(best.x, 0.0), hessian=None)
    if (c.law.effect, c.law.sensor) == SENSED and torque_factor(search.fitter, start) is not None:
        return start, None
    own = problem.start(Hypothesis(laws=(c.law,)))[len(problem.nominals) :]
    shift = c.shift / c.size if c.size else np.zeros_like(c.shift)
    return start, np.concatenate([shift, own])


def _at_home(search: Search, fit: Fit, way: NDArray | None) -> NDArray:
    """Unknowns (n,) along a line from a fit where the priors cost least."""
    if way is None:
        return at_home(search.fitter, fit).x
    low, high = search.problem.bounds(fit.hypothesis)
    size = _size_home(search.problem, fit.hypothesis, fit.x, way)
    return np.clip(fit.x + size * way, low, high)


def _size_home(problem: Problem, hypothesis: Hypothesis, x: NDArray, way: NDArray) -> float:
    """How far along a line (n,) from x the priors cost least."""
    centre, weight = problem.prior(hypothesis)
    stiffness = float(weight**2 @ way**2)
    return -float(weight**2 @ ((x - centre) * way)) / stiffness if stiffness > 0.0 else 0.0
