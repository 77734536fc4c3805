"""The gap along an arm, at rest and deformed, from the fields that a study keeps."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dftfs.analysis.meshing.coil_gap_mesh import CoilGapMesh
from dftfs.analysis.torsion.result import FieldSnapshot
from dftfs.errors import DesignError

_SAME_PLACE_M = 1e-9


@dataclass(frozen=True, kw_only=True)
class GapProfile:
    """Gap from the arm's outer edge to what faces it, at one state.

    arc_length_m (n,) : along the undeformed edge, 0 where it leaves the hub.
    angle_rad (n,) : polar angle of the undeformed edge from there. gap_m (n,) : nan where nothing
    faces. smallest_m, smallest_at_m : smallest gap, facing corners included, and its arc length.
    """

    arc_length_m: NDArray
    angle_rad: NDArray
    gap_m: NDArray
    smallest_m: float
    smallest_at_m: float


def gap_profile(gap: CoilGapMesh, displacement_m: NDArray | None = None) -> GapProfile:
    """Gap along the arm's outer edge for a displacement (nodes, 2) of the sector."""
    rest, _ = gap.polylines()
    floor, _ = gap.polylines(displacement_m)
    clearance = gap.clearance(displacement_m)
    radius = np.hypot(*rest.T)
    leaves = int(np.argmax(radius > 1.001 * radius[0]))
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(rest, axis=0).T))])
    arc -= arc[leaves]
    angle = np.unwrap(np.arctan2(rest[:, 1], rest[:, 0]))
    nearest = int(np.argmin(np.linalg.norm(floor - clearance.at_m, axis=1)))
    gap = np.where(np.isfinite(clearance.floor_gap_m), clearance.floor_gap_m, np.nan)
    return GapProfile(
        arc_length_m=arc[leaves:],
        angle_rad=(angle - angle[leaves])[leaves:],
        gap_m=gap[leaves:],
        smallest_m=clearance.smallest_m,
        smallest_at_m=float(arc[nearest]),
    )


def sector_displacement(gap: CoilGapMesh, snapshot: FieldSnapshot) -> NDArray:
    """Displacement (nodes, 2) of the gap's sector in a snapshot of the whole spring.

    Raises
    ------
    DesignError
        If the snapshot does not begin with the nodes of that sector.
    """
    count = len(gap.sector.nodes)
    own = snapshot.nodes_m[:count]
    if own.shape != gap.sector.nodes.shape or not np.allclose(
        own, gap.sector.nodes, rtol=0, atol=_SAME_PLACE_M
    ):
        raise DesignError(
            f"the field of {len(snapshot.nodes_m)} nodes does not begin with the {count} nodes of"
            " the study's sector: both must come from one mesh"
        )
    return snapshot.displacement_m[:count]
