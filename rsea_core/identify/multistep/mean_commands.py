"""Long logs of a slow machine under one mean command in each row.

A command that moves linearly from row to row is simulated in parts of rows, which costs as many
times the steps. Where a cycle of the machine has thousands of rows (EMPS: 5900), their means do.
"""

import numpy as np

from rsea_core.identify.multistep.criteria import LONG_ROWS, LOST_IN_NOISE
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.multistep.horizons import in_steps


def with_mean_commands(estimator: Estimator, base: Estimate) -> Estimator:
    """The same with whole rows, where a recording is long and no innovation shows the difference.

    Short ones keep the parts: whole runs that leave nothing but a fine sensor's noise would show
    it, and they cost little.
    """
    problem, trials = estimator.problem, [(base.hypothesis, base.x)]
    long = max(t.experiment.rows for t in estimator.tracks) > LONG_ROWS
    if not (long and problem.timing.linear):
        return estimator
    other = in_steps(estimator, problem.steps._replace(in_row=1))
    for before, after in zip(estimator.innovations(trials), other.innovations(trials), strict=True):
        moved = np.sqrt(np.mean((before - after) ** 2, axis=(0, 1)))
        if not np.all(moved < LOST_IN_NOISE):
            return estimator
    return other
