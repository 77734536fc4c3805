"""How sure an order of controllers is: paired bootstrap over tuning seeds and machines.

Every controller runs on the same random machines with the same noise, once for the best point of
each tuning seed. Machines are drawn anew in common, seeds for each controller by itself; the
share of draws in which one has the lower mean RMSE is the probability that it is better.

Source: Efron & Tibshirani, An Introduction to the Bootstrap (1993), chapters 8 and 16.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

DRAWS = 4000
INTERVAL = (2.5, 97.5)


@dataclass(frozen=True, kw_only=True)
class Paired:
    """One controller against another.

    Attributes
    ----------
    better, worse : str
    probability : float
        That the first has the lower mean RMSE.
    difference : (float, float)
        95 % interval of worse less better, in the unit of what is followed.
    """

    better: str
    worse: str
    probability: float
    difference: tuple[float, float]


def paired(first: tuple[str, NDArray], second: tuple[str, NDArray], *, seed: int = 0) -> Paired:
    """Compare two tables of RMSE (seeds, machines), machines in common.

    A run that failed has an infinite RMSE and counts as ten times the largest finite one.

    Raises
    ------
    ValueError
        If the tables have different machines.
    """
    (name, one), (other, two) = first, second
    if one.shape[1] != two.shape[1]:
        raise ValueError(f"{one.shape[1]} and {two.shape[1]} machines cannot be paired")
    finite = np.concatenate((one[np.isfinite(one)], two[np.isfinite(two)]))
    worst = 10.0 * finite.max(initial=1.0)
    one, two = (np.where(np.isfinite(table), table, worst) for table in (one, two))
    rng, machines = np.random.default_rng(seed), one.shape[1]
    drawn = rng.integers(machines, size=(DRAWS, machines))
    means = []
    for table in (one, two):
        rows = rng.integers(len(table), size=(DRAWS, len(table)))
        by_machine = table[rows].mean(axis=1)
        means.append(np.take_along_axis(by_machine, drawn, axis=1).mean(axis=1))
    difference = means[1] - means[0]
    wins = (difference > 0.0).mean() + 0.5 * (difference == 0.0).mean()
    low, high = np.percentile(difference, INTERVAL)
    return Paired(
        better=name, worse=other, probability=float(wins), difference=(float(low), float(high))
    )


def pareto(objectives: NDArray) -> NDArray:
    """(n,) bool: points (n, objectives) that no other one beats in one and equals in the rest."""
    no_worse = (objectives[:, None, :] <= objectives[None, :, :]).all(axis=2)
    better = (objectives[:, None, :] < objectives[None, :, :]).any(axis=2)
    return ~(no_worse & better).any(axis=0)
