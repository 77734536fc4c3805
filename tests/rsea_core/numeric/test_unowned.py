"""Arrays in a tuple lose their owner in compiled code and stay the same memory."""

from typing import NamedTuple

import numpy as np
from numba import njit

from rsea_core.numeric.unowned import unowned


class Inner(NamedTuple):
    lower: np.ndarray
    factor: float


class Outer(NamedTuple):
    inner: Inner
    pair: tuple[np.ndarray, np.ndarray]
    count: int


@njit
def doubled(given):
    borrowed = unowned(given)
    borrowed.inner.lower[:] *= borrowed.inner.factor
    borrowed.pair[1][0, 1] = borrowed.count
    return borrowed.pair[0].sum()


def test_arrays_at_any_depth_of_a_tuple_are_the_callers():
    given = Outer(Inner(np.arange(3.0), 2.0), (np.ones(4), np.zeros((2, 2))), 7)
    assert doubled(given) == 4.0
    assert given.inner.lower.tolist() == [0.0, 2.0, 4.0]
    assert given.pair[1][0, 1] == 7.0
