"""Quadratic facets in compiled loops: shape functions, normals, closest points.

Source: Wriggers, Computational Contact Mechanics (2006), 4.1 (closest-point projection).
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

_ITERATIONS = 25


@njit(cache=True)
def facet_shape(xi, N, dN, ddN, axes):
    """Shape functions of a 3-node edge or 8-node face on the unit cell, two derivatives.

    N (q,), dN (D - 1, q), ddN (D - 1, D - 1, q); corners first, then midsides.
    """
    if len(axes) == 2:
        x = xi[0]
        N[0], N[1], N[2] = (1 - x) * (1 - 2 * x), x * (2 * x - 1), 4 * x * (1 - x)
        dN[0, 0], dN[0, 1], dN[0, 2] = 4 * x - 3, 4 * x - 1, 4 - 8 * x
        ddN[0, 0, 0], ddN[0, 0, 1], ddN[0, 0, 2] = 4.0, 4.0, -8.0
        return
    s, t = 2 * xi[0] - 1, 2 * xi[1] - 1
    for k in range(4):
        a = -1.0 if k == 0 or k == 3 else 1.0
        b = -1.0 if k < 2 else 1.0
        N[k] = 0.25 * (1 + a * s) * (1 + b * t) * (a * s + b * t - 1)
        dN[0, k] = 0.5 * a * (1 + b * t) * (2 * a * s + b * t)
        dN[1, k] = 0.5 * b * (1 + a * s) * (2 * b * t + a * s)
        ddN[0, 0, k] = 2 * (1 + b * t)
        ddN[1, 1, k] = 2 * (1 + a * s)
        ddN[0, 1, k] = ddN[1, 0, k] = a * b * (1 + 2 * a * s + 2 * b * t)
    for k in range(4, 8):
        if k % 2 == 0:  # middle of an edge along s
            b = -1.0 if k == 4 else 1.0
            N[k] = 0.5 * (1 - s * s) * (1 + b * t)
            dN[0, k] = -2 * s * (1 + b * t)
            dN[1, k] = b * (1 - s * s)
            ddN[0, 0, k] = -4 * (1 + b * t)
            ddN[1, 1, k] = 0.0
            ddN[0, 1, k] = ddN[1, 0, k] = -4 * s * b
        else:
            a = 1.0 if k == 5 else -1.0
            N[k] = 0.5 * (1 - t * t) * (1 + a * s)
            dN[0, k] = a * (1 - t * t)
            dN[1, k] = -2 * t * (1 + a * s)
            ddN[0, 0, k] = 0.0
            ddN[1, 1, k] = -4 * (1 + a * s)
            ddN[0, 1, k] = ddN[1, 0, k] = -4 * t * a


@njit(cache=True)
def interpolated(weights, nodes, result):
    """Nodal values (q, D) weighted into result (D,)."""
    for i in range(nodes.shape[1]):
        result[i] = 0.0
        for a in range(nodes.shape[0]):
            result[i] += weights[a] * nodes[a, i]


@njit(cache=True)
def outward(tangents, normal, axes):
    """Unit normal of a facet from its tangents (D - 1, D); returns the area's measure."""
    if len(axes) == 2:
        normal[0], normal[1] = tangents[0, 1], -tangents[0, 0]
        size = np.sqrt(normal[0] ** 2 + normal[1] ** 2)
    else:
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            normal[i] = tangents[0, j] * tangents[1, k] - tangents[0, k] * tangents[1, j]
        size = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    for i in range(len(axes)):
        normal[i] /= max(size, 1e-300)
    return size


@njit(cache=True)
def inverse_of(A, result, axes):
    """Inverse of a symmetric (D - 1, D - 1) matrix; returns the determinant."""
    if len(axes) == 2:
        result[0, 0] = 1.0 / A[0, 0]
        return A[0, 0]
    det = A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0]
    result[0, 0], result[1, 1] = A[1, 1] / det, A[0, 0] / det
    result[0, 1] = result[1, 0] = -A[0, 1] / det
    return det


class Workspace(NamedTuple):
    """Scratch arrays of `project`, with q nodes a facet and d = D - 1.

    Parameters
    ----------
    N (q,), dN (d, q), ddN (d, d, q) : shape functions and their derivatives
    tangent (d, D), curved (d, d, D), normal (D,) : of the facet
    H, inverse (d, d) : Hessian of the distance
    r (D,) : from the foot to the point
    xi (d,) : coordinates of a foot
    """

    N: NDArray[np.float64]
    dN: NDArray[np.float64]
    ddN: NDArray[np.float64]
    tangent: NDArray[np.float64]
    curved: NDArray[np.float64]
    normal: NDArray[np.float64]
    H: NDArray[np.float64]
    inverse: NDArray[np.float64]
    r: NDArray[np.float64]
    xi: NDArray[np.float64]


@njit(cache=True)
def workspace(axes):
    """Scratch arrays for one dimension."""
    D = len(axes)
    d, q = D - 1, 3 if D == 2 else 8
    return Workspace(
        np.empty(q),
        np.empty((d, q)),
        np.empty((d, d, q)),
        np.empty((d, D)),
        np.empty((d, d, D)),
        np.empty(D),
        np.empty((d, d)),
        np.empty((d, d)),
        np.empty(D),
        np.empty(d),
    )


@njit(cache=True)
def project(x, nodes, xi, work, axes):
    """Closest point of a facet, started at ``xi`` and left there; False if Newton stalls.

    ``work`` holds the facet's tangents and curvatures there, and x less the point.
    """
    tangent, curved, H, inverse, r = work.tangent, work.curved, work.H, work.inverse, work.r
    d = len(axes) - 1
    for _ in range(_ITERATIONS):
        _at_foot(x, nodes, xi, work, axes)
        metric = 1.0
        for full in range(2):
            for a in range(d):
                for b in range(d):
                    H[a, b] = 0.0
                    for i in range(len(axes)):
                        H[a, b] += tangent[a, i] * tangent[b, i]
                        if full == 0:
                            H[a, b] -= r[i] * curved[a, b, i]
            metric = inverse_of(H, inverse, axes)
            if metric > 0 and H[0, 0] > 0:
                break  # else Gauss-Newton
        if not metric > 0:
            return False
        largest = 0.0
        for a in range(d):
            step = 0.0
            for b in range(d):
                slope = 0.0
                for i in range(len(axes)):
                    slope += r[i] * tangent[b, i]
                step += inverse[a, b] * slope
            moved = min(max(xi[a] + step, -0.5), 1.5)
            largest = max(largest, abs(moved - xi[a]))
            xi[a] = moved
        if largest < 1e-13:
            break
    _at_foot(x, nodes, xi, work, axes)
    return True


@njit(cache=True)
def _at_foot(x, nodes, xi, work, axes):
    """Shape functions, tangents and curvatures of a facet at xi, and x less the point there."""
    facet_shape(xi, work.N, work.dN, work.ddN, axes)
    interpolated(work.N, nodes, work.r)
    for i in range(len(axes)):
        work.r[i] = x[i] - work.r[i]
    for a in range(len(axes) - 1):
        interpolated(work.dN[a], nodes, work.tangent[a])
        for b in range(len(axes) - 1):
            interpolated(work.ddN[a, b], nodes, work.curved[a, b])
