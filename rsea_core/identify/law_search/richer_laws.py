"""Richer laws of candidates and plainer ones: which form of what was fitted is ranked."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.gear_transmission_error import GearTransmissionError
from rsea_core.effects.load_friction import LoadFriction
from rsea_core.effects.load_friction_angle import LoadFrictionAngle
from rsea_core.effects.sensor_offset import SensorOffset
from rsea_core.effects.variant import Law
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.candidate_fits import at_bound, count_values
from rsea_core.identify.multistep.criteria import (
    ALIKE_GAIN,
    ALIKE_SHARE,
    NESTED_SHARE,
    PER_VALUE,
    PLAINER_SHARE,
    RICHER_GAIN,
    RICHER_RIVAL,
)
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.multistep.horizons import with_noise
from rsea_core.numeric.work_limit import no_work_left

TRANSMISSION, OFFSET = GearTransmissionError.effect, SensorOffset.effect


def with_richer_law(entry, base: Estimate, laws: Sequence[Law], say):
    """The law of the same effect that is worth its further values, if one is."""
    c, own, fit = entry
    tried: set[str] = set()
    names = list(c.law.richer)
    while names and not no_work_left(begun=True):
        name = names.pop(0)
        law = next((w for w in laws if w.law == name and w.effect == c.law.effect
                    and w.sensor == c.law.sensor), None)  # fmt: skip
        if law is None or name in tried:
            continue
        tried.add(name)
        known = own.problem.values(fit.hypothesis, fit.x)[1][-1]
        others = (fit.x[: -count_values(c.law)], base.x)
        more = own.fit(*begun_with(own, base, law, known, others)[1:], iterations=8)
        better = fit.cost - more.cost - PER_VALUE * (count_values(law) - count_values(c.law))
        say(f"    richer {law.key}: {better:.1f}")
        if better > RICHER_GAIN and not at_bound(own.problem, more, law):
            own = with_noise(own, more.hypothesis, more.x)
            fit = own.fit(more.hypothesis, more.x, iterations=6)
            c = replace(c, law=law)
            names = [*names, *law.richer]
    return c, own, fit


def begun_with(
    own: Estimator, base: Estimate, law: Law, known: dict[str, float], others: Sequence[NDArray]
) -> tuple[float, Hypothesis, NDArray]:
    """The likeliest start of a law of the same effect beside what is fitted already, and its cost.

    Parameters
    ----------
    known : dict
        Values of the law whose place it takes: those that both have begin as they were found.
    others : sequence of (k,) array
        All other values, from which a fit may begin: what a richer law explains, a plainer one
        may have left to them.
    """
    problem, n = own.problem, len(own.problem.nominals)
    h = Hypothesis(laws=(*base.hypothesis.laws, law))
    starts = {
        tuple(known.get(p.name, v) for p, v in zip(law.unknowns, start, strict=True))
        for start in law.starts
    }
    begun = [problem.start(Hypothesis(laws=(law,)), [start])[n:] for start in sorted(starts)]
    trials = [(h, np.concatenate([x, start])) for x in others for start in begun]
    costs = own.costs(trials)
    best = int(np.argmin(costs))
    return float(costs[best]), *trials[best]


def with_richer_rivals(
    finished: list, base: Estimate, laws: Sequence[Law], worth, say
) -> tuple[list, set[str]]:
    """The entries, those near the best one with their effects' richer laws, and keys of these.

    A plain law of the right effect may lose to a wrong effect that its richer law beats.
    """
    near = RICHER_RIVAL * max(worth(finished[0]), 0.0) if finished else 0.0
    richest = set()
    for place, entry in enumerate(finished):
        if worth(entry) > near:
            finished[place] = entry = with_richer_law(entry, base, laws, say)
            richest.add(entry[0].law.key)
    return preferred(finished, worth) if richest else finished, richest


def preferred(finished: list, worth) -> list:
    """The entries, best first: plainer laws before those that hold them, the load's readings."""
    finished = prefer_plainer(sorted(finished, key=worth, reverse=True), worth)
    prefer_load_reading(finished, worth)
    return finished


def prefer_plainer(finished: list, worth) -> list:
    """Of laws at one place that gain about as much, only the one with fewer values.

    A law that holds another one gains by whatever the other is not quite; that is no evidence,
    and it is no rival of the other. The plainer form of the best law takes the best one's place.
    """

    def plainer_of(entry):
        for other in finished:
            fewer = count_values(other[0].law) < count_values(entry[0].law)
            same = other[0].law.subsystem == entry[0].law.subsystem
            # a transmission error counts from a zero of its own, as an encoder with an offset does
            same |= (entry[0].law.effect, other[0].law.effect) == (TRANSMISSION, OFFSET)
            nested = entry[0].law.effect == LoadFrictionAngle.effect
            nested = nested and other[0].law.effect == LoadFriction.effect
            share = NESTED_SHARE if nested else PLAINER_SHARE
            if fewer and same and worth(other) > share * worth(entry):
                return other
        return None

    first = plainer_of(finished[0]) or finished[0]
    return [first] + [e for e in finished if e is not first and plainer_of(e) is None]


def prefer_load_reading(finished: list, worth) -> None:
    """Only the difference of two angles shows what one of them misreads: name the load's."""
    first = finished[0]
    for j, other in enumerate(finished[1:], 1):
        alike = other[0].law.effect == first[0].law.effect and first[0].law.sensor is not None
        near = worth(first) - worth(other) < ALIKE_GAIN + ALIKE_SHARE * worth(first)
        if alike and near and other[0].law.sensor == "load_angle_rad":
            finished[0], finished[j] = other, first
            return
