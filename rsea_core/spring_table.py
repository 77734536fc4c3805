"""The form in which compiled code reads an elastic law: a table of cubics.

Every law, the linear one included, is a `SpringTable`, so that the kernel and the controllers
have one spring and no cases. The `table_*` functions are compiled and take a scalar; the
`spring_*` functions do the same for arrays.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray


class SpringTable(NamedTuple):
    """An elastic law as cubics between breaks, linear outside them.

    With n breaks there are n + 1 regions: below the first break, n - 1 intervals, above the
    last. In region j the torque is the sum over p of coefficients[j, p] (d - anchors[j])^p.
    """

    breaks_rad: NDArray  # (n,)
    anchors_rad: NDArray  # (n + 1,)
    coefficients: NDArray  # (n + 1, 4) torque [Nm] by powers of the deflection [rad]
    valid_low_rad: float
    valid_high_rad: float


@njit(error_model="numpy", inline="always")
def _region(breaks, deflection):
    low, high = 0, breaks.size
    while low < high:
        middle = (low + high) // 2
        if breaks[middle] <= deflection:
            low = middle + 1
        else:
            high = middle
    return low


@njit(error_model="numpy", inline="always")
def table_torque(table, deflection):
    """Torque [Nm] of a `SpringTable` at a deflection [rad]; compiled code."""
    j = _region(table.breaks_rad, deflection)
    s = deflection - table.anchors_rad[j]
    c = table.coefficients
    return c[j, 0] + s * (c[j, 1] + s * (c[j, 2] + s * c[j, 3]))


@njit(error_model="numpy")
def table_tangent(table, deflection):
    """Tangent stiffness [Nm/rad] of a `SpringTable`; compiled code."""
    j = _region(table.breaks_rad, deflection)
    s = deflection - table.anchors_rad[j]
    c = table.coefficients
    return c[j, 1] + s * (2.0 * c[j, 2] + s * 3.0 * c[j, 3])


@njit(error_model="numpy")
def table_deflection(table, torque):
    """Deflection [rad] at which a `SpringTable` carries a torque [Nm]; compiled code."""
    c, n = table.coefficients, table.breaks_rad.size
    j = 0
    while j < n and c[j + 1, 0] <= torque:
        j += 1
    anchor = table.anchors_rad[j]
    if j == 0 or j == n:
        return anchor + (torque - c[j, 0]) / c[j, 1]
    low, high = 0.0, table.breaks_rad[j] - anchor
    s = (torque - c[j, 0]) / (c[j + 1, 0] - c[j, 0]) * high
    for _ in range(60):
        error = c[j, 0] + s * (c[j, 1] + s * (c[j, 2] + s * c[j, 3])) - torque
        if error > 0.0:
            high = s
        else:
            low = s
        slope = c[j, 1] + s * (2.0 * c[j, 2] + s * 3.0 * c[j, 3])
        step = s - error / slope
        if not low < step < high:
            step = 0.5 * (low + high)
        if abs(step - s) <= 1e-15 * (abs(anchor) + abs(s)):
            return anchor + step
        s = step
    return anchor + s


def linear_table(stiffness_Nm_per_rad: float) -> SpringTable:
    """The table of tau = K d, valid everywhere."""
    line = np.array([[0.0, stiffness_Nm_per_rad, 0.0, 0.0]])
    return SpringTable(
        breaks_rad=read_only(np.zeros(1)),
        anchors_rad=read_only(np.zeros(2)),
        coefficients=read_only(np.repeat(line, 2, axis=0)),
        valid_low_rad=-np.inf,
        valid_high_rad=np.inf,
    )


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
    c = table.coefficients[j]
    return c[..., 0] + s * (c[..., 1] + s * (c[..., 2] + s * c[..., 3]))


def spring_tangent_Nm_per_rad(table: SpringTable, deflection_rad: ArrayLike) -> NDArray:
    """Tangent stiffness at a deflection, float or array of any shape [Nm/rad]."""
    j, s = _locate(table, deflection_rad)
    c = table.coefficients[j]
    return c[..., 1] + s * (2.0 * c[..., 2] + s * 3.0 * c[..., 3])


def _locate(table: SpringTable, deflection_rad: ArrayLike) -> tuple[NDArray, NDArray]:
    d = np.asarray(deflection_rad, dtype=float)
    j = np.searchsorted(table.breaks_rad, d, side="right")
    return j, d - table.anchors_rad[j]


def _antiderivative(table: SpringTable, deflection: NDArray) -> NDArray:
    c, breaks = table.coefficients, table.breaks_rad
    h = np.diff(breaks)
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
