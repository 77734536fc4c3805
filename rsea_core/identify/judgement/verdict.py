"""What a search's fit is worth: a verdict, its rivals, the probability of what it names."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.spring_hysteresis import LOOP_AT_rad, slips_of
from rsea_core.identify.fitting.least_squares import Fit
from rsea_core.identify.fitting.problem import Problem
from rsea_core.identify.locate.unknown_input_test import came_from_elsewhere
from rsea_core.identify.selection.common_scale_factor import came_home, scale_named
from rsea_core.identify.selection.criteria import (
    EXPLAINED,
    NOISE_POWER,
    TEMPERATURE,
    Search,
    explained,
)
from rsea_core.identify.selection.polish import ROUGH, misleads

CLEAR, UNTOUCHED = 5.0, 0.5  # power of a clear mismatch, and the share of it that may not stay
HARDLY = 0.9  # share that stays where an effect has done next to nothing
OF_ALL = 1.0 / 3.0  # in recordings that hold so much (rms) of the whole
# of 255 claims as sure on four sets of concealed cases none was wrong (rule of succession: 0.996,
# and those sets helped to make the program)
SUREST = 0.99
ONE_BODY = {"load-friction": "gear-friction"}
NEARLY, STEEP = 0.05, 12.0  # how the share that is explained turns into belief


def verdict_of(search: Search, fit: Fit, *, named_by_values: bool) -> str:
    """The contract's verdict on a fit.

    Parameters
    ----------
    named_by_values : bool
        Whether corrected values alone amount to an effect (an unbalance).
    """
    quiet = bool(np.all(fit.power < NOISE_POWER))
    if not fit.hypothesis.laws:
        if named_by_values and quiet:
            return "missing-physics"
        if np.all(search.nominal_power < NOISE_POWER):
            return "no-mismatch"
        return "parameters-only" if quiet else "unexplained"
    little = explained(search.parameters, fit) < EXPLAINED and not quiet
    fine = float(np.median(fit.power)) < ROUGH  # else values are fitted once more
    if little or (fine and misleads(search, fit)):
        return "unexplained"
    shorts = None
    if search.short and np.any(fit.power > CLEAR):
        shorts = search.short_power(search.parameters), search.short_power(fit)
    if untouched(search.parameters, fit, shorts):
        return "unexplained"
    if slips_through(search.problem, fit):
        return "unexplained"
    asked = search.effort.ports and np.any(fit.power > NOISE_POWER)  # else nothing contradicts
    if asked and came_from_elsewhere(search.problem, search.parameters, fit):
        return "unexplained"
    own = {law.subsystem for law in fit.hypothesis.laws}
    near = [f for f, gap in rivals(search, fit) if gap < TEMPERATURE]
    if any({law.subsystem for law in f.hypothesis.laws} != own for f in near):
        return "insufficient-data"
    return "missing-physics"


def untouched(before: Fit, after: Fit, shorts: tuple[NDArray, NDArray] | None = None) -> bool:
    """Whether recordings with much of the mismatch keep most of it: something else is there.

    Not one whose short runs say that most is taken away: it only lost step. Where both kinds of
    run keep next to all of a clear mismatch, one recording is enough, for what acts in it is not
    in these laws.

    Parameters
    ----------
    shorts : two (benches,) arrays or None
        Powers of short runs before and after.
    """
    had, left = before.power, after.power
    clear = left > CLEAR
    kept = clear & (left - 1.0 > UNTOUCHED * (had - 1.0))
    if shorts is not None:
        first, rest = shorts
        kept &= (first < NOISE_POWER) | (rest - 1.0 > UNTOUCHED * (first - 1.0))
        stays = clear & (left - 1.0 > HARDLY * (had - 1.0))
        if np.any(stays & (rest > NOISE_POWER) & (rest - 1.0 > HARDLY * (first - 1.0))):
            return True
    size = np.sqrt(np.maximum(had - 1.0, 0.0))
    return bool(np.sum(size[kept]) > OF_ALL * np.sum(size))


def slips_through(problem: Problem, fit: Fit) -> bool:
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
        if law.effect == "spring-hysteresis":
            slips = slips_of(values)
            if law.law == "bouc-wen":
                slips = [(values["stiffness_Nm_per_rad"], values["yield_rad"])]
            held += sum(k * min(y, LOOP_AT_rad) for k, y in slips)
    return held > spring * LOOP_AT_rad


def rivals(search: Search, fit: Fit) -> list[tuple[Fit, float]]:
    """Fits that name other effects than a fit, with how many nats they are behind.

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
    if came_home(search.parameters, fit, len(search.problem.nominals)):
        taken = max(taken, 1.0 - fit.prior_cost / search.parameters.prior_cost)
    known = 1.0 / (1.0 + np.exp(-STEEP * (taken - EXPLAINED + NEARLY)))
    gain = search.score(fit) - search.score(search.parameters)
    seen = 1.0 - np.exp(-max(gain, 0.0) / TEMPERATURE)
    named = scale_named(search, fit)
    if named is not None:  # by odds of priors, which are not tempered
        odds = 1.0 - np.exp(-named.nats)
        seen = max(seen, odds)
        known = max(known, odds) if len(fit.hypothesis.laws) == 1 else known
    return float(min(SUREST, share * known * seen))
