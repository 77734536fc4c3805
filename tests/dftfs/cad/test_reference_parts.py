"""The committed parts of `cad_out/` are the geometry that the built-in designs have now."""

import hashlib
import json

import ezdxf
import numpy as np
import pytest

from dftfs.cad.bulge_loop import BulgeLoop
from dftfs.cad.drawing import read_measurements, write_drawing
from dftfs.cad.dxf import check_dxf
from dftfs.cad.step import StepLabels, check_step
from dftfs.cad.stl import check_stl
from dftfs.cli.main import main
from dftfs.design import load_design
from tests.cases.places import ROOT

pytestmark = pytest.mark.needs_cad  # the module imports the kernel

PARTS = ROOT / "cad_out"
NAMES = ("al1", "al2", "ss", "ti")


@pytest.mark.parametrize("name", NAMES)
def test_committed_files_are_the_present_design(name):
    design = load_design(name)
    outline, width = design.outline, design.width_m
    stated = StepLabels(
        material=design.material.name, density_kg_per_m3=design.material.density_kg_per_m3
    )
    path = PARTS / f"{name}.step"
    step = check_step(path, outline=outline, width_m=width, name=name, labels=stated)
    assert step.volume_error < 1e-6
    check_stl(PARTS / f"{name}.stl", volume_m3=outline.area_m2 * width, chord_tolerance_mm=0.01)
    for suffix, variant in ((".dxf", "arcs"), ("-polyline.dxf", "polyline")):
        path = PARTS / f"{name}{suffix}"
        found = check_dxf(path, outline=outline, variant=variant, tolerance_m=2e-6)
        assert found.deviation_m <= 2e-6


@pytest.mark.parametrize("name", NAMES)
def test_dimensions_of_the_committed_drawing_measure_the_present_design(name):
    design = load_design(name)
    p, found = design.spiral, read_measurements(PARTS / f"{name}-drawing.dxf")
    lengths = {
        "rim outside diameter": 2 * p.rim_outer_radius_m,
        "rim inside diameter": 2 * p.rim_inner_radius_m,
        "hub diameter": 2 * p.hub_radius_m,
        "bore diameter": 2 * p.bore_radius_m,
        "strip thickness": p.thickness_m,
        "width": design.width_m,
        "slit width": 2 * p.fillet_radius_m,
        **{f"{root} fillet radius": p.fillet_radius_m for root in ("notch", "foot", "slit", "tip")},
    }
    for dimension, length in lengths.items():
        assert found[dimension] == pytest.approx(1e3 * length, abs=1e-6), dimension
    # by a fine polygon of both edges, independent of the Newton that found the gap
    edges = {e.name: e.point(np.linspace(0, 1, 6001)) for e in design.outline.coil_gaps[0]}
    inner, outer = edges["arm_inner:0"], edges["arm_outer:0"]
    nearest = min(np.min(np.hypot(*(outer - q).T)) for q in inner[::5])
    assert found["smallest gap between coils"] == pytest.approx(1e3 * nearest, abs=0.01)
    assert len(found) == len(lengths) + 1


def test_the_front_view_is_the_exact_outline_at_full_size():
    outline = load_design("al1").outline
    space = ezdxf.readfile(PARTS / "al1-drawing.dxf").modelspace()
    loops = [e for e in space.query("LWPOLYLINE") if e.closed and e.dxf.layer == "OUTLINE"]
    areas = []
    for entity in loops[:4]:
        points = np.array(entity.get_points("xyb"))
        loop = BulgeLoop(name="x", vertices_m=1e-3 * points[:, :2], bulges=points[:, 2])
        areas.append(abs(loop.area_m2))
    assert areas[0] - sum(areas[1:]) == pytest.approx(outline.area_m2, rel=1e-5)


def test_the_drawing_says_what_a_shop_needs(tmp_path):
    design = load_design("ref", {"centreline": "archimedean", "turns": "1.9"})
    made = write_drawing(design, tmp_path, design_hash="0123456789ab")
    texts = {e.dxf.text for e in ezdxf.readfile(made.dxf).modelspace().query("TEXT")}
    assert "0123456789ab" in texts
    assert f"{design.mass_kg * 1e3:.1f} g" in texts
    assert any("r = 18.3800 + 4.74868 t mm" in line for line in texts)
    assert any("No fastening holes" in line for line in texts)
    assert made.svg.read_text().startswith("<?xml")


def test_the_manifest_is_of_the_committed_files_and_the_present_designs():
    record = json.loads((PARTS / "manifest.json").read_text())
    assert set(record["parts"]) == set(NAMES)
    listed = {"manifest.json"}
    for name, part in record["parts"].items():
        design = load_design(name)
        assert part["mass_kg"] == pytest.approx(design.mass_kg, rel=1e-9)
        assert part["volume_m3"] == pytest.approx(design.outline.area_m2 * design.width_m, rel=1e-9)
        assert len(part["files"]) == 6
        for file in part["files"].values():
            content = (PARTS / file["name"]).read_bytes()
            assert hashlib.sha256(content).hexdigest() == file["sha256"], file["name"]
            listed.add(file["name"])
    assert listed == {path.name for path in PARTS.iterdir()}


def test_parts_that_are_there_are_not_overwritten(tmp_path, capsys):
    (tmp_path / "manifest.json").write_text("{}")
    assert main(["parts", "al1", "--out", str(tmp_path)]) == 2
    assert "--force" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["manifest.json"]
