"""A table that is smooth: the cubic B-spline over evenly spaced nodes.

Twice continuously differentiable, so that an integrator of high order keeps its order; zero from
two nodes outside on (de Boor, A Practical Guide to Splines, 1978, chapter IX).
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(error_model="numpy", inline="always")
def uniform_spline(numbers, first, count, u):
    """The spline at u, counted in nodes from the first; entries numbers[first : first + count]."""
    value = 0.0
    if -2.0 < u < count + 1.0:
        i = int(np.floor(u))
        f = u - i
        g = 1.0 - f
        if 0 < i <= count:
            value += numbers[first + i - 1] * (g * g * g)
        if 0 <= i < count:
            value += numbers[first + i] * (f * f * (3.0 * f - 6.0) + 4.0)
        if 0 <= i + 1 < count:
            value += numbers[first + i + 1] * (g * g * (3.0 * g - 6.0) + 4.0)
        if 0 <= i + 2 < count:
            value += numbers[first + i + 2] * (f * f * f)
    return value / 6.0


@njit(error_model="numpy")
def steepest(numbers, first, count):
    """Bound of the slope per node: the largest step between neighbours, zeros outside."""
    found, before = 0.0, 0.0
    for j in range(count):
        node = numbers[first + j]
        found, before = max(found, abs(node - before)), node
    return max(found, abs(before))


def spline_integral(u: NDArray) -> NDArray:
    """Integral of one node's spline (height 2/3, area 1) from below to u, nodes away from it."""
    a = np.minimum(np.abs(u), 2.0)
    near = (4.0 * a - 2.0 * a**3 + 0.75 * a**4) / 6.0
    half = np.where(a <= 1.0, near, 0.5 - (2.0 - a) ** 4 / 24.0)
    return 0.5 + np.sign(u) * half
