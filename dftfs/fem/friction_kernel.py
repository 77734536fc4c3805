"""Coulomb friction of slave points on quadratic facets, in compiled loops.

A point sticks, elastically, to its anchor: a material point xi of a master facet, known from the
last state. With d = x_s - x_m(xi), n the facet's normal there, h = n . d and d_T = d - h n, the
traction is along e = d_T / |d_T| and of size min(k |d_T|, limit), the derivative of Huber's
function of |d_T| for a given limit. With t_a = x_m,a and t^a = M^ab t_b

    d|d_T| = e . (du_s - N du_m) + h (e . t^a) N,a n . du_m

|d_T| does not change in a rigid motion of both bodies, so neither force nor moment is left over.
The tangent leaves the second variation of d_T out: it is of the order of traction times h over
the facet's length, both small.

Source: Wriggers & Haraldsson, A simple formulation for two-dimensional contact problems using a
moving friction cone, Commun. Numer. Meth. Engng 19 (2003) 285 (anchor instead of slip rates).
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from dftfs.fem.contact_integration import add_contact_block, add_pair
from dftfs.fem.facets import facet_shape, interpolated, inverse_of, outward, workspace

_NO_SLIP = 1e-14  # m: below it a direction is not defined
_NEWTON = 8


class Anchors(NamedTuple):
    """Where slave points stick, and how much they may carry.

    Parameters
    ----------
    stick : float
        Traction per elastic slip, Pa/m.
    anchor (s, p), where (s, p, D - 1) : master facet of the anchor, -1 where none, and its point
    limit (s, p) : friction bound, Pa
    """

    stick: float
    anchor: NDArray[np.int64]
    where: NDArray[np.float64]
    limit: NDArray[np.float64]


class Slip(NamedTuple):
    """What `move_anchors` fills: new points (s, p, D - 1), traction (s, p) in Pa, heat in J."""

    where: NDArray[np.float64]
    traction: NDArray[np.float64]
    heat: NDArray[np.float64]


@njit(cache=True)
def _tangential(x, nodes, xi, work, apart, axes):
    """d_T of a point into ``apart``; normal, tangents, inverse metric into ``work``; returns h."""
    D = len(axes)
    tangent, metric = work.tangent, work.H
    facet_shape(xi, work.N, work.dN, work.ddN, axes)
    for a in range(D - 1):
        interpolated(work.dN[a], nodes, tangent[a])
    outward(tangent, work.normal, axes)
    interpolated(work.N, nodes, apart)
    height = 0.0
    for i in range(D):
        apart[i] = x[i] - apart[i]
        height += apart[i] * work.normal[i]
    for i in range(D):
        apart[i] -= height * work.normal[i]
    for a in range(D - 1):
        for b in range(D - 1):
            metric[a, b] = 0.0
            for i in range(D):
                metric[a, b] += tangent[a, i] * tangent[b, i]
    inverse_of(metric, work.inverse, axes)
    return height


@njit(cache=True)
def _slip_row(e, height, shape, rotation, work, row, axes):
    """Variation of the slip along the unit vector e over the slave's nodes, then the master's."""
    D = len(axes)
    q = shape.shape[0]
    lifted = np.zeros(q)  # h (e . t^a) N,a
    for a in range(D - 1):
        share = 0.0
        for b in range(D - 1):
            for i in range(D):
                share += work.inverse[a, b] * work.tangent[b, i] * e[i]
        for node in range(q):
            lifted[node] += height * share * work.dN[a, node]
    for node in range(q):
        for i in range(D):
            row[node * D + i] = shape[node] * e[i]
            along, up = 0.0, 0.0
            for j in range(D):
                along += rotation[j, i] * e[j]
                up += rotation[j, i] * work.normal[j]
            row[(q + node) * D + i] = lifted[node] * up - work.N[node] * along


@njit(cache=True)
def _length(v):
    square = 0.0
    for i in range(v.shape[0]):
        square += v[i] * v[i]
    return np.sqrt(square)


@njit(cache=True)
def _direction(apart, size, tangent, e):
    scale = size if size > _NO_SLIP else _length(tangent[0])
    for i in range(e.shape[0]):
        e[i] = (apart[i] if size > _NO_SLIP else tangent[0, i]) / scale


@njit(cache=True)
def _traction(geometry, anchors, s, p, e, work, row, axes):
    """Traction of a point, its slip and height; the slip's direction into e, variation into row."""
    x, xi, apart = np.empty(len(axes)), np.empty(len(axes) - 1), np.empty(len(axes))
    m = anchors.anchor[s, p]
    interpolated(geometry.shapes[p], geometry.slave_m[s], x)
    xi[:] = anchors.where[s, p]
    shape, rotation = geometry.shapes[p], geometry.turns[geometry.turn[m]]
    height = _tangential(x, geometry.master_m[m], xi, work, apart, axes)
    slip = _length(apart)
    _direction(apart, slip, work.tangent, e)
    _slip_row(e, height, shape, rotation, work, row, axes)
    return min(anchors.stick * slip, anchors.limit[s, p]), slip, height


@njit(cache=True)
def integrate_friction_forces(geometry, anchors, force, axes):
    """Add friction forces (n, D) in N."""
    row = np.empty(2 * geometry.slave.shape[1] * len(axes))
    work, e = workspace(axes), np.empty(len(axes))
    for s in range(anchors.anchor.shape[0]):
        for p in range(anchors.anchor.shape[1]):
            m = anchors.anchor[s, p]
            if m >= 0 and anchors.limit[s, p] > 0:
                traction, _, _ = _traction(geometry, anchors, s, p, e, work, row, axes)
                factor = geometry.area[s, p] * traction
                add_pair(row, factor, geometry.slave[s], geometry.master[m], force)


@njit(cache=True)
def integrate_friction_tangent(geometry, anchors, pairs, sums, axes):
    """`integrate_friction_forces`, with the tangent added to data and product of ``sums``."""
    D = len(axes)
    size = 2 * geometry.slave.shape[1] * D
    row, block = np.empty(size), np.empty((size, size))
    work, e, across = workspace(axes), np.empty(D), np.empty(D)
    for s in range(anchors.anchor.shape[0]):
        for p in range(anchors.anchor.shape[1]):
            m = anchors.anchor[s, p]
            if m < 0 or not anchors.limit[s, p] > 0:
                continue
            traction, slip, height = _traction(geometry, anchors, s, p, e, work, row, axes)
            area, sticks = geometry.area[s, p], anchors.stick * slip <= anchors.limit[s, p]
            add_pair(row, area * traction, geometry.slave[s], geometry.master[m], sums.force)
            slope = area * anchors.stick if sticks else 0.0
            for a in range(size):
                for b in range(size):
                    block[a, b] = slope * row[a] * row[b]
            if D == 3:  # across the slip the traction only turns
                for i in range(D):
                    j, k = (i + 1) % 3, (i + 2) % 3
                    across[i] = work.normal[j] * e[k] - work.normal[k] * e[j]
                shape, rotation = geometry.shapes[p], geometry.turns[geometry.turn[m]]
                _slip_row(across, height, shape, rotation, work, row, axes)
                slope = area * (anchors.stick if sticks else traction / slip)
                for a in range(size):
                    for b in range(size):
                        block[a, b] += slope * row[a] * row[b]
            add_contact_block(block, geometry, s, m, pairs, sums, axes)


@njit(cache=True)
def move_anchors(geometry, anchors, before, found, foot, slip, axes):
    """Anchors after the slip of a converged state, and what the slip has dissipated.

    The new anchor lies on the facet that a point faces now, behind its foot by the elastic slip
    that the traction needs. Slip is dissipated at the mean of the bounds at both ends of the
    increment: never negative, and of second order in its length where the end alone is of first.

    Parameters
    ----------
    before (s, p) : friction bounds at the state before, Pa
    found (s, p), foot (s, p, D - 1) : where the points stand now
    slip : Slip
        Filled.

    Returns
    -------
    stored : float
        Elastic energy of the sticking, J.
    """
    D = len(axes)
    work, x, xi = workspace(axes), np.empty(D), np.empty(D - 1)
    apart, e = np.empty(D), np.empty(D)
    stored = 0.0
    for s in range(found.shape[0]):
        for p in range(found.shape[1]):
            slip.traction[s, p], slip.heat[s, p] = 0.0, 0.0
            m = found[s, p]
            if m < 0:
                continue
            interpolated(geometry.shapes[p], geometry.slave_m[s], x)
            e[:] = 0.0
            mean = (before[s, p] + anchors.limit[s, p]) / 2
            if anchors.anchor[s, p] >= 0 and mean > 0:
                xi[:] = anchors.where[s, p]
                _tangential(x, geometry.master_m[anchors.anchor[s, p]], xi, work, apart, axes)
                total = _length(apart)
                _direction(apart, total, work.tangent, e)
                traction = min(anchors.stick * total, anchors.limit[s, p])
                elastic = traction / anchors.stick
                slip.traction[s, p] = traction
                slip.heat[s, p] = geometry.area[s, p] * mean * max(total - elastic, 0.0)
                stored += geometry.area[s, p] * traction * elastic / 2
                for i in range(D):
                    e[i] *= elastic
            xi[:] = foot[s, p]
            _behind(x, e, geometry.master_m[m], xi, work, axes)
            slip.where[s, p] = xi
    return stored


@njit(cache=True)
def _behind(x, e, nodes, xi, work, axes):
    """Move xi from the foot of x to the point behind it by the vector e, along the facet."""
    D = len(axes)
    N, dN, tangent, metric, inverse, r = (
        work.N, work.dN, work.tangent, work.H, work.inverse, work.r,
    )  # fmt: skip
    there = np.empty((D - 1, D))
    facet_shape(xi, N, dN, work.ddN, axes)
    for a in range(D - 1):
        interpolated(dN[a], nodes, there[a])
    for _ in range(_NEWTON):  # t_a(foot) . (x - x_m(xi) - e) = 0
        facet_shape(xi, N, dN, work.ddN, axes)
        interpolated(N, nodes, r)
        for a in range(D - 1):
            interpolated(dN[a], nodes, tangent[a])
        for a in range(D - 1):
            for b in range(D - 1):
                metric[a, b] = 0.0
                for i in range(D):
                    metric[a, b] += there[a, i] * tangent[b, i]
        _invert_general(metric, inverse, axes)
        for a in range(D - 1):
            for b in range(D - 1):
                left = 0.0
                for i in range(D):
                    left += there[b, i] * (x[i] - r[i] - e[i])
                xi[a] += inverse[a, b] * left


@njit(cache=True)
def _invert_general(A, result, axes):
    """Inverse of a (D - 1, D - 1) matrix that need not be symmetric."""
    if len(axes) == 2:
        result[0, 0] = 1.0 / A[0, 0]
        return
    det = A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0]
    result[0, 0], result[1, 1] = A[1, 1] / det, A[0, 0] / det
    result[0, 1], result[1, 0] = -A[0, 1] / det, -A[1, 0] / det
