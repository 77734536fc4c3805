"""Gauss-Newton tuning: minima of squares, of magnitudes and at a margin; costs of a task."""

import numpy as np
import pytest

from rsea_core.control.tuning.least_squares import Squares, gauss_newton
from rsea_core.control.tuning.optimisers import search
from rsea_core.control.tuning.search_record import Box
from rsea_core.errors import InputError

BOX = Box(names=("a", "b"), low=[-2.0, -2.0], high=[2.0, 2.0])


class Made:
    """A cost of errors: squares, or magnitudes by weights 1 / |error|; with a margin if given."""

    def __init__(self, errors, *, magnitudes=False, slack=None):
        self.errors, self.magnitudes, self.slack = errors, magnitudes, slack

    def __call__(self, points):
        return self.squares(points).costs

    def squares(self, points):
        e = self.errors(points)
        slack = np.full(len(points), np.inf) if self.slack is None else self.slack(points)
        costs, weights = (e**2).sum(axis=1), np.full(e.shape, 2.0)
        if self.magnitudes:
            costs, weights = np.abs(e).sum(axis=1), 1.0 / np.maximum(np.abs(e), 1e-6)
        costs = np.where(slack > 0.0, costs, np.inf)
        return Squares(costs=costs, errors=e, weights=weights, slack=slack)


TIME = np.linspace(0.0, 3.0, 40)
NOISE = 0.05 * np.sin(37.0 * TIME)
DECAY = Box(names=("size", "rate", "offset"), low=[0.0, 0.1, -2.0], high=[5.0, 6.0, 2.0])


def decay(points):
    """Errors of a decay fitted to rows with something beside it."""
    size, rate, offset = points.T[:, :, None]
    return size * np.exp(-rate * TIME) + offset - (2.0 * np.exp(-1.5 * TIME) + 0.3 + NOISE)


def line(points):
    """A line through data of which one is far off: magnitudes pass it by."""
    x, y = np.arange(5.0), np.array([0.0, 0.5, 1.0, 1.5, 9.0])
    return points[:, :1] + points[:, 1:] * x - y


def test_a_third_of_the_evaluations_reach_what_cma_es_reaches():
    pytest.importorskip("cma", reason="the library is not installed")
    for seed in range(2):
        found = gauss_newton(Made(decay), DECAY, seed=seed, population=10, generations=13)
        other = search(Made(decay), DECAY, method="cma-es", seed=seed, generations=40)
        assert (found.evaluations, other.evaluations) == (130, 400)
        assert found.cost <= other.cost * (1.0 + 1e-4)


def test_sums_of_magnitudes_are_minimised_by_weights():
    found = gauss_newton(Made(line, magnitudes=True), BOX, seed=0, generations=20)
    np.testing.assert_allclose(found.best, [0.0, 0.5], atol=0.01)


def test_a_margin_is_followed_to_the_lowest_point_that_keeps_it():
    made = Made(lambda p: p - np.array([1.0, 1.0]), slack=lambda p: 1.0 - p.sum(axis=1))
    found = gauss_newton(made, BOX, seed=0)
    np.testing.assert_allclose(found.best, [0.5, 0.5], atol=0.01)
    assert found.best.sum() < 1.0


def test_what_it_cannot_search_is_refused():
    with pytest.raises(InputError, match="errors row by row"):
        gauss_newton(lambda p: p.sum(axis=1), BOX, seed=0)
    with pytest.raises(InputError, match="population of at least 4"):
        gauss_newton(Made(line), BOX, seed=0, population=3)
