"""Tolerances in a STEP file that programs can read (PMI after AP242): sizes, profile, datums.

Datum A is the lower face, B the bore. The bore is a diameter with the limits of H7: a profile to
B would tolerance the datum to itself. All other faces but the upper one are cut: they carry one
profile of a surface to A and B. The axial width is a distance of two faces with its limits.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import cadquery as cq
from OCP.StepShape import StepShape_PlusMinusTolerance, StepShape_ToleranceValue
from OCP.TCollection import TCollection_HAsciiString
from OCP.TDF import TDF_Label, TDF_LabelSequence
from OCP.TDocStd import TDocStd_Document
from OCP.XCAFDimTolObjects import XCAFDimTolObjects_DimensionType as DimensionType
from OCP.XCAFDimTolObjects import XCAFDimTolObjects_GeomToleranceType as ToleranceType
from OCP.XCAFDoc import (
    XCAFDoc_Datum,
    XCAFDoc_Dimension,
    XCAFDoc_DimTolTool,
    XCAFDoc_DocumentTool,
    XCAFDoc_GeomTolerance,
)

from dftfs.cad.fits import h7_m
from dftfs.cad.verify import require, require_close
from dftfs.errors import DesignError

_RTOL = 1e-9
_ACROSS = 0.9  # of a normal along z: the two end faces
_WIDTH = DimensionType.XCAFDimTolObjects_DimensionType_Location_LinearDistance
_DIAMETER = DimensionType.XCAFDimTolObjects_DimensionType_Size_Diameter


@dataclass(frozen=True, kw_only=True)
class StepTolerances:
    """Of the axial width, either way, and the zone of the profile of all cut faces but the bore.

    Raises
    ------
    DesignError
        If one is not positive.
    """

    width_tolerance_m: float
    profile_m: float

    def __post_init__(self) -> None:
        for name in ("width_tolerance_m", "profile_m"):
            if not 0 < getattr(self, name) < float("inf"):
                raise DesignError(f"{name} = {getattr(self, name)} must be positive")


def add_tolerances(
    document: TDocStd_Document,
    part: TDF_Label,
    solid: cq.Solid,
    width_m: float,
    tolerances: StepTolerances,
) -> None:
    """State width, bore, profile and datums on the faces of the part, in the document's mm."""
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    tool = XCAFDoc_DocumentTool.DimTolTool_s(document.Main())
    faces = solid.Faces()
    labels = [shapes.AddSubShape(part, face.wrapped) for face in faces]
    ends = [k for k, face in enumerate(faces) if _is_end(face)]
    lower, upper = sorted(ends, key=lambda k: faces[k].Center().z)
    cut = [k for k in range(len(faces)) if k not in ends]
    bore = min(cut, key=lambda k: (not _is_whole_cylinder(faces[k]), faces[k].Area()))
    place = tool.AddDimension()
    tool.SetDimension(_sequence(labels[lower]), _sequence(labels[upper]), place)
    width = tolerances.width_tolerance_m
    _state_size(place, _WIDTH, width_m, -width, width)
    place = tool.AddDimension()
    tool.SetDimension(labels[bore], place)
    diameter_m = 2e-3 * next(e for e in faces[bore].Edges() if e.geomType() == "CIRCLE").radius()
    _state_size(place, _DIAMETER, diameter_m, 0.0, h7_m(diameter_m))
    zone = tool.AddGeomTolerance()
    tool.SetGeomTolerance(_sequence(*(labels[k] for k in cut if k != bore)), zone)
    tolerance = XCAFDoc_GeomTolerance.Set_s(zone)
    profile = tolerance.GetObject()
    profile.SetType(ToleranceType.XCAFDimTolObjects_GeomToleranceType_ProfileOfSurface)
    profile.SetValue(1e3 * tolerances.profile_m)
    tolerance.SetObject(profile)
    for position, (name, face) in enumerate((("A", lower), ("B", bore)), start=1):
        _add_datum(tool, name, position, labels[face], zone)


def _state_size(
    place: TDF_Label, kind: DimensionType, size_m: float, lower_m: float, upper_m: float
) -> None:
    """Give a dimension its kind, its size and how far below and above it the part may lie."""
    dimension = XCAFDoc_Dimension.Set_s(place)
    stated = dimension.GetObject()
    stated.SetType(kind)
    stated.SetValue(1e3 * size_m)
    stated.SetLowerTolValue(1e3 * lower_m)
    stated.SetUpperTolValue(1e3 * upper_m)
    dimension.SetObject(stated)


def correct_limits(entities: Iterable[object]) -> None:
    """Name both limits of a size as lengths, the lower one not positive: the kernel drops both."""
    for limits in entities:
        if not isinstance(limits, StepShape_ToleranceValue):
            continue
        for bound, sign in ((limits.LowerBound(), -1), (limits.UpperBound(), 1)):
            bound.SetValueComponent(sign * abs(bound.ValueComponent()) + 0.0)  # no -0
            bound.ValueComponentMember().SetName("LENGTH_MEASURE")


def _limits(entities: Iterable[object]) -> dict[DimensionType, tuple[float, float]]:
    """Lower and upper limit in mm of the distance and of the diameter that a file states."""
    found = {}
    for entity in entities:
        if isinstance(entity, StepShape_PlusMinusTolerance):
            value = entity.Range().ToleranceValue()
            kind = _DIAMETER if entity.TolerancedDimension().DimensionalSize() else _WIDTH
            found[kind] = tuple(
                bound.ValueComponent() for bound in (value.LowerBound(), value.UpperBound())
            )
    return found


def check_tolerances(
    document: TDocStd_Document,
    entities: Iterable[object],
    sizes_m: tuple[float, float],
    tolerances: StepTolerances | None,
    what: str,
) -> None:
    """Compare what a file that was read states with what it must state.

    ``sizes_m`` : width and bore.

    Raises
    ------
    CadError
        If a tolerance, a datum or the faces of the profile differ, or are there unasked.
    """
    tool = XCAFDoc_DocumentTool.DimTolTool_s(document.Main())
    dimensions, zones, datums = (TDF_LabelSequence() for _ in range(3))
    tool.GetDimensionLabels(dimensions)
    tool.GetGeomToleranceLabels(zones)
    tool.GetDatumLabels(datums)
    found = dimensions.Length(), zones.Length(), datums.Length()
    count = (0, 0, 0) if tolerances is None else (2, 1, 2)
    require(found == count, f"{what} states {found} and must state {count} sizes, profiles, datums")
    if tolerances is None:
        return
    either, limits = tolerances.width_tolerance_m, _limits(entities)
    must = {
        _WIDTH: ("width", sizes_m[0], -either, either),
        _DIAMETER: ("bore", sizes_m[1], 0.0, h7_m(sizes_m[1])),
    }
    for k in (1, 2):
        found = XCAFDoc_Dimension.Set_s(dimensions.Value(k)).GetObject()
        require(found.GetType() in must, f"{what} states a size that is neither width nor bore")
        name, size_m, *bounds_m = must.pop(found.GetType())
        require_close(f"{name}_mm stated in {what}", found.GetValue(), 1e3 * size_m, _RTOL)
        for side, is_mm, bound_m in zip(("lower", "upper"), limits[found.GetType()], bounds_m):
            # of the size: a limit of zero has no relative error
            is_at, must_at = 1e3 * size_m + is_mm, 1e3 * (size_m + bound_m)
            require_close(f"{name}'s {side} limit in {what}", is_at, must_at, _RTOL)
    profile = XCAFDoc_GeomTolerance.Set_s(zones.Value(1)).GetObject().GetValue()
    require_close(f"profile_mm stated in {what}", profile, 1e3 * tolerances.profile_m, _RTOL)
    names = [XCAFDoc_Datum.Set_s(datums.Value(k)).GetObject().GetName().ToCString() for k in (1, 2)]
    require(sorted(names) == ["A", "B"], f"{what} has the datums {names} and must have A and B")


def _add_datum(
    tool: XCAFDoc_DimTolTool, name: str, position: int, face: TDF_Label, zone: TDF_Label
) -> None:
    place = tool.AddDatum()
    tool.SetDatum(_sequence(face), place)
    datum = XCAFDoc_Datum.Set_s(place)
    stated = datum.GetObject()
    stated.SetName(TCollection_HAsciiString(name))
    stated.SetPosition(position)
    datum.SetObject(stated)
    tool.SetDatumToGeomTol(place, zone)


def _is_end(face: cq.Face) -> bool:
    return face.geomType() == "PLANE" and abs(face.normalAt().z) > _ACROSS


def _is_whole_cylinder(face: cq.Face) -> bool:
    """Bore or rim: two circles and one seam around it."""
    return face.geomType() == "CYLINDER" and len(face.Wires()[0].Edges()) == 3


def _sequence(*labels: TDF_Label) -> TDF_LabelSequence:
    sequence = TDF_LabelSequence()
    for label in labels:
        sequence.Append(label)
    return sequence
