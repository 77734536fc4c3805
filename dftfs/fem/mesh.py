"""Immutable quadratic meshes with named boundaries, refused where they cannot be solved on.

After scikit-fem's meshes (frozen, named boundaries, new meshes from old ones), except that an
empty selection, an inverted element or an unused node is an error here.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dftfs.errors import MeshError
from dftfs.fem.elements import HEX20, QUAD8, ElementKind, gauss_table

_MATCH_FRACTION = 1e-6  # of the mesh's extent: farther apart, two cut nodes are not partners


@dataclass(frozen=True, kw_only=True, eq=False)
class TaggedMesh:
    """Eight-node quadrilaterals or twenty-node hexahedra with named boundaries.

    Parameters
    ----------
    nodes : (n, 2) or (n, 3) array
        Coordinates in m.
    cells : (m, 8) or (m, 20) int array
        Node numbers in the order of Abaqus' CPS8 or C3D20.
    boundaries : mapping of name to (k, 3) or (k, 8) int array
        Facets as node numbers, corners first, then midsides. Stored turned as in their cell:
        an edge has the outside on its right, a face is counter-clockwise seen from outside.

    Raises
    ------
    MeshError
        Wrong shapes, numbers out of range, unused nodes, a Jacobian that is not positive at an
        integration point, an empty boundary, or a facet that bounds no cell or two.
    """

    nodes: NDArray[np.float64]
    cells: NDArray[np.int32]
    boundaries: Mapping[str, NDArray[np.int32]]

    def __post_init__(self) -> None:
        nodes = np.array(self.nodes, dtype=float, order="C")
        cells = np.array(self.cells, dtype=np.int32, order="C")
        _check_shapes(nodes, cells)
        _check_nodes(nodes, cells)
        object.__setattr__(self, "nodes", _frozen(nodes))
        object.__setattr__(self, "cells", _frozen(cells))
        _check_jacobians(self)
        boundaries = {
            name: _frozen(_turned(name, np.array(rows), cells, self.kind))
            for name, rows in self.boundaries.items()
        }
        object.__setattr__(self, "boundaries", MappingProxyType(boundaries))

    @property
    def dim(self) -> int:
        return self.nodes.shape[1]

    @property
    def kind(self) -> ElementKind:
        return QUAD8 if self.dim == 2 else HEX20

    def facets(self, name: str) -> NDArray[np.int32]:
        """Facets of a boundary; MeshError names the known ones if there is none of that name."""
        if name not in self.boundaries:
            raise MeshError(f"no boundary '{name}'; this mesh has {sorted(self.boundaries)}")
        return self.boundaries[name]

    def boundary_nodes(self, name: str) -> NDArray[np.int32]:
        """Sorted numbers of the nodes on a boundary."""
        return np.unique(self.facets(name))


def jacobian_determinants(mesh: TaggedMesh, per_direction: int = 3) -> NDArray[np.float64]:
    """(m, q) determinants of the map from the unit cell at the Gauss points."""
    table = gauss_table(mesh.kind.name, per_direction)
    result = np.empty((len(mesh.cells), len(table.weights)))
    for start in range(0, len(mesh.cells), 512):  # in slices: the Jacobians would be large
        corners = mesh.nodes[mesh.cells[start : start + 512]]
        jacobian = np.einsum("eni,qjn->eqij", corners, table.gradients, optimize=True)
        result[start : start + 512] = np.linalg.det(jacobian)
    return result


def extruded(planar: TaggedMesh, levels_m: NDArray[np.float64]) -> TaggedMesh:
    """Hexahedra by extruding quadrilaterals along z through the given heights.

    Planar boundaries become surfaces of the same names; ``bottom`` and ``top`` are added.

    Raises
    ------
    MeshError
        If the mesh is not planar, a name is taken, or the levels do not increase.
    """
    levels = np.asarray(levels_m, dtype=float)
    if planar.dim != 2:
        raise MeshError("extruded() needs a planar mesh, got a solid one")
    if levels.ndim != 1 or len(levels) < 2 or not np.all(np.diff(levels) > 0):
        raise MeshError(f"levels_m must be at least two increasing heights, got {levels.tolist()}")
    taken = {"bottom", "top"} & set(planar.boundaries)
    if taken:
        raise MeshError(f"boundary name {sorted(taken)} is reserved for the extrusion's ends")
    n_all, layers = len(planar.nodes), len(levels) - 1
    corner = np.unique(planar.cells[:, :4])
    corner_rank = np.full(n_all, -1)
    corner_rank[corner] = np.arange(len(corner))
    stride = n_all + len(corner)

    def on(nodes: NDArray, layer: int) -> NDArray:
        return nodes + layer * stride

    def between(nodes: NDArray, layer: int) -> NDArray:
        return corner_rank[nodes] + layer * stride + n_all

    planes = []
    for k, z in enumerate(levels):
        planes.append(np.column_stack([planar.nodes, np.full(n_all, z)]))
        if k < layers:
            middle = (z + levels[k + 1]) / 2
            planes.append(np.column_stack([planar.nodes[corner], np.full(len(corner), middle)]))
    c, m = planar.cells[:, :4], planar.cells[:, 4:]
    cells = [
        np.hstack([on(c, k), on(c, k + 1), on(m, k), on(m, k + 1), between(c, k)])
        for k in range(layers)
    ]
    boundaries = {
        name: np.concatenate(
            [
                np.column_stack(
                    [
                        *(on(i, k), on(j, k), on(j, k + 1), on(i, k + 1)),
                        *(on(mid, k), between(j, k), on(mid, k + 1), between(i, k)),
                    ]
                )
                for k in range(layers)
            ]
        )
        for name, (i, j, mid) in ((name, rows.T) for name, rows in planar.boundaries.items())
    }
    boundaries["bottom"] = np.hstack([c[:, ::-1], m[:, [2, 1, 0, 3]]])
    boundaries["top"] = on(planar.cells, layers)
    return TaggedMesh(
        nodes=np.concatenate(planes), cells=np.concatenate(cells), boundaries=boundaries
    )


def matched_cut_nodes(
    mesh: TaggedMesh, n_sectors: int, *, cut_low: str, cut_high: str
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Partners across a cyclic sector's cuts: ``high = R(2 pi / n) low`` about the z axis.

    Returns
    -------
    low, high : (k,) int arrays
        Node numbers on ``cut_low`` and their images on ``cut_high``.

    Raises
    ------
    MeshError
        If ``n_sectors`` < 2, a node is on both cuts, or a node has no partner.
    """
    if n_sectors < 2:
        raise MeshError(f"n_sectors={n_sectors}: a cyclic mesh needs at least 2 sectors")
    low, high = mesh.boundary_nodes(cut_low), mesh.boundary_nodes(cut_high)
    if np.intersect1d(low, high).size:
        raise MeshError(f"'{cut_low}' and '{cut_high}' share a node: the axis must be outside")
    image = mesh.nodes[low] @ rotation_about_z(2 * np.pi / n_sectors, mesh.dim).T
    distance, partner = cKDTree(mesh.nodes[high]).query(image)
    limit = _MATCH_FRACTION * float(np.ptp(mesh.nodes, axis=0).max())
    if len(low) != len(high) or distance.max() > limit or len(np.unique(partner)) < len(high):
        raise MeshError(
            f"'{cut_low}' ({len(low)} nodes) turned by 2 pi/{n_sectors} is not '{cut_high}'"
            f" ({len(high)} nodes): worst gap {distance.max():.3g} m, allowed {limit:.3g} m"
        )
    return low, high[partner]


def replicated(mesh: TaggedMesh, n: int, *, cut_low: str, cut_high: str) -> TaggedMesh:
    """The whole ring from one cyclic sector: n copies turned about z, joined at the cuts.

    Boundaries of the copies keep their names and are united; the two cuts disappear.

    Raises
    ------
    MeshError
        If the cuts do not match (see `matched_cut_nodes`).
    """
    low, high = matched_cut_nodes(mesh, n, cut_low=cut_low, cut_high=cut_high)
    own = np.setdiff1d(np.arange(len(mesh.nodes)), high)
    number = np.empty((n, len(mesh.nodes)), dtype=np.int32)
    for k in range(n):
        number[k, own] = k * len(own) + np.arange(len(own))
    for k in range(n):
        number[k, high] = number[(k + 1) % n, low]
    nodes = [mesh.nodes[own] @ rotation_about_z(2 * np.pi * k / n, mesh.dim).T for k in range(n)]
    boundaries = {
        name: np.concatenate([number[k][rows] for k in range(n)])
        for name, rows in mesh.boundaries.items()
        if name not in (cut_low, cut_high)
    }
    cells = np.concatenate([number[k][mesh.cells] for k in range(n)])
    return TaggedMesh(nodes=np.concatenate(nodes), cells=cells, boundaries=boundaries)


def rotation_about_z(angle_rad: float, dim: int) -> NDArray[np.float64]:
    """(dim, dim) matrix that turns a column vector counter-clockwise about z."""
    rotation = np.eye(dim)
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    rotation[:2, :2] = [[c, -s], [s, c]]
    return rotation


def _frozen(array: NDArray) -> NDArray:
    array.setflags(write=False)
    return array


def _check_shapes(nodes: NDArray, cells: NDArray) -> None:
    widths = {2: 8, 3: 20}
    if nodes.ndim != 2 or nodes.shape[1] not in widths or cells.ndim != 2 or not len(cells):
        raise MeshError(f"nodes {nodes.shape}, cells {cells.shape}: need (n, 2|3) and (m, 8|20)")
    if cells.shape[1] != widths[nodes.shape[1]]:
        raise MeshError(
            f"cells have {cells.shape[1]} nodes; {nodes.shape[1]}D needs {widths[nodes.shape[1]]}"
        )


def _check_nodes(nodes: NDArray, cells: NDArray) -> None:
    if not np.isfinite(nodes).all():
        raise MeshError(f"node {int(np.argwhere(~np.isfinite(nodes))[0, 0])} is not finite")
    if cells.min() < 0 or cells.max() >= len(nodes):
        raise MeshError(f"cells name node {cells.max()}; the mesh has nodes 0..{len(nodes) - 1}")
    used = np.zeros(len(nodes), dtype=bool)
    used[cells] = True
    if not used.all():
        raise MeshError(
            f"{np.count_nonzero(~used)} nodes belong to no cell, the first is {used.argmin()}"
        )


def _check_jacobians(mesh: TaggedMesh) -> None:
    determinant = jacobian_determinants(mesh)
    bad = determinant.min(axis=1) <= 0
    if bad.any():
        worst = int(bad.argmax())
        raise MeshError(
            f"{np.count_nonzero(bad)} of {len(bad)} cells are folded; the first is cell {worst}"
            f" at {mesh.nodes[mesh.cells[worst]].mean(axis=0).round(6).tolist()} m with Jacobian"
            f" {determinant[worst].min():.3g}"
        )


def _turned(
    name: str, rows: NDArray, cells: NDArray[np.int32], kind: ElementKind
) -> NDArray[np.int32]:
    """The rows of a boundary as their cells write them; each must bound exactly one cell."""
    width = kind.facets.shape[1]
    if rows.ndim != 2 or not len(rows):
        raise MeshError(f"boundary '{name}' selects no facet")
    if rows.shape[1] != width or rows.min() < 0 or rows.max() > cells.max():
        raise MeshError(f"boundary '{name}': a facet needs {width} existing nodes")
    on_boundary = np.zeros(cells.max() + 1, dtype=bool)
    on_boundary[rows] = True
    near = cells[on_boundary[cells].sum(axis=1) >= width]
    candidates = near[:, kind.facets].reshape(-1, width)
    candidates = candidates[on_boundary[candidates].all(axis=1)]
    keys = {}
    for row in candidates:
        keys.setdefault(tuple(sorted(row.tolist())), []).append(row)
    result = np.empty(rows.shape, dtype=np.int32)
    for k, row in enumerate(rows.tolist()):
        found = keys.get(tuple(sorted(row)), [])
        if len(found) != 1:
            where = "lies between two cells" if found else "is no cell's facet"
            raise MeshError(f"boundary '{name}': facet {k} with nodes {row} {where}")
        result[k] = found[0]
    return result
