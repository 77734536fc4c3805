"""Mamdani inference with two inputs: min-AND, clipped output sets, centre of gravity.

A set is a triangle (left, peak, right); where left equals peak, or peak equals right, an input
set is a shoulder that goes on at 1 beyond it. A rule fires by the smaller of its two
memberships and clips its output set there. `SUM` adds the clipped sets (the thesis' equation
4.10), so that overlapping ones count twice and the centre of gravity (4.11) has a closed form
by areas and moments of trapezoids; `MAX` takes their envelope, as most libraries do, and is
integrated piece by piece between the corners, which is exact as well. Where no rule fires the
answer is the neutral value, and `fires` says so.

Source: the thesis' section 4.3.2; Driankov, Hellendoorn & Reinfrank, An Introduction to Fuzzy
Control (1996), section 3.4.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from rsea_core.errors import ControllerError
from rsea_core.numeric.arrays import read_only

SUM, MAX = 0, 1
AGGREGATIONS = ("sum", "max")
# numbers of a system as compiled code reads them: sizes, then sets, then rules
N_FIRST, N_SECOND, N_OUTPUT, AGGREGATION, NEUTRAL = range(5)
HEADER = 5


@dataclass(frozen=True, kw_only=True)
class FuzzySystem:
    """Two inputs, one output.

    Attributes
    ----------
    first, second : (n, 3) and (m, 3) array
        Input sets, as left, peak and right.
    output : (q, 3) array
        Output sets; a left that equals the peak is a vertical edge there.
    rules : (n, m) array of int
        Which output set each pair of input sets leads to.
    names : (tuple, tuple, tuple) of str
        Names of the sets.
    neutral : float
        The answer where no rule fires.
    aggregation : "sum" or "max"

    Raises
    ------
    ControllerError
        If a set is not in order or has no width, a rule names no set, or shapes do not fit.
    """

    first: NDArray
    second: NDArray
    output: NDArray
    rules: NDArray
    names: tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]
    neutral: float = 0.0
    aggregation: str = "sum"

    def __post_init__(self):
        for name, labels in zip(("first", "second", "output"), self.names, strict=True):
            sets = np.array(getattr(self, name), dtype=float)
            if sets.shape != (len(labels), 3) or not len(labels):
                raise ControllerError(
                    f"fuzzy {name}: {len(labels)} names need ({len(labels)}, 3) numbers,"
                    f" not {sets.shape}"
                )
            for label, (left, peak, right) in zip(labels, sets, strict=True):
                if not (left <= peak <= right and left < right and np.isfinite(sets).all()):
                    raise ControllerError(
                        f"fuzzy {name}: set {label} [{left:g} {peak:g} {right:g}] is out of order;"
                        " it must be left <= peak <= right with some width"
                    )
            object.__setattr__(self, name, read_only(sets))
        rules = np.array(self.rules)
        wanted = (len(self.names[0]), len(self.names[1]))
        if rules.shape != wanted or rules.dtype.kind != "i":
            raise ControllerError(f"fuzzy rules must be {wanted} whole numbers, not {rules.shape}")
        if rules.min() < 0 or rules.max() >= len(self.names[2]):
            raise ControllerError(
                f"fuzzy rules must name output sets 0..{len(self.names[2]) - 1}, found"
                f" {rules.min()}..{rules.max()}"
            )
        object.__setattr__(self, "rules", read_only(rules))
        if self.aggregation not in AGGREGATIONS:
            raise ControllerError(
                f"fuzzy aggregation {self.aggregation!r} must be one of {', '.join(AGGREGATIONS)}"
            )

    def packed(self) -> NDArray:
        """The system as one array of numbers for `infer`."""
        sizes = [len(n) for n in self.names]
        header = [*sizes, AGGREGATIONS.index(self.aggregation), self.neutral]
        parts = (header, self.first, self.second, self.output, self.rules)
        return np.concatenate([np.ravel(part) for part in parts]).astype(float)

    def evaluate(self, first: ArrayLike, second: ArrayLike) -> NDArray:
        """The answer for arrays of inputs, broadcast against each other."""
        return self._map(infer, first, second)

    def fires(self, first: ArrayLike, second: ArrayLike) -> NDArray:
        """The largest degree to which any rule fires."""
        return self._map(firing, first, second)

    def _map(self, function, first: ArrayLike, second: ArrayLike) -> NDArray:
        a, b = np.broadcast_arrays(np.asarray(first, float), np.asarray(second, float))
        found = np.empty(a.size)
        _each(function, self.packed(), a.ravel(), b.ravel(), found)
        return found.reshape(a.shape)


@njit(error_model="numpy", cache=True)
def membership(sets, start, x):
    """Degree to which x belongs to the input set whose three numbers begin at start."""
    left, peak, right = sets[start], sets[start + 1], sets[start + 2]
    if x <= peak:
        if left == peak:
            return 1.0
        return max((x - left) / (peak - left), 0.0)
    if peak == right:
        return 1.0
    return max((right - x) / (right - peak), 0.0)


@njit(error_model="numpy", cache=True)
def infer(p, x, y):
    """The answer of a packed system to the inputs x and y."""
    n, m, q = int(p[N_FIRST]), int(p[N_SECOND]), int(p[N_OUTPUT])
    second, output = HEADER + 3 * n, HEADER + 3 * (n + m)
    rules = output + 3 * q
    if p[AGGREGATION] == MAX:
        return _infer_max(p, x, y, n, m, q)
    area, moment = 0.0, 0.0
    for i in range(n):
        one = membership(p, HEADER + 3 * i, x)
        if one == 0.0:
            continue
        for j in range(m):
            height = min(one, membership(p, second + 3 * j, y))
            if height == 0.0:
                continue
            at = output + 3 * int(p[rules + i * m + j])
            a, b, c = p[at], p[at + 1], p[at + 2]
            # trapezoid: two ramps and the flat between them
            up, flat, down = height * (b - a), (1.0 - height) * (c - a), height * (c - b)
            first, middle, last = 0.5 * height * up, height * flat, 0.5 * height * down
            area += first + middle + last
            moment += first * (a + up * (2.0 / 3.0))
            moment += middle * (a + up + 0.5 * flat) + last * (c - down * (2.0 / 3.0))
    return moment / area if area > 0.0 else p[NEUTRAL]


@njit(error_model="numpy", cache=True)
def firing(p, x, y):
    """The largest degree to which a rule of a packed system fires."""
    n, m = int(p[N_FIRST]), int(p[N_SECOND])
    second = HEADER + 3 * n
    largest = 0.0
    for i in range(n):
        one = membership(p, HEADER + 3 * i, x)
        for j in range(m):
            largest = max(largest, min(one, membership(p, second + 3 * j, y)))
    return largest


@njit(error_model="numpy", cache=True)
def _infer_max(p, x, y, n, m, q):
    """Centre of gravity of the envelope of the clipped sets."""
    second, output = HEADER + 3 * n, HEADER + 3 * (n + m)
    rules = output + 3 * q
    heights = np.zeros(q)
    for i in range(n):
        one = membership(p, HEADER + 3 * i, x)
        if one > 0.0:
            for j in range(m):
                at = int(p[rules + i * m + j])
                height = min(one, membership(p, second + 3 * j, y))
                heights[at] = max(heights[at], height)
    # the envelope is straight between these corners
    corners = np.empty(4 * q + 6 * q * q)
    count = 0
    for a in range(q):
        if heights[a] == 0.0:
            continue
        left, peak, right = p[output + 3 * a], p[output + 3 * a + 1], p[output + 3 * a + 2]
        corners[count] = left
        corners[count + 1] = left + heights[a] * (peak - left)
        corners[count + 2] = right - heights[a] * (right - peak)
        corners[count + 3] = right
        count += 4
        for b in range(q):
            if b != a and heights[b] > 0.0:
                count = _crossings(p, output, heights, a, b, corners, count)
    points = np.sort(corners[:count])
    area, moment = 0.0, 0.0
    for i in range(count - 1):
        u, v = points[i], points[i + 1]
        if v <= u:
            continue
        # two inner points give the straight line, also where an edge is vertical
        low = _envelope(p, output, heights, q, u + 0.25 * (v - u))
        high = _envelope(p, output, heights, q, u + 0.75 * (v - u))
        at_u, at_v = 1.5 * low - 0.5 * high, 1.5 * high - 0.5 * low
        area += 0.5 * (v - u) * (at_u + at_v)
        moment += (v - u) * (u * (2.0 * at_u + at_v) + v * (at_u + 2.0 * at_v)) / 6.0
    return moment / area if area > 0.0 else p[NEUTRAL]


@njit(error_model="numpy", cache=True)
def _crossings(p, output, heights, a, b, corners, count):
    """Adds where an edge of set a meets an edge or the flat of set b."""
    for side in range(2):
        foot, peak = p[output + 3 * a + 2 * side], p[output + 3 * a + 1]
        if foot == peak:
            continue
        corners[count] = foot + heights[b] * (peak - foot)
        count += 1
        for other in range(2):
            foot_b, peak_b = p[output + 3 * b + 2 * other], p[output + 3 * b + 1]
            if foot_b == peak_b:
                continue
            slope, slope_b = 1.0 / (peak - foot), 1.0 / (peak_b - foot_b)
            if slope != slope_b:
                corners[count] = (slope * foot - slope_b * foot_b) / (slope - slope_b)
                count += 1
    return count


@njit(error_model="numpy", cache=True)
def _envelope(p, output, heights, q, x):
    largest = 0.0
    for a in range(q):
        left, peak, right = p[output + 3 * a], p[output + 3 * a + 1], p[output + 3 * a + 2]
        if heights[a] == 0.0 or x < left or x > right:
            continue
        value = 1.0
        if x < peak:
            value = (x - left) / (peak - left)
        elif x > peak:
            value = (right - x) / (right - peak)
        largest = max(largest, min(heights[a], value))
    return largest


@njit(cache=True)
def _each(function, p, first, second, found):
    for i in range(found.size):
        found[i] = function(p, first[i], second[i])
