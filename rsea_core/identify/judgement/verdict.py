"""What a search's fit is worth: a verdict, its rivals, the probability of what it names."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.gear_friction import GearFriction
from rsea_core.effects.load_friction import LoadFriction
from rsea_core.effects.spring_hysteresis import LOOP_AT_rad, SpringHysteresis, slips_of
from rsea_core.identify.fitting.least_squares import Fit
from rsea_core.identify.fitting.problem import Problem
from rsea_core.identify.judgement.criteria import (
    BELIEF_MARGIN,
    BELIEF_STEEPNESS,
    CLEAR_MSNI,
    HARDLY_CHANGED,
    HIGHEST_CONFIDENCE,
    PART_OF_MISMATCH,
    UNCHANGED_SHARE,
)
from rsea_core.identify.locate.unknown_input_test import explained_better_by_other_port
from rsea_core.identify.selection.common_scale_factor import named_scale, returned_to_prior
from rsea_core.identify.selection.criteria import (
    EXPLAINED,
    NOISE_MSNI,
    ROUGH_MSNI,
    TEMPERATURE,
    Search,
    explained,
)
from rsea_core.identify.selection.final_refinement import worsens_free_runs

ONE_BODY = {LoadFriction.effect: GearFriction.effect}


def verdict_of(search: Search, fit: Fit, *, named_by_values: bool) -> str:
    """The contract's verdict on a fit.

    Parameters
    ----------
    named_by_values : bool
        Whether corrected values alone amount to an effect (an unbalance).
    """
    quiet = bool(np.all(fit.msni < NOISE_MSNI))
    if not fit.hypothesis.laws:
        if named_by_values and quiet:
            return "missing-physics"
        if np.all(search.nominal_msni < NOISE_MSNI):
            return "no-mismatch"
        return "parameters-only" if quiet else "unexplained"
    little = explained(search.parameters, fit) < EXPLAINED and not quiet
    fine = float(np.median(fit.msni)) < ROUGH_MSNI  # else values are fitted once more
    if little or (fine and worsens_free_runs(search, fit)):
        return "unexplained"
    shorts = None
    if search.short and np.any(fit.msni > CLEAR_MSNI):
        shorts = search.short_msni(search.parameters), search.short_msni(fit)
    if is_unchanged(search.parameters, fit, shorts):
        return "unexplained"
    if is_unobservable_slip(search.problem, fit):
        return "unexplained"
    asked = search.effort.ports and np.any(fit.msni > NOISE_MSNI)  # else nothing contradicts
    if asked and explained_better_by_other_port(search.problem, search.parameters, fit):
        return "unexplained"
    own = {law.subsystem for law in fit.hypothesis.laws}
    near = [f for f, gap in rivals(search, fit) if gap < TEMPERATURE]
    if any({law.subsystem for law in f.hypothesis.laws} != own for f in near):
        return "insufficient-data"
    return "missing-physics"


def is_unchanged(before: Fit, after: Fit, shorts: tuple[NDArray, NDArray] | None = None) -> bool:
    """Whether recordings with much of the mismatch keep most of it: something else is there.

    Not one whose short runs say that most is taken away: it only lost step. Where both kinds of
    run keep next to all of a clear mismatch, one recording is enough, for what acts in it is not
    in these laws.

    Parameters
    ----------
    shorts : two (recordings,) arrays or None
        Powers of short runs before and after.
    """
    had, left = before.msni, after.msni
    clear = left > CLEAR_MSNI
    kept = clear & (left - 1.0 > UNCHANGED_SHARE * (had - 1.0))
    if shorts is not None:
        first, rest = shorts
        kept &= (first < NOISE_MSNI) | (rest - 1.0 > UNCHANGED_SHARE * (first - 1.0))
        stays = clear & (left - 1.0 > HARDLY_CHANGED * (had - 1.0))
        if np.any(stays & (rest > NOISE_MSNI) & (rest - 1.0 > HARDLY_CHANGED * (first - 1.0))):
            return True
    size = np.sqrt(np.maximum(had - 1.0, 0.0))
    return bool(np.sum(size[kept]) > PART_OF_MISMATCH * np.sum(size))


def is_unobservable_slip(problem: Problem, fit: Fit) -> bool:
    """Whether a hysteresis holds more than the spring that it should belong to.

    Friction inside a spring takes a part of what the spring gives. Where over the contract's loop
    it is the slipping elements that give most of it, little more comes once they slip: whatever
    slips there is in series with the spring (its clamp, its seat) and no loss of its own.
    """
    nominal, laws = problem.values(fit.hypothesis, fit.x)
    spring = nominal.get("spring_stiffness_Nm_per_rad")
    if spring is None:
        return False
    held = 0.0
    for law, values in zip(fit.hypothesis.laws, laws, strict=True):
        if law.effect == SpringHysteresis.effect:
            slips = slips_of(values)
            if law.law == "bouc-wen":
                slips = [(values["stiffness_Nm_per_rad"], values["yield_rad"])]
            held += sum(k * min(y, LOOP_AT_rad) for k, y in slips)
    return held > spring * LOOP_AT_rad


def rivals(search: Search, fit: Fit) -> list[tuple[Fit, float]]:
    """Fits that name other effects than a fit, with how many log-likelihood units they are behind.

    Without a spring gear and load are one body: friction of the one is no rival of the other's, as
    no recording will ever tell them apart.
    """
    one_body = not search.problem.case.rig.has("spring")

    def parts(effects: Sequence[str]) -> set[str]:
        return {ONE_BODY.get(name, name) if one_body else name for name in effects}

    mine = parts(fit.hypothesis.effects)
    best: dict[tuple, tuple[Fit, float]] = {}
    for other in search.ranked():
        named = other.hypothesis.effects
        if named and parts(named) != mine and len(named) <= len(mine):
            best.setdefault(named, (other, search.behind(fit, other)))
    return list(best.values())


def confidence(search: Search, fit: Fit) -> float:
    """Probability that the effects that a fit names are there."""
    gaps = np.array([0.0, *[gap for _, gap in rivals(search, fit)]])
    weights = np.exp(-np.maximum(gaps, -50.0) / TEMPERATURE)
    share = float(weights[0] / weights.sum())
    taken = explained(search.parameters, fit)
    # an effect may show in what the constants cost alone
    if returned_to_prior(search.parameters, fit, len(search.problem.nominals)):
        taken = max(taken, 1.0 - fit.prior_cost / search.parameters.prior_cost)
    known = 1.0 / (1.0 + np.exp(-BELIEF_STEEPNESS * (taken - EXPLAINED + BELIEF_MARGIN)))
    gain = search.score(fit) - search.score(search.parameters)
    seen = 1.0 - np.exp(-max(gain, 0.0) / TEMPERATURE)
    named = named_scale(search, fit)
    if named is not None:  # by odds of priors, which are not tempered
        odds = 1.0 - np.exp(-named.log_odds)
        seen = max(seen, odds)
        known = max(known, odds) if len(fit.hypothesis.laws) == 1 else known
    return float(min(HIGHEST_CONFIDENCE, share * known * seen))
