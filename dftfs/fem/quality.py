"""How good a mesh's elements are: the numbers a report prints beside a result."""

from dataclasses import dataclass

import numpy as np

from dftfs.fem.mesh import TaggedMesh, jacobian_determinants


@dataclass(frozen=True, kw_only=True)
class MeshQuality:
    """Counts and worst shapes of a mesh.

    Parameters
    ----------
    nodes, elements : int
    min_scaled_jacobian : float
        Smallest corner Jacobian divided by the lengths of the edges that meet there; 1 is a
        right angle, 0 a collapsed corner.
    min_jacobian_ratio : float
        Smallest over largest Jacobian at an element's integration points.
    max_aspect : float
        Longest over shortest edge of an element.

    Source
    ------
    Knupp et al., The Verdict geometric quality library, SAND2007-1751 (scaled Jacobian).
    """

    nodes: int
    elements: int
    min_scaled_jacobian: float
    min_jacobian_ratio: float
    max_aspect: float


def mesh_quality(mesh: TaggedMesh) -> MeshQuality:
    """Quality figures of a mesh (corner shapes from the straight-sided elements)."""
    corners = mesh.nodes[mesh.cells[:, : mesh.kind.n_corners]]
    points = mesh.kind.node_points[: mesh.kind.n_corners]
    lengths, scaled = [], []
    for i, here in enumerate(points):
        # neighbours along each axis, edges towards increasing reference coordinate
        adjacent = np.flatnonzero(np.abs(points - here).sum(axis=1) == 1)
        axes = np.abs(points[adjacent] - here).argmax(axis=1)
        signs = (points[adjacent] - here).sum(axis=1)
        edges = (corners[:, adjacent] - corners[:, i, None]) * signs[:, None]
        length = np.linalg.norm(edges, axis=2)
        lengths.append(length)
        scaled.append(np.linalg.det(edges[:, np.argsort(axes)]) / length.prod(axis=1))
    length = np.concatenate(lengths, axis=1)
    determinant = jacobian_determinants(mesh)
    return MeshQuality(
        nodes=len(mesh.nodes),
        elements=len(mesh.cells),
        min_scaled_jacobian=float(np.min(scaled)),
        min_jacobian_ratio=float((determinant.min(axis=1) / determinant.max(axis=1)).min()),
        max_aspect=float((length.max(axis=1) / length.min(axis=1)).max()),
    )
