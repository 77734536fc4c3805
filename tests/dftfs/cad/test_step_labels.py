"""A STEP file states material, density, author and tolerances so that another reader finds them."""

import re
from dataclasses import replace

import cadquery as cq
import numpy as np
import pytest
from OCP.APIHeaderSection import APIHeaderSection_MakeHeader
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDF import TDF_LabelSequence
from OCP.TDocStd import TDocStd_Document
from OCP.XCAFApp import XCAFApp_Application
from OCP.XCAFDoc import (
    XCAFDoc_DimTolTool,
    XCAFDoc_DocumentTool,
    XCAFDoc_MaterialTool,
    XCAFDoc_ShapeTool,
)

from dftfs.cad.solid import build_solid
from dftfs.cad.step import StepLabels, check_step, write_step
from dftfs.cad.step_tolerances import StepTolerances
from dftfs.cad.verify import CadError
from dftfs.cli.main import main
from dftfs.design import load_design
from dftfs.errors import DesignError

pytestmark = pytest.mark.needs_cad  # the module imports the kernel

LABELS = StepLabels(material="al-7075-t6", density_kg_per_m3=2810.0, author="J. O'Brien")


@pytest.fixture(scope="module")
def part():
    """What `write_step` takes but the labels, and a solid."""
    design = load_design("al1")
    expected = {"outline": design.outline, "width_m": design.width_m, "name": "al1"}
    return build_solid(design.outline, design.width_m), expected


@pytest.fixture(scope="module")
def written(part, tmp_path_factory):
    solid, expected = part
    path = tmp_path_factory.mktemp("step") / "al1.step"
    write_step(solid, path, **expected, labels=LABELS)
    return path


def entities(path):
    """Number to type and arguments of every entity of a Part 21 file, without the kernel."""
    data = re.sub(r"\s*\n\s*", "", path.read_text().split("DATA;", 1)[1])
    return {n: (kind, rest) for n, kind, rest in re.findall(r"#(\d+) = (\w+)\((.*?)\);", data)}


def of_kind(found, kind):
    return {number: rest for number, (name, rest) in found.items() if name == kind}


def test_the_file_is_ap242_by_its_header(written):
    header = written.read_text().split("ENDSEC;", 1)[0]
    assert "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF {1 0 10303 442 1 1 4 }" in header
    assert "AUTOMOTIVE_DESIGN" not in header
    assert "'J. O''Brien'" in header


def test_material_and_density_in_g_per_cm3_are_properties_of_the_one_product(written):
    found = entities(written)
    (definition,) = of_kind(found, "PRODUCT_DEFINITION")
    properties = of_kind(found, "PROPERTY_DEFINITION")
    stated = {rest.split("'")[3]: rest.rsplit("#", 1)[1] for rest in properties.values()}
    assert stated == {"material name": definition, "density": definition}
    (name,) = of_kind(found, "DESCRIPTIVE_REPRESENTATION_ITEM").values()
    assert name == "'al-7075-t6',''"
    (density,) = of_kind(found, "MEASURE_REPRESENTATION_ITEM").values()
    assert "POSITIVE_RATIO_MEASURE(2.81)" in density
    powers = [rest.split(",") for rest in of_kind(found, "DERIVED_UNIT_ELEMENT").values()]
    text = written.read_text()
    by_unit = {
        re.search(rf"^{unit} = .*?SI_UNIT\(([^)]*)\)", text, re.M).group(1): float(power)
        for unit, power in powers
    }
    assert by_unit == {"$,.GRAM.": 1.0, ".CENTI.,.METRE.": -3.0}


def read_labels(path):
    """Density of the free shape in kg/mm^3 and the author, by the kernel's own reader."""
    document = TDocStd_Document(TCollection_ExtendedString("MDTV-XCAF"))
    XCAFApp_Application.GetApplication_s().InitDocument(document)
    reader = STEPCAFControl_Reader()
    reader.SetMatMode(True)
    reader.ReadFile(str(path))
    reader.Transfer(document)
    shapes = TDF_LabelSequence()
    XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).GetFreeShapes(shapes)
    header = APIHeaderSection_MakeHeader(reader.ChangeReader().StepModel())
    density = XCAFDoc_MaterialTool.GetDensityForShape_s(shapes.Value(1))
    return density, header.AuthorValue(1).ToCString()


def test_the_kernels_reader_finds_the_density_on_the_shape_and_the_author(written):
    density, author = read_labels(written)
    assert density == pytest.approx(2.81e-3, rel=1e-12)  # g/mm^3: with mm^3 it gives grams
    assert author == "J. O'Brien"


@pytest.mark.parametrize("author", ["", "Jürgen Müller", "山田 太郎", "a 🙂 b", "x" * 200])
def test_authors_of_any_script_are_found_again(part, tmp_path, author):
    solid, expected = part
    labels = StepLabels(material="stål", density_kg_per_m3=7850.0, author=author)
    path = tmp_path / "al1.step"
    write_step(solid, path, **expected, labels=labels)
    assert path.read_text(encoding="ascii").startswith("ISO-10303-21;")
    assert read_labels(path)[1] == author


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"material": "ti-grade-2"}, "has the material 'al-7075-t6' and must have 'ti-grade-2'"),
        ({"density_kg_per_m3": 2810.001}, r"density of .* is 2810 and must be 2810\.001"),
        ({"author": "J. Brien"}, "has the author"),
    ],
)
def test_the_check_refuses_other_labels(part, written, changes, message):
    values = {name: getattr(LABELS, name) for name in ("material", "density_kg_per_m3", "author")}
    with pytest.raises(CadError, match=message):
        check_step(written, **part[1], labels=StepLabels(**{**values, **changes}))


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (("AP242_MANAGED", "AP999_MANAGED"), "is not AP242"),
        ((r"\n#\d+ = PROPERTY_DEFINITION.*", ""), "must state one material, not 0"),
    ],
)
def test_the_check_refuses_another_schema_and_a_file_without_material(
    part, written, tmp_path, spoil, message
):
    path = tmp_path / "al1.step"
    path.write_text(re.sub(*spoil, written.read_text()))
    with pytest.raises(CadError, match=message):
        check_step(path, **part[1], labels=LABELS)


@pytest.mark.parametrize(
    "changes",
    [
        {"author": "two\nlines"},
        {"author": "a\\X2\\0041\\X0\\"},
        {"material": ""},
        {"material": "al\t7075"},
        {"density_kg_per_m3": float("nan")},
        {"density_kg_per_m3": -1.0},
    ],
)
def test_labels_that_a_file_cannot_state_are_refused_in_one_line(changes):
    values = {"material": "x", "density_kg_per_m3": 1.0, **changes}
    with pytest.raises(DesignError, match=r"must be") as caught:
        StepLabels(**values)
    assert "\n" not in str(caught.value)


def test_export_and_parts_name_material_and_author(tmp_path, capsys):
    design = load_design("al2")
    expected = {"outline": design.outline, "width_m": design.width_m, "name": "al2"}
    labels = StepLabels(
        material=design.material.name,
        density_kg_per_m3=design.material.density_kg_per_m3,
        author="A. Smith",
    )
    folder = ["--out", str(tmp_path), "--author", "A. Smith"]
    assert main(["export", "al2", "--formats", "step", *folder]) == 0
    check_step(tmp_path / "al2.step", **expected, labels=labels)
    assert main(["parts", "al2", "--force", *folder]) == 0
    check_step(tmp_path / "al2.step", **expected, labels=labels)
    assert main(["export", "al2", "--force", "--out", str(tmp_path), "--author", "a\nb"]) == 2
    assert "author = 'a\\nb' must be one line" in capsys.readouterr().err


TOLERANCES = StepTolerances(width_tolerance_m=5e-5, profile_m=6e-5)


@pytest.fixture(scope="module")
def toleranced(part, tmp_path_factory):
    solid, expected = part
    path = tmp_path_factory.mktemp("step") / "al1.step"
    labels = replace(LABELS, tolerances=TOLERANCES)
    write_step(solid, path, **expected, labels=labels)
    return path


def test_limits_of_width_and_bore_profile_and_datums_are_in_the_file_as_part_21_text(toleranced):
    text = re.sub(r"\s*\n\s*", "", toleranced.read_text())
    limits = [
        tuple(
            re.search(rf"#{number} = MEASURE_WITH_UNIT\(LENGTH_MEASURE\((\S+?)\),", text).group(1)
            for number in pair
        )
        for pair in re.findall(r"TOLERANCE_VALUE\(#(\d+),#(\d+)\)", text)
    ]
    assert sorted(limits) == [("-5.E-02", "5.E-02"), ("0.", "2.1E-02")]  # H7 of 21.36 mm
    assert "POSITIVE_LENGTH_MEASURE(7.34)" in text
    assert "POSITIVE_LENGTH_MEASURE(21.36)" in text
    assert text.count("SURFACE_PROFILE_TOLERANCE()") == 1
    assert text.count("PLUS_MINUS_TOLERANCE(") == 2
    assert re.search(r"DIMENSIONAL_SIZE\(#\d+,'diameter'\)", text)
    assert re.findall(r"= DATUM\('','',#\d+,\.F\.,'(\w)'\)", text) == ["A", "B"]


def test_the_kernels_reader_finds_the_profile_on_every_cut_face_but_the_bore(part, toleranced):
    document = TDocStd_Document(TCollection_ExtendedString("MDTV-XCAF"))
    XCAFApp_Application.GetApplication_s().InitDocument(document)
    reader = STEPCAFControl_Reader()
    reader.SetGDTMode(True)
    reader.ReadFile(str(toleranced))
    reader.Transfer(document)
    zones, faces, none = (TDF_LabelSequence() for _ in range(3))
    XCAFDoc_DocumentTool.DimTolTool_s(document.Main()).GetGeomToleranceLabels(zones)
    XCAFDoc_DimTolTool.GetRefShapeLabel_s(zones.Value(1), faces, none)
    assert faces.Length() == len(part[0].Faces()) - 3  # two ends, and the datum of the profile
    bore = 2 * np.pi * 10.68 * 7.34
    for k in range(1, faces.Length() + 1):
        face = cq.Shape.cast(XCAFDoc_ShapeTool.GetShape_s(faces.Value(k)))
        assert face.Area() != pytest.approx(bore, rel=1e-6)


@pytest.mark.parametrize(
    ("must", "message"),
    [
        (None, r"states \(2, 1, 2\) and must state \(0, 0, 0\)"),
        (replace(TOLERANCES, width_tolerance_m=6e-5), "width's lower limit"),
        (replace(TOLERANCES, profile_m=7e-5), "profile_mm stated"),
    ],
)
def test_the_check_refuses_other_tolerances(part, toleranced, must, message):
    with pytest.raises(CadError, match=message):
        check_step(toleranced, **part[1], labels=replace(LABELS, tolerances=must))


def test_the_check_refuses_another_bore_and_its_limits(part, toleranced, tmp_path):
    text = toleranced.read_text()
    for old, new, message in (
        ("(21.36)", "(21.37)", "bore_mm stated"),
        ("(2.1E-02)", "(2.5E-02)", "bore's upper limit"),
    ):
        assert old in text
        path = tmp_path / "al1.step"
        path.write_text(text.replace(old, new))
        with pytest.raises(CadError, match=message):
            check_step(path, **part[1], labels=replace(LABELS, tolerances=TOLERANCES))


def test_a_file_without_the_tolerances_asked_for_is_refused(part, written):
    with pytest.raises(CadError, match=r"states \(0, 0, 0\) and must state \(2, 1, 2\)"):
        check_step(written, **part[1], labels=replace(LABELS, tolerances=TOLERANCES))


@pytest.mark.parametrize("number", [0.0, -1e-5, float("nan"), float("inf")])
def test_a_tolerance_that_is_none_is_refused(number):
    with pytest.raises(DesignError, match=r"profile_m = .* must be positive"):
        StepTolerances(width_tolerance_m=5e-5, profile_m=number)
