"""Triangles of the solid's surface within a stated chord tolerance.

The kernel's own mesher does not keep its linear deflection on circles (27 um asked for 5), so the
loops are cut into chords whose sagitta is known, the kernel triangulates the polygon with its
holes, and walls join the two faces. Corners are shared, so the surface is closed by construction.
"""

import numpy as np
from numpy.typing import NDArray
from OCP.BRep import BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.gp import gp_Pln, gp_Pnt
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Wire
from scipy.spatial import cKDTree

from dftfs.cad.bulge_loop import BulgeLoop
from dftfs.cad.profile import chord_loop, outline_loops
from dftfs.cad.verify import require
from dftfs.errors import DesignError
from dftfs.spring.outline import SpringOutline

_COARSE = (1.0, 0.5)  # deflections in mm and rad: without effect on straight edges
_SAME_POINT_MM = 1e-6


def tessellate(
    outline: SpringOutline, width_m: float, tolerance_mm: float
) -> tuple[NDArray, NDArray]:
    """Closed triangulated surface of the solid, from z = 0 to z = width.

    Parameters
    ----------
    tolerance_mm : float
        Largest distance between a chord and the exact edge.

    Returns
    -------
    vertices_m : (n, 3) array
    triangles : (m, 3) int array
        Anticlockwise seen from outside.

    Raises
    ------
    DesignError
        If the width is not positive or the tolerance not between 1e-5 and 1 mm.
    CadError
        If the kernel cannot triangulate the face.
    """
    if not (np.isfinite(width_m) and width_m > 0):
        raise DesignError(f"width_mm = {width_m * 1e3:.6g} must be positive")
    loops = [chord_loop(name, edges, tolerance_mm * 1e-3) for name, edges in outline_loops(outline)]
    face = triangulate(loops)
    corners = np.concatenate([loop.vertices_m for loop in loops])
    count = len(corners)
    lower = np.column_stack([corners, np.zeros(count)])
    upper = np.column_stack([corners, np.full(count, width_m)])
    walls = np.concatenate(
        [_wall(first, len(loop.vertices_m), count) for first, loop in zip(_firsts(loops), loops)]
    )
    return np.concatenate([lower, upper]), np.concatenate([face[:, ::-1], face + count, walls])


def triangulate(loops: list[BulgeLoop]) -> NDArray:
    """Triangles (m, 3) of the polygon ``loops[0]`` less the others, over their vertices in order.

    Raises
    ------
    CadError
        If the kernel adds, drops or moves a vertex, or leaves a hole.
    """
    maker = BRepBuilderAPI_MakeFace(gp_Pln(), _wire(loops[0]))
    for loop in loops[1:]:
        maker.Add(_wire(loop))
    require(maker.IsDone(), "the section's face could not be built from its loops")
    face = maker.Face()
    BRepMesh_IncrementalMesh(face, _COARSE[0], False, _COARSE[1], False)
    mesh = BRep_Tool.Triangulation_s(face, TopLoc_Location())
    corners = 1e3 * np.concatenate([loop.vertices_m for loop in loops])
    expected = len(corners) + 2 * (len(loops) - 2)  # Euler: no vertex inside the face
    require(
        mesh is not None and mesh.NbTriangles() == expected,
        f"the section's face was not triangulated into {expected} triangles",
    )
    nodes = [mesh.Node(index + 1) for index in range(mesh.NbNodes())]
    distance, vertex = cKDTree(corners).query([(node.X(), node.Y()) for node in nodes])
    require(float(distance.max()) <= _SAME_POINT_MM, "the kernel moved a corner of the section")
    triangles = vertex[np.array([[t.Value(j) - 1 for j in (1, 2, 3)] for t in mesh.Triangles()])]
    a, b, c = np.moveaxis(corners[triangles], 1, 0)
    twice = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    return np.where((twice < 0)[:, None], triangles[:, ::-1], triangles)


def _wire(loop: BulgeLoop) -> TopoDS_Wire:
    polygon = BRepBuilderAPI_MakePolygon()
    for x, y in 1e3 * loop.vertices_m:
        polygon.Add(gp_Pnt(float(x), float(y), 0.0))
    polygon.Close()
    return polygon.Wire()


def _firsts(loops: list[BulgeLoop]) -> NDArray:
    return np.cumsum([0, *(len(loop.vertices_m) for loop in loops[:-1])])


def _wall(first: int, count: int, above: int) -> NDArray:
    """Two triangles per chord; the material lies to the left of travel, so they face right."""
    here = first + np.arange(count)
    ahead = first + (np.arange(count) + 1) % count
    return np.concatenate(
        [
            np.column_stack([here, ahead, ahead + above]),
            np.column_stack([here, ahead + above, here + above]),
        ]
    )
