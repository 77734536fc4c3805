"""Arc splines: the fewest tangent-continuous pairs of arcs within a tolerance of a smooth curve.

A biarc joins two points with given tangents by two arcs that share a tangent. Greedy: from each
point the longest biarc that stays within tolerance, found by bisection. Both tangents are the
curve's own, so the chain is smooth everywhere and joins its neighbours smoothly.

Source: Bolton, "Biarc curves", Computer-Aided Design 7 (1975) 89; for the error
``|dkappa/ds| h^3 / 324`` of a biarc of length h, Meek & Walton, "Approximating smooth planar
curves by arc splines", J. Comput. Appl. Math. 59 (1995) 221.
"""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dftfs.cad.bulge_loop import ArcPieces, bulge_from_chord
from dftfs.errors import DesignError

_SAMPLES = 33
_BISECTIONS = 12
_GROWTH = 1.5
_MAX_PIECES = 20000


class SmoothEdge(Protocol):
    """What the fitter needs of a curve: points and unit tangents over [0, 1], and its length."""

    def point(self, t: ArrayLike) -> NDArray: ...

    def tangent(self, t: ArrayLike) -> NDArray: ...

    @property
    def length_m(self) -> float: ...


def biarc_joint(
    start: NDArray, end: NDArray, tangent_start: NDArray, tangent_end: NDArray
) -> NDArray:
    """Joint (2,) of the biarc with equal tangent lengths d, for tangents along the chord.

    ``d`` solves ``|v - d (t0 + t1)| = 2 d`` with v the chord; the joint is the middle of
    ``start + d t0`` and ``end - d t1``.
    """
    chord = end - start
    square, forward = float(chord @ chord), float(chord @ (tangent_start + tangent_end))
    turning = 2 * (1 - float(tangent_start @ tangent_end))
    d = square / (forward + np.sqrt(forward**2 + turning * square))
    return (start + d * tangent_start + end - d * tangent_end) / 2


def fit_biarcs(edge: SmoothEdge, tolerance_m: float) -> tuple[NDArray, NDArray]:
    """Approximate a smooth edge by arcs whose distance from it is at most ``tolerance_m``.

    The distance is sampled at 33 points of each biarc, which sees its maximum to 0.2 %.

    Returns
    -------
    vertices_m : (n, 2) array
        Starts of the n arcs; the last arc ends at ``edge.point(1)``.
    bulges : (n,) array

    Raises
    ------
    DesignError
        If the tolerance is not positive, or the edge needs more than 20000 arcs.
    """
    if not tolerance_m > 0:
        raise DesignError(f"tolerance_m = {tolerance_m} of an arc fit must be positive")
    vertices, bulges = [], []
    start, step = 0.0, 1.0

    def deviation(stop: float) -> float:
        return _fit_once(edge, start, stop)[2]

    while start < 1.0:
        step = _longest(deviation, start, min(step * _GROWTH, 1.0 - start), tolerance_m)
        stop = 1.0 if start + step > 1.0 - 1e-12 else start + step
        ends, arcs, _ = _fit_once(edge, start, stop)
        vertices.extend(ends[:2])
        bulges.extend(arcs)
        start = stop
        if len(bulges) > _MAX_PIECES:
            raise DesignError(
                f"tolerance_m = {tolerance_m:.3g} needs more than {_MAX_PIECES} arcs on an edge"
                f" of {edge.length_m:.3g} m; a larger tolerance would work"
            )
    return np.array(vertices), np.array(bulges)


def _longest(
    deviation: Callable[[float], float], start: float, guess: float, tolerance_m: float
) -> float:
    """The longest step from ``start`` within tolerance: bracket from a guess, then bisect."""
    low, high = 0.0, guess
    while deviation(start + high) <= tolerance_m:
        low = high
        if start + high >= 1.0:
            return high
        high = min(high * _GROWTH, 1.0 - start)
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        if deviation(start + middle) <= tolerance_m:
            low = middle
        else:
            high = middle
        if low > 0 and high - low <= 1e-3 * low:
            break
    return low if low > 0 else _longest(deviation, start, high, tolerance_m)


def _fit_once(edge: SmoothEdge, start: float, stop: float) -> tuple[NDArray, NDArray, float]:
    """Ends (3, 2) and bulges (2,) of the biarc over [start, stop], and its deviation in m."""
    points = edge.point(np.linspace(start, stop, _SAMPLES))
    first, last = points[0], points[-1]
    tangents = edge.tangent(np.array([start, stop]))
    if np.any(tangents @ (last - first) <= 0):  # doubles back on its chord: far too long
        return np.array([first, first, last]), np.zeros(2), np.inf
    ends = np.array([first, biarc_joint(first, last, *tangents), last])
    chords = np.diff(ends, axis=0)
    bulges = np.array(
        [
            bulge_from_chord(tangents[0], chords[0]),
            -bulge_from_chord(-tangents[1], -chords[1]),
        ]
    )
    pieces = ArcPieces.from_bulges(ends[:-1], ends[1:], bulges)
    each = [pieces.distance(points, np.full(len(points), index)) for index in (0, 1)]
    return ends, bulges, float(np.max(np.minimum(*each)))
