"""Tuning by Gauss-Newton steps: where a cost is made of errors row by row, their changes with the
gains say more than the cost alone.

At a point the cost's gradient is that of a weighted sum of squares of the errors (and of the
changes of the command): weights 1 / |error| for sums of magnitudes (iteratively reweighted least
squares), equal ones for squares. `d` evaluations go on forward differences, then four at a time
on steps of increasing damping (Levenberg, Marquardt), all within the box and within the
linearised distance from -1 that the task asks for; the lowest point tried is the next one. The
differences begin at a tenth of the box: encoder counts scatter the errors of a loop however little
a gain changes, and over a small difference that scatter appears as a large slope. The differences
shrink with the steps and where no point is lower; at the smallest, the search starts again from
another random point.

Source: Nocedal & Wright, Numerical Optimization (2006), chapters 10 and 18; Daubechies et al.,
Comm. Pure Appl. Math. 63 (2010) 1-38, for the weights.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize

from rsea_core.control.tuning.search_record import Box, Cost, Record, Search
from rsea_core.errors import InputError

DIFFERENCES = (1e-3, 0.1)  # of the box: events and encoder counts make smaller ones rough
SMALLER = 3.0  # largest ratio of the differences before and after a step
SLACK = 1e-3  # that a step keeps of the distance from -1, for what is not linear in it
FIRST, LEAST, MOST = 1e-2, 1e-6, 1e4  # of the damping, relative to the matrix
STEPS, FACTOR = 4, 10.0  # tried at once, and from the damping of one to the next


@dataclass(frozen=True, kw_only=True)
class Squares:
    """Points of a search with what their costs are made of.

    Attributes
    ----------
    costs : (n,) array
        Infinite where a point cannot be taken.
    errors, weights : (n, m) arrays
        Gradient of the cost: sum of weights x errors x gradient of the errors. NaN where the cost
        is infinite.
    slack : (n,) array
        By how much the point keeps the margin that is asked; infinite where none is.
    """

    costs: NDArray
    errors: NDArray
    weights: NDArray
    slack: NDArray


class SquaresCost(Protocol):
    """A cost that tells what it is made of."""

    def squares(self, points: NDArray) -> Squares:
        """Points (n, d) of the box."""


def gauss_newton(
    cost: Cost,
    box: Box,
    *,
    seed: int,
    population: int = 10,
    generations: int = 40,
    start: ArrayLike | None = None,
) -> Search:
    """Damped Gauss-Newton steps from the best of a generation of random points.

    Raises
    ------
    InputError
        If the cost does not tell what it is made of, or a generation has no room for differences.
    """
    if not hasattr(cost, "squares"):
        raise InputError("gauss-newton needs a cost that is made of errors row by row")
    if population < box.size + 2:
        raise InputError(
            f"gauss-newton on {box.size} values needs a population of at least {box.size + 2}"
        )
    asked = _Asked(cost, box)
    record, rng = Record(asked, box), np.random.default_rng(seed)
    most = population * generations
    first = box.unit(start)[None, :] if start is not None else None
    while record.evaluations < most:
        room = min(population, most - record.evaluations)
        places = rng.random((room, box.size))
        if first is not None:
            places, first = first, None
        _descend(record, asked, places, population, most)
    return record.result("gauss-newton", seed)


class _Asked:
    """The cost, with all that was found of the last points, in the unit cube."""

    def __init__(self, cost: SquaresCost, box: Box):
        self.cost, self.box = cost, box
        self.last: Squares | None = None

    def __call__(self, points: NDArray) -> NDArray:
        self.last = self.cost.squares(points)
        return self.last.costs


def _descend(record: Record, asked: _Asked, places: NDArray, population: int, most: int) -> None:
    """From the best of some points downwards until no step is lower, or all is spent."""
    box = asked.box
    costs = record(box.inside(places))
    j = int(costs.argmin())
    if not np.isfinite(costs[j]):
        return
    at, here = places[j], _row(asked.last, j)
    damping, difference = FIRST, DIFFERENCES[1]
    while record.evaluations + box.size + 1 <= most:
        moved = np.where(at + difference <= 1.0, difference, -difference)
        neighbours = at + np.diag(moved)
        record(box.inside(neighbours))
        record.history.pop()  # one generation with the steps that follow
        found = asked.last
        model, j = _Model(here, found, moved), int(found.costs.argmin())
        next_at, next_here = neighbours[j], _row(found, j)
        lower = False
        while not lower and damping <= MOST and record.evaluations < most:
            room = min(STEPS, population - box.size, most - record.evaluations)
            steps = [model.step(at, damping * FACTOR**k) for k in range(room)]
            costs = record(box.inside(at + np.array(steps)))
            j = int(costs.argmin())
            lower = costs[j] < here.costs[0] * (1.0 - 1e-9)
            damping *= FACTOR ** (j - 1 if lower else room)
            if costs[j] < next_here.costs[0]:
                next_at, next_here = at + steps[j], _row(asked.last, j)
        smaller = max(difference / SMALLER, DIFFERENCES[0])
        if next_here.costs[0] < here.costs[0] * (1.0 - 1e-9):
            step = float(np.abs(next_at - at).max())
            at, here, damping = next_at, next_here, float(np.clip(damping, LEAST, FIRST))
            difference = float(np.clip(0.3 * step, smaller, DIFFERENCES[1]))
        elif difference > DIFFERENCES[0]:
            damping, difference = FIRST, smaller
        else:
            return


def _row(found: Squares, j: int) -> Squares:
    return Squares(
        costs=found.costs[j : j + 1],
        errors=found.errors[j : j + 1],
        weights=found.weights[j : j + 1],
        slack=found.slack[j : j + 1],
    )


class _Model:
    """Weighted squares about a point, of the unit cube: gradient, matrix, slope of the slack."""

    def __init__(self, here: Squares, moved: Squares, by: NDArray):
        errors, weights = here.errors[0], here.weights[0]
        jacobian = (moved.errors - errors) / by[:, None]
        jacobian[~np.isfinite(moved.costs)] = 0.0  # refused there: this value stays
        self.gradient = jacobian @ (weights * errors)
        self.matrix = (jacobian * weights) @ jacobian.T
        self.slack = float(here.slack[0])
        self.slack_slope = np.zeros(by.size)
        if np.isfinite(self.slack):
            slope = (moved.slack - self.slack) / by
            self.slack_slope = np.where(np.isfinite(slope), slope, 0.0)

    def step(self, at: NDArray, damping: float) -> NDArray:
        """The lowest point of the damped squares within the cube and the linearised margin."""
        size = np.diag(self.matrix)
        matrix = self.matrix + damping * np.diag(np.maximum(size, 1e-12 * size.max() + 1e-300))
        scale = max(float(np.abs(self.gradient).max()), 1e-300)
        limits = []
        if np.isfinite(self.slack):
            limits = [{
                "type": "ineq",
                "fun": lambda s: self.slack - SLACK + self.slack_slope @ s,
                "jac": lambda _: self.slack_slope,
            }]  # fmt: skip
        found = optimize.minimize(
            lambda s: (0.5 * s @ matrix @ s + self.gradient @ s) / scale,
            np.zeros(at.size),
            jac=lambda s: (matrix @ s + self.gradient) / scale,
            bounds=list(zip(-at, 1.0 - at, strict=True)),
            constraints=limits,
            method="SLSQP",
            options={"maxiter": 50, "ftol": 1e-12},
        )
        return np.clip(np.nan_to_num(found.x), -at, 1.0 - at)
