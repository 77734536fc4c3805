"""Displacements and stresses of every step of a CalculiX frd file, and what is measured on them."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dftfs.fem.mesh import TaggedMesh
from dftfs.spring.clearance import sample_coil_gap
from dftfs.spring.outline import SpringOutline

_POINTS = 17  # on each quadratic edge of a facet
_FAR_M = 1e3  # where nothing is near
_SPACING_M = 5e-5  # of the outline's points


def frd_fields(frd: str, name: str, columns: int) -> list[NDArray[np.float64]]:
    """Values (n, columns) at the nodes of every block of that name, in the order of the file."""
    found = []
    for block in frd.split("\n -4  ")[1:]:
        if block.split(None, 1)[0] != name:
            continue
        rows = [row for row in block[: block.index("\n -3")].splitlines() if row[:3] == " -1"]
        values = {
            int(row[3:13]): [float(row[13 + 12 * k : 25 + 12 * k]) for k in range(columns)]
            for row in rows
        }
        found.append(np.array([values[node] for node in sorted(values)]))
    return found


def smallest_gap_m(
    mesh: TaggedMesh, displacement_m: NDArray[np.float64], outline: SpringOutline
) -> float:
    """Smallest distance between floor and ceiling of gap 0 in the deformed mid-plane.

    Near its closed ends the gap is the fillet, and not counted, as in `dftfs.spring.clearance`.
    Distances of points of the ceiling from the chords between points of the floor; both edges are
    sampled by their shape functions.
    """
    counted = sample_coil_gap(outline, _SPACING_M)
    moved = mesh.nodes + displacement_m
    sides = []
    for name, places in (("gap_floor", counted.floor_m), ("gap_ceiling", counted.ceiling_m)):
        edges = _lower_edges(mesh, mesh.facets(name))
        rest = _sampled(mesh.nodes[edges][..., :2])
        fillet = cKDTree(places).query(rest)[0] > _SPACING_M
        sides.append((_sampled(moved[edges][..., :2]), fillet))
    (floor, at_end), (ceiling, left_out) = sides
    floor[at_end] += _FAR_M
    points = ceiling[~left_out]
    edge, point = np.divmod(cKDTree(floor.reshape(-1, 2)).query(points)[1], _POINTS)
    distances = []
    for step in (-1, 1):
        other = np.clip(point + step, 0, _POINTS - 1)
        other = np.where(at_end[edge, other], point, other)
        distances.append(_from_chord(points, floor[edge, point], floor[edge, other]))
    return float(np.min(distances))


def regional_peaks_Pa(
    mesh: TaggedMesh,
    von_mises_Pa: NDArray[np.float64],
    reach_m: float,
    radii_m: tuple[float, float],
) -> dict[str, float]:
    """Largest nodal stress within ``reach_m`` of the fillets of notch and slit, and of the arms.

    ``radii_m``: of hub and rim's inner side; what is in the rings is not the arm's.
    """
    planar = mesh.nodes[:, :2]
    near = {}
    for region, name in (("hub notch", "notch"), ("rim slit", "slit")):
        tree = cKDTree(planar[mesh.boundary_nodes(name)])
        near[region] = tree.query(planar, distance_upper_bound=reach_m)[0] < np.inf
    radius = np.hypot(*planar.T)
    ring = (radius <= radii_m[0]) | (radius >= radii_m[1])
    near["rim slit"] &= ~near["hub notch"]
    near["arm body"] = ~(ring | near["hub notch"] | near["rim slit"])
    return {region: float(np.max(von_mises_Pa[mask])) for region, mask in near.items()}


def _lower_edges(mesh: TaggedMesh, facets: NDArray[np.int32]) -> NDArray[np.int32]:
    """(k, 3): both corners and midside node of each facet's edge in the plane z = 0."""
    low = np.abs(mesh.nodes[facets, 2]) < 1e-9
    facets, low = facets[low.sum(axis=1) == 3], low[low.sum(axis=1) == 3]
    return facets[low].reshape(-1, 3)


def _sampled(edges_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (k, p, 2) on quadratic edges (k, 3, 2), given as both ends and the middle."""
    s = np.linspace(-1, 1, _POINTS)
    weights = np.stack([s * (s - 1) / 2, s * (s + 1) / 2, 1 - s**2], axis=1)
    return np.einsum("pa,kax->kpx", weights, edges_m)


def _from_chord(
    points: NDArray[np.float64], begin: NDArray[np.float64], end: NDArray[np.float64]
) -> NDArray[np.float64]:
    along = end - begin
    length2 = np.maximum((along**2).sum(axis=1), 1e-30)
    part = np.clip(((points - begin) * along).sum(axis=1) / length2, 0, 1)
    return np.linalg.norm(points - begin - part[:, None] * along, axis=1)
