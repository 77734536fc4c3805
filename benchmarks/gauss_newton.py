"""Gauss-Newton tuning against CMA-ES and the default, on the shipped task of the worm.

    python -m benchmarks.gauss_newton [--seeds 3] [--controllers PID-FFC,FTC-FC]

Each controller of `compare-torque-worm` with gains to tune is searched from the same bounds with
the same 400 evaluations (bounds grow, as in `dftfs tune`). Printed: the cost that each method
reaches, and after how many evaluations Gauss-Newton is at or below what CMA-ES ends with. Target: a
third of the 400.
"""

import argparse
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from rsea_core.control.tuning.grown_bounds import search_and_grow
from rsea_core.control.tuning.least_squares import Squares
from rsea_core.control.tuning.search_record import Box
from rsea_core.control.tuning.tune import TaskCost, with_values
from rsea_core.scenarios.comparison_file import read_comparison

POPULATION, GENERATIONS = 10, 40
METHODS = ("gauss-newton", "cma-es", "pymoo-particle-swarm")


class Counted(TaskCost):
    """The cost of a task, and the lowest one after each evaluation."""

    def __init__(self, *given):
        super().__init__(*given)
        self.lowest: list[float] = []

    def __call__(self, points: NDArray) -> NDArray:
        return self._kept(super().__call__(points))

    def squares(self, points: NDArray) -> Squares:
        found = super().squares(points)
        self._kept(found.costs)
        return found

    def _kept(self, costs: NDArray) -> NDArray:
        for cost in costs:
            self.lowest.append(min(cost, self.lowest[-1] if self.lowest else np.inf))
        return costs

    def reached(self, cost: float) -> float:
        """Evaluations until a cost was reached; inf: never."""
        below = np.flatnonzero(np.array(self.lowest) <= cost)
        return float(below[0] + 1) if below.size else np.inf


def main() -> None:
    """Search and print a line for each controller and seed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--controllers", default="", help="names, by commas; default: all")
    arguments = parser.parse_args()
    path = resources.files("dftfs") / "examples" / "compare-torque-worm.toml"
    comparison = read_comparison(str(path))
    wanted = [name for name in arguments.controllers.split(",") if name]
    shares = []
    for compared in comparison.controllers:
        if not compared.bounds or (wanted and compared.name not in wanted):
            continue
        names, pairs = tuple(compared.bounds), np.array(list(compared.bounds.values()))
        box = Box(names=names, low=pairs[:, 0], high=pairs[:, 1])

        def accepts(name: str, value: float, law=compared.controller) -> bool:
            return with_values(law, (name,), np.array([value])) is not None

        for seed in range(arguments.seeds):
            ran = {}
            for method in METHODS:
                ran[method] = Counted(comparison.task, compared.controller, names)
                search_and_grow(
                    ran[method], box, accepts, method=method, seed=seed, population=POPULATION,
                    generations=GENERATIONS,
                )  # fmt: skip
            needed = ran["gauss-newton"].reached(ran["cma-es"].lowest[-1])
            shares.append(needed / (POPULATION * GENERATIONS))
            costs = ", ".join(f"{method} {c.lowest[-1]:.5g}" for method, c in ran.items())
            print(f"{compared.name}, seed {seed}: {costs}; CMA-ES reached after {needed:g}",
                  flush=True)  # fmt: skip
    print(f"median share of CMA-ES' evaluations: {np.median(shares):.3g}, worst {max(shares):.3g}")


if __name__ == "__main__":
    main()
