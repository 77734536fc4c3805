"""A slow drift of the amplifier's offset, which belongs to its recording and to no other.

Without it the parameters and the offset are biased, and what is left of whole recordings can be
mistaken for a law. It is part of the hypothesis only where parameters with it leave no more than
the sensors' noise: heating changes the motor's torque slowly too. It predicts no other recording.
"""

from dataclasses import replace

import numpy as np

from rsea_core.identify.law_search.found import Found
from rsea_core.identify.multistep.criteria import DRIFT_LEAVES, DRIFT_SHARE, LEAST_EXCESS
from rsea_core.identify.multistep.log_nuisances import offset_drifts
from rsea_core.identify.whole_runs.nearly_complete import in_own_share
from rsea_core.identify.whole_runs.sensor_noise import excess, in_sensor_noise, misfit
from rsea_core.numeric.work_limit import no_work_left

ITERATIONS = 12


def with_offset_drift(found: Found, say) -> Found:
    """Parameters alone with drifts of the amplifier's offset, if these leave nothing but noise.

    The search as it was where laws were found, or where drifts explain less than `DRIFT_SHARE` of
    what parameters alone leave.
    """
    known = found.left_by_parameters < np.inf
    drifts = offset_drifts(found.problem.case) if known and not found.steps else ()
    if not drifts or no_work_left():
        return found
    own = in_sensor_noise(found.base_estimator, found.base)
    h = found.base.hypothesis
    plain = own.fit(h, found.base.x, iterations=ITERATIONS)
    before = excess(own, h, plain.x)
    if before < LEAST_EXCESS:
        return found
    more = replace(h, laws=(*h.laws, *drifts))
    fit = own.fit(more, np.append(plain.x, np.zeros(len(drifts))), iterations=ITERATIONS)
    left = misfit(own, more, fit.x)
    if left > DRIFT_LEAVES or plain.cost - fit.cost < DRIFT_SHARE * before:
        return found
    say(f"whole recordings: drifts of the amplifier's offset leave {left:.2f}, without a law")
    own, fit = in_own_share(own, fit)
    return replace(
        found, base_estimator=own, base=fit, estimator=own, best=fit, horizon=None,
        base_horizon=None, left_by_parameters=left, excess=excess(own, more, fit.x),
    )  # fmt: skip
