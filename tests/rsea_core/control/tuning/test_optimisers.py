"""Every search method finds a known minimum, repeats by its seed and stays in its box."""

import numpy as np
import pytest

from rsea_core.control.tuning.least_squares import Squares
from rsea_core.control.tuning.optimisers import CHI, DEFAULT, METHODS, PHI, Starts, search
from rsea_core.control.tuning.search_record import Box
from rsea_core.errors import InputError

BOX = Box(names=("a", "b", "c"), low=[-5.0, -5.0, -5.0], high=[5.0, 5.0, 5.0])
TARGET = np.array([1.0, -2.0, 0.5])


def bowl(points):
    return ((points - TARGET) ** 2).sum(axis=1)


def broken(points):
    costs = bowl(points)
    return np.where(points[:, 0] < 0.0, np.nan, costs)


def test_constriction_is_0_72984_and_its_inertia_form_1_49618():
    """Clerc & Kennedy 2002; specification, actuator.md 3.4."""
    assert pytest.approx(0.72984, abs=1e-5) == CHI
    assert pytest.approx(1.49618, abs=1e-5) == CHI * PHI


@pytest.mark.parametrize(("method", "reach"), [
    ("particle-swarm", 1e-4), ("genetic", 0.3), ("ant-colony", 0.5), ("cma-es", 1e-4),
    ("differential-evolution", 0.05), ("pymoo-particle-swarm", 1e-4), ("pymoo-genetic", 0.05),
    ("pymoo-differential-evolution", 0.05),
])  # fmt: skip
def test_each_method_finds_the_bottom_of_a_bowl(method, reach):
    library = "cma" if method == "cma-es" else method.partition("-")[0]
    if library in ("cma", "pymoo"):
        pytest.importorskip(library, reason="the library is not installed")
    found = search(bowl, BOX, method=method, seed=3, population=12, generations=60)
    assert found.cost < reach
    assert np.abs(found.best - TARGET).max() < np.sqrt(reach) + 1e-9
    assert (np.diff(found.history) <= 0.0).all()
    assert found.history[-1] == found.cost


class Squared:
    """The bowl with what it is made of, for gauss-newton."""

    def __init__(self, cost):
        self.cost = cost

    def __call__(self, points):
        return self.cost(points)

    def squares(self, points):
        errors = points - TARGET
        costs = np.nan_to_num(self.cost(points), nan=np.inf)
        slack = np.full(len(points), np.inf)
        weights = np.full(errors.shape, 2.0)
        return Squares(costs=costs, errors=errors, weights=weights, slack=slack)


@pytest.mark.parametrize("method", METHODS)
def test_the_same_seed_repeats_to_the_bit_and_another_does_not(method):
    library = "cma" if method == "cma-es" else method.partition("-")[0]
    if library in ("cma", "pymoo"):
        pytest.importorskip(library, reason="the library is not installed")
    one, two, other = (
        search(Squared(bowl), BOX, method=method, seed=seed, population=8, generations=6)
        for seed in (5, 5, 6)
    )
    assert one.cost == two.cost
    assert np.array_equal(one.best, two.best)
    assert one.cost != other.cost


@pytest.mark.parametrize("method", METHODS)
def test_costs_that_are_no_numbers_are_avoided(method):
    library = "cma" if method == "cma-es" else method.partition("-")[0]
    if library in ("cma", "pymoo"):
        pytest.importorskip(library, reason="the library is not installed")
    found = search(Squared(broken), BOX, method=method, seed=1, population=10, generations=25)
    assert np.isfinite(found.cost)
    assert found.best[0] >= 0.0


SIX = Box(names=tuple("abcdef"), low=[-5.0] * 6, high=[5.0] * 6)
BOTTOM = np.array([1.0, -2.0, 0.5, 3.0, -1.0, 0.3])


def sphere(points):
    return ((points - BOTTOM) ** 2).sum(axis=1)


def rastrigin(points):
    away = points - BOTTOM
    return (10.0 + away**2 - 10.0 * np.cos(2.0 * np.pi * away)).sum(axis=1)


@pytest.mark.parametrize("function", [sphere, rastrigin])
def test_the_default_is_ahead_of_the_thesis_variants_with_the_same_evaluations(function):
    pytest.importorskip("pymoo", reason="the library is not installed")
    median = {}
    for method in (DEFAULT, "particle-swarm", "ant-colony"):
        runs = [
            search(function, SIX, method=method, seed=s, population=10, generations=40)
            for s in range(9)
        ]
        assert {r.evaluations for r in runs} == {400}
        median[method] = np.median([r.cost for r in runs])
    assert median[DEFAULT] < min(median["particle-swarm"], median["ant-colony"])


def test_points_never_leave_the_box():
    seen = []

    def spy(points):
        seen.append(points.copy())
        return -points.sum(axis=1)

    for method in ("particle-swarm", "genetic", "ant-colony", "differential-evolution"):
        search(spy, BOX, method=method, seed=2, population=8, generations=8)
    every = np.concatenate(seen)
    assert every.min() >= -5.0
    assert every.max() <= 5.0


def test_the_share_of_failed_seeds_is_reported():
    runs = [
        search(bowl, BOX, method="genetic", seed=s, population=6, generations=3) for s in (1, 2)
    ]
    starts = Starts(searches=tuple(runs))
    ratio = max(r.cost for r in runs) / min(r.cost for r in runs)
    assert starts.failed_share == (0.5 if ratio > 2.0 else 0.0)
    assert starts.best.cost == min(r.cost for r in runs)


def test_unusable_searches_are_refused():
    with pytest.raises(InputError, match="bounds of a: 1 must be below 0"):
        Box(names=("a",), low=[1.0], high=[0.0])
    with pytest.raises(InputError, match="tuning method 'annealing'"):
        search(bowl, BOX, method="annealing", seed=0)
    with pytest.raises(InputError, match="population = 2"):
        search(bowl, BOX, method="genetic", seed=0, population=2)
