"""Which master facet every point of a slave surface faces, in compiled loops."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from dftfs.fem.facets import facet_shape, interpolated, outward, project, workspace

OUTSIDE = 0.05  # a foot this far off its facet (in its coordinates) still counts
_TURNED_AWAY = 0.0  # product of the normals at the middle of the facet: not worth a projection
_FACING = -0.5  # product of the two normals: within 60 degrees of opposed


class Search(NamedTuple):
    """What is looked for: points of slave facets, and how near a master facet must be.

    Parameters
    ----------
    shapes (p, q), gradients (p, D - 1, q) : shape functions at a slave facet's points
    apart (s, m) : whether two facets may touch (share no node)
    reach, deepest : largest gap and penetration that count, m
    """

    shapes: NDArray[np.float64]
    gradients: NDArray[np.float64]
    apart: NDArray[np.bool_]
    reach: float
    deepest: float


class Feet(NamedTuple):
    """What is found.

    Parameters
    ----------
    found (s, p) : master facet that a slave point faces, -1 where none
    where (s, p, D - 1) : its closest point
    gap (s, p) : m, infinite where nothing is faced
    """

    found: NDArray[np.int64]
    where: NDArray[np.float64]
    gap: NDArray[np.float64]


class _Facets(NamedTuple):
    """Per facet: middle, radius of a sphere about it, normal there, and how far it bulges."""

    centre: NDArray[np.float64]
    radius: NDArray[np.float64]
    normal: NDArray[np.float64]
    bulge: NDArray[np.float64]


@njit(cache=True)
def detect(slave, master, search, feet, axes):
    """Foot of every slave point on the master facet that faces it, into ``feet``.

    slave (s, q, D), master (m, q, D) : current positions of facet nodes, m.
    """
    D = len(axes)
    work = workspace(axes)
    tangent, own, x = np.empty((D - 1, D)), np.empty(D), np.empty(D)
    masters, slaves = _boxes(master, work, axes), _boxes(slave, work, axes)
    near = np.empty(master.shape[0], dtype=np.int64)
    for s in range(slave.shape[0]):
        count = _near(s, slaves, masters, search, near)
        for p in range(search.shapes.shape[0]):
            feet.found[s, p] = -1
            feet.gap[s, p] = np.inf
            if count == 0:
                continue
            interpolated(search.shapes[p], slave[s], x)
            for a in range(D - 1):
                interpolated(search.gradients[p, a], slave[s], tangent[a])
            outward(tangent, own, axes)
            best = np.inf, np.inf
            for k in range(count):
                m = near[k]
                if not _may_face(x, own, m, masters, search):
                    continue
                found = _foot(x, own, master[m], search, best, work, axes)
                if found[2]:
                    best = found[0], abs(found[1])
                    feet.found[s, p] = m
                    feet.gap[s, p] = found[1]
                    feet.where[s, p] = work.xi


@njit(cache=True)
def _near(s, slaves, masters, search, near):
    """Numbers of the master facets whose spheres meet that of slave facet s; how many."""
    count = 0
    for m in range(masters.radius.shape[0]):
        if not search.apart[s, m]:
            continue
        square = 0.0
        for i in range(masters.centre.shape[1]):
            square += (slaves.centre[s, i] - masters.centre[m, i]) ** 2
        limit = slaves.radius[s] + masters.radius[m] + max(search.reach, search.deepest)
        if square < limit**2:
            near[count] = m
            count += 1
    return count


@njit(cache=True)
def _may_face(x, own, m, masters, search):
    """Whether a point with the outward normal ``own`` is worth projecting on master facet m."""
    facing, height = 0.0, 0.0
    for i in range(x.shape[0]):
        facing += own[i] * masters.normal[m, i]
        height += (x[i] - masters.centre[m, i]) * masters.normal[m, i]
    bulge = masters.bulge[m]
    far = height > search.reach + bulge or height < -search.deepest - bulge
    return not (far or facing > _TURNED_AWAY)


@njit(cache=True)
def _foot(x, own, nodes, search, best, work, axes):
    """Projection of a point on a facet, its closest point left in ``work.xi``.

    ``best`` is how far outside the best foot so far is, and its distance. Returns the same of
    this one (the gap with its sign) and whether it is better.
    """
    work.xi[:] = 0.5
    if not project(x, nodes, work.xi, work, axes):
        return np.inf, np.inf, False
    outside = 0.0
    for a in range(len(axes) - 1):
        outside = max(outside, -work.xi[a], work.xi[a] - 1)
    outside = max(outside, 0.0)
    if outside > OUTSIDE or outside > best[0]:
        return outside, np.inf, False
    outward(work.tangent, work.normal, axes)
    facing, gap = 0.0, 0.0
    for i in range(len(axes)):
        facing += own[i] * work.normal[i]
        gap += work.r[i] * work.normal[i]
    if facing > _FACING or gap > search.reach or gap < -search.deepest:
        return outside, gap, False
    return outside, gap, not (outside == best[0] and abs(gap) >= best[1])


@njit(cache=True)
def _boxes(facets, work, axes):
    D = len(axes)
    N, dN, ddN, tangent = work.N, work.dN, work.ddN, work.tangent
    count = facets.shape[0]
    centre, normal = np.zeros((count, D)), np.zeros((count, D))
    radius, bulge = np.zeros(count), np.zeros(count)
    xi = np.full(D - 1, 0.5)
    facet_shape(xi, N, dN, ddN, axes)
    for f in range(count):
        interpolated(N, facets[f], centre[f])
        for a in range(D - 1):
            interpolated(dN[a], facets[f], tangent[a])
        outward(tangent, normal[f], axes)
        for a in range(facets.shape[1]):
            square, height = 0.0, 0.0
            for i in range(D):
                apart = facets[f, a, i] - centre[f, i]
                square += apart**2
                height += apart * normal[f, i]
            radius[f] = max(radius[f], np.sqrt(square))
            bulge[f] = max(bulge[f], 2 * abs(height))
    return _Facets(centre, radius, normal, bulge)
