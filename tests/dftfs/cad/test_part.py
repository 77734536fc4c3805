"""The solid and its files are the outline's, and the checks on them find every planted fault."""

import dataclasses
import json
import subprocess
import sys

import cadquery as cq
import ezdxf
import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from dftfs.cad import export
from dftfs.cad.dxf import check_dxf, write_dxf
from dftfs.cad.export import export_part
from dftfs.cad.mesh import tessellate
from dftfs.cad.solid import (
    build_solid,
    check_solid,
    fit_spline,
    measure_solid,
    smooth_pieces,
)
from dftfs.cad.step import StepLabels, check_step, write_step
from dftfs.cad.stl import check_stl, write_stl
from dftfs.cad.verify import CadError
from dftfs.errors import DesignError
from dftfs.spring.edges import OffsetEdge
from dftfs.spring.outline import build_outline
from tests.cases.spring import FIT

pytestmark = pytest.mark.needs_cad  # the module imports the kernel

WIDTH_M = 7.34e-3
DENSITY = 2810.0
LABELS = {"density_kg_per_m3": DENSITY, "material": "al-7075-t6"}
DESIGNS = {
    "fit": FIT,
    "ref": dataclasses.replace(FIT, turns=2.0, fillet_radius_m=1e-3),
    "three-arms": dataclasses.replace(FIT, n_arms=3, turns=1.2),
    "sharp-tip": dataclasses.replace(FIT, tip_radius_m=0.0),
    "profiled": dataclasses.replace(
        FIT, thickness_profile=(1.0, 0.9, 0.8, 0.9, 1.0), centreline_offset_m=(5e-4, -3e-4, 4e-4)
    ),
}


@pytest.fixture(scope="module", params=DESIGNS)
def part(request):
    outline = build_outline(DESIGNS[request.param])
    return request.param, outline, build_solid(outline, WIDTH_M)


@pytest.fixture(scope="module")
def fit():
    outline = build_outline(FIT)
    return outline, build_solid(outline, WIDTH_M)


@pytest.fixture(scope="module")
def exported(part, tmp_path_factory):
    name, outline, _ = part
    folder = tmp_path_factory.mktemp(name)
    return outline, export_part(outline, WIDTH_M, name, folder, **LABELS)


def pieces_of(outline):
    return [p for loop in outline.coil_gaps for edge in loop for p in smooth_pieces(edge)]


# the solid


def test_solid_is_one_valid_closed_body_with_the_outlines_volume_and_box(part):
    _, outline, solid = part
    found = measure_solid(solid)

    assert (found.solids, found.valid, found.closed) == (1, True, True)
    assert found.volume_mm3 == pytest.approx(outline.area_m2 * WIDTH_M * 1e9, rel=5e-9)
    np.testing.assert_allclose(found.bounding_box_mm, [173.24, 173.24, 7.34], rtol=1e-7)
    assert found.faces == 4 + len(pieces_of(outline))


def test_solid_stands_on_the_plane_z_0(fit):
    box = fit[1].BoundingBox()

    assert (box.zmin, box.zmax) == (pytest.approx(0, abs=1e-6), pytest.approx(7.34, abs=1e-6))


def test_splines_follow_the_spiral_to_a_tenth_of_a_micrometre_in_area_tangent_and_place(part):
    """Independent samples; the area by Gauss's rule on every knot span, exact for quintics."""
    _, outline, _ = part
    nodes, weights = np.polynomial.legendre.leggauss(6)
    area_error = 0.0
    for edge in pieces_of(outline):
        if not isinstance(edge, OffsetEdge):
            continue
        spline = fit_spline(edge)
        t = np.linspace(0, 1, 7919)
        length_mm = edge.length_m * 1e3
        gap = np.hypot(*(spline(t * length_mm) - 1e3 * edge.point(t)).T)
        assert gap.max() < 2e-8
        slope = spline.derivative()
        ends = slope(np.array([0, length_mm]))
        ends /= np.linalg.norm(ends, axis=1, keepdims=True)
        np.testing.assert_allclose(ends, edge.tangent(np.array([0.0, 1.0])), atol=1e-12)
        knots = np.unique(spline.t)
        half = np.diff(knots) / 2
        u = (knots[:-1, None] + half[:, None] * (1 + nodes)).ravel()
        (x, y), (dx, dy) = spline(u).T, slope(u).T
        area = 0.5 * np.sum((half[:, None] * weights).ravel() * (x * dy - y * dx))
        area_error += abs(1e-6 * area - edge.area_m2)

    assert area_error / outline.area_m2 < 1e-9


def test_check_refuses_another_width_and_a_second_body(fit):
    outline, solid = fit

    with pytest.raises(CadError, match=r"volume_mm3 of it is .* off by 9\.\d+e-04"):
        check_solid(solid, outline, WIDTH_M * 1.001, "it")
    two = cq.Compound.makeCompound([solid, solid.translate(cq.Vector(500, 0, 0))])
    with pytest.raises(CadError, match="must be one solid but has 2"):
        check_solid(two, outline, WIDTH_M, "it")


@pytest.mark.parametrize("width_m", [0.0, -1e-3, np.nan])
def test_width_must_be_positive(fit, width_m):
    with pytest.raises(DesignError, match="width_mm"):
        build_solid(fit[0], width_m)
    with pytest.raises(DesignError, match="width_mm"):
        tessellate(fit[0], width_m, 0.1)


# triangles


def test_triangles_close_the_surface_around_the_volume(part):
    _, outline, _ = part
    vertices, triangles = tessellate(outline, WIDTH_M, 0.02)

    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    forward, backward = (set(map(tuple, pair)) for pair in (edges, edges[:, ::-1]))
    assert len(forward) == len(edges)  # no edge twice in one direction
    assert forward == backward
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    volume = np.sum(a * np.cross(b, c)) / 6
    assert volume == pytest.approx(outline.area_m2 * WIDTH_M, rel=5e-4)
    assert set(vertices[:, 2]) == {0.0, WIDTH_M}
    handles = (len(vertices) - len(edges) / 2 + len(triangles) - 2) / -2
    assert handles == 1 + len(outline.coil_gaps)


def test_volume_error_of_the_triangles_falls_in_proportion_to_the_chord_tolerance(fit):
    outline, _ = fit
    errors = []
    for tolerance_mm in (0.08, 0.02, 0.005):
        vertices, triangles = tessellate(outline, WIDTH_M, tolerance_mm)
        a, b, c = np.moveaxis(vertices[triangles], 1, 0)
        errors.append(np.sum(a * np.cross(b, c)) / 6 - outline.area_m2 * WIDTH_M)

    np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 4, rtol=0.1)


# the files


def test_step_file_holds_the_part_under_its_name(exported):
    outline, result = exported
    shape = cq.importers.importStep(str(result.files["step"])).val()
    text = result.files["step"].read_text()

    assert shape.isValid()
    assert shape.Volume() == pytest.approx(outline.area_m2 * WIDTH_M * 1e9, rel=1e-8)
    assert f"PRODUCT('{result.name}','{result.name}'" in text
    assert "AP242_MANAGED_MODEL_BASED_3D_ENGINEERING" in text
    assert "SI_UNIT(.MILLI.,.METRE.)" in text
    assert result.step.volume_error < 1e-8
    assert result.step.bounding_box_error < 1e-7


def test_stl_file_is_watertight_and_within_a_thousandth(exported):
    outline, result = exported
    mesh = trimesh.load_mesh(result.files["stl"])

    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert len(mesh.split()) == 1
    assert mesh.volume == pytest.approx(outline.area_m2 * WIDTH_M * 1e9, rel=2e-4)
    assert result.stl.volume_error < 2e-4
    assert result.stl.chord_tolerance_m == 1e-5
    header = result.files["stl"].read_bytes()[:80].decode()
    assert header.startswith("binary STL in mm, chord tolerance 0.01 mm: ")
    assert len(result.files["stl"].read_bytes()) == 84 + 50 * result.stl.triangles


@pytest.mark.parametrize("key", ["dxf_arcs", "dxf_polyline"])
def test_dxf_file_holds_closed_loops_in_mm_and_nothing_else(exported, key):
    outline, result = exported
    document = ezdxf.readfile(result.files[key])
    kinds = sorted((entity.dxf.layer, entity.dxftype()) for entity in document.modelspace())

    circle = "CIRCLE" if key == "dxf_arcs" else "LWPOLYLINE"
    voids = [("VOIDS", "LWPOLYLINE")] * len(outline.coil_gaps)
    assert kinds == [("BORE", circle), ("OUTER", circle), *voids]
    assert all(p.closed for p in document.modelspace().query("LWPOLYLINE"))
    assert (document.header["$INSUNITS"], document.header["$MEASUREMENT"]) == (4, 1)
    assert document.header.custom_vars.get("part") == result.name
    assert not document.audit().has_errors
    check = getattr(result, key)
    assert check.deviation_m <= 2e-6
    assert abs(check.area_error_m2) <= check.area_bound_m2
    assert (check.arcs > 0) == (key == "dxf_arcs")


def test_arcs_of_the_dxf_lie_within_2_um_of_the_spiral_by_ezdxfs_own_reading(exported):
    """Oracle: ezdxf turns bulges into arcs; distance along the normal at the nearest of the exact
    points, which stand some 5 um apart (6 nm of sagitta in the smallest fillet)."""
    outline, result = exported
    polyline = ezdxf.readfile(result.files["dxf_arcs"]).modelspace().query("LWPOLYLINE").first
    arcs = [arc for arc in polyline.virtual_entities() if arc.dxftype() == "ARC"]
    points = 1e-3 * np.array([(p.x, p.y) for arc in arcs for p in arc.flattening(1e-4)])
    samples = [
        (edge, np.linspace(0, 1, 2 + int(edge.length_m / 5e-6))) for edge in outline.coil_gaps[0]
    ]
    exact = np.concatenate([edge.point(t) for edge, t in samples])
    tangent = np.concatenate([edge.tangent(t) for edge, t in samples])

    _, nearest = cKDTree(exact).query(points)
    gap, along = points - exact[nearest], tangent[nearest]
    distance = np.abs(gap[:, 0] * along[:, 1] - gap[:, 1] * along[:, 0])

    assert 1.8e-6 < distance.max() < 2e-6
    assert np.linalg.norm(gap, axis=1).max() < 1e-5  # no point is far from every edge


def test_dxf_is_economical(fit, tmp_path):
    """Two arms of two spiral edges at most 52 arcs each, eight fillets and tips, the circles."""
    check = write_dxf(
        fit[0], tmp_path / "a.dxf", variant="arcs", name="a", width_m=WIDTH_M, tolerance_m=2e-6
    )

    assert check.arcs <= 4 * 52 + 24
    assert check.lines == 2


def test_result_states_volume_mass_and_box(exported):
    outline, result = exported

    assert result.volume_m3 == pytest.approx(outline.area_m2 * WIDTH_M, rel=1e-15)
    assert result.mass_kg == pytest.approx(outline.area_m2 * WIDTH_M * DENSITY, rel=1e-15)
    assert result.bounding_box_m == (0.17324, 0.17324, WIDTH_M)
    assert set(result.files) == {"step", "stl", "dxf_arcs", "dxf_polyline"}
    assert all(path.stat().st_size > 1000 for path in result.files.values())
    folder = result.files["step"].parent
    assert sorted(folder.iterdir()) == sorted(result.files.values())
    assert "volume_error" in json.dumps(dataclasses.asdict(result), default=str)


def test_only_the_formats_asked_for_are_written_and_nothing_is_printed(fit, tmp_path, capfd):
    result = export_part(fit[0], WIDTH_M, "a b", tmp_path / "x" / "y", **LABELS, formats=("step",))

    assert [p.name for p in (tmp_path / "x" / "y").iterdir()] == ["a b.step"]
    assert (result.stl, result.dxf_arcs) == (None, None)
    assert capfd.readouterr() == ("", "")


# the checks can fail


def test_step_check_refuses_another_name_and_another_part(fit, tmp_path):
    outline, solid = fit
    path = tmp_path / "a.step"
    labels = StepLabels(**LABELS)
    write_step(solid, path, outline=outline, width_m=WIDTH_M, name="a", labels=labels)

    with pytest.raises(CadError, match="must hold the product b"):
        check_step(path, outline=outline, width_m=WIDTH_M, name="b", labels=labels)
    with pytest.raises(CadError, match=r"volume_mm3 of STEP file a\.step"):
        check_step(path, outline=outline, width_m=2 * WIDTH_M, name="a", labels=labels)
    path.write_text(path.read_text().replace(".MILLI.,.METRE.", "$,.METRE."))
    with pytest.raises(CadError, match="is not in mm"):
        check_step(path, outline=outline, width_m=WIDTH_M, name="a", labels=labels)


def test_stl_check_refuses_a_missing_a_turned_facet_and_a_coarse_file(fit, tmp_path):
    outline, _ = fit
    path = tmp_path / "a.stl"
    write_stl(outline, WIDTH_M, path, name="a")
    whole = path.read_bytes()
    volume = {"volume_m3": outline.area_m2 * WIDTH_M, "chord_tolerance_mm": 0.01}
    facets = len(whole[84:]) // 50

    path.write_bytes(whole[:80] + np.uint32(facets - 1).tobytes() + whole[84:-50])
    with pytest.raises(CadError, match="not watertight"):
        check_stl(path, **volume)
    first = whole[84:134]
    turned = first[:12] + first[24:36] + first[12:24] + first[36:]
    path.write_bytes(whole[:84] + turned + whole[134:])
    with pytest.raises(CadError, match="face the wrong way"):
        check_stl(path, **volume)
    with pytest.raises(CadError, match=r"a chord tolerance of 0\.0\d+ mm would work"):
        write_stl(outline, WIDTH_M, path, name="a", chord_tolerance_mm=0.2)


def test_dxf_check_refuses_a_moved_vertex_an_open_loop_a_spline_and_inches(fit, tmp_path):
    outline, _ = fit
    path = tmp_path / "a.dxf"
    expected = {"outline": outline, "variant": "arcs", "tolerance_m": 2e-6}
    write_dxf(outline, path, variant="arcs", name="a", width_m=WIDTH_M)
    whole = path.read_text()

    def spoilt(change):
        path.write_text(whole)
        document = ezdxf.readfile(path)
        change(document, document.modelspace().query("LWPOLYLINE").first)
        document.saveas(path)
        return path

    def move(_, polyline):
        x, y, bulge = polyline.get_points("xyb")[40]
        polyline[40] = (x * 1.0002, y * 1.0002, 0, 0, bulge)

    with pytest.raises(CadError, match=r"strays \d+\.?\d* um from the outline, at most 2"):
        check_dxf(spoilt(move), **expected)
    with pytest.raises(CadError, match="open polyline on layer VOIDS"):
        check_dxf(spoilt(lambda _, polyline: polyline.close(False)), **expected)
    splines = spoilt(lambda document, _: document.modelspace().add_spline([(0, 0), (1, 2), (3, 1)]))
    with pytest.raises(CadError, match="holds a SPLINE"):
        check_dxf(splines, **expected)
    with pytest.raises(CadError, match="not in mm"):
        check_dxf(spoilt(lambda d, _: d.header.__setitem__("$INSUNITS", 1)), **expected)
    with pytest.raises(CadError, match="must hold loops on layers"):
        check_dxf(spoilt(lambda _, polyline: polyline.destroy()), **expected)


def test_dxf_variant_must_be_known(fit, tmp_path):
    with pytest.raises(DesignError, match="variant = 'spline'"):
        write_dxf(fit[0], tmp_path / "a.dxf", variant="spline", name="a", width_m=WIDTH_M)


# requests that cannot be met


def refusal(fit, folder, name="a", **changes):
    arguments = {**LABELS, "formats": ("dxf",), **changes}
    with pytest.raises(DesignError) as caught:
        export_part(fit[0], WIDTH_M, name, folder, **arguments)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("name", ["", "../a", "a/b", "a\\b", ".", "..", ".a", "a.", "ä", "a" * 101])
def test_a_name_that_cannot_name_files_is_refused(fit, tmp_path, name):
    assert "cannot name files" in refusal(fit, tmp_path, name)
    assert not list(tmp_path.iterdir())


def test_unknown_formats_and_bad_numbers_are_refused(fit, tmp_path):
    assert "'igs'" in refusal(fit, tmp_path, formats=("igs",))
    assert "formats = []" in refusal(fit, tmp_path, formats=())
    assert "density_kg_per_m3 = 0" in refusal(fit, tmp_path, density_kg_per_m3=0.0)
    assert "tolerance_um = -1" in refusal(fit, tmp_path, dxf_tolerance_um=-1)
    assert "tolerance_um = 0" in refusal(
        fit, tmp_path, formats=("stl",), stl_chord_tolerance_mm=0.0
    )
    assert not list(tmp_path.iterdir())


def test_a_folder_that_cannot_be_written_is_refused(fit, tmp_path):
    (tmp_path / "file").write_text("x")

    assert "cannot be written" in refusal(fit, tmp_path / "file")
    assert "cannot be written" in refusal(fit, tmp_path / "file" / "below")


def test_an_existing_file_is_kept_unless_overwriting(fit, tmp_path):
    path = tmp_path / "a-polyline.dxf"
    path.write_text("mine")

    assert "a-polyline.dxf exists" in refusal(fit, tmp_path)
    assert path.read_text() == "mine"
    assert list(tmp_path.iterdir()) == [path]
    arguments = {**LABELS, "formats": ("dxf",), "overwrite": True}
    export_part(fit[0], WIDTH_M, "a", tmp_path, **arguments)
    assert path.read_text() != "mine"


@pytest.mark.parametrize(
    ("failure", "raised", "message"),
    [
        (CadError("bad file"), CadError, "bad file"),
        (OSError(28, "No space left on device"), DesignError, "the disk is full"),
    ],
)
def test_a_failure_before_the_end_leaves_every_file_as_it_was(
    fit, tmp_path, monkeypatch, failure, raised, message
):
    path = tmp_path / "a.step"
    path.write_text("mine")

    def fail(*_, **__):
        raise failure

    monkeypatch.setattr(export, "write_dxf", fail)
    with pytest.raises(raised, match=message):
        export_part(fit[0], WIDTH_M, "a", tmp_path, **LABELS, overwrite=True)
    assert list(tmp_path.iterdir()) == [path]
    assert path.read_text() == "mine"


def test_the_package_and_its_geometry_import_without_cad_libraries():
    code = (
        "import sys\n"
        "for name in ('cadquery', 'OCP', 'ezdxf', 'trimesh'): sys.modules[name] = None\n"
        "import dftfs, dftfs.spring.outline, dftfs.cad.system_libraries\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
