"""Rivals of a law of whole recordings, fitted in short windows first.

A law that changes the machine's frequency has a local minimum for each cycle by which a simulation
of whole recordings is early or late. If its fit ends in one of these, another law seems better.
Short windows hold too few cycles for such minima.
"""

from collections.abc import Sequence

from rsea_core.effects.variant import Law
from rsea_core.identify.law_search.candidate_fits import at_bound, count_values, fitted
from rsea_core.identify.law_search.screening import screen
from rsea_core.identify.multistep.criteria import CLOSE_TO_BEST, PER_VALUE, SHORT, WHOLE_RIVALS
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.multistep.horizons import with_windows
from rsea_core.identify.whole_runs.forms import most_promising
from rsea_core.identify.whole_runs.sensor_noise import converged, misfit
from rsea_core.identify.whole_runs.taken_laws import Trial


def rivals_of_short_windows(
    own: Estimator, plain: Estimate, taken: Estimate, laws: Sequence[Law]
) -> list[Trial]:
    """Laws that gain more than the one taken in short windows, fitted to whole recordings.

    Parameters
    ----------
    plain, taken : Estimate
        Parameters alone, and with the one law, of whole recordings.
    laws : sequence of Law
        Of other effects.
    """
    short = own.having(with_windows(own, SHORT))
    base = short.fit(plain.hypothesis, plain.x)
    best = short.fit(taken.hypothesis, taken.x)
    promising = most_promising(screen(short, base, laws))
    target = base.cost - CLOSE_TO_BEST * (base.cost - best.cost)
    rough = [(c, fitted(short, base, c, target_cost=target)) for c in promising]
    better = sorted((pair for pair in rough if pair[1].cost < best.cost), key=lambda p: p[1].cost)
    found = []
    for c, begun in better[:WHOLE_RIVALS]:
        fit = converged(own, begun.hypothesis, begun.x)
        if not at_bound(own.problem, fit, c.law):
            gain = plain.cost - fit.cost - PER_VALUE * count_values(c.law)
            left = misfit(own, fit.hypothesis, fit.x)
            found.append(Trial(candidate=c, fit=fit, gain=gain, left=left))
    return found
