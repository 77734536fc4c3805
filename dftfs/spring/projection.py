"""Distance from points to a polyline by projection, and the gap between facing edges.

Sampling the other edge and taking the nearest sample overstates the gap between nearly parallel
coils; the foot of the perpendicular on its segments does not.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, kw_only=True)
class Projection:
    """Nearest feet of points on a polyline.

    distance_m : (n,); foot_m : (n, 2); segment : (n,) index of the segment hit. Distance is
    infinite (and segment -1) where no admissible segment exists.
    """

    distance_m: NDArray
    foot_m: NDArray
    segment: NDArray


def project(
    points: NDArray,
    polyline: NDArray,
    *,
    normals: NDArray | None = None,
    segment_normals: NDArray | None = None,
    opposed: float = 0.0,
) -> Projection:
    """Project points on a polyline, by choice only where the normals face each other.

    Parameters
    ----------
    points : (n, 2) array
    polyline : (m, 2) array
    normals, segment_normals : (n, 2) and (m - 1, 2) arrays, optional
        Unit normals out of the material. Where given, a segment counts for a point only if the
        product of the two is below ``-opposed`` and the foot lies on the point's outer side or
        no deeper inside than one segment's length.
    """
    start, step = polyline[:-1], np.diff(polyline, axis=0)
    square = np.maximum(np.sum(step**2, axis=1), 1e-300)
    best = np.full(len(points), np.inf)
    foot = np.full((len(points), 2), np.nan)
    hit = np.full(len(points), -1)
    for first in range(0, len(points), 256):  # blocks keep the n x m tables small
        rows = slice(first, first + 256)
        gap = points[rows, None] - start[None]
        along = np.clip(np.einsum("nmk,mk->nm", gap, step) / square, 0.0, 1.0)
        feet = start[None] + along[..., None] * step[None]
        distance = np.linalg.norm(points[rows, None] - feet, axis=2)
        if normals is not None and segment_normals is not None:
            facing = normals[rows] @ segment_normals.T < -opposed
            distance = np.where(facing, distance, np.inf)
        nearest = np.argmin(distance, axis=1)
        index = np.arange(len(nearest))
        best[rows] = distance[index, nearest]
        found = np.isfinite(best[rows])
        foot[rows][found] = feet[index, nearest][found]
        hit[rows] = np.where(found, nearest, -1)
    return Projection(distance_m=best, foot_m=foot, segment=hit)


def polyline_normals(polyline: NDArray) -> NDArray:
    """Unit normals to the right of travel of each segment, shape (m - 1, 2)."""
    step = np.diff(polyline, axis=0)
    step = step / np.maximum(np.linalg.norm(step, axis=1), 1e-300)[:, None]
    return np.stack([step[:, 1], -step[:, 0]], axis=1)
