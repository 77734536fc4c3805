"""Extrapolation of a solution path from states and rates."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

_REACH = 2.5  # times the last increment: farther, a polynomial is worse than the tangent


def hermite(
    points: Sequence[tuple[float, NDArray[np.float64], NDArray[np.float64]]], t: float
) -> NDArray[np.float64]:
    """Value at t of the polynomial through values and rates at distinct parameters.

    Parameters
    ----------
    points : sequence of (t, value, rate)
        Two give a cubic, three a quintic.

    Source: divided differences with doubled nodes, e.g. Stoer & Bulirsch, Introduction to
    Numerical Analysis, 2.1.5.
    """
    nodes = [s for s, _, _ in points for _ in (0, 1)]
    column = [value for _, value, _ in points for _ in (0, 1)]
    coefficients = [column[0]]
    for order in range(1, len(nodes)):
        column = [
            points[i // 2][2]
            if order == 1 and i % 2 == 0
            else (column[i + 1] - column[i]) / (nodes[i + order] - nodes[i])
            for i in range(len(column) - 1)
        ]
        coefficients.append(column[0])
    result = coefficients[-1]
    for node, coefficient in zip(nodes[-2::-1], coefficients[-2::-1]):
        result = coefficient + (t - node) * result
    return result


def extrapolated(
    history: Sequence[tuple[float, NDArray[np.float64], NDArray[np.float64]]], t: float
) -> NDArray[np.float64] | None:
    """Predicted value at t from the last states (oldest first), or None if t is out of reach."""
    usable = list(history[-1:])
    for point in reversed(history[:-1]):
        if point[0] in [s for s, _, _ in usable]:
            break
        usable.insert(0, point)
    if len(usable) < 2 or abs(t - usable[-1][0]) > _REACH * abs(usable[-1][0] - usable[-2][0]):
        return None
    return hermite(usable, t)
