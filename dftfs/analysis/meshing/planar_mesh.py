"""All-quadrilateral planar meshes that stay on the exact outline: refine, join, raise to quad8.

A coarse mesh carries, for every boundary edge, the exact curve and the parameters of its ends.
Splitting it puts the new boundary nodes on the curve, so a family of nested meshes (for an error
estimate) and the midside nodes of quad8 all lie on the one geometry.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dftfs.errors import MeshError
from dftfs.spring.edges import Edge

_MERGE_FRACTION = 1e-9  # of the mesh's extent: nodes nearer than this are one node


@dataclass(frozen=True, kw_only=True)
class CoarseMesh:
    """Corner-node faces with curve-tagged boundary edges.

    nodes : (n, 2) m. faces : tuple of 3- or 4-tuples of node numbers, anticlockwise.
    curves : boundary edge (i, j) in the direction of travel -> (curve, t_i, t_j).
    """

    nodes: NDArray
    faces: tuple[tuple[int, ...], ...]
    curves: dict[tuple[int, int], tuple[Edge, float, float]]


def joined(meshes: list[CoarseMesh], *, internal: str) -> CoarseMesh:
    """One mesh of several that meet at curves named ``internal``, whose tags are dropped."""
    offsets = np.cumsum([0] + [len(mesh.nodes) for mesh in meshes])
    nodes = np.concatenate([mesh.nodes for mesh in meshes])
    tree = cKDTree(nodes)
    reach = _MERGE_FRACTION * float(np.ptp(nodes))
    first = np.array([min(group) for group in tree.query_ball_point(nodes, reach)])
    kept, index = np.unique(first, return_inverse=True)
    faces, curves = [], {}
    for mesh, offset in zip(meshes, offsets):
        faces += [tuple(int(index[n + offset]) for n in face) for face in mesh.faces]
        for (i, j), tag in mesh.curves.items():
            if tag[0].name != internal:
                curves[int(index[i + offset]), int(index[j + offset])] = tag
    return CoarseMesh(nodes=nodes[kept], faces=tuple(faces), curves=curves)


def split(mesh: CoarseMesh) -> CoarseMesh:
    """Every quadrilateral into four, every triangle into three: quadrilaterals only."""
    nodes = list(mesh.nodes)
    middle: dict[tuple[int, int], int] = {}
    curves: dict[tuple[int, int], tuple[Edge, float, float]] = {}

    def midpoint(i: int, j: int) -> int:
        key = (min(i, j), max(i, j))
        if key not in middle:
            tag = mesh.curves.get((i, j)) or mesh.curves.get((j, i))
            mean = (mesh.nodes[i] + mesh.nodes[j]) / 2
            nodes.append(mean if tag is None else tag[0].point((tag[1] + tag[2]) / 2))
            middle[key] = len(nodes) - 1
        return middle[key]

    faces = []
    for face in mesh.faces:
        ring = [midpoint(face[k], face[(k + 1) % len(face)]) for k in range(len(face))]
        nodes.append(np.mean([nodes[n] for n in (*face, *ring)], axis=0))
        centre = len(nodes) - 1
        faces += [(face[k], ring[k], centre, ring[k - 1]) for k in range(len(face))]
    for (i, j), (curve, t_i, t_j) in mesh.curves.items():
        m, t_m = middle[min(i, j), max(i, j)], (t_i + t_j) / 2
        curves[i, m] = (curve, t_i, t_m)
        curves[m, j] = (curve, t_m, t_j)
    return CoarseMesh(nodes=np.array(nodes), faces=tuple(faces), curves=curves)


def without_flat_corners(mesh: CoarseMesh, least: float = 0.45) -> CoarseMesh:
    """Cut quadrilaterals with a corner near 180 degrees in two triangles at that corner.

    Such a corner on a smooth boundary cannot be moved; `split` makes sound quadrilaterals of the
    triangles. ``least`` is the smallest sine of a corner's angle that is kept.
    """
    faces: list[tuple[int, ...]] = []
    for face in mesh.faces:
        corners = mesh.nodes[list(face)]
        if len(face) == 3 or corner_quality(corners[None])[0] >= least:
            faces.append(face)
            continue
        ahead, back = np.roll(corners, -1, axis=0) - corners, np.roll(corners, 1, axis=0) - corners
        cosine = np.sum(ahead * back, axis=1)
        cosine /= np.linalg.norm(ahead, axis=1) * np.linalg.norm(back, axis=1)
        a, b, c, d = np.roll(face, -int(np.argmin(cosine)))
        faces += [(int(a), int(b), int(c)), (int(a), int(c), int(d))]
    return CoarseMesh(nodes=mesh.nodes, faces=tuple(faces), curves=mesh.curves)


def smoothed(mesh: CoarseMesh, passes: int) -> CoarseMesh:
    """Move inner nodes so that the worst corner around each gets better, never worse.

    Candidates are the neighbours' mean and a shrinking star about the present place: an
    optimisation-based smoother (Freitag, Jones & Plassmann 1995) in its plainest form.
    """
    fixed = {n for edge in mesh.curves for n in edge}
    neighbours: dict[int, set[int]] = {}
    around: dict[int, list[int]] = {}
    for number, face in enumerate(mesh.faces):
        for k, n in enumerate(face):
            neighbours.setdefault(n, set()).update((face[k - 1], face[(k + 1) % len(face)]))
            around.setdefault(n, []).append(number)
    nodes, faces = mesh.nodes.copy(), np.array(mesh.faces)
    free = [n for n in neighbours if n not in fixed]
    angles = np.arange(8) * np.pi / 4
    star = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    for sweep in range(passes):
        for n in free:
            near = nodes[list(neighbours[n])]
            reach = 0.3 * 0.7**sweep * np.min(np.linalg.norm(near - nodes[n], axis=1))
            candidates = np.concatenate([nodes[n][None], near.mean(axis=0)[None]])
            candidates = np.concatenate([candidates, nodes[n] + reach * star])
            cells = faces[around[n]]
            trial = np.repeat(nodes[cells][None], len(candidates), axis=0)
            trial[:, cells == n] = candidates[:, None]
            quality = corner_quality(trial.reshape(-1, 4, 2)).reshape(len(candidates), -1)
            nodes[n] = candidates[np.argmax(quality.min(axis=1) + 1e-9)]
    return CoarseMesh(nodes=nodes, faces=mesh.faces, curves=mesh.curves)


def corner_quality(corners: NDArray) -> NDArray:
    """Smallest sine of the corner angles of quadrilaterals (m, 4, 2); negative if inverted."""
    ahead = np.roll(corners, -1, axis=1) - corners
    back = np.roll(corners, 1, axis=1) - corners
    cross = ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0]
    size = np.linalg.norm(ahead, axis=2) * np.linalg.norm(back, axis=2)
    return np.min(cross / np.maximum(size, 1e-300), axis=1)


def quad8(mesh: CoarseMesh) -> tuple[NDArray, NDArray, dict[str, NDArray]]:
    """Serendipity quadrilaterals with midside nodes on the exact curves.

    Returns
    -------
    nodes (n, 2); cells (m, 8), corners then midsides; boundaries: name -> (k, 3) node lists.

    Raises
    ------
    MeshError
        If an outer edge of the mesh lies on no curve.
    """
    corners = np.array(mesh.faces)
    pairs = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2)
    keys, inverse, counts = np.unique(
        np.sort(pairs, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    positions = mesh.nodes[keys].mean(axis=1)
    row = {(int(a), int(b)): k for k, (a, b) in enumerate(keys)}
    boundaries: dict[str, list[tuple[int, int, int]]] = {}
    for (i, j), (curve, t_i, t_j) in mesh.curves.items():
        k = row[min(i, j), max(i, j)]
        positions[k] = curve.point((t_i + t_j) / 2)
        boundaries.setdefault(curve.name, []).append((i, j, len(mesh.nodes) + k))
    if int(np.sum(counts == 1)) != len(mesh.curves):
        raise MeshError(
            f"mesh: {int(np.sum(counts == 1))} outer edges but {len(mesh.curves)} of them on the"
            " outline; the blocks do not fit together"
        )
    cells = np.concatenate([corners, len(mesh.nodes) + inverse.reshape(-1, 4)], axis=1)
    tagged = {name: np.array(rows) for name, rows in boundaries.items()}
    return np.concatenate([mesh.nodes, positions]), cells, tagged
