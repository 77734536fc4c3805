"""The outline as one closed solid, from z = 0 to z = width, in mm.

Circles and straight edges are taken over exactly; each offset of the spiral becomes a quintic
B-spline through enough of its points that it lies within 1e-8 mm of the exact curve, with the
exact tangents at its ends. From cadquery and bd_warehouse: derive, build, then check the solid
against the numbers it was built from.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import cadquery as cq
import numpy as np
from numpy.typing import NDArray
from OCP.Bnd import Bnd_Box
from OCP.BRep import BRep_Tool
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge
from OCP.BRepGProp import BRepGProp
from OCP.Geom import Geom_BSplineCurve
from OCP.gp import gp_Ax2, gp_Circ, gp_Dir, gp_Pnt
from OCP.GProp import GProp_GProps
from OCP.TColgp import TColgp_Array1OfPnt
from OCP.TColStd import TColStd_Array1OfInteger, TColStd_Array1OfReal
from scipy.interpolate import BSpline, make_interp_spline

from dftfs.cad.verify import CadError, require, require_close
from dftfs.errors import DesignError
from dftfs.spring.edges import Arc, Edge, OffsetEdge, Segment
from dftfs.spring.outline import SpringOutline

SPLINE_TOLERANCE_MM = 1e-8
SOLID_RTOL = 1e-6
_DEGREE = 5
_MAX_INTERVALS = 8192
_CLUSTERING = 0.5  # points stand twice as close at an edge's ends, where the spline errs most


@dataclass(frozen=True, kw_only=True)
class SolidMeasure:
    """Volume (mm^3), bounding box (x, y, z sizes in mm), and topology of a shape."""

    volume_mm3: float
    bounding_box_mm: tuple[float, float, float]
    solids: int
    faces: int
    valid: bool
    closed: bool


def build_solid(outline: SpringOutline, width_m: float) -> cq.Solid:
    """The spring as one valid closed solid in mm, its lower face at z = 0, upper at the width.

    Raises
    ------
    DesignError
        If the width is not positive.
    CadError
        If the kernel's solid is not valid, not closed, or off the outline's volume or bounding
        box by more than 1e-6.
    """
    if not (np.isfinite(width_m) and width_m > 0):
        raise DesignError(f"width_mm = {width_m * 1e3:.6g} must be positive")
    outer = cq.Wire.assembleEdges([_arc(outline.rim_outer)])
    holes = [cq.Wire.assembleEdges([_arc(outline.bore)])]
    for loop in outline.coil_gaps:
        pieces = [piece for edge in loop for piece in smooth_pieces(edge)]
        holes.append(cq.Wire.assembleEdges([_edge(piece) for piece in pieces]))
    solid = cq.Solid.extrudeLinear(outer, holes, cq.Vector(0, 0, width_m * 1e3))
    check_solid(solid, outline, width_m, "the solid")
    return solid


def check_solid(
    shape: cq.Shape, outline: SpringOutline, width_m: float, what: str
) -> tuple[float, float]:
    """Relative errors of volume and bounding box of a shape that must be the outline's solid.

    Raises
    ------
    CadError
        If it is not one valid closed solid, or an error exceeds 1e-6.
    """
    found = measure_solid(shape)
    require(found.solids == 1, f"{what} must be one solid but has {found.solids}")
    require(found.valid and found.closed, f"{what} is not a valid closed solid")
    volume = outline.area_m2 * width_m * 1e9
    volume_error = require_close(f"volume_mm3 of {what}", found.volume_mm3, volume, SOLID_RTOL)
    across = 2e3 * outline.parameters.rim_outer_radius_m
    box_error = max(
        require_close(f"{axis} size in mm of {what}", size, expected, SOLID_RTOL)
        for axis, size, expected in zip(
            "xyz", found.bounding_box_mm, (across, across, width_m * 1e3), strict=True
        )
    )
    return volume_error, box_error


def measure_solid(shape: cq.Shape) -> SolidMeasure:
    """Volume, bounding box and topology from the exact geometry (no triangulation, no gap)."""
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape.wrapped, properties)
    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape.wrapped, box, False, False)
    box.SetGap(0.0)
    low, high = box.CornerMin(), box.CornerMax()
    shells = shape.Shells()
    return SolidMeasure(
        volume_mm3=properties.Mass(),
        bounding_box_mm=(high.X() - low.X(), high.Y() - low.Y(), high.Z() - low.Z()),
        solids=len(shape.Solids()),
        faces=len(shape.Faces()),
        valid=shape.isValid(),
        closed=bool(shells) and all(BRep_Tool.IsClosed_s(shell.wrapped) for shell in shells),
    )


def fit_spline(edge: OffsetEdge) -> BSpline:
    """Quintic B-spline (mm over mm) within 1e-8 mm of the edge, with its end tangents.

    Raises
    ------
    CadError
        If 8192 intervals are not enough.
    """
    intervals = 16
    while intervals <= _MAX_INTERVALS:
        spline = _interpolate(edge, intervals)
        between = _clustered((np.arange(8 * intervals) + 0.5) / (8 * intervals))
        gap = spline(between * edge.length_m * 1e3) - 1e3 * edge.point(between)
        if np.max(np.hypot(*gap.T)) <= SPLINE_TOLERANCE_MM:
            return spline
        intervals += intervals // 2
    raise CadError(
        f"edge {edge.name}: no B-spline of {_MAX_INTERVALS} intervals comes within"
        f" {SPLINE_TOLERANCE_MM:.0e} mm of it"
    )


def smooth_pieces(edge: Edge) -> list[Edge]:
    """The edge, cut where a profile's third derivative jumps: no spline converges across."""
    if not isinstance(edge, OffsetEdge):
        return [edge]
    low, high = sorted((edge.start, edge.end))
    breaks = [b for b in edge.breaks if low < b < high]
    ends = np.unique(np.round([low, *breaks, high], 12))
    ends[0], ends[-1] = low, high
    if edge.start > edge.end:
        ends = ends[::-1]
    return [replace(edge, start=float(a), end=float(b)) for a, b in pairwise(ends)]


def _clustered(s: NDArray) -> NDArray:
    return s - _CLUSTERING * np.sin(2 * np.pi * s) / (2 * np.pi)


def _interpolate(edge: OffsetEdge, intervals: int) -> BSpline:
    """Spline through points of the edge, with its end tangents and one knot less at each end."""
    t = _clustered(np.linspace(0.0, 1.0, intervals + 1))
    length = edge.length_m
    ends = np.array([0.0, 1.0])
    rate = abs(edge.end - edge.start) / length * edge.speed(edge.parameter(ends))
    tangents = rate[:, None] * edge.tangent(ends)
    u = t * length * 1e3
    knots = np.concatenate([np.full(_DEGREE + 1, u[0]), u[2:-2], np.full(_DEGREE + 1, u[-1])])
    return make_interp_spline(
        u,
        1e3 * edge.point(t),
        k=_DEGREE,
        t=knots,
        bc_type=([(1, tangents[0])], [(1, tangents[1])]),
    )


def _edge(edge: Edge) -> cq.Edge:
    if isinstance(edge, Arc):
        return _arc(edge)
    if isinstance(edge, Segment):
        return cq.Edge.makeLine(
            *(cq.Vector(*(1e3 * x for x in p), 0) for p in (edge.start_m, edge.end_m))
        )
    return _spline(fit_spline(edge))


def _arc(edge: Arc) -> cq.Edge:
    x, y = edge.centre_m
    circle = gp_Circ(gp_Ax2(gp_Pnt(1e3 * x, 1e3 * y, 0), gp_Dir(0, 0, 1)), 1e3 * edge.radius_m)
    angles = sorted((edge.start_rad, edge.end_rad))
    return cq.Edge(BRepBuilderAPI_MakeEdge(circle, *angles).Edge())


def _spline(spline: BSpline) -> cq.Edge:
    knots, multiplicities = np.unique(spline.t, return_counts=True)
    poles_occ = TColgp_Array1OfPnt(1, len(spline.c))
    for index, (x, y) in enumerate(spline.c, start=1):
        poles_occ.SetValue(index, gp_Pnt(float(x), float(y), 0.0))
    knots_occ = TColStd_Array1OfReal(1, len(knots))
    multiplicities_occ = TColStd_Array1OfInteger(1, len(knots))
    for index, (knot, count) in enumerate(zip(knots, multiplicities, strict=True), start=1):
        knots_occ.SetValue(index, float(knot))
        multiplicities_occ.SetValue(index, int(count))
    curve = Geom_BSplineCurve(poles_occ, knots_occ, multiplicities_occ, _DEGREE)
    return cq.Edge(BRepBuilderAPI_MakeEdge(curve).Edge())
