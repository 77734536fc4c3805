"""Search of a box for the lowest cost: the thesis' three methods, and two that do better.

Every method asks for the costs of a whole generation at once, so that a batch simulator can run
them side by side, and draws its random numbers before it asks: the same seed gives the same
result for any number of threads. A cost that is not finite counts as infinite.

| method | source |
| --- | --- |
| `particle_swarm` | the thesis' 4.36-4.38: constriction (Clerc & Kennedy 2002), phi 2.05 + 2.05 |
| `genetic` | the thesis' Table 4.1: ranks, stochastic uniform selection, scattered crossover |
| `ant_colony` | the thesis' Appendix B: one grid of nodes for each parameter, roulette, elitism |
| `cma_es` | Hansen's CMA-ES, by the library `cma` |
| `differential_evolution` | Storn & Price, by scipy |

4.36 with constriction chi is the inertia form with w = chi and c_i = chi phi_i, exactly. Speeds
are limited to the box's width, as the thesis says ("[-v_max, v_max]", no value). Rates that the
thesis does not state: 2 elites of the genetic algorithm and a mutation that narrows as ranks
improve; evaporation 0.9 and 50 nodes for the ants.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize

from rsea_core.errors import ControllerError, InputError

Cost = Callable[[NDArray], NDArray]
"""(population, parameters) array to (population,) costs."""

PHI = 2.05
CHI = 2.0 / abs(2.0 - 2.0 * PHI - np.sqrt((2.0 * PHI) ** 2 - 8.0 * PHI))


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
    """

    method: str
    seed: int
    best: NDArray
    cost: float
    history: NDArray
    evaluations: int


class _Record:
    """Counts evaluations and keeps the best point."""

    def __init__(self, cost: Cost, box: Box):
        self.cost_of, self.box = cost, box
        self.best, self.cost = box.inside(np.full(box.size, 0.5)), np.inf
        self.history: list[float] = []
        self.evaluations = 0

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
        return costs

    def result(self, method: str, seed: int) -> Search:
        return Search(
            method=method,
            seed=seed,
            best=self.best,
            cost=self.cost,
            history=np.array(self.history),
            evaluations=self.evaluations,
        )


def particle_swarm(
    cost: Cost, box: Box, *, seed: int, population: int = 10, generations: int = 40
) -> Search:
    """Constriction PSO from random places at rest."""
    rng, record = np.random.default_rng(seed), _Record(cost, box)
    width = box.high - box.low
    place = box.inside(rng.random((population, box.size)))
    speed = np.zeros_like(place)
    costs = record(place)
    own, own_cost = place.copy(), costs.copy()
    for _ in range(generations - 1):
        r1, r2 = rng.random((2, population, box.size))
        speed = CHI * (speed + PHI * r1 * (own - place) + PHI * r2 * (record.best - place))
        speed = np.clip(speed, -width, width)
        place = np.clip(place + speed, box.low, box.high)
        costs = record(place)
        better = costs < own_cost
        own[better], own_cost[better] = place[better], costs[better]
    return record.result("particle-swarm", seed)


def genetic(
    cost: Cost, box: Box, *, seed: int, population: int = 20, generations: int = 20
) -> Search:
    """Real-coded genetic algorithm with rank scaling."""
    rng, record = np.random.default_rng(seed), _Record(cost, box)
    elites = min(2, population - 1)
    place = rng.random((population, box.size))
    costs = record(box.inside(place))
    for generation in range(generations - 1):
        order = np.argsort(costs, kind="stable")
        place, costs = place[order], costs[order]
        fitness = 1.0 / np.sqrt(np.arange(1, population + 1))
        children = population - elites
        # stochastic uniform: evenly spaced marks on the wheel of fitness
        marks = (rng.random() + np.arange(2 * children)) / (2 * children)
        chosen = np.searchsorted(np.cumsum(fitness) / fitness.sum(), marks)
        parents = place[rng.permutation(np.minimum(chosen, population - 1))]
        first, second = parents[:children], parents[children:]
        young = np.where(rng.random(first.shape) < 0.5, first, second)
        spread = 0.3 * (1.0 - generation / generations)
        mutates = rng.random(young.shape) < 1.0 / box.size
        young = young + np.where(mutates, spread * rng.standard_normal(young.shape), 0.0)
        young = np.clip(young, 0.0, 1.0)
        place = np.concatenate((place[:elites], young))
        costs = np.concatenate((costs[:elites], record(box.inside(young))))
    return record.result("genetic", seed)


def ant_colony(
    cost: Cost,
    box: Box,
    *,
    seed: int,
    population: int = 10,
    generations: int = 40,
    nodes: int = 50,
    evaporation: float = 0.9,
) -> Search:
    """Appendix B: T = rho T + sum over ants of (lowest cost / their cost) on their nodes."""
    rng, record = np.random.default_rng(seed), _Record(cost, box)
    grid = box.low[:, None] + (box.high - box.low)[:, None] * np.linspace(0.0, 1.0, nodes)
    trail = np.ones((box.size, nodes))
    every = np.arange(box.size)
    kept: NDArray | None = None
    kept_cost = np.inf
    for _ in range(generations):
        wheel = np.cumsum(trail, axis=1)
        marks = rng.random((population, box.size)) * wheel[:, -1]
        ants = (marks[:, :, None] > wheel[None, :, :]).sum(axis=2)
        costs = record(grid[every, ants])
        lowest = int(costs.argmin())
        if costs[lowest] > kept_cost and kept is not None:
            worst = int(costs.argmax())
            ants[worst], costs[worst] = kept, kept_cost
        elif np.isfinite(costs[lowest]):
            kept, kept_cost = ants[lowest].copy(), float(costs[lowest])
        trail *= evaporation
        if np.isfinite(kept_cost):
            gained = np.where(np.isfinite(costs), max(kept_cost, 1e-300) / costs, 0.0)
            for ant, gain in zip(ants, gained, strict=True):
                trail[every, ant] += gain
    return record.result("ant-colony", seed)


def cma_es(
    cost: Cost, box: Box, *, seed: int, population: int = 10, generations: int = 40
) -> Search:
    """CMA-ES in the unit cube from its middle.

    Raises
    ------
    ControllerError
        If the library `cma` is not installed.
    """
    try:
        import cma
    except ImportError as problem:
        raise ControllerError(
            "the method cma-es needs the library cma: pip install cma"
        ) from problem
    record = _Record(cost, box)
    options = {
        "bounds": [0.0, 1.0],
        "popsize": population,
        "maxiter": generations,
        "seed": seed + 1,  # 0 would mean the clock
        "verbose": -9,
        "CMA_stds": np.full(box.size, 1.0),
        "tolfun": 0.0,
        "tolfunhist": 0.0,
    }
    search = cma.CMAEvolutionStrategy(np.full(box.size, 0.5), 0.3, options)
    for _ in range(generations):
        points = np.array(search.ask())
        costs = record(box.inside(points))
        # the library ranks: infinity would spoil its statistics, a large number does not
        finite = costs[np.isfinite(costs)]
        worst = 10.0 * abs(finite).max() + 1.0 if finite.size else 1.0
        search.tell(list(points), list(np.where(np.isfinite(costs), costs, worst)))
    return record.result("cma-es", seed)


def differential_evolution(
    cost: Cost, box: Box, *, seed: int, population: int = 10, generations: int = 40
) -> Search:
    """Differential evolution by scipy, generation by generation."""
    record = _Record(cost, box)
    rng = np.random.default_rng(seed)
    optimize.differential_evolution(
        lambda points: np.minimum(record(np.atleast_2d(points.T)), 1e30),
        list(zip(box.low, box.high, strict=True)),
        init=box.inside(rng.random((max(population, 5), box.size))),
        maxiter=generations - 1,
        tol=0.0,
        rng=rng,
        polish=False,
        vectorized=True,
        updating="deferred",
    )
    return record.result("differential-evolution", seed)


METHODS = {
    "particle-swarm": particle_swarm,
    "genetic": genetic,
    "ant-colony": ant_colony,
    "cma-es": cma_es,
    "differential-evolution": differential_evolution,
}


@dataclass(frozen=True, kw_only=True)
class Starts:
    """What several seeds of one method found: one run says little.

    Attributes
    ----------
    searches : tuple of Search
    """

    searches: tuple[Search, ...]

    FAILED = 2.0

    @property
    def best(self) -> Search:
        """The search with the lowest cost, the first of equals."""
        return min(self.searches, key=lambda s: s.cost)

    @property
    def costs(self) -> NDArray:
        """(seeds,) array."""
        return np.array([s.cost for s in self.searches])

    @property
    def median(self) -> float:
        """Median of the costs."""
        return float(np.median(self.costs))

    @property
    def failed_share(self) -> float:
        """Share of the seeds whose cost is more than `FAILED` times the lowest."""
        return float((self.costs > self.FAILED * self.costs.min()).mean())


def search(
    cost: Cost,
    box: Box,
    *,
    method: str,
    seed: int,
    population: int = 10,
    generations: int = 40,
) -> Search:
    """One run of a method by name.

    Raises
    ------
    InputError
        If the method is unknown or the budget too small.
    """
    if method not in METHODS:
        raise InputError(f"tuning method {method!r} must be one of {', '.join(METHODS)}")
    if population < 4 or generations < 1:
        raise InputError(
            f"population = {population} must be at least 4, generations = {generations} at least 1"
        )
    return METHODS[method](cost, box, seed=seed, population=population, generations=generations)
