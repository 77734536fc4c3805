"""Search methods of libraries: CMA-ES by `cma`, three by `pymoo`, differential evolution by scipy.

Each asks for a generation, is given its costs, and starts from a known point where there is one.
"""

from collections.abc import Callable
from importlib import import_module

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize

from rsea_core.control.tuning.search_record import Box, Cost, Record, Search
from rsea_core.errors import ControllerError

SIGMA, SIGMA_AGAIN = 0.3, 0.1  # of the box: at first, and around a point that is known


def _library(name: str, method: str):
    try:
        return import_module(name)
    except ImportError as problem:
        library = name.split(".")[0]
        raise ControllerError(
            f"the method {method} needs the library {library}: pip install {library}"
        ) from problem


def cma_es(
    cost: Cost,
    box: Box,
    *,
    seed: int,
    population: int = 10,
    generations: int = 40,
    start: ArrayLike | None = None,
) -> Search:
    """CMA-ES in the unit cube from its middle, or from a point that is known.

    Raises
    ------
    ControllerError
        If the library `cma` is not installed.
    """
    cma, record = _library("cma", "cma-es"), Record(cost, box)
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
    middle = np.full(box.size, 0.5) if start is None else box.unit(start)
    search = cma.CMAEvolutionStrategy(middle, SIGMA if start is None else SIGMA_AGAIN, options)
    for _ in range(generations):
        points = np.array(search.ask())
        costs = record(box.inside(points))
        search.tell(list(points), list(_finite(costs)))
    return record.result("cma-es", seed)


def _finite(costs: NDArray) -> NDArray:
    """Costs without infinity, which would spoil a library's statistics; a large number does not."""
    finite = costs[np.isfinite(costs)]
    worst = 10.0 * abs(finite).max() + 1.0 if finite.size else 1.0
    return np.where(np.isfinite(costs), costs, worst)


def differential_evolution(
    cost: Cost,
    box: Box,
    *,
    seed: int,
    population: int = 10,
    generations: int = 40,
    start: ArrayLike | None = None,
) -> Search:
    """Differential evolution by scipy, generation by generation."""
    record, rng = Record(cost, box), np.random.default_rng(seed)
    first = box.inside(rng.random((max(population, 5), box.size)))
    if start is not None:
        first[0] = np.clip(start, box.low, box.high)
    optimize.differential_evolution(
        lambda points: np.minimum(record(np.atleast_2d(points.T)), 1e30),
        list(zip(box.low, box.high, strict=True)),
        init=first,
        maxiter=generations - 1,
        tol=0.0,
        rng=rng,
        polish=False,
        vectorized=True,
        updating="deferred",
    )
    return record.result("differential-evolution", seed)


PYMOO = {
    "pymoo-particle-swarm": ("pymoo.algorithms.soo.nonconvex.pso", "PSO"),
    "pymoo-genetic": ("pymoo.algorithms.soo.nonconvex.ga", "GA"),
    "pymoo-differential-evolution": ("pymoo.algorithms.soo.nonconvex.de", "DE"),
}


def by_pymoo(method: str) -> Callable[..., Search]:
    """A search by one of pymoo's algorithms, asked and answered, within its evaluations."""

    def run(
        cost: Cost,
        box: Box,
        *,
        seed: int,
        population: int = 10,
        generations: int = 40,
        start: ArrayLike | None = None,
    ) -> Search:
        problem = _library("pymoo.core.problem", method).Problem(
            n_var=box.size, n_obj=1, xl=np.zeros(box.size), xu=np.ones(box.size)
        )
        evaluator = _library("pymoo.core.evaluator", method).Evaluator()
        static = _library("pymoo.problems.static", method).StaticProblem
        place, name = PYMOO[method]
        record, most = Record(cost, box), population * generations
        first = np.random.default_rng(seed).random((population, box.size))
        if start is not None:
            first[0] = box.unit(start)
        algorithm = getattr(_library(place, method), name)(pop_size=population, sampling=first)
        algorithm.setup(problem, termination=("n_eval", 10 * most), seed=seed, verbose=False)
        while record.evaluations < most:
            asked = algorithm.ask()
            points = asked.get("X")[: most - record.evaluations]
            costs = _finite(record(box.inside(points)))
            unseen = np.full(len(asked) - len(points), costs.max())  # beyond the budget
            values = np.concatenate((costs, unseen))[:, None]
            evaluator.eval(static(problem, F=values), asked)
            algorithm.tell(infills=asked)
        return record.result(method, seed)

    run.__doc__ = f"pymoo's {PYMOO[method][1]}."
    return run
