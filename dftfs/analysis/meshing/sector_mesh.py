"""The spring's mesh: one sector of quadrilaterals from the outline, turned and extruded.

Roots by gmsh (Frontal-Delaunay for quads, Blossom recombination, at twice the wanted size), the
arm as a grid, all split once so that only quadrilaterals are left. Only this file imports gmsh.
"""

from itertools import pairwise

import gmsh
import numpy as np
from numpy.typing import NDArray

from dftfs.analysis.meshing.bands import banded_ring
from dftfs.analysis.meshing.blocks import (
    CROSS_SECTION,
    MeshSizing,
    SectorBlocks,
    sector_blocks,
    size_at,
)
from dftfs.analysis.meshing.planar_mesh import (
    CoarseMesh,
    corner_quality,
    joined,
    quad8,
    smoothed,
    split,
    without_flat_corners,
)
from dftfs.errors import MeshError
from dftfs.fem.mesh import TaggedMesh, extruded, replicated
from dftfs.spring.edges import Edge, OffsetEdge
from dftfs.spring.outline import SpringOutline

_FRONTAL_QUADS, _FRONTAL, _MESH_ADAPT, _BLOSSOM = 8, 6, 1, 1
# gmsh folds a block now and then without an error: algorithms and factors of the element size
# inside the root blocks, in the order in which they are tried
_TRIED = ((_FRONTAL_QUADS, 1.0), (_FRONTAL, 1.0), (_MESH_ADAPT, 1.0), (_FRONTAL_QUADS, 0.85),
          (_FRONTAL, 0.85), (_FRONTAL_QUADS, 0.7), (_FRONTAL, 0.7))  # fmt: skip
_SUFFICIENT = 0.1  # lowest corner quality of a mesh that ends the trials; not above 0: folded
_MIN_PIECES = {"notch_fillet": 4, "foot_fillet": 2, "slit_fillet": 4, "tip_fillet": 2}


def sector_mesh(outline: SpringOutline, sizing: MeshSizing | None = None) -> TaggedMesh:
    """Quad8 mesh of arm 0's sector with every edge of the outline as a named boundary.

    Boundaries: ``bore``, ``rim_outer``, ``hub``, ``foot_fillet``, ``arm_outer``, ``slit_fillet``,
    ``rim_inner``, ``tip_fillet``, ``tip_face``, ``tip_round`` (where rounded), ``arm_inner``,
    ``notch_fillet``, and the cuts ``cut_low``, ``cut_high``
    (none for one arm, whose sector is the whole spring).

    Raises
    ------
    MeshError
        If gmsh fails or an element is unusable.
    """
    sizing = sizing or MeshSizing()
    best, highest, refused = None, 0.0, None
    for tried in _TRIED:
        try:
            mesh = _sector_mesh(outline, sizing, *tried)
        except MeshError as error:
            refused = refused or error
            continue
        quality = corner_quality(mesh.nodes[mesh.cells[:, :4]]).min()
        if quality > highest:
            best, highest = mesh, quality
        if quality >= _SUFFICIENT:
            break
    if best is None:
        raise refused or MeshError("gmsh's elements overlap in the hub's or the rim's block")
    return best


def _sector_mesh(
    outline: SpringOutline, sizing: MeshSizing, algorithm: int, inside: float
) -> TaggedMesh:
    """The mesh by one algorithm of gmsh, elements inside the root blocks smaller by a factor."""
    blocks = sector_blocks(outline)
    pieces = [
        _gmsh_block(outline, blocks.hub_loops, sizing, algorithm, inside),
        _arm_block(outline, blocks, sizing),
        _gmsh_block(outline, blocks.rim_loops, sizing, algorithm, inside),
    ]
    fine = smoothed(split(joined(pieces, internal=CROSS_SECTION)), passes=8)
    nodes, cells, boundaries = quad8(fine)
    return TaggedMesh(nodes=nodes, cells=cells, boundaries=boundaries)


def solid_mesh(planar: TaggedMesh, levels_m: NDArray) -> TaggedMesh:
    """Hex20 mesh: the planar one extruded through the given heights."""
    return extruded(planar, levels_m)


def full_mesh(sector: TaggedMesh, n_arms: int) -> TaggedMesh:
    """The whole spring from its sector (2D or 3D)."""
    if n_arms == 1:
        return sector
    return replicated(sector, n_arms, cut_low="cut_low", cut_high="cut_high")


def _arm_block(outline: SpringOutline, blocks: SectorBlocks, sizing: MeshSizing) -> CoarseMesh:
    p = outline.parameters
    line, half = p.centreline, p.thickness_m / 2
    across = sizing.across // 2
    length = line.length(blocks.arm_start, blocks.arm_end)
    thinnest = p.thickness_range_m[0]
    along = max(4, int(np.ceil(length / (2 * sizing.along * thinnest))))
    theta = line.parameter_at_length(blocks.arm_start, np.linspace(0, length, along + 1))
    theta[0], theta[-1] = blocks.arm_start, blocks.arm_end
    offset = np.linspace(-0.5, 0.5, across + 1) * p.thickness_at(theta)[:, None]
    points = line.point(theta)[:, None] + offset[:, :, None] * line.normal(theta)[:, None]
    index = np.arange((along + 1) * (across + 1)).reshape(along + 1, across + 1)
    # normal to tangent is a quarter turn anticlockwise: across first keeps the faces so
    faces = np.stack(
        [index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1
    ).reshape(-1, 4)
    inner = OffsetEdge(
        name="arm_inner",
        centreline=line,
        taper=p.taper,
        offset_m=-half,
        start=blocks.arm_end,
        end=blocks.arm_start,
    )
    outer = OffsetEdge(
        name="arm_outer",
        centreline=line,
        taper=p.taper,
        offset_m=half,
        start=blocks.arm_start,
        end=blocks.arm_end,
    )
    fraction = (theta - blocks.arm_start) / (blocks.arm_end - blocks.arm_start)
    curves: dict[tuple[int, int], tuple[Edge, float, float]] = {}
    for k in range(along):
        curves[index[k, -1], index[k + 1, -1]] = (outer, fraction[k], fraction[k + 1])
        curves[index[k + 1, 0], index[k, 0]] = (inner, 1 - fraction[k + 1], 1 - fraction[k])
    return CoarseMesh(
        nodes=points.reshape(-1, 2),
        faces=tuple(tuple(int(n) for n in face) for face in faces),
        curves={(int(i), int(j)): tag for (i, j), tag in curves.items()},
    )


def _gmsh_block(
    outline: SpringOutline, loops: tuple[tuple[Edge, ...], ...], sizing: MeshSizing,
    algorithm: int, inside: float,
) -> CoarseMesh:  # fmt: skip
    """A root block: a band of ordered quadrilaterals along every fillet, gmsh in between.

    The band puts the nodes where the stress peaks in rows along the edge, whatever gmsh does.
    """
    size = size_at(outline, loops, sizing)
    rings, curves = [], {}
    for loop in loops:
        pieces: list[tuple[Edge, float, float]] = []
        for edge in loop:
            if edge.name == CROSS_SECTION:
                steps = np.linspace(0, 1, sizing.across // 2 + 1)
            else:
                steps = _graded(edge, size, _MIN_PIECES.get(edge.name, 1))
            pieces += [(edge, a, b) for a, b in pairwise(steps)]
        _mirror_cuts(pieces)
        rings.append(banded_ring(pieces, size, outline.parameters.fillet_radius_m))
    # nodes: what gmsh sees of every ring, then its own, then the boundary under the bands
    polygons = [ring.polygon_m for ring in rings]
    nodes, faces_inside = _gmsh_faces(polygons, [2 * inside * size(p) for p in polygons], algorithm)
    first, covered = 0, len(nodes)
    faces = list(faces_inside)
    for ring in rings:
        number = np.where(
            ring.covered, covered + np.cumsum(ring.covered) - 1, first + ring.polygon_index
        )
        count = len(ring.pieces)
        for k, piece in enumerate(ring.pieces):
            curves[int(number[k]), int(number[(k + 1) % count])] = piece
        for k in np.flatnonzero(ring.banded):
            after = (k + 1) % count
            corner = number[k], number[after], first + ring.inward[after], first + ring.inward[k]
            faces.append(tuple(int(n) for n in corner))
        nodes = np.concatenate([nodes, ring.points_m[ring.covered]])
        covered += int(ring.covered.sum())
        first += len(ring.polygon_m)
    return without_flat_corners(CoarseMesh(nodes=nodes, faces=tuple(faces), curves=curves))


def _graded(edge: Edge, size, least: int) -> NDArray:
    """Parameters that cut an edge into coarse pieces of twice the wanted size."""
    t = np.linspace(0, 1, 801)
    density = edge.length_m / (2 * size(edge.point(t)))
    along = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(t))])
    count = max(least, round(along[-1]))
    return np.interp(np.linspace(0, along[-1], count + 1), along, t)


def _mirror_cuts(pieces: list[tuple[Edge, float, float]]) -> None:
    """Give ``cut_high`` the cut points of ``cut_low``, so that one turned is the other."""
    low = [(a, b) for edge, a, b in pieces if edge.name == "cut_low"]
    where = [k for k, (edge, _, _) in enumerate(pieces) if edge.name == "cut_high"]
    if not where:
        return
    edge = pieces[where[0]][0]
    pieces[where[0] : where[-1] + 1] = [(edge, 1 - b, 1 - a) for a, b in reversed(low)]


def _gmsh_faces(
    rings: list[NDArray], sizes: list[NDArray], algorithm: int
) -> tuple[NDArray, tuple[tuple[int, ...], ...]]:
    """Mesh between polygons, holes turned the other way; sides stay whole, corners come first."""
    scale = float(np.ptp(rings[0]))
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Verbosity", 0)
        gmsh.option.setNumber("General.NumThreads", 1)
        gmsh.option.setNumber("Mesh.Algorithm", algorithm)
        gmsh.option.setNumber("Mesh.RecombineAll", 1)
        gmsh.option.setNumber("Mesh.RecombinationAlgorithm", _BLOSSOM)
        gmsh.option.setNumber("Mesh.Smoothing", 10)
        tags, lines, loops = [], [], []
        for points, size in zip(rings, sizes):
            ring = [
                gmsh.model.geo.addPoint(x / scale, y / scale, 0.0, h / scale)
                for (x, y), h in zip(points, size)
            ]
            sides = [gmsh.model.geo.addLine(a, b) for a, b in zip(ring, [*ring[1:], ring[0]])]
            loops.append(gmsh.model.geo.addCurveLoop(sides))
            tags, lines = tags + ring, lines + sides
        surface = gmsh.model.geo.addPlaneSurface(loops)
        gmsh.model.geo.synchronize()
        for line in lines:
            gmsh.model.mesh.setTransfiniteCurve(line, 2)
        gmsh.model.mesh.generate(2)
        nodes, faces = _read_faces(tags, surface, scale)
    except Exception as error:  # gmsh raises nothing more specific
        raise MeshError(f"gmsh could not mesh a block of {len(rings[0])} sides: {error}") from None
    finally:
        gmsh.finalize()
    if not faces:
        raise MeshError(
            f"gmsh left a block of {len(rings[0])} sides empty: the arm is too short or too steep"
            " to be cut into roots and strip; more turns would work"
        )
    return nodes, faces


def _read_faces(
    corner_tags: list[int], surface: int, scale: float
) -> tuple[NDArray, tuple[tuple[int, ...], ...]]:
    numbers, coordinates, _ = gmsh.model.mesh.getNodes()
    position = dict(zip((int(n) for n in numbers), coordinates.reshape(-1, 3)[:, :2] * scale))
    order = [int(gmsh.model.mesh.getNodes(0, tag)[0][0]) for tag in corner_tags]
    order += [n for n in position if n not in set(order)]
    index = {n: k for k, n in enumerate(order)}
    faces: list[tuple[int, ...]] = []
    for kind, _, flat in zip(*gmsh.model.mesh.getElements(2, surface)):
        width = gmsh.model.mesh.getElementProperties(kind)[3]
        for row in np.asarray(flat).reshape(-1, width):
            faces.append(tuple(index[int(n)] for n in row))
    nodes = np.array([position[n] for n in order])
    # one orientation for all: a folded element keeps its negative area until smoothing unfolds it
    clockwise = sum(_area(nodes[list(face)]) for face in faces) < 0
    return nodes, tuple(face[::-1] if clockwise else face for face in faces)


def _area(polygon: NDArray) -> float:
    """Area inside a polygon (n, 2), positive where it turns anticlockwise."""
    x, y = polygon.T
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2
