"""Clearance between the facing edges of a gap between the coils, undeformed or deformed.

The floor of a coil gap is the hub and the next arm's outer edge, its ceiling the rim, the arm's tip
and the arm's inner edge (`dftfs.spring.outline`). Both are polylines with the material on the
left, whoever deformed them: rod model or finite elements.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dftfs.spring.edges import Edge
from dftfs.spring.outline import SpringOutline
from dftfs.spring.projection import point_normals, project

FLOOR = ("hub", "foot_fillet", "arm_outer")
CEILING = ("rim_inner", "tip_fillet", "tip_face", "tip_round", "arm_inner")
_END_ZONE = 4.0  # fillet radii beside a gap's closed ends that count as the fillet


@dataclass(frozen=True, kw_only=True)
class Clearance:
    """Distance between the floor and the ceiling of a coil gap.

    floor_gap_m : (n,) at the floor's points, infinite where nothing faces them.
    smallest_m : the smallest gap anywhere, corners of the ceiling included; negative means that
    the edges overlap. at_m : (2,) where.
    """

    floor_gap_m: NDArray
    smallest_m: float
    at_m: NDArray


def measure_clearance(floor: NDArray, ceiling: NDArray, *, deepest_m: float) -> Clearance:
    """Smallest gap between two facing polylines, projected both ways.

    Parameters
    ----------
    floor, ceiling : (n, 2) and (m, 2) arrays
        Points in travel order with the material on the left.
    deepest_m : float
        Largest overlap that still counts as one (half the strip's thickness).
    """
    up = project(floor, point_normals(floor), ceiling, deepest_m=deepest_m)
    down = project(ceiling, point_normals(ceiling), floor, deepest_m=deepest_m)
    i, j = int(np.argmin(up.gap_m)), int(np.argmin(down.gap_m))
    if up.gap_m[i] <= down.gap_m[j]:
        return Clearance(floor_gap_m=up.gap_m, smallest_m=float(up.gap_m[i]), at_m=floor[i])
    return Clearance(floor_gap_m=up.gap_m, smallest_m=float(down.gap_m[j]), at_m=ceiling[j])


def trimmed_ends(points: NDArray, radius_m: float, *, start: bool, end: bool) -> NDArray:
    """Mask of a polyline's points that are not within the end zone of a fillet at its ends."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    zone = _END_ZONE * radius_m
    return ~((start & (along < zone)) | (end & (along[-1] - along < zone)))


@dataclass(frozen=True, kw_only=True)
class CoilGapSamples:
    """Sampled floor and ceiling of coil gap 0: points, and where each one belongs.

    floor_kind, ceiling_kind : (n,) edge kinds (``arm_outer``, ...); floor_theta, ceiling_theta :
    centreline parameter for points of an arm's edge (of the floor's arm, which is arm 1, and of
    arm 0), nan elsewhere.
    """

    floor_m: NDArray
    floor_kind: NDArray
    floor_theta: NDArray
    ceiling_m: NDArray
    ceiling_kind: NDArray
    ceiling_theta: NDArray


def sample_coil_gap(outline: SpringOutline, spacing_m: float) -> CoilGapSamples:
    """Sample the floor and the ceiling of coil gap 0, their closed ends left out."""
    radius = outline.parameters.fillet_radius_m
    edges = {edge.name.split(":")[0]: edge for edge in outline.coil_gaps[0]}
    floor = _sample([edges[name] for name in FLOOR], spacing_m)
    ceiling = _sample([edges[name] for name in CEILING if name in edges], spacing_m)
    keep_floor = trimmed_ends(floor[0], radius, start=True, end=True)
    keep_ceiling = trimmed_ends(ceiling[0], radius, start=True, end=True)
    return CoilGapSamples(
        floor_m=floor[0][keep_floor],
        floor_kind=floor[1][keep_floor],
        floor_theta=floor[2][keep_floor],
        ceiling_m=ceiling[0][keep_ceiling],
        ceiling_kind=ceiling[1][keep_ceiling],
        ceiling_theta=ceiling[2][keep_ceiling],
    )


def _sample(edges: list[Edge], spacing_m: float) -> tuple[NDArray, NDArray, NDArray]:
    points, kinds, thetas = [], [], []
    for edge in edges:
        t = np.linspace(0, 1, max(4, int(np.ceil(edge.length_m / spacing_m))) + 1)
        t = t[:-1] if edge is not edges[-1] else t
        points.append(edge.point(t))
        kinds.append(np.full(len(t), edge.name.split(":")[0]))
        along = edge.parameter(t) if hasattr(edge, "parameter") else np.full(len(t), np.nan)
        thetas.append(along)
    return np.concatenate(points), np.concatenate(kinds), np.concatenate(thetas)
