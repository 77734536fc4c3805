"""`dftfs deliver` packs what a shop needs, its drawing toleranced so that the stiffness holds."""

import csv
import io
import json
import zipfile
from dataclasses import replace

import pytest

from dftfs.analysis.study.delivery import packed
from dftfs.cad.drawing import write_drawing
from dftfs.cad.drawing_notes import edge_break_mm, notes
from dftfs.cad.drawing_sheet import SHEETS_MM, BoltCircle, ShopData, chosen_sheet
from dftfs.cli.main import main
from dftfs.design import load_design
from dftfs.errors import DesignError
from rsea_core import read_spring_curve

pytestmark = pytest.mark.needs_cad


def scaled(factor: float, width: float):
    """Al1 with every length of the plane times a factor."""
    names = ("inner_radius", "outer_radius", "thickness", "fillet_radius", "tip_radius")
    names += ("bore_radius", "hub_radius", "rim_inner_radius", "rim_outer_radius")
    p = load_design("al1").spiral
    changes = {f"{name}_mm": repr(1e3 * factor * getattr(p, f"{name}_m")) for name in names}
    return load_design("al1", {**changes, "width_mm": repr(width), "name": f"x{factor:g}"})


@pytest.mark.parametrize(
    ("factor", "width", "sheet", "scale"),
    [
        (0.1, 2.0, "A3", 10.0),
        (1.0, 7.34, "A3", 1.0),
        (2.2, 20.0, "A3", 0.2),
        (5.0, 30.0, "A3", 0.2),
    ],
)
def test_a_part_of_any_size_fits_its_sheet_and_measures_true(tmp_path, factor, width, sheet, scale):
    design = scaled(factor, width)
    chosen = chosen_sheet(design, None, None)
    assert chosen.name == sheet
    made = write_drawing(design, tmp_path, design_hash="0" * 12, sheet=chosen)
    rim = 2e3 * design.spiral.rim_outer_radius_m
    assert made.measured_mm["rim outside diameter"] == pytest.approx(rim, rel=1e-9)
    assert made.measured_mm["width"] == pytest.approx(width, rel=1e-9)
    reach, (x, y) = chosen.scale * rim / 2, chosen.front_mm
    assert x - reach > 10
    assert x + reach < chosen.side_mm
    assert 10 < y - reach < y + reach < SHEETS_MM[chosen.name][1] - 10


def test_what_does_not_fit_is_refused_in_one_line():
    design = load_design("al1")
    with pytest.raises(DesignError, match="a smaller --scale or a larger --sheet"):
        chosen_sheet(design, "A4", 1.0)
    with pytest.raises(DesignError, match="no standard scale; known are 10:1"):
        chosen_sheet(design, None, 0.7)
    with pytest.raises(DesignError, match="leave its ring"):
        BoltCircle(where="rim", count=6, hole_m=3e-3, circle_m=150e-3).check(design)


def test_the_same_content_is_the_same_zip():
    assert packed({"b": b"1", "a": b"2"}) == packed({"a": b"2", "b": b"1"})


def test_the_zip_holds_files_tolerances_certificate_and_measuring_sheet(tmp_path, capsys):
    arguments = [
        "deliver",
        "al1",
        "--part",
        "S-7",
        "--revision",
        "B",
        "--author",
        "A. B.",
        "--json",
    ]
    arguments += ["--temper", "T651", "--rim-bolts", "6", "3.2", "165.5", "--out", str(tmp_path)]
    assert main(arguments) == 1  # al1 misses its own requirements, and the certificate says so
    record = json.loads(capsys.readouterr().out)
    assert {check["name"] for check in record["checks"] if check["passed"] is False} == {
        "contact-free torque, unwinding",
        "safety factor to yield",
    }
    assert record["tolerances"]["kept"] >= 0.99
    with zipfile.ZipFile(tmp_path / "al1-B.zip") as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    assert {name.rpartition(".")[2] for name in files} == {
        "step", "dxf", "svg", "pdf", "json", "csv", "toml",
    }  # fmt: skip
    drawing = files["al1-drawing.dxf"].decode()
    limit = 1e3 * record["tolerances"]["thickness_m"]
    for text in ("S-7, B", "T651", f"{limit:.3f}", "Profile of all cut edges", "6 holes D 3.20"):
        assert text in drawing
    rows = list(csv.DictReader(io.StringIO(files["measuring-sheet.csv"].decode())))
    thickness = float(rows[0]["most_mm"]) - float(rows[0]["least_mm"])
    assert thickness == pytest.approx(2 * limit)
    assert b"'A. B.'" in files["al1.step"].split(b"ENDSEC;", 1)[0]
    assert b"DESCRIPTIVE_REPRESENTATION_ITEM('al-thesis'" in files["al1.step"]
    assert files["al1.step"].count(b"SURFACE_PROFILE_TOLERANCE()") == 1
    assert files["certificate.pdf"].startswith(b"%PDF")
    path = tmp_path / "curve.csv"
    path.write_bytes(files["curve.csv"])
    low, high = read_spring_curve(path).contact_onset_rad
    assert low == pytest.approx(-0.370, abs=2e-3)  # winding: the actuator's negative side
    assert high == pytest.approx(0.202, abs=2e-3)
    assert main(arguments) == 2
    assert ShopData().revision == "A"


def test_a_small_strip_keeps_its_stiffness_where_its_edges_are_broken():
    assert edge_break_mm(load_design("al1")) == 0.2
    small = scaled(0.1, 2.0)  # 0.2 mm would take 16 % of its second moment
    p = small.spiral
    share = 6 * (1e-3 * edge_break_mm(small)) ** 2 / (small.width_m * p.thickness_m)
    assert 0 < share <= 0.005
    assert "Edges broken 0.03 at most" in "\n".join(notes(small, ShopData()))


def test_a_shaped_strip_is_not_called_parallel():
    design = load_design("al1")
    offset = (2e-4, 1e-4, 0.0, 0.0, 0.0)
    spiral = replace(design.spiral, rim_thickness_m=7e-3, centreline_offset_m=offset)
    shaped = replace(design, spiral=spiral)
    text = "\n".join(notes(shaped, ShopData()))
    assert "7.70 thick at the hub, 7.00 at the rim, 7.00 to 7.70 between" in text
    assert "an offset of at most 0.20 mm: see the DXF" in text
