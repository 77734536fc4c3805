"""Contact of quadratic facets, point against facet, in compiled loops.

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

import numpy as np
from numba import njit

OUTSIDE = 0.05  # a foot this far off its facet (in its coordinates) still counts
_TURNED_AWAY = 0.0  # the same at the middle of the facet: not worth a projection
_FACING = -0.5  # product of the two normals: within 60 degrees of opposed
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
def _interpolated(weights, nodes, result):
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


@njit(cache=True)
def project(x, nodes, xi, work, axes):
    """Closest point of a facet, started at ``xi`` and left there; False if Newton stalls.

    ``work`` = (N, dN, ddN, tangents, curvatures, H, inverse, r), as `workspace` makes it.
    """
    N, dN, ddN, tangent, curved, H, inverse, r = work
    d = len(axes) - 1
    for _ in range(_ITERATIONS):
        facet_shape(xi, N, dN, ddN, axes)
        _interpolated(N, nodes, r)
        for i in range(len(axes)):
            r[i] = x[i] - r[i]
        for a in range(d):
            _interpolated(dN[a], nodes, tangent[a])
            for b in range(d):
                _interpolated(ddN[a, b], nodes, curved[a, b])
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
    facet_shape(xi, N, dN, ddN, axes)
    _interpolated(N, nodes, r)
    for i in range(len(axes)):
        r[i] = x[i] - r[i]
    for a in range(d):
        _interpolated(dN[a], nodes, tangent[a])
        for b in range(d):
            _interpolated(ddN[a, b], nodes, curved[a, b])
    return True


@njit(cache=True)
def workspace(axes):
    """Scratch arrays of `project`."""
    D = len(axes)
    d, q = D - 1, 3 if D == 2 else 8
    return (
        np.empty(q),
        np.empty((d, q)),
        np.empty((d, d, q)),
        np.empty((d, D)),
        np.empty((d, d, D)),
        np.empty((d, d)),
        np.empty((d, d)),
        np.empty(D),
    )


@njit(cache=True)
def detect(slave, master, shapes, slopes, apart, reach, deepest, found, where, gaps, axes):
    """Foot of every slave point on the master facet that faces it.

    Parameters
    ----------
    slave (s, q, D), master (m, q, D) : current positions of facet nodes
    shapes (p, q), slopes (p, D - 1, q) : shape functions at a slave facet's points
    apart (s, m) : whether the two facets may touch (share no node)
    found (s, p) : master facet, -1 where none
    where (s, p, D - 1), gaps (s, p)
    """
    D = len(axes)
    work = workspace(axes)
    tangent, normal, own = np.empty((D - 1, D)), np.empty(D), np.empty(D)
    x, xi = np.empty(D), np.empty(D - 1)
    centre_s, radius_s, _, _ = _boxes(slave, work, axes)
    centre_m, radius_m, normal_m, bulge_m = _boxes(master, work, axes)
    near = np.empty(master.shape[0], dtype=np.int64)
    for s in range(slave.shape[0]):
        count = 0
        for m in range(master.shape[0]):
            if not apart[s, m]:
                continue
            square = 0.0
            for i in range(D):
                square += (centre_s[s, i] - centre_m[m, i]) ** 2
            if square < (radius_s[s] + radius_m[m] + max(reach, deepest)) ** 2:
                near[count] = m
                count += 1
        for p in range(shapes.shape[0]):
            found[s, p] = -1
            gaps[s, p] = np.inf
            if count == 0:
                continue
            _interpolated(shapes[p], slave[s], x)
            for a in range(D - 1):
                _interpolated(slopes[p, a], slave[s], tangent[a])
            outward(tangent, own, axes)
            least, nearest = np.inf, np.inf
            for k in range(count):
                m = near[k]
                facing, height = 0.0, 0.0
                for i in range(D):
                    facing += own[i] * normal_m[m, i]
                    height += (x[i] - centre_m[m, i]) * normal_m[m, i]
                far = height > reach + bulge_m[m] or height < -deepest - bulge_m[m]
                if far or facing > _TURNED_AWAY:
                    continue
                xi[:] = 0.5
                if not project(x, master[near[k]], xi, work, axes):
                    continue
                outside = 0.0
                for a in range(D - 1):
                    outside = max(outside, -xi[a], xi[a] - 1)
                outside = max(outside, 0.0)
                if outside > OUTSIDE or outside > least:
                    continue
                outward(work[3], normal, axes)
                facing, gap = 0.0, 0.0
                for i in range(D):
                    facing += own[i] * normal[i]
                    gap += work[7][i] * normal[i]
                if facing > _FACING or gap > reach or gap < -deepest:
                    continue
                if outside == least and abs(gap) >= nearest:
                    continue
                least, nearest = outside, abs(gap)
                found[s, p] = near[k]
                gaps[s, p] = gap
                for a in range(D - 1):
                    where[s, p, a] = xi[a]


@njit(cache=True)
def _boxes(facets, work, axes):
    """Per facet: middle, radius of a sphere about it, normal there, and how far it bulges."""
    D = len(axes)
    N, dN, ddN, tangent, _, _, _, _ = work
    count = facets.shape[0]
    centre, normal = np.zeros((count, D)), np.zeros((count, D))
    radius, bulge = np.zeros(count), np.zeros(count)
    xi = np.full(D - 1, 0.5)
    facet_shape(xi, N, dN, ddN, axes)
    for f in range(count):
        _interpolated(N, facets[f], centre[f])
        for a in range(D - 1):
            _interpolated(dN[a], facets[f], tangent[a])
        outward(tangent, normal[f], axes)
        for a in range(facets.shape[1]):
            square, height = 0.0, 0.0
            for i in range(D):
                apart = facets[f, a, i] - centre[f, i]
                square += apart**2
                height += apart * normal[f, i]
            radius[f] = max(radius[f], np.sqrt(square))
            bulge[f] = max(bulge[f], 2 * abs(height))
    return centre, radius, normal, bulge


@njit(cache=True)
def variations(x, nodes, xi, shape, rotation, work, first, second, twice, axes):
    """dg and d2g at a foot, in the mesh's own coordinates.

    ``first`` (P D,) and ``second`` (P D, P D) over the slave's nodes, then the master's, whose
    displacements are turned by ``rotation`` into the copy that is touched; returns the gap.
    ``second`` is filled only if ``twice``.
    """
    D = len(axes)
    d, q = D - 1, nodes.shape[0]
    project(x, nodes, xi, work, axes)
    N, dN, _, tangent, curved, H, inverse, r = work
    normal = np.empty(D)
    outward(tangent, normal, axes)
    gap = 0.0
    for i in range(D):
        gap += r[i] * normal[i]
    metric, bent, metric_inverse = np.empty((d, d)), np.empty((d, d)), np.empty((d, d))
    for a in range(d):
        for b in range(d):
            metric[a, b] = bent[a, b] = 0.0
            for i in range(D):
                metric[a, b] += tangent[a, i] * tangent[b, i]
                bent[a, b] += normal[i] * curved[a, b, i]
            H[a, b] = metric[a, b] - gap * bent[a, b]
    inverse_of(H, inverse, axes)
    inverse_of(metric, metric_inverse, axes)
    rows = np.zeros((2 * d, 2 * q * D))  # t_a . B, then n . N,a
    for node in range(q):
        for i in range(D):
            first[node * D + i] = shape[node] * normal[i]
            turned = 0.0
            for j in range(D):
                turned += rotation[j, i] * normal[j]
            at = (q + node) * D + i
            first[at] = -N[node] * turned
            for a in range(d):
                rows[a, node * D + i] = shape[node] * tangent[a, i]
                rows[d + a, at] = dN[a, node] * turned
                for j in range(D):
                    rows[a, at] -= N[node] * rotation[j, i] * tangent[a, j]
    if not twice:
        return gap
    form = np.zeros((2 * d, 2 * d))
    for a in range(d):
        for b in range(d):
            for k in range(d):
                for m in range(d):
                    form[a, b] -= inverse[a, k] * bent[k, m] * metric_inverse[m, b]
            form[a, d + b] = form[d + a, b] = -inverse[a, b]
            form[d + a, d + b] = -gap * inverse[a, b]
    second[:] = 0.0
    for a in range(2 * d):
        for b in range(2 * d):
            if form[a, b] != 0.0:
                for i in range(rows.shape[1]):
                    scaled = form[a, b] * rows[a, i]
                    if scaled != 0.0:
                        for j in range(rows.shape[1]):
                            second[i, j] += scaled * rows[b, j]
    return gap


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
