"""Tolerances in a STEP file that programs can read (PMI after AP242): width, profile, datums.

Datum A is the lower face, B the bore. All other faces but the upper one are cut: they carry one
profile of a surface to A and B. The axial width is a distance of two faces with its limits.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import cadquery as cq
from OCP.StepShape import StepShape_ToleranceValue
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

from dftfs.cad.verify import require, require_close
from dftfs.errors import DesignError

_RTOL = 1e-9
_ACROSS = 0.9  # of a normal along z: the two end faces


@dataclass(frozen=True, kw_only=True)
class StepTolerances:
    """Of the axial width, either way, and the zone of the profile of all cut faces.

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
    """State width, profile and datums on the faces of the part, in the document's mm."""
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
    dimension = XCAFDoc_Dimension.Set_s(place)
    distance = dimension.GetObject()
    distance.SetType(DimensionType.XCAFDimTolObjects_DimensionType_Location_LinearDistance)
    distance.SetValue(1e3 * width_m)
    distance.SetLowerTolValue(-1e3 * tolerances.width_tolerance_m)
    distance.SetUpperTolValue(1e3 * tolerances.width_tolerance_m)
    dimension.SetObject(distance)
    zone = tool.AddGeomTolerance()
    tool.SetGeomTolerance(_sequence(*(labels[k] for k in cut)), zone)
    tolerance = XCAFDoc_GeomTolerance.Set_s(zone)
    profile = tolerance.GetObject()
    profile.SetType(ToleranceType.XCAFDimTolObjects_GeomToleranceType_ProfileOfSurface)
    profile.SetValue(1e3 * tolerances.profile_m)
    tolerance.SetObject(profile)
    for position, (name, face) in enumerate((("A", lower), ("B", bore)), start=1):
        _add_datum(tool, name, position, labels[face], zone)


def correct_limits(entities: Iterable[object]) -> None:
    """Name both limits of a width as lengths, the lower one negative: the kernel drops both."""
    for limits in _limits(entities):
        for bound, sign in ((limits.LowerBound(), -1), (limits.UpperBound(), 1)):
            bound.SetValueComponent(sign * abs(bound.ValueComponent()))
            bound.ValueComponentMember().SetName("LENGTH_MEASURE")


def _limits(entities: Iterable[object]) -> list[StepShape_ToleranceValue]:
    return [entity for entity in entities if isinstance(entity, StepShape_ToleranceValue)]


def check_tolerances(
    document: TDocStd_Document,
    entities: Iterable[object],
    width_m: float,
    tolerances: StepTolerances | None,
    what: str,
) -> None:
    """Compare what a file that was read states with what it must state.

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
    count = (0, 0, 0) if tolerances is None else (1, 1, 2)
    require(
        found == count, f"{what} states {found} and must state {count} widths, profiles, datums"
    )
    if tolerances is None:
        return
    width = XCAFDoc_Dimension.Set_s(dimensions.Value(1)).GetObject()
    either = 1e3 * tolerances.width_tolerance_m
    require_close(f"width_mm stated in {what}", width.GetValue(), 1e3 * width_m, _RTOL)
    (limits,) = _limits(entities)
    for side, bound, must in (
        ("lower", limits.LowerBound(), -either),
        ("upper", limits.UpperBound(), either),
    ):
        require_close(f"width's {side} limit in {what}", bound.ValueComponent(), must, _RTOL)
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
