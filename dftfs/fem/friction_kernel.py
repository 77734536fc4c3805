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

import numpy as np
from numba import njit

from dftfs.fem.contact_integration import add_contact_block, add_nodal, position
from dftfs.fem.contact_kernel import facet_shape, inverse_of, outward, workspace

_NO_SLIP = 1e-14  # m: below it a direction is not defined
_NEWTON = 8


@njit(cache=True)
def _anchored(x, nodes, xi, work, apart, axes):
    """d_T of a point into ``apart``; tangents, inverse metric stay in ``work``; returns n, h."""
    D = len(axes)
    N, dN, ddN, tangent, _, metric, inverse, _ = work
    normal = np.empty(D)
    facet_shape(xi, N, dN, ddN, axes)
    for a in range(D - 1):
        position(dN[a], nodes, tangent[a])
    outward(tangent, normal, axes)
    position(N, nodes, apart)
    height = 0.0
    for i in range(D):
        apart[i] = x[i] - apart[i]
        height += apart[i] * normal[i]
    for i in range(D):
        apart[i] -= height * normal[i]
    for a in range(D - 1):
        for b in range(D - 1):
            metric[a, b] = 0.0
            for i in range(D):
                metric[a, b] += tangent[a, i] * tangent[b, i]
    inverse_of(metric, inverse, axes)
    return normal, height


@njit(cache=True)
def _slip_row(e, normal, height, shape, rotation, work, row, axes):
    """Variation of the slip along the unit vector e over the slave's nodes, then the master's."""
    D = len(axes)
    N, dN, _, tangent, _, _, inverse, _ = work
    q = shape.shape[0]
    lifted = np.zeros(q)  # h (e . t^a) N,a
    for a in range(D - 1):
        share = 0.0
        for b in range(D - 1):
            for i in range(D):
                share += inverse[a, b] * tangent[b, i] * e[i]
        for node in range(q):
            lifted[node] += height * share * dN[a, node]
    for node in range(q):
        for i in range(D):
            row[node * D + i] = shape[node] * e[i]
            along, up = 0.0, 0.0
            for j in range(D):
                along += rotation[j, i] * e[j]
                up += rotation[j, i] * normal[j]
            row[(q + node) * D + i] = lifted[node] * up - N[node] * along


@njit(cache=True)
def _length(v):
    square = 0.0
    for i in range(v.shape[0]):
        square += v[i] * v[i]
    return np.sqrt(square)


@njit(cache=True)
def _direction(apart, size, work, e, axes):
    tangent = work[3]
    scale = size if size > _NO_SLIP else _length(tangent[0])
    for i in range(len(axes)):
        e[i] = (apart[i] if size > _NO_SLIP else tangent[0, i]) / scale


@njit(cache=True)
def _traction(geometry, stick, s, p, m, where, limit, work, apart, e, row, axes):
    """Traction of a point and its direction ``e``; ``row`` is filled, ``apart`` is d_T."""
    x, xi = np.empty(len(axes)), np.empty(len(axes) - 1)
    position(geometry.shapes[p], geometry.slave_m[s], x)
    xi[:] = where[s, p]
    shape, rotation = geometry.shapes[p], geometry.turns[geometry.turn[m]]
    normal, height = _anchored(x, geometry.master_m[m], xi, work, apart, axes)
    slip = _length(apart)
    _direction(apart, slip, work, e, axes)
    _slip_row(e, normal, height, shape, rotation, work, row, axes)
    return min(stick * slip, limit[s, p]), slip, normal, height


@njit(cache=True)
def integrate_friction_forces(geometry, stick, anchor, where, limit, force, axes):
    """Add friction forces (n, D) in N.

    Parameters
    ----------
    geometry : contact_integration.Geometry
    stick : float
        Traction per elastic slip, Pa/m.
    anchor (s, p), where (s, p, D - 1) : master facet of the anchor, -1 where none, and its point
    limit (s, p) : largest traction, Pa
    """
    D = len(axes)
    row = np.empty(2 * geometry.slave.shape[1] * D)
    work, apart, e = workspace(axes), np.empty(D), np.empty(D)
    for s in range(anchor.shape[0]):
        for p in range(anchor.shape[1]):
            m = anchor[s, p]
            if m >= 0 and limit[s, p] > 0:
                traction, _, _, _ = _traction(
                    geometry, stick, s, p, m, where, limit, work, apart, e, row, axes
                )
                pull = geometry.area[s, p] * traction
                add_nodal(row, pull, geometry.slave[s], geometry.master[m], force, D)


@njit(cache=True)
def integrate_friction_tangent(
    geometry, stick, anchor, where, limit, place, target, offset, direction, force, product, data,
    axes,
):  # fmt: skip
    """`integrate_friction_forces`, with the tangent added to ``data`` and to ``product``."""
    D = len(axes)
    size = 2 * geometry.slave.shape[1] * D
    row, pull, block = np.empty(size), np.empty(size), np.empty((size, size))
    work, apart, e, across = workspace(axes), np.empty(D), np.empty(D), np.empty(D)
    for s in range(anchor.shape[0]):
        for p in range(anchor.shape[1]):
            m = anchor[s, p]
            if m < 0 or not limit[s, p] > 0:
                continue
            traction, slip, normal, height = _traction(
                geometry, stick, s, p, m, where, limit, work, apart, e, row, axes
            )
            area, sticks = geometry.area[s, p], stick * slip <= limit[s, p]
            slave, master = geometry.slave[s], geometry.master[m]
            add_nodal(row, area * traction, slave, master, force, D)
            slope = area * stick if sticks else 0.0
            for a in range(size):
                for b in range(size):
                    block[a, b] = slope * row[a] * row[b]
            if D == 3:  # across the slip the traction only turns
                for i in range(D):
                    j, k = (i + 1) % 3, (i + 2) % 3
                    across[i] = normal[j] * e[k] - normal[k] * e[j]
                shape, rotation = geometry.shapes[p], geometry.turns[geometry.turn[m]]
                _slip_row(across, normal, height, shape, rotation, work, row, axes)
                slope = area * (stick if sticks else traction / slip)
                for a in range(size):
                    for b in range(size):
                        block[a, b] += slope * row[a] * row[b]
            add_contact_block(
                block, slave, master, target, offset[place[s, m]], direction, product, data, pull,
                axes,
            )  # fmt: skip


@njit(cache=True)
def moved_anchors(
    geometry, stick, anchor, where, limit, before, found, foot, new_where, traction, heat, axes
):
    """Anchors after the slip of a converged state, and what the slip has dissipated.

    A point goes on from the facet that it faces now, its anchor behind its foot by the elastic
    slip that the traction needs. Slip is dissipated at the mean of the limits at both ends of the
    increment: never negative, and of second order in its length where the end alone is of first.

    Parameters
    ----------
    before (s, p) : limits at the state before, Pa
    found (s, p), foot (s, p, D - 1) : where the points stand now
    new_where (s, p, D - 1), traction (s, p) in Pa, heat (s, p) in J : filled

    Returns
    -------
    stored : float
        Elastic energy of the sticking, J.
    """
    D = len(axes)
    work, x, xi = workspace(axes), np.empty(D), np.empty(D - 1)
    N, dN, ddN, tangent, _, metric, inverse, r = work
    apart, e, there = np.empty(D), np.empty(D), np.empty((D - 1, D))
    stored = 0.0
    for s in range(found.shape[0]):
        for p in range(found.shape[1]):
            traction[s, p], heat[s, p] = 0.0, 0.0
            m = found[s, p]
            if m < 0:
                continue
            position(geometry.shapes[p], geometry.slave_m[s], x)
            e[:] = 0.0
            mean = (before[s, p] + limit[s, p]) / 2
            if anchor[s, p] >= 0 and mean > 0:
                xi[:] = where[s, p]
                _anchored(x, geometry.master_m[anchor[s, p]], xi, work, apart, axes)
                slip = _length(apart)
                _direction(apart, slip, work, e, axes)
                traction[s, p] = min(stick * slip, limit[s, p])
                elastic = traction[s, p] / stick
                heat[s, p] = geometry.area[s, p] * mean * max(slip - elastic, 0.0)
                stored += geometry.area[s, p] * traction[s, p] * elastic / 2
                for i in range(D):
                    e[i] *= elastic
            nodes = geometry.master_m[m]
            xi[:] = foot[s, p]
            facet_shape(xi, N, dN, ddN, axes)
            for a in range(D - 1):
                position(dN[a], nodes, there[a])
            for _ in range(_NEWTON):  # t_a(foot) . (x - x_m(xi) - elastic slip) = 0
                facet_shape(xi, N, dN, ddN, axes)
                position(N, nodes, r)
                for a in range(D - 1):
                    position(dN[a], nodes, tangent[a])
                for a in range(D - 1):
                    for b in range(D - 1):
                        metric[a, b] = 0.0
                        for i in range(D):
                            metric[a, b] += there[a, i] * tangent[b, i]
                determinant = metric[0, 0]
                if D == 3:
                    determinant = metric[0, 0] * metric[1, 1] - metric[0, 1] * metric[1, 0]
                    inverse[0, 0] = metric[1, 1] / determinant
                    inverse[1, 1] = metric[0, 0] / determinant
                    inverse[0, 1] = -metric[0, 1] / determinant
                    inverse[1, 0] = -metric[1, 0] / determinant
                else:
                    inverse[0, 0] = 1.0 / determinant
                for a in range(D - 1):
                    for b in range(D - 1):
                        left = 0.0
                        for i in range(D):
                            left += there[b, i] * (x[i] - r[i] - e[i])
                        xi[a] += inverse[a, b] * left
            new_where[s, p] = xi
    return stored
