"""What may be searched, and what a search of it found."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rsea_core.errors import InputError

Cost = Callable[[NDArray], NDArray]
"""(population, parameters) array to (population,) costs."""

LEADERS = 10
"""Best points that a search keeps, to be judged again more precisely."""


@dataclass(frozen=True, kw_only=True)
class Box:
    """What may be searched.

    Attributes
    ----------
    names : tuple of str
    low, high : (d,) arrays

    Raises
    ------
    InputError
        If sizes differ or a lower bound is not below its upper one.
    """

    names: tuple[str, ...]
    low: NDArray
    high: NDArray

    def __post_init__(self):
        for side in ("low", "high"):
            object.__setattr__(self, side, np.array(getattr(self, side), dtype=float))
        if not len(self.names) == self.low.size == self.high.size:
            raise InputError(
                f"{len(self.names)} names need as many bounds, not {self.low.size} and"
                f" {self.high.size}"
            )
        for name, low, high in zip(self.names, self.low, self.high, strict=True):
            if not (np.isfinite([low, high]).all() and low < high):
                raise InputError(f"bounds of {name}: {low:g} must be below {high:g}, both finite")

    @property
    def size(self) -> int:
        """How many parameters."""
        return len(self.names)

    def inside(self, unit: ArrayLike) -> NDArray:
        """Points of the unit cube as points of the box."""
        return self.low + (self.high - self.low) * np.asarray(unit)

    def unit(self, point: ArrayLike) -> NDArray:
        """A point of the box as one of the unit cube."""
        return np.clip((np.asarray(point) - self.low) / (self.high - self.low), 0.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class Search:
    """One run of a method from one seed.

    Attributes
    ----------
    method : str
    seed : int
    best : (d,) array
    cost : float
        Infinite where no point had a finite cost.
    history : (generations,) array
        Lowest cost after each generation.
    evaluations : int
    leaders : (n, d) array
        The best points of the search, the best first; at most LEADERS.
    leader_costs : (n,) array
    low, high : (d,) arrays
        The box that was searched last.
    """

    method: str
    seed: int
    best: NDArray
    cost: float
    history: NDArray
    evaluations: int
    leaders: NDArray
    leader_costs: NDArray
    low: NDArray
    high: NDArray


class Record:
    """Counts evaluations and keeps the best points."""

    def __init__(self, cost: Cost, box: Box):
        self.cost_of, self.box = cost, box
        self.best, self.cost = box.inside(np.full(box.size, 0.5)), np.inf
        self.history: list[float] = []
        self.evaluations = 0
        self.leaders, self.leader_costs = np.empty((0, box.size)), np.empty(0)

    def __call__(self, points: NDArray) -> NDArray:
        """Costs of points of the box, bounded."""
        points = np.clip(points, self.box.low, self.box.high)
        costs = np.asarray(self.cost_of(points), dtype=float)
        costs = np.where(np.isfinite(costs), costs, np.inf)
        self.evaluations += len(points)
        first = int(costs.argmin())
        if costs[first] < self.cost:
            self.best, self.cost = points[first].copy(), float(costs[first])
        self.history.append(self.cost)
        self._keep(points, costs)
        return costs

    def _keep(self, points: NDArray, costs: NDArray) -> None:
        """The best points so far, each once."""
        every = np.vstack((self.leaders, points[np.isfinite(costs)]))
        values = np.concatenate((self.leader_costs, costs[np.isfinite(costs)]))
        _, once = np.unique(every, axis=0, return_index=True)
        order = once[np.argsort(values[once], kind="stable")][:LEADERS]
        self.leaders, self.leader_costs = every[order], values[order]

    def result(self, method: str, seed: int) -> Search:
        """The search so far."""
        return Search(
            method=method,
            seed=seed,
            best=self.best,
            cost=self.cost,
            history=np.array(self.history),
            evaluations=self.evaluations,
            leaders=self.leaders,
            leader_costs=self.leader_costs,
            low=self.box.low,
            high=self.box.high,
        )
