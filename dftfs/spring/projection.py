"""Signed distance from points to a polyline by projection.

Sampling the other edge and taking the nearest sample overstates the gap between nearly parallel
coils; the foot of the perpendicular on its segments does not (`spec/spring.md`).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_FACING = -0.5  # product of the two normals: within 60 degrees of opposed
_BLOCK = 256  # points at a time: keeps the points x segments tables small


@dataclass(frozen=True, kw_only=True)
class Projection:
    """Nearest facing feet of points on a polyline.

    gap_m : (n,) distance, negative where the foot lies inside the point's own material, infinite
    where nothing faces the point. foot_m : (n, 2). segment : (n,), -1 where nothing faces.
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
    start, step = polyline[:-1], np.diff(polyline, axis=0)
    square = np.maximum(np.sum(step**2, axis=1), 1e-300)
    other = right_normals(polyline)
    gap, foot, hit = np.full(len(points), np.inf), np.full((len(points), 2), np.nan), []
    for first in range(0, len(points), _BLOCK):
        rows = slice(first, first + _BLOCK)
        offset = points[rows, None] - start[None]
        along = np.clip(np.einsum("nmk,mk->nm", offset, step) / square, 0.0, 1.0)
        feet = start[None] + along[..., None] * step[None]
        towards = feet - points[rows, None]
        distance = np.linalg.norm(towards, axis=2)
        outside = np.einsum("nmk,nk->nm", towards, normals[rows])
        signed = np.where(outside < 0, -distance, distance)
        facing = (normals[rows] @ other.T < _FACING) & (signed > -deepest_m)
        facing[:, 0] &= along[:, 0] > 0  # beyond the polyline's ends nothing is known
        facing[:, -1] &= along[:, -1] < 1
        distance = np.where(facing, distance, np.inf)
        nearest = np.argmin(distance, axis=1)
        index = np.arange(len(nearest))
        found = np.isfinite(distance[index, nearest])
        gap[rows] = np.where(found, signed[index, nearest], np.inf)
        foot[rows] = feet[index, nearest]
        hit.append(np.where(found, nearest, -1))
    return Projection(gap_m=gap, foot_m=foot, segment=np.concatenate(hit))
