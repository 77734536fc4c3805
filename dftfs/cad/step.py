"""STEP AP214 in millimetres: written, read back, and compared with the outline.

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
from OCP.StepBasic import StepBasic_Product
from OCP.STEPControl import (
    STEPControl_AsIs,
    STEPControl_Controller,
    STEPControl_Reader,
    STEPControl_Writer,
)
from OCP.TCollection import TCollection_HAsciiString
from OCP.TColStd import TColStd_SequenceOfAsciiString

from dftfs import __version__
from dftfs.cad.solid import check_solid, measure_solid
from dftfs.cad.verify import require
from dftfs.spring.outline import SpringOutline

_SCHEMA = "AUTOMOTIVE_DESIGN"  # the schema identifier of AP214


@dataclass(frozen=True, kw_only=True)
class StepCheck:
    """What the re-read STEP file differs by from the outline (relative), and its faces."""

    volume_error: float
    bounding_box_error: float
    faces: int


def write_step(
    solid: cq.Solid, path: Path, *, outline: SpringOutline, width_m: float, name: str
) -> StepCheck:
    """Write the solid as a STEP product called ``name``, read the file back and check it.

    Raises
    ------
    CadError
        If the file cannot be written or read by the kernel, or does not hold exactly one valid
        closed solid in mm under that name with the outline's volume and bounding box to 1e-6.
    """
    settings = {
        "write.step.schema": "AP214IS",
        "write.step.unit": "MM",
        "xstep.cascade.unit": "MM",
    }
    with _kernel_settings(settings):
        writer = STEPControl_Writer()
        done = writer.Transfer(solid.wrapped, STEPControl_AsIs)
        require(done == IFSelect_RetDone, f"the kernel could not translate {name} to STEP")
        called = TCollection_HAsciiString(name)
        for product in _products(writer.Model()):  # the kernel's own option appends a counter
            product.SetId(called)
            product.SetName(called)
        header = APIHeaderSection_MakeHeader(writer.Model())
        header.SetName(called)
        header.SetAuthorValue(1, TCollection_HAsciiString(""))
        header.SetOrganizationValue(1, TCollection_HAsciiString(""))
        header.SetOriginatingSystem(TCollection_HAsciiString(f"dftfs {__version__}"))
        done = writer.Write(str(path))
    require(done == IFSelect_RetDone, f"the kernel could not write {path.name}")
    return check_step(path, outline=outline, width_m=width_m, name=name)


def check_step(path: Path, *, outline: SpringOutline, width_m: float, name: str) -> StepCheck:
    """Read a STEP file and compare it with the outline and the name it was written from.

    Raises
    ------
    CadError
        As `write_step`.
    """
    what = f"STEP file {path.name}"
    header = path.read_text(encoding="ascii").split("ENDSEC;", 1)[0]
    require(_SCHEMA in header, f"{what} is not AP214")
    with _kernel_settings({"xstep.cascade.unit": "MM"}):
        reader = STEPControl_Reader()
        require(reader.ReadFile(str(path)) == IFSelect_RetDone, f"{what} cannot be read back")
        names = [product.Name().ToCString() for product in _products(reader.StepModel())]
        require(names == [name], f"{what} must hold the product {name} and not {names}")
        require(_length_units(reader) == {"millimetre"}, f"{what} is not in mm")
        reader.TransferRoots()
        require(reader.NbShapes() == 1, f"{what} must hold one shape, not {reader.NbShapes()}")
        shape = cq.Shape.cast(reader.OneShape())
    volume_error, box_error = check_solid(shape, outline, width_m, what)
    return StepCheck(
        volume_error=volume_error,
        bounding_box_error=box_error,
        faces=measure_solid(shape).faces,
    )


def _products(model: Interface_InterfaceModel) -> list[StepBasic_Product]:
    entities = (model.Value(index + 1) for index in range(model.NbEntities()))
    return [entity for entity in entities if isinstance(entity, StepBasic_Product)]


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
