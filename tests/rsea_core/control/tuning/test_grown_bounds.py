"""Bounds grow until the optimum is inside, and what stays at one is said with its reason."""

import numpy as np
import pytest

from rsea_core.control.tuning.grown_bounds import ROUNDS, at_bounds, grown, search_and_grow
from rsea_core.control.tuning.optimisers import METHODS
from rsea_core.control.tuning.search_record import Box

BOX = Box(names=("kp", "ki"), low=[1.0, 0.0], high=[10.0, 5.0])


def accepts(name, value):
    return value >= 0.0


def bowl_at(*bottom):
    return lambda points: ((points - np.array(bottom)) ** 2).sum(axis=1)


def test_an_optimum_ten_times_beyond_its_bound_is_found_inside_the_grown_box():
    found = search_and_grow(bowl_at(100.0, 2.0), BOX, accepts, method="cma-es", seed=1,
                            population=10, generations=40)  # fmt: skip
    assert found.best == pytest.approx([100.0, 2.0], rel=0.02)
    searched = Box(names=BOX.names, low=found.low, high=found.high)
    assert at_bounds(found.best, searched, accepts) == ()


def test_a_bound_that_the_controller_keeps_is_named_as_physical():
    found = search_and_grow(bowl_at(5.0, -3.0), BOX, accepts, method="pymoo-particle-swarm",
                            seed=1, population=10, generations=40)  # fmt: skip
    searched = Box(names=BOX.names, low=found.low, high=found.high)
    (bound,) = at_bounds(found.best, searched, accepts)
    assert (bound.name, bound.bound, bound.is_physical) == ("ki", 0.0, True)
    assert "its physical limit" in str(bound)


def test_growth_ends_and_what_is_still_at_its_bound_is_named():
    found = search_and_grow(lambda x: -x[:, 0], BOX, accepts, method="cma-es", seed=1,
                            population=10, generations=40)  # fmt: skip
    assert found.high[0] == 10.0 * 4.0 ** (ROUNDS - 1)
    searched = Box(names=BOX.names, low=found.low, high=found.high)
    at = {bound.name: bound for bound in at_bounds(found.best, searched, accepts)}
    assert not at["kp"].is_physical
    assert "the end of what was searched" in str(at["kp"])


def test_a_side_moves_only_as_far_as_the_controller_takes_values():
    box = Box(names=("exponent",), low=[0.2], high=[0.9])
    moved = grown(box, np.array([0.9]), lambda name, value: 0.0 <= value <= 1.0)
    assert moved.low[0] == 0.2
    assert 0.98 < moved.high[0] <= 1.0


@pytest.mark.parametrize("method", [m for m in METHODS if m != "gauss-newton"])
def test_growing_costs_no_evaluation_more_than_the_budget(method):
    found = search_and_grow(bowl_at(100.0, 2.0), BOX, accepts, method=method, seed=1,
                            population=8, generations=21)  # fmt: skip
    assert found.evaluations == 8 * 21
    assert (np.diff(found.leader_costs) >= 0.0).all()
    assert found.leader_costs[0] == found.cost == found.history[-1]
