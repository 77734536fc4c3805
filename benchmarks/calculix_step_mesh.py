"""A mesh of a spring for CalculiX that owes the program nothing but its STEP file.

gmsh imports the file, takes its lower face, meshes the whole ring (unstructured quadrilaterals,
midside nodes on the curves of the file); the mesh is extruded through half the width.
The outline only names the boundary: which facets face each other across a gap between the coils.
"""

from dataclasses import dataclass
from pathlib import Path

import gmsh
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dftfs.design import SpringDesign
from dftfs.errors import MeshError
from dftfs.fem.mesh import TaggedMesh, extruded
from dftfs.spring.clearance import CEILING, FLOOR

_FRONTAL_DELAUNAY, _FULL_BLOSSOM = 6, 3  # gmsh's quads of "8, 3" leave corners of 6 degrees
_QUAD8 = 16  # gmsh's number of the eight-node quadrilateral
_SAMPLES = 2001  # of an edge of the outline: nearer to its own than to any other


@dataclass(frozen=True, kw_only=True)
class StepMeshSizing:
    """Elements across the strip, elements per fillet radius, layers through half the width."""

    across: float = 3.0
    fillet: float = 8.0
    growth: float = 0.3
    layers: int = 1


def step_ring(path: Path, design: SpringDesign, sizing: StepMeshSizing) -> TaggedMesh:
    """Hex20 mesh of the whole ring, half the width, from a STEP file in mm.

    Boundaries: ``bore``, ``rim_outer``; the fillets ``notch`` and ``slit`` of all arms; ``floor``
    and ``ceiling`` of all gaps between the coils; ``gap_floor`` and ``gap_ceiling`` of gap 0.
    ``bottom`` is the face that gmsh meshed: here the mid-plane.
    """
    gmsh.initialize(interruptible=False)
    try:
        curves = _opened(path)
        gmsh.model.mesh.setRecombine(2, gmsh.model.getEntities(2)[0][1])
        _grade(curves, design, sizing)
        gmsh.model.mesh.generate(2)
        nodes, cells, lines = _read(curves)
    except Exception as error:  # gmsh raises nothing more specific
        raise MeshError(f"gmsh could not mesh {path.name}: {error}") from None
    finally:
        gmsh.finalize()
    planar = TaggedMesh(nodes=nodes, cells=cells, boundaries=named_facets(design, nodes, lines))
    return extruded(planar, np.linspace(0, design.width_m / 2, sizing.layers + 1))


def _opened(path: Path) -> dict[int, float]:
    """The lower face alone in the model; its curves with their radii (infinite if not circles)."""
    options = {
        "General.Verbosity": 1,
        "General.NumThreads": 1,
        "Mesh.Algorithm": _FRONTAL_DELAUNAY,
        "Mesh.RecombinationAlgorithm": _FULL_BLOSSOM,
        "Mesh.ElementOrder": 2,
        "Mesh.SecondOrderIncomplete": 1,
        "Mesh.MeshSizeExtendFromBoundary": 0,
        "Mesh.MeshSizeFromPoints": 0,
    }
    for name, value in options.items():
        gmsh.option.setNumber(name, value)
    gmsh.option.setString("Geometry.OCCTargetUnit", "M")
    gmsh.model.occ.importShapes(str(path))
    gmsh.model.occ.synchronize()
    planes = [tag for _, tag in gmsh.model.getEntities(2) if gmsh.model.getType(2, tag) == "Plane"]
    low = min(planes, key=lambda tag: gmsh.model.occ.getCenterOfMass(2, tag)[2])
    gmsh.model.occ.remove([(3, tag) for _, tag in gmsh.model.getEntities(3)])
    gmsh.model.occ.remove([(2, t) for _, t in gmsh.model.getEntities(2) if t != low], True)
    gmsh.model.occ.synchronize()
    radii = {}
    for _, curve in gmsh.model.getBoundary([(2, low)], oriented=False):
        circle = gmsh.model.getType(1, curve) == "Circle"
        begin, end = (float(x[0]) for x in gmsh.model.getParametrizationBounds(1, curve))
        middle = [(begin + end) / 2]
        radii[curve] = 1 / gmsh.model.getCurvature(1, curve, middle)[0] if circle else np.inf
    return radii


def _grade(curves: dict[int, float], design: SpringDesign, sizing: StepMeshSizing) -> None:
    """Element size from the strip, smaller around every circle that is smaller than the strip."""
    spiral = design.spiral
    thinnest = min(
        spiral.thickness_range_m[0], spiral.rim_outer_radius_m - spiral.rim_inner_radius_m
    )
    coarse = thinnest / sizing.across
    fields = []
    add, number = gmsh.model.mesh.field.add, gmsh.model.mesh.field.setNumber
    for radius in sorted({round(r, 7) for r in curves.values() if r < thinnest}):
        fine = min(radius / sizing.fillet, coarse)
        around = add("Distance")
        chosen = [tag for tag, r in curves.items() if abs(r - radius) < 1e-6]
        gmsh.model.mesh.field.setNumbers(around, "CurvesList", chosen)
        number(around, "Sampling", 200)
        graded = add("MathEval")
        gmsh.model.mesh.field.setString(
            graded, "F", f"{fine:.9f} + {sizing.growth:.9f} * F{around}"
        )
        fields.append(graded)
    widest = add("MathEval")
    gmsh.model.mesh.field.setString(widest, "F", f"{coarse:.9f}")
    least = add("Min")
    gmsh.model.mesh.field.setNumbers(least, "FieldsList", [*fields, widest])
    gmsh.model.mesh.field.setAsBackgroundMesh(least)


def _read(curves: dict[int, float]) -> tuple[NDArray, NDArray, NDArray]:
    """Nodes (n, 2), cells (m, 8) and the facets (k, 3) of all curves, numbered from 0."""
    (_, face), *_ = gmsh.model.getEntities(2)
    kinds, _, found = gmsh.model.mesh.getElements(2, face)
    if list(kinds) != [_QUAD8]:
        raise RuntimeError(f"gmsh made elements of the kinds {list(kinds)}, not quad8 alone")
    cells = np.asarray(found[0], dtype=np.int64).reshape(-1, 8)
    tags, at, _ = gmsh.model.mesh.getNodes()
    used = np.unique(cells)
    position = dict(zip(tags.tolist(), at.reshape(-1, 3)[:, :2]))
    nodes = np.array([position[tag] for tag in used.tolist()])
    rows = np.concatenate([gmsh.model.mesh.getElements(1, curve)[2][0] for curve in curves])
    lines = np.searchsorted(used, rows.astype(np.int64).reshape(-1, 3))
    cells = np.searchsorted(used, cells)
    corner = nodes[cells[:, :4]]
    x, y = np.moveaxis(corner - np.roll(corner, 1, axis=1), -1, 0)
    clockwise = x[:, 0] * y[:, 1] - y[:, 0] * x[:, 1] < 0
    cells[clockwise] = cells[clockwise][:, [0, 3, 2, 1, 7, 6, 5, 4]]
    return nodes, cells.astype(np.int32), lines


def named_facets(
    design: SpringDesign, nodes: NDArray[np.float64], facets: NDArray[np.int64]
) -> dict[str, NDArray[np.int64]]:
    """Facets by what they are: bore and rim by their radius, the others by the nearest edge."""
    middle = nodes[facets[:, 2]]
    radius = np.hypot(*middle.T)
    bore = np.isclose(radius, design.spiral.bore_radius_m, rtol=1e-6)
    rim = np.isclose(radius, design.spiral.rim_outer_radius_m, rtol=1e-6)
    edges = [(edge, k) for k, loop in enumerate(design.outline.coil_gaps) for edge in loop]
    places = np.concatenate([edge.point(np.linspace(0, 1, _SAMPLES)) for edge, _ in edges])
    nearest = cKDTree(places).query(middle)[1] // _SAMPLES
    kind = np.array([edge.name.split(":")[0] for edge, _ in edges])[nearest]
    kind[bore | rim] = ""
    first = np.array([k == 0 for _, k in edges])[nearest]
    floor, ceiling = np.isin(kind, FLOOR), np.isin(kind, CEILING)
    return {
        "bore": facets[bore],
        "rim_outer": facets[rim],
        "notch": facets[np.isin(kind, ("notch_fillet", "foot_fillet"))],
        "slit": facets[np.isin(kind, ("slit_fillet", "tip_fillet"))],
        "floor": facets[floor],
        "ceiling": facets[ceiling],
        "gap_floor": facets[floor & first],
        "gap_ceiling": facets[ceiling & first],
    }
