"""One mean command per row in long recordings of a slow machine.

A command that moves linearly from row to row is simulated in `FINER` parts of each row, which
multiplies the steps. Where a cycle of the machine has thousands of rows (EMPS: 5900), the mean
over each row is accurate enough.
"""

import numpy as np

from rsea_core.identify.multistep.criteria import LONG_ROWS, LOST_IN_NOISE
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.multistep.horizons import in_steps


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
