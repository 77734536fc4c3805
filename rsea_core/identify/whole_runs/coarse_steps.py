"""Engine steps in which candidates of whole recordings are compared first.

Parameters alone often leave errors of many noise deviations. While candidates are compared by
these, the error of the engine may be a small share of them: one row then needs a third of the
steps or fewer.
"""

from dataclasses import replace

from rsea_core.identify.multistep.criteria import COARSE_SHARE, COARSE_STEPS
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.multistep.experiment import EngineSteps
from rsea_core.identify.multistep.horizons import in_steps
from rsea_core.identify.whole_runs.parameters_alone import step_error


def in_coarse_steps(own: Estimator, fit: Estimate, left: float) -> Estimator:
    """The estimator in the longest steps that change its errors by a small share of the misfit.

    Parameters
    ----------
    left : float
        Misfit of the fit [noise deviations].
    """
    used = own.problem.steps
    for per_cycle in COARSE_STEPS:
        steps = EngineSteps(per_cycle, parts_of_row=1)
        if steps.per_cycle / steps.fineness >= used.per_cycle / used.fineness:
            continue
        coarse = in_steps(own, steps)
        if step_error(own, coarse, fit) < COARSE_SHARE * left:
            return coarse
    return own


def with_costs_of(own: Estimator, fit: Estimate) -> Estimate:
    """A fit with the costs that another estimator gives its values."""
    cost = float(own.costs([(fit.hypothesis, fit.x)])[0])
    return replace(fit, cost=cost, negative_log_likelihood=(cost - fit.prior_cost) / own.tempering)
