"""Signed distance from points to a polyline by projection.

Sampling the other edge and taking the nearest sample overstates the gap between nearly parallel
coils; the foot of the perpendicular on its segments does not (`spec/spring.md`).
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

_CONE = 0.7  # cosine between normal and foot's direction: within 45 degrees of the normal
_FACING = -0.5  # product of the two normals: within 60 degrees of opposed
_WIDER = 1 + 1e-9  # on half a segment's length, for round-off


@dataclass(frozen=True, kw_only=True)
class Projection:
    """Nearest facing feet of points on a polyline.

    gap_m : (n,) distance, negative where the foot lies inside the point's own material, infinite
    where nothing faces the point or the nearest foot is a corner off to the side.
    foot_m : (n, 2). segment : (n,), -1 where nothing faces.
    """

    gap_m: NDArray
    foot_m: NDArray
    segment: NDArray


def right_normals(polyline: NDArray) -> NDArray:
    """Unit normals to the right of travel of each segment, shape (m - 1, 2).

    With the material on the left of an outline these point out of it.
    """
    step = np.diff(polyline, axis=0)
    step = step / np.maximum(np.linalg.norm(step, axis=1), 1e-300)[:, None]
    return np.stack([step[:, 1], -step[:, 0]], axis=1)


def point_normals(polyline: NDArray) -> NDArray:
    """Unit normals at the points of a polyline: the mean of the neighbouring segments'."""
    normals = right_normals(polyline)
    padded = np.concatenate([normals[:1], normals, normals[-1:]])
    mean = padded[1:] + padded[:-1]
    return mean / np.maximum(np.linalg.norm(mean, axis=1), 1e-300)[:, None]


def project(
    points: NDArray, normals: NDArray, polyline: NDArray, *, deepest_m: float
) -> Projection:
    """Project points on the part of a polyline that faces them.

    Parameters
    ----------
    points, normals : (n, 2) arrays
        Points of one edge and the unit normals out of its material.
    polyline : (m, 2) array
        The other edge, its material on the left of travel.
    deepest_m : float
        Feet further than this inside the point's own material are not counted: they are the
        back of the strip or what lies behind it.
    """
    arrays = [np.ascontiguousarray(a, dtype=float) for a in (points, normals, polyline)]
    gap, foot, segment = _nearest(*arrays, right_normals(arrays[2]), float(deepest_m))
    return Projection(gap_m=gap, foot_m=foot, segment=segment)


@njit(cache=True)
def _nearest(points, normals, polyline, other, deepest):
    n, m = len(points), len(polyline) - 1
    gap, foot, segment = np.full(n, np.inf), np.full((n, 2), np.nan), np.full(n, -1)
    middle, half = np.empty((m, 2)), np.empty(m)
    for k in range(m):
        dx, dy = polyline[k + 1, 0] - polyline[k, 0], polyline[k + 1, 1] - polyline[k, 1]
        middle[k, 0], middle[k, 1] = polyline[k, 0] + dx / 2, polyline[k, 1] + dy / 2
        half[k] = _WIDER * np.hypot(dx, dy) / 2
    for i in range(n):
        # distances: to any segment, and to those that face the point, outside and inside
        nearest, ahead, behind = np.inf, np.inf, np.inf
        at_ahead, at_behind = -1, -1
        for k in range(m):
            facing = normals[i, 0] * other[k, 0] + normals[i, 1] * other[k, 1] < _FACING
            # too far away to change anything: most segments
            reach = max(ahead, min(behind, deepest)) if facing else nearest
            mx, my = middle[k, 0] - points[i, 0], middle[k, 1] - points[i, 1]
            if mx * mx + my * my > (reach + half[k]) ** 2:
                continue
            inside, tx, ty = _foot(points[i], polyline, k)
            if not inside:
                continue  # beyond the polyline's ends nothing is known
            distance = np.hypot(tx, ty)
            nearest = min(nearest, distance)
            if not facing:
                continue
            if tx * normals[i, 0] + ty * normals[i, 1] >= 0:
                if distance < ahead:
                    ahead, at_ahead = distance, k
            elif distance < min(behind, deepest):
                behind, at_behind = distance, k
        # no overlap if another part of the edge is nearer: a tip's corner faces parts further on
        if behind > nearest:
            behind = np.inf
        k = at_ahead if ahead <= behind else at_behind
        distance = min(ahead, behind)
        if distance < np.inf:
            _, tx, ty = _foot(points[i], polyline, k)
            outwards = tx * normals[i, 0] + ty * normals[i, 1]
            # a nearest foot off to the side is a corner: its own projection measures it
            aside = abs(outwards) < _CONE * distance
            gap[i] = np.inf if aside else np.copysign(distance, outwards)
            foot[i, 0], foot[i, 1] = points[i, 0] + tx, points[i, 1] + ty
            segment[i] = k
    return gap, foot, segment


@njit(cache=True, inline="always")
def _foot(point, polyline, k):
    """Whether a point projects on the polyline at segment k, and the step (2,) to its foot."""
    dx, dy = polyline[k + 1, 0] - polyline[k, 0], polyline[k + 1, 1] - polyline[k, 1]
    px, py = point[0] - polyline[k, 0], point[1] - polyline[k, 1]
    along = (px * dx + py * dy) / max(dx * dx + dy * dy, 1e-300)
    beyond = (k == 0 and along <= 0) or (k == len(polyline) - 2 and along >= 1)
    along = min(max(along, 0.0), 1.0)
    return not beyond, along * dx - px, along * dy - py
