"""The form in which compiled code reads an elastic law: a table of cubics.

Every law, the linear one included, is a `SpringTable`, so that the kernel and the controllers
have one spring and no cases. The `table_*` functions are compiled and take a scalar; the
`spring_*` functions do the same for arrays.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

# columns of SpringTable.regions
UPPER, ANCHOR, C0, C1, C2, C3 = range(6)


class SpringTable(NamedTuple):
    """An elastic law as cubics between breaks, linear outside them.

    With n breaks there are n + 1 regions, a row each: the deflection where the region ends
    (inf for the last), the deflection a that its cubic is written around, and c0..c3 of
    torque = c0 + c1 (d - a) + c2 (d - a)^2 + c3 (d - a)^3.
    """

    regions: NDArray  # (n + 1, 6)
    valid_low_rad: float
    valid_high_rad: float


@njit(error_model="numpy", inline="always")
def _region(regions, deflection):
    low, high = 0, regions.shape[0] - 1
    while low < high:
        middle = (low + high) // 2
        if regions[middle, UPPER] <= deflection:
            low = middle + 1
        else:
            high = middle
    return low


@njit(error_model="numpy", inline="always", cache=True)
def table_torque(regions, deflection):
    """Torque [Nm] at a deflection [rad]; compiled code."""
    j = _region(regions, deflection)
    s = deflection - regions[j, ANCHOR]
    return regions[j, C0] + s * (regions[j, C1] + s * (regions[j, C2] + s * regions[j, C3]))


@njit(error_model="numpy", cache=True)
def table_tangent(regions, deflection):
    """Tangent stiffness [Nm/rad] at a deflection [rad]; compiled code."""
    j = _region(regions, deflection)
    s = deflection - regions[j, ANCHOR]
    return regions[j, C1] + s * (2.0 * regions[j, C2] + s * 3.0 * regions[j, C3])


@njit(error_model="numpy")
def table_deflection(regions, torque):
    """Deflection [rad] at which the spring carries a torque [Nm]; compiled code."""
    last = regions.shape[0] - 1
    j = 0
    while j < last and regions[j + 1, C0] <= torque:
        j += 1
    anchor, c0, c1, c2, c3 = regions[j, ANCHOR:]
    if j == 0 or j == last:
        return anchor + (torque - c0) / c1
    low, high = 0.0, regions[j, UPPER] - anchor
    s = (torque - c0) / (regions[j + 1, C0] - c0) * high
    for _ in range(60):
        error = c0 + s * (c1 + s * (c2 + s * c3)) - torque
        if error > 0.0:
            high = s
        else:
            low = s
        step = s - error / (c1 + s * (2.0 * c2 + s * 3.0 * c3))
        if not low < step < high:
            step = 0.5 * (low + high)
        if abs(step - s) <= 1e-15 * (abs(anchor) + abs(s)):
            return anchor + step
        s = step
    return anchor + s


def linear_table(stiffness_Nm_per_rad: float) -> SpringTable:
    """The table of tau = K d, valid everywhere."""
    line = (0.0, 0.0, stiffness_Nm_per_rad, 0.0, 0.0)
    regions = np.array([(0.0, *line), (np.inf, *line)])
    return SpringTable(regions=read_only(regions), valid_low_rad=-np.inf, valid_high_rad=np.inf)


def sum_of_regions(first: NDArray, second: NDArray) -> NDArray:
    """Regions of the sum of two laws; a break of either is a break of the sum."""
    breaks = np.union1d(first[:-1, UPPER], second[:-1, UPPER])
    regions = np.zeros((breaks.size + 1, 6))
    regions[:-1, UPPER], regions[-1, UPPER] = breaks, np.inf
    regions[0, ANCHOR], regions[1:, ANCHOR] = breaks[0], breaks
    middle = np.concatenate(([breaks[0] - 1.0], 0.5 * (breaks[1:] + breaks[:-1]), [np.inf]))
    for law in (first, second):
        rows = law[np.searchsorted(law[:-1, UPPER], middle, side="right")]
        s = regions[:, ANCHOR] - rows[:, ANCHOR]
        c0, c1, c2, c3 = rows[:, C0:].T
        regions[:, C0] += c0 + s * (c1 + s * (c2 + s * c3))
        regions[:, C1] += c1 + s * (2.0 * c2 + 3.0 * s * c3)
        regions[:, C2] += c2 + 3.0 * s * c3
        regions[:, C3] += c3
    return read_only(regions)


def with_dead_zone(regions: NDArray, width_rad: float) -> NDArray:
    """Regions of f(d - w/2) above w/2, f(d + w/2) below -w/2 and no torque between."""
    half = 0.5 * width_rad
    nothing = np.zeros((2, 6))
    nothing[1, UPPER] = np.inf
    split = sum_of_regions(regions, nothing)
    below, above = split[split[:, UPPER] <= 0.0].copy(), split[split[:, UPPER] > 0.0].copy()
    below[:, [UPPER, ANCHOR]] -= half
    above[:, [UPPER, ANCHOR]] += half
    gap = np.array([(half, -half, 0.0, 0.0, 0.0, 0.0)])
    return read_only(np.concatenate((below, gap, above)))


def spring_energy_J(table: SpringTable, deflection_rad: ArrayLike) -> NDArray:
    """Energy stored at a deflection, the exact integral of the torque from zero [J].

    Parameters
    ----------
    deflection_rad : float or (...) array

    Returns
    -------
    (...) array
    """
    d = np.asarray(deflection_rad, dtype=float)
    return _antiderivative(table, d) - _antiderivative(table, np.zeros(1))[0]


def spring_torque_Nm(table: SpringTable, deflection_rad: ArrayLike) -> NDArray:
    """Torque at a deflection, float or array of any shape [Nm]."""
    j, s = _locate(table, deflection_rad)
    c = table.regions[j, C0:]
    return c[..., 0] + s * (c[..., 1] + s * (c[..., 2] + s * c[..., 3]))


def spring_tangent_Nm_per_rad(table: SpringTable, deflection_rad: ArrayLike) -> NDArray:
    """Tangent stiffness at a deflection, float or array of any shape [Nm/rad]."""
    j, s = _locate(table, deflection_rad)
    c = table.regions[j, C0:]
    return c[..., 1] + s * (2.0 * c[..., 2] + s * 3.0 * c[..., 3])


def _locate(table: SpringTable, deflection_rad: ArrayLike) -> tuple[NDArray, NDArray]:
    d = np.asarray(deflection_rad, dtype=float)
    j = np.searchsorted(table.regions[:-1, UPPER], d, side="right")
    return j, d - table.regions[j, ANCHOR]


def _antiderivative(table: SpringTable, deflection: NDArray) -> NDArray:
    c, h = table.regions[:, C0:], np.diff(table.regions[:-1, UPPER])
    # energy at each region's anchor, counted from the first break
    offset = np.concatenate(([0.0, 0.0], np.cumsum(_quartic(c[1:-1], h))))
    j, s = _locate(table, deflection)
    return offset[j] + _quartic(c[j], s)


def _quartic(c: NDArray, s: NDArray) -> NDArray:
    return s * (c[..., 0] + s * (c[..., 1] / 2 + s * (c[..., 2] / 3 + s * c[..., 3] / 4)))


def read_only(array: NDArray) -> NDArray:
    """The same array, closed for writing."""
    array.setflags(write=False)
    return array
