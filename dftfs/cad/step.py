"""STEP AP242 in millimetres, with material and author: written, read back, and compared.

The kernel keeps its writer's options in process-wide variables; they are set for the one write
and put back.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import cadquery as cq
from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
from OCP.IFSelect import IFSelect_RetDone
from OCP.Interface import Interface_InterfaceModel, Interface_Static
from OCP.StepBasic import (
    StepBasic_DerivedUnit,
    StepBasic_Product,
    StepBasic_SiUnitAndMassUnit,
)
from OCP.STEPCAFControl import STEPCAFControl_Reader, STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_AsIs, STEPControl_Controller, STEPControl_Reader
from OCP.TCollection import TCollection_ExtendedString, TCollection_HAsciiString
from OCP.TColStd import TColStd_SequenceOfAsciiString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_LabelSequence
from OCP.TDocStd import TDocStd_Document
from OCP.XCAFApp import XCAFApp_Application
from OCP.XCAFDoc import XCAFDoc_DocumentTool, XCAFDoc_Material, XCAFDoc_ShapeTool

from dftfs import __version__
from dftfs.cad.solid import check_solid, measure_solid
from dftfs.cad.step_tolerances import (
    StepTolerances,
    add_tolerances,
    check_tolerances,
    correct_limits,
)
from dftfs.cad.verify import CadError, require, require_close
from dftfs.errors import DesignError
from dftfs.spring.outline import SpringOutline

_SCHEMA = "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING"  # the schema identifier of AP242
_G_PER_CM3 = 1e3  # the kernel's unit of density, in kg/m3
_DENSITY_RTOL = 1e-12


@dataclass(frozen=True, kw_only=True)
class StepLabels:
    """What a STEP file says of a part beside its shape.

    Parameters
    ----------
    author : str
        Empty where nobody is named.
    tolerances : StepTolerances or None
        Stated on the faces where there are any.

    Raises
    ------
    DesignError
        If the material has no name, the density is not positive, or a text is not one line.
    """

    material: str
    density_kg_per_m3: float
    author: str = ""
    tolerances: StepTolerances | None = None

    def __post_init__(self) -> None:
        for field, text in (("material", self.material), ("author", self.author)):
            if not text.isprintable() or "\\" in text:
                raise DesignError(
                    f"{field} = {text!r} must be one line of printable characters without \\,"
                    " for example 'J. Smith'"
                )
        if not self.material:
            raise DesignError("material = '' must be a name, for example 'al-7075-t6'")
        if not 0 < self.density_kg_per_m3 < float("inf"):
            raise DesignError(f"density_kg_per_m3 = {self.density_kg_per_m3} must be positive")


@dataclass(frozen=True, kw_only=True)
class StepCheck:
    """What the re-read STEP file differs by from the outline (relative), and its faces."""

    volume_error: float
    bounding_box_error: float
    faces: int


def write_step(
    solid: cq.Solid,
    path: Path,
    *,
    outline: SpringOutline,
    width_m: float,
    name: str,
    labels: StepLabels,
) -> StepCheck:
    """Write the solid as a STEP product called ``name``, read the file back and check it.

    Raises
    ------
    CadError
        If the file cannot be written or read by the kernel, or does not hold exactly one valid
        closed solid in mm under that name with the outline's volume and bounding box to 1e-6, the
        material with its density, the author and the tolerances.
    """
    settings = {
        "write.step.schema": "AP242DIS",
        "write.step.unit": "MM",
        "xstep.cascade.unit": "MM",
    }
    with _kernel_settings(settings):
        writer = STEPCAFControl_Writer()
        writer.SetMaterialMode(True)
        writer.SetDimTolMode(True)
        done = writer.Transfer(_document(solid, width_m, name, labels), STEPControl_AsIs)
        require(done, f"the kernel could not translate {name} to STEP")
        model = writer.Writer().Model()
        _correct_density_units(model)
        correct_limits(_entities(model))
        header = APIHeaderSection_MakeHeader(model)
        header.SetName(TCollection_HAsciiString(name))
        header.SetAuthorValue(1, _encoded(labels.author))
        header.SetOrganizationValue(1, TCollection_HAsciiString(""))
        header.SetOriginatingSystem(TCollection_HAsciiString(f"dftfs {__version__}"))
        done = writer.Write(str(path))
    require(done == IFSelect_RetDone, f"the kernel could not write {path.name}")
    return check_step(path, outline=outline, width_m=width_m, name=name, labels=labels)


def check_step(
    path: Path, *, outline: SpringOutline, width_m: float, name: str, labels: StepLabels
) -> StepCheck:
    """Read a STEP file and compare it with what it was written from.

    Raises
    ------
    CadError
        As `write_step`.
    """
    what = f"STEP file {path.name}"
    text = path.read_text(encoding="ascii")
    require(_SCHEMA in text.split("ENDSEC;", 1)[0], f"{what} is not AP242")
    with _kernel_settings({"xstep.cascade.unit": "MM"}):
        caf_reader = STEPCAFControl_Reader()
        caf_reader.SetMatMode(True)
        caf_reader.SetGDTMode(True)
        require(caf_reader.ReadFile(str(path)) == IFSelect_RetDone, f"{what} cannot be read back")
        reader = caf_reader.ChangeReader()
        names = [product.Name().ToCString() for product in _products(reader.StepModel())]
        require(names == [name], f"{what} must hold the product {name} and not {names}")
        require(_length_units(reader) == {"millimetre"}, f"{what} is not in mm")
        document = _empty_document()
        require(caf_reader.Transfer(document), f"{what} cannot be translated")
        shapes = TDF_LabelSequence()
        XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).GetFreeShapes(shapes)
        require(shapes.Length() == 1, f"{what} must hold one shape, not {shapes.Length()}")
        shape = cq.Shape.cast(XCAFDoc_ShapeTool.GetShape_s(shapes.Value(1)))
        found = _labels(document, reader.StepModel(), what)
        stated = _entities(reader.StepModel())
        sizes = width_m, 2 * outline.parameters.bore_radius_m
        check_tolerances(document, stated, sizes, labels.tolerances, what)
    for field in ("material", "author"):
        is_, must = getattr(found, field), getattr(labels, field)
        require(is_ == must, f"{what} has the {field} {is_!r} and must have {must!r}")
    density = found.density_kg_per_m3
    require_close(f"density of {what}", density, labels.density_kg_per_m3, _DENSITY_RTOL)
    volume_error, box_error = check_solid(shape, outline, width_m, what)
    return StepCheck(
        volume_error=volume_error,
        bounding_box_error=box_error,
        faces=measure_solid(shape).faces,
    )


def _empty_document() -> TDocStd_Document:
    document = TDocStd_Document(TCollection_ExtendedString("MDTV-XCAF"))
    XCAFApp_Application.GetApplication_s().InitDocument(document)
    return document


def _document(solid: cq.Solid, width_m: float, name: str, labels: StepLabels) -> TDocStd_Document:
    """The solid as one part of that name and material, with its tolerances."""
    document = _empty_document()
    part = XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).AddShape(solid.wrapped, False)
    TDataStd_Name.Set_s(part, TCollection_ExtendedString(name))
    XCAFDoc_DocumentTool.MaterialTool_s(document.Main()).SetMaterial(
        part,
        _encoded(labels.material),
        TCollection_HAsciiString(""),
        labels.density_kg_per_m3 / _G_PER_CM3,
        TCollection_HAsciiString("density measure"),
        TCollection_HAsciiString("POSITIVE_RATIO_MEASURE"),
    )
    if labels.tolerances is not None:
        add_tolerances(document, part, solid, width_m, labels.tolerances)
    return document


def _correct_density_units(model: Interface_InterfaceModel) -> None:
    """Give the density g cm^-3: the kernel writes g^3 cm^2 and ignores the powers on reading."""
    for entity in _entities(model):
        if isinstance(entity, StepBasic_DerivedUnit):
            for index in range(1, entity.NbElements() + 1):
                element = entity.ElementsValue(index)
                mass = isinstance(element.Unit(), StepBasic_SiUnitAndMassUnit)
                element.SetExponent(1.0 if mass else -3.0)


def _labels(document: TDocStd_Document, model: Interface_InterfaceModel, what: str) -> StepLabels:
    """What a file that was read says of its part; one that says less or more is refused."""
    labels = TDF_LabelSequence()
    XCAFDoc_DocumentTool.MaterialTool_s(document.Main()).GetMaterialLabels(labels)
    require(labels.Length() == 1, f"{what} must state one material, not {labels.Length()}")
    material = XCAFDoc_Material()
    labels.Value(1).FindAttribute(XCAFDoc_Material.GetID_s(), material)
    try:
        return StepLabels(
            material=material.GetName().ToCString(),
            density_kg_per_m3=material.GetDensity() * _G_PER_CM3,
            author=APIHeaderSection_MakeHeader(model).AuthorValue(1).ToCString(),
        )
    except DesignError as error:
        raise CadError(f"{what}: {error}") from None


def _encoded(text: str) -> TCollection_HAsciiString:
    """A text in the characters of ISO 10303-21: what is not ASCII by its code in hexadecimal."""
    return TCollection_HAsciiString(
        "".join(c if c.isascii() else f"\\X4\\{ord(c):08X}\\X0\\" for c in text)
    )


def _products(model: Interface_InterfaceModel) -> list[StepBasic_Product]:
    return [entity for entity in _entities(model) if isinstance(entity, StepBasic_Product)]


def _entities(model: Interface_InterfaceModel) -> Iterator[object]:
    return (model.Value(index + 1) for index in range(model.NbEntities()))


def _length_units(reader: STEPControl_Reader) -> set[str]:
    lengths, angles, solid_angles = (TColStd_SequenceOfAsciiString() for _ in range(3))
    reader.FileUnits(lengths, angles, solid_angles)
    return {lengths.Value(index).ToCString() for index in range(1, lengths.Length() + 1)}


@contextmanager
def _kernel_settings(settings: dict[str, str]) -> Iterator[None]:
    STEPControl_Controller.Init_s()  # until then the variables do not exist
    before = {key: Interface_Static.CVal_s(key) for key in settings}
    try:
        for key, value in settings.items():
            require(Interface_Static.SetCVal_s(key, value), f"the kernel refuses {key} = {value}")
        yield
    finally:
        for key, value in before.items():
            Interface_Static.SetCVal_s(key, value)
