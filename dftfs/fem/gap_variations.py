"""First and second variation of the gap between a point and a facet, and the penalty law.

A point of the slave surface with its closest point xi on a master facet has the gap
g = (x_s - x_m(xi)) . n along the facet's outward normal. With B du = du_s - N(xi) du_m, tangents
t_a = x_m,a, metric M, curvature k_ab = n . x_m,ab, H = M - g k, a = t^T B and c_a = n^T N,a du_m:

    dg = n . B du,    d2g = - a^T H^-1 k M^-1 a - c^T H^-1 a - a^T H^-1 c - g c^T H^-1 c

the second variation at a foot that is itself a minimum (Schur complement of the distance's
Hessian), free of the division by g of the textbook form. Penalty energy per reference area makes
force and tangent exact derivatives, hence symmetric.

Source: Laursen, Computational Contact and Impact Mechanics (2002), 3.2 and 6.2; Wriggers,
Computational Contact Mechanics (2006), 4.1 (closest-point projection, variations of the gap).
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from dftfs.fem.facets import inverse_of, outward, project


class SlavePoint(NamedTuple):
    """A point (D,), the shape functions (q,) of its facet there, and the master copy's rotation."""

    x: NDArray[np.float64]
    shape: NDArray[np.float64]
    rotation: NDArray[np.float64]


@njit(cache=True)
def variations(point, nodes, xi, work, derivatives, axes):
    """dg and d2g at a foot, in the mesh's own coordinates; returns the gap.

    ``derivatives`` are first (P D,) and second (P D, P D) over the slave's nodes, then the
    master's, whose displacements are turned by the rotation into the copy that is touched. An
    empty second is left out.
    """
    first, second = derivatives
    D = len(axes)
    d, q = D - 1, nodes.shape[0]
    project(point.x, nodes, xi, work, axes)
    tangent, normal, H = work.tangent, work.normal, work.H
    outward(tangent, normal, axes)
    gap = 0.0
    for i in range(D):
        gap += work.r[i] * normal[i]
    metric, curvature, metric_inverse = np.empty((d, d)), np.empty((d, d)), np.empty((d, d))
    for a in range(d):
        for b in range(d):
            metric[a, b] = curvature[a, b] = 0.0
            for i in range(D):
                metric[a, b] += tangent[a, i] * tangent[b, i]
                curvature[a, b] += normal[i] * work.curved[a, b, i]
            H[a, b] = metric[a, b] - gap * curvature[a, b]
    inverse_of(H, work.inverse, axes)
    inverse_of(metric, metric_inverse, axes)
    rows = np.zeros((2 * d, 2 * q * D))  # t_a . B, then n . N,a
    _fill_rows(point, work, first, rows)
    if second.size == 0:
        return gap
    form = np.zeros((2 * d, 2 * d))
    for a in range(d):
        for b in range(d):
            for k in range(d):
                for m in range(d):
                    form[a, b] -= work.inverse[a, k] * curvature[k, m] * metric_inverse[m, b]
            form[a, d + b] = form[d + a, b] = -work.inverse[a, b]
            form[d + a, d + b] = -gap * work.inverse[a, b]
    _square(rows, form, second)
    return gap


@njit(cache=True)
def _fill_rows(point, work, first, rows):
    """dg (P D,) and, per tangent, t_a . B and n . N,a over the nodes of both facets."""
    q, D = point.shape.shape[0], point.x.shape[0]
    for node in range(q):
        for i in range(D):
            first[node * D + i] = point.shape[node] * work.normal[i]
            turned = 0.0
            for j in range(D):
                turned += point.rotation[j, i] * work.normal[j]
            at = (q + node) * D + i
            first[at] = -work.N[node] * turned
            for a in range(D - 1):
                rows[a, node * D + i] = point.shape[node] * work.tangent[a, i]
                rows[D - 1 + a, at] = work.dN[a, node] * turned
                for j in range(D):
                    rows[a, at] -= work.N[node] * point.rotation[j, i] * work.tangent[a, j]


@njit(cache=True)
def _square(rows, form, second):
    """second = rows^T form rows."""
    second[:] = 0.0
    for a in range(form.shape[0]):
        for b in range(form.shape[0]):
            if form[a, b] != 0.0:
                for i in range(rows.shape[1]):
                    scaled = form[a, b] * rows[a, i]
                    if scaled != 0.0:
                        for j in range(rows.shape[1]):
                            second[i, j] += scaled * rows[b, j]


@njit(cache=True)
def pressure_of(gap, stiffness, smoothing):
    """Pressure, its slope -dp/dg and the energy per area of a gap.

    Zero above the smoothing length, linear in the penetration below minus it, a parabola between
    (continuous slope): the smoothed penalty.
    """
    if gap >= smoothing:
        return 0.0, 0.0, 0.0
    if gap <= -smoothing:
        energy = stiffness * (gap * gap / 2 + smoothing * smoothing / 6)
        return -stiffness * gap, stiffness, energy
    open_part = smoothing - gap
    return (
        stiffness * open_part**2 / (4 * smoothing),
        stiffness * open_part / (2 * smoothing),
        stiffness * open_part**3 / (12 * smoothing),
    )
