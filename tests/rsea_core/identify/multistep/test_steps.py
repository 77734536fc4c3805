"""Steps of a fit in a curved valley (Transtrum and Sethna, arXiv:1201.5885, section 4)."""

import numpy as np
import pytest

from rsea_core.identify.multistep.kalman_filter import huber_squares
from rsea_core.identify.multistep.steps import (
    PROBE,
    UNDAMPED,
    Start,
    curved,
    damped_step,
    normal_equations,
)

SHARP = 1e3  # deviations by which the product may differ from one
LOW, HIGH = np.full(2, -100.0), np.full(2, 100.0)
AT = np.array([2.0, 0.5])  # in the valley of the product, far from its lowest point (1, 1)


def innovations(x):
    """One innovation of a product, as of a torque constant and a current that is not read."""
    return [np.array([[SHARP * (x[0] * x[1] - 1.0)]])]


def derivatives(x):
    return [np.array([[[SHARP * x[1]]], [[SHARP * x[0]]]])]


def cost(x):
    (e,) = innovations(x)
    return 0.5 * float(np.sum(huber_squares(e))) + 0.5 * float(np.sum((x - 1.0) ** 2))


def begun(x):
    A, g = normal_equations(innovations(x), derivatives(x))
    start = Start(None, x, cost(x), A + np.eye(2), g + x - 1.0)
    return start, damped_step(x, start.A, start.g, UNDAMPED, LOW, HIGH) - x


def test_a_curved_step_lowers_the_cost_far_more_than_any_straight_one():
    start, v = begun(AT)
    probed = innovations(AT + PROBE * v)
    ends = curved(start, v, innovations(AT), derivatives(AT), probed, 1.0)
    shares = np.geomspace(1e-4, 1.0, 200)
    straight = start.cost - min(cost(AT + s * v) for s in shares)
    by_curve = start.cost - min(cost(x) for x in ends)
    assert by_curve > 5.0 * max(straight, 1e-3)


def test_repeated_curved_steps_reach_the_lowest_point_of_the_valley():
    x = AT
    for _ in range(30):
        start, v = begun(x)
        ends = curved(start, v, innovations(x), derivatives(x), innovations(x + PROBE * v), 1.0)
        x = min([x, *ends], key=cost)
    assert x == pytest.approx([1.0, 1.0], abs=0.02)


def test_a_failed_probe_gives_no_curved_step():
    start, v = begun(AT)
    assert not curved(start, v, innovations(AT), derivatives(AT), [np.array([[np.nan]])], 1.0)


def test_unknowns_that_nothing_determines_give_no_curved_step():
    start, v = begun(AT)
    start = start._replace(A=np.zeros((2, 2)))
    probed = innovations(AT + PROBE * v)
    assert not curved(start, v, innovations(AT), derivatives(AT), probed, 1.0)
