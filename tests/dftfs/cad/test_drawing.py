"""The drawing states one limit for every size, the one that sheet and STEP file state too."""

import csv
import io
from dataclasses import replace
from functools import cache
from itertools import combinations

import ezdxf
import numpy as np
import pytest
from ezdxf import bbox as bounding_box
from ezdxf.tools.text_size import mtext_size

from dftfs.analysis.strength.fkm import SURFACE_OF_PROCESS, SURFACES, surface_left_by
from dftfs.analysis.study.drawing_tolerance import drawing_tolerance
from dftfs.analysis.study.measuring_sheet import measuring_sheet
from dftfs.cad.drawing import read_measurements, write_drawing
from dftfs.cad.drawing_notes import notes, title_block
from dftfs.cad.drawing_sheet import ShopData, chosen_sheet, place
from dftfs.design import load_design
from dftfs.process import builtin_processes, find_process

pytestmark = pytest.mark.needs_cad

FILLETS = ("notch", "foot", "slit", "tip")
EXACT = {"slit width", "rim outside diameter", "rim inside diameter", "hub diameter"}
EXACT |= {f"{root} fillet radius" for root in FILLETS}


@cache
def tolerance(name="al1"):
    return drawing_tolerance(load_design(name), find_process("wire-edm"))


def shop(name="al1", **changes):
    found = tolerance(name)
    values = {
        "thickness_tolerance_m": found.thickness_m,
        "width_tolerance_m": found.width_m,
        "profile_m": found.profile_m,
        "stiffness": found.line(),
    }
    return ShopData(**{**values, **changes})


def wide_and_thin():
    """A strip of 1 mm, 30 mm wide, whose fillets turn by half a circle."""
    lengths = {"inner_radius": 12, "outer_radius": 40, "thickness": 1, "width": 30}
    lengths |= {"fillet_radius": 0.5, "tip_radius": 0.2, "bore_radius": 8, "hub_radius": 12}
    lengths |= {"rim_inner_radius": 40.5, "rim_outer_radius": 46}
    changes = {f"{name}_mm": repr(float(value)) for name, value in lengths.items()}
    return load_design("al1", {**changes, "turns": "2", "material": "ti64", "name": "thin"})


def small():
    """Al1 at a tenth of its size."""
    p = load_design("al1").spiral
    names = ("inner_radius", "outer_radius", "thickness", "fillet_radius", "tip_radius")
    names += ("bore_radius", "hub_radius", "rim_inner_radius", "rim_outer_radius")
    changes = {f"{name}_mm": repr(100 * getattr(p, f"{name}_m")) for name in names}
    return load_design("al1", {**changes, "width_mm": "2", "name": "small"})


DESIGNS = {"al1": lambda: load_design("al1"), "thin": wide_and_thin, "small": small}


@pytest.fixture(scope="module", params=DESIGNS)
def each(request, tmp_path_factory):
    """A design, its sheet and what is drawn of it, with limits."""
    design = DESIGNS[request.param]()
    sheet = chosen_sheet(design, None, None)
    folder = tmp_path_factory.mktemp("drawing")
    made = write_drawing(design, folder, design_hash="0" * 12, shop=shop(), sheet=sheet)
    return design, sheet, ezdxf.readfile(made.dxf)


def dimensions(path):
    """Text of every dimension's block by its name, and whether a closed frame stands around it."""
    document, found = ezdxf.readfile(path), {}
    for entity in document.modelspace().query("DIMENSION"):
        block = entity.get_geometry_block()
        (label,) = block.query("MTEXT")
        name = next(tag.value for tag in entity.get_xdata("DFTFS") if tag.code == 1000)
        boxed = any(line.closed for line in block.query("LWPOLYLINE"))
        assert boxed == (entity.override().get("dimgap") < 0)  # a program that redraws it boxes it
        found[name] = label.text, boxed
    return found


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drawing")
    return write_drawing(load_design("al1"), folder, design_hash="0" * 12, shop=shop())


def test_sizes_that_the_profile_limits_are_exact_and_the_others_carry_their_limits(drawn):
    found = dimensions(drawn.dxf)
    assert {name for name, (_, boxed) in found.items() if boxed} == EXACT
    assert found["bore diameter"][0] == "%%c21.36 H7 (+0.021 / 0)"
    assert found["smallest gap between coils"][0] == "(2.233)"
    assert found["width"][0] == "7.34 %%p0.050"
    assert found["strip thickness"][0] == "7.7 %%p0.040"
    assert drawn.measured_mm == pytest.approx(read_measurements(drawn.dxf))


def test_the_bore_of_sheet_drawing_and_note_is_the_same(drawn):
    design = load_design("al1")
    rows = {
        row["characteristic"]: row
        for row in csv.DictReader(io.StringIO(measuring_sheet(design, tolerance())))
    }
    bore = rows["bore diameter, H7"]
    assert f"H7: {bore['least_mm']} to {bore['most_mm']}." in "\n".join(notes(design, shop()))
    upper = float(bore["most_mm"]) - float(bore["nominal_mm"])
    assert f"H7 (+{upper:.3f} / 0)" in dimensions(drawn.dxf)["bore diameter"][0]
    assert bore["least_mm"] == bore["nominal_mm"]


def test_without_a_profile_nothing_is_exact_and_the_general_tolerance_holds(tmp_path):
    design = load_design("al1")
    made = write_drawing(design, tmp_path, design_hash="0" * 12)
    assert not any(boxed for _, boxed in dimensions(made.dxf).values())
    sheet = chosen_sheet(design, None, None)
    for data, general in ((ShopData(), True), (shop(), False)):
        block = dict(title_block(design, "0" * 12, sheet, data))
        assert ("ISO 2768" in block["TOLERANCES"]) == general


def arrows(document):
    """Where the arrow of each radius and diameter ends, by name, in mm of paper."""
    found = {}
    for entity in document.modelspace().query("DIMENSION"):
        name = next(tag.value for tag in entity.get_xdata("DFTFS") if tag.code == 1000)
        for arrow in entity.get_geometry_block().query("INSERT"):
            found.setdefault(name, np.array(arrow.dxf.insert.vec2))
    return found


def distance_mm(edges, point):
    """From a point of the part to edges, both in m."""
    points = np.concatenate([edge.point(np.linspace(0, 1, 4001)) for edge in edges])
    return 1e3 * float(np.min(np.hypot(*(points - point).T)))


def test_every_arrow_ends_on_the_arc_that_it_dimensions(each):
    design, sheet, document = each
    found, outline = arrows(document), design.outline
    gaps = [edge for gap in outline.coil_gaps for edge in gap]
    for name, spot in zip(FILLETS, sheet.spots_mm):
        fillet = outline.edge(f"{name}_fillet:0")
        at = 1e-3 * (found[f"{name} fillet radius"] - spot) / sheet.detail_scale
        off = distance_mm([fillet], at + fillet.centre_m)
        assert off < 1e-3 * 1e3 * fillet.radius_m, name
    for name, edges in (
        ("hub", [edge for edge in gaps if edge.name.startswith("hub:")]),
        ("rim inside", [edge for edge in gaps if edge.name.startswith("rim_inner:")]),
        ("rim outside", [outline.rim_outer]),
        ("bore", [outline.bore]),
    ):
        at = 1e-3 * (found[f"{name} diameter"] - sheet.front_mm) / sheet.scale
        assert distance_mm(edges, at) < 1e-3 * 2e3 * design.spiral.rim_outer_radius_m, name


def test_datums_stand_in_boxes_with_a_filled_triangle_on_their_feature(each):
    _, sheet, document = each
    space = document.modelspace()
    texts = {e.dxf.text for e in space.query("TEXT")}
    letters = {text for text in texts if len(text) == 1 and text.isalpha()}
    assert letters == {"A", "B", "W", "X", "Y", "Z"}  # no detail is called as a datum
    axis, face = (
        np.array([np.array(t.dxf.get(f"vtx{k}").vec2) for k in range(3)])
        for t in sorted(space.query("SOLID"), key=lambda t: t.dxf.vtx0.x)
    )
    assert face[:2, 0] == pytest.approx(sheet.side_mm)  # on the lower face: z = 0 is on the left
    assert face[2, 0] < sheet.side_mm
    (bore,) = (
        entity.get_geometry_block()
        for entity in space.query("DIMENSION")
        if any(tag.value == "bore diameter" for tag in entity.get_xdata("DFTFS"))
    )
    levels = [e.dxf.start.y for e in bore.query("LINE") if abs(e.dxf.start.y - e.dxf.end.y) < 1e-9]
    assert axis[:2, 1] == pytest.approx(levels[0])  # on the line of the size: the axis is meant


def test_the_title_block_names_an_alloy_the_projection_and_who_approves():
    for name, alloy in (("al1", "al-thesis: aluminium EN AW-6061 T6"), ("ti", "UNS R50400")):
        design = load_design(name)
        block = dict(title_block(design, "0" * 12, chosen_sheet(design, None, None), shop()))
        assert alloy in block["MATERIAL"]
        assert "first angle" in block["SCALE, SHEET"]
        assert "APPROVED" in block


def test_the_symbol_of_the_projection_is_that_of_the_first_angle(drawn):
    space = ezdxf.readfile(drawn.dxf).modelspace()
    circles = [e for e in space.query("CIRCLE") if e.dxf.layer == "SHEET"]
    large, low = sorted((e.dxf.radius for e in circles), reverse=True)
    assert large == pytest.approx(2 * low)
    centre = circles[0].dxf.center
    (frustum,) = (
        np.array(e.get_points("xy"))
        for e in space.query("LWPOLYLINE")
        if e.dxf.layer == "SHEET" and len(e) == 4 and len({y for _, y in e.get_points("xy")}) == 4
    )
    assert np.max(frustum[:, 0]) < centre.x - large  # the small end's view stands on the far side
    heights = [np.ptp(frustum[frustum[:, 0] == x, 1]) for x in sorted(set(frustum[:, 0]))]
    assert heights == pytest.approx([2 * low, 2 * large])  # small end on the left


def test_the_slit_has_its_width(each):
    design, _, document = each
    (entity,) = (
        e
        for e in document.modelspace().query("DIMENSION")
        if any(tag.value == "slit width" for tag in e.get_xdata("DFTFS"))
    )
    scale = next(tag.value for tag in entity.get_xdata("DFTFS") if tag.code == 1040)
    assert entity.get_measurement() / scale == pytest.approx(2e3 * design.spiral.fillet_radius_m)


def label_boxes(document):
    """Name to left, lower, right, upper of every dimension's text and every single letter."""
    space, found = document.modelspace(), {}
    for entity in space.query("DIMENSION"):
        (label,) = entity.get_geometry_block().query("MTEXT")
        size, turn = mtext_size(label), np.radians(label.dxf.rotation)
        wide = abs(size.total_width * np.cos(turn)) + abs(size.total_height * np.sin(turn))
        high = abs(size.total_width * np.sin(turn)) + abs(size.total_height * np.cos(turn))
        half, centre = np.array([wide, high]) / 2, np.array(label.dxf.insert.vec2)
        found[label.text + str(len(found))] = (*(centre - half), *(centre + half))
    for entity in space.query("TEXT"):
        if len(entity.dxf.text) == 1 and entity.dxf.text.isalpha():
            box = bounding_box.extents([entity])
            found[entity.dxf.text] = (*box.extmin.vec2, *box.extmax.vec2)
    return found


def test_no_label_lies_on_another_or_beyond_the_frame(each):
    _, sheet, document = each
    found, (width, height) = label_boxes(document), sheet.size_mm
    assert len(found) == 12 + 6
    for name, box in found.items():
        assert min(box[:2]) > 10, name
        assert max(box[2] - width, box[3] - height) < -10, name
    for (name, a), (other, b) in combinations(found.items(), 2):
        apart = a[2] < b[0] or b[2] < a[0] or a[3] < b[1] or b[3] < a[1]
        assert apart, f"{name} lies on {other}"


def test_strips_and_letters_stay_legible(each):
    design, sheet, document = each
    wide = document.layers.get("OUTLINE").dxf.lineweight / 100
    assert 1e3 * design.spiral.thickness_m * sheet.scale >= 4 * wide
    edges = [edge for gap in design.outline.coil_gaps for edge in gap]
    points = np.concatenate([edge.point(np.linspace(0, 1, 3001)) for edge in edges])
    placed = place(points, sheet.front_mm, sheet.scale)
    for letter, box in label_boxes(document).items():
        if letter in ("W", "X", "Y", "Z"):
            outside = np.maximum(np.maximum(box[:2] - placed, placed - box[2:]), 0)
            assert np.min(np.hypot(*outside.T)) > 0.4 + wide / 2, letter


def test_a_wide_part_keeps_its_scale_and_a_thin_strip_gets_a_sheet_that_shows_it():
    thin = chosen_sheet(wide_and_thin(), None, None)
    assert (thin.name, thin.scale) == ("A3", 2.0)
    (left, y), (right, _) = thin.spots_mm[:2]
    assert left - thin.detail_radius_mm > thin.side_mm + thin.side_width_mm
    assert right + thin.detail_radius_mm < 410
    assert y + thin.detail_radius_mm < 287
    whole = load_design("al1")
    spiral = replace(whole.spiral, thickness_m=7e-4, rim_inner_radius_m=76.2e-3)
    chosen = chosen_sheet(replace(whole, spiral=spiral), None, None)  # 0.7 mm on A3
    assert (chosen.name, chosen.scale, chosen.line_widths) == ("A1", 2.0, (25, 13))


@pytest.mark.parametrize("process", builtin_processes(), ids=lambda process: process.name)
def test_the_surface_is_the_one_that_the_life_assumes(process):
    rz = SURFACES[SURFACE_OF_PROCESS[process.name]].roughness_um
    assert surface_left_by(process.name).roughness_um == rz
    data = shop(roughness_um=rz, process=process.name)
    (line,) = (line for line in notes(load_design("al1"), data) if "Cut edges" in line)
    ra = float(line.split(" Ra ")[1].split()[0])
    assert ra == pytest.approx(rz / 6, rel=0.05)
    assert f"(Rz {rz:g}) at most" in line
    assert ("bore Ra 1.6" in line) == (ra > 2)  # a fit needs more than the process leaves


def test_the_taper_of_a_water_jet_is_compared_with_the_profile():
    water_jet = find_process("water-jet")
    taper = water_jet.taper_least_m, water_jet.taper_most_m
    assert taper == (pytest.approx(8e-5), pytest.approx(2.5e-4))
    design = load_design("al1")
    for profile, end in (
        (8e-5, "more than the profile allows: correct it."),
        (3e-4, "within the profile."),
    ):
        text = "\n".join(notes(design, shop(taper_m=taper, process="water-jet", profile_m=profile)))
        assert f"through the width 0.08 to 0.25 by water-jet, {end}" in text
    assert "Taper" not in "\n".join(notes(design, shop(process="wire-edm")))
