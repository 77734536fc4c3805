"""Gaps, outlines, residuals and scales behind the report's figures are those of the fields."""

import subprocess
from dataclasses import replace

import numpy as np
import pytest

from dftfs.analysis.meshing.coil_gap_mesh import CoilGapMesh
from dftfs.analysis.meshing.sector_mesh import sector_mesh
from dftfs.design import load_design
from dftfs.errors import DesignError
from dftfs.report.figures import render as figures_render
from dftfs.report.figures.actuator import decimated
from dftfs.report.figures.cell_outlines import border_edges, cell_outlines, near
from dftfs.report.figures.curve import ModelCurve, residual_percent
from dftfs.report.figures.gap_profile import gap_profile, sector_displacement
from dftfs.report.figures.render import part_render
from dftfs.report.figures.render_window import half_extents
from dftfs.report.figures.stress import bulk_stress_Pa, stress_scale
from dftfs.report.numbers import fixed, human, kilobytes, percent, plain, seconds, with_uncertainty
from dftfs.spring.edges import rotate
from tests.cases.report_study import COARSE, box, snapshot

pytestmark = pytest.mark.needs_cad  # a study holds what its exported files measured


@pytest.fixture(scope="module")
def design():
    return load_design("al1")


@pytest.fixture(scope="module")
def sector(design):
    return sector_mesh(design.outline, COARSE)


@pytest.fixture(scope="module")
def gap(design, sector):
    return CoilGapMesh(sector=sector, parameters=design.spiral)


def test_gap_profile_runs_from_the_hub_to_the_slit(design, gap):
    profile = gap_profile(gap)
    edge = design.outline.edge("arm_outer:0").length_m
    assert profile.arc_length_m[0] == 0
    assert np.all(np.diff(profile.arc_length_m) > 0)
    # the foot's fillet is part of the walk, the last four fillet radii before the slit are not
    assert profile.arc_length_m[-1] == pytest.approx(edge, abs=3e-3)
    assert profile.smallest_m == gap.clearance().smallest_m
    assert profile.smallest_m == pytest.approx(1.08e-3, rel=0.02)  # where the slit closes
    sweep = design.outline.feet.slit_theta - design.outline.feet.foot_theta
    assert profile.angle_rad[-1] == pytest.approx(sweep, rel=0.03)


def test_gap_does_not_change_when_the_spring_is_turned_as_a_whole(gap):
    rest = gap_profile(gap)
    turned = gap_profile(gap, rotate(gap.sector.nodes, 0.83) - gap.sector.nodes)
    np.testing.assert_allclose(turned.gap_m, rest.gap_m, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(turned.arc_length_m, rest.arc_length_m)


def test_sector_displacement_is_the_first_part_of_the_field(design, sector, gap):
    field = snapshot(design, sector, -0.1)
    found = sector_displacement(gap, field)
    np.testing.assert_array_equal(found, field.displacement_m[: len(sector.nodes)])


def test_field_of_another_mesh_is_refused(design, sector, gap):
    field = snapshot(design, sector, -0.1)
    with pytest.raises(DesignError, match="must come from one mesh"):
        sector_displacement(gap, replace(field, nodes_m=1.001 * field.nodes_m))


def test_border_of_the_whole_spring_has_no_joints_between_sectors(design, sector):
    field = snapshot(design, sector, 0.1)
    edges = border_edges(field.nodes_m, field.cells)
    outside = [len(rows) for name, rows in sector.boundaries.items() if "cut" not in name]
    assert len(edges) == design.n_arms * sum(outside)
    middles = np.hypot(*field.nodes_m[edges[:, 1]].T)
    assert middles.max() == pytest.approx(design.spiral.rim_outer_radius_m, rel=1e-6)


def test_cell_outlines_are_closed_and_pass_through_the_nodes(sector):
    outlines = cell_outlines(sector.nodes, sector.cells)
    np.testing.assert_array_equal(outlines[:, 0], outlines[:, -1])
    np.testing.assert_allclose(outlines[:, 0:16:4], sector.nodes[sector.cells[:, :4]], atol=1e-15)
    np.testing.assert_allclose(outlines[:, 2:16:4], sector.nodes[sector.cells[:, 4:]], atol=1e-15)
    x, y = np.moveaxis(outlines, -1, 0)
    area = 0.5 * np.sum(x[:, :-1] * y[:, 1:] - x[:, 1:] * y[:, :-1])
    assert area == pytest.approx(load_design("al1").outline.area_m2 / 2, rel=2e-3)


def test_near_keeps_what_reaches_into_the_window():
    squares = np.array([[[x, 0.0], [x + 1.0, 0.0], [x + 1.0, 1.0]] for x in (0.0, 3.0, 9.0)])
    kept = near(squares, np.array([2.6, 0.5]), 0.7)
    np.testing.assert_array_equal(kept, squares[1:2])


def curve(name: str, factor: float, reach: float) -> ModelCurve:
    angle = np.linspace(-0.6 * reach, reach, 200)
    return ModelCurve(
        name=name,
        colour="k",
        dashes="-",
        width=1,
        deflection_rad=angle,
        torque_Nm=factor * 65.0 * angle,
        stiffness_Nm_per_rad=factor * 65.0,
        contact_onset={},
    )


def test_residual_is_the_relative_difference_where_both_are_known():
    at, difference = residual_percent(curve("a", 1.023, 0.5), curve("b", 1.0, 0.3))
    np.testing.assert_allclose(difference, 2.3, rtol=1e-9)
    assert (at.min(), at.max()) == pytest.approx((-0.18, 0.3))
    assert np.abs(at).min() > 0.01  # at rest a ratio of torques says nothing


def test_stress_scale_ends_at_yield_only_where_a_peak_exceeds_it(design, sector):
    fields = {"winding": snapshot(design, sector, 0.37)}
    peak = fields["winding"].von_mises_Pa.max()
    low = stress_scale(fields, 0.5 * peak)
    assert (low.top_Pa, low.above) == (0.5 * peak, "above yield")
    high = stress_scale(fields, 3 * peak)
    assert high.top_Pa < peak
    assert high.above == f"above {plain(high.top_Pa / 1e6, 2)} MPa"
    assert high.top_Pa == pytest.approx(1.4 * bulk_stress_Pa(fields["winding"]))
    unknown = stress_scale(fields, None)
    assert unknown.top_Pa == high.top_Pa


def test_bulk_stress_of_a_linear_field_is_its_quantile_by_area(design, sector):
    field = snapshot(design, sector, 0.37)
    turned_over = replace(field, von_mises_Pa=1e8 + 1e9 * field.nodes_m[:, 1])
    # area above a chord at height h of a ring's outer edge is the same 2 % on either side
    up = bulk_stress_Pa(turned_over)
    down = bulk_stress_Pa(replace(field, von_mises_Pa=1e8 - 1e9 * field.nodes_m[:, 1]))
    assert up == pytest.approx(down, rel=0.02)
    assert 0.9 < (up - 1e8) / (1e9 * design.spiral.rim_outer_radius_m) < 1.0


def test_a_decimated_curve_keeps_every_peak():
    time = np.linspace(0, 1, 50_000)
    values = np.sin(40 * time)
    values[[777, 31_234]] = 9.0, -7.0
    t, v = decimated(time, values)
    assert len(t) <= 1202
    assert (v.max(), v.min()) == (9.0, -7.0)
    assert np.all(np.diff(t) > 0)
    assert (t[0], t[-1]) == (0.0, 1.0)


def test_render_falls_back_and_says_so_when_vtk_fails(monkeypatch):
    def failing(*args, **kwargs):
        return subprocess.CompletedProcess(args, returncode=-6)

    monkeypatch.setattr(figures_render.subprocess, "run", failing)
    figure = part_render(*box((0.17, 0.12, 0.00734)), "x")
    assert "drawn by matplotlib: VTK could not open an off-screen window" in figure.caption
    assert figure.png.startswith(b"\x89PNG")
    assert "170.0 mm across and 7.34 mm wide" in figure.alt


def test_camera_window_fits_the_part():
    vertices, _ = box((0.17, 0.12, 0.00734))
    half = half_extents(vertices - vertices.mean(axis=0))
    assert 0.12 < 2 * half[0] < np.hypot(0.17, 0.12)
    assert half[1] < half[0]


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (66.0861, 4, "66.09"),
        (-13.38, 3, "−13.4"),
        (0.00012345, 3, "0.000123"),
        (1.6e-9, 2, "1.6 × 10⁻⁹"),
        (99.999, 3, "100"),
        (2.5e9, 2, "2.5 × 10⁹"),
        (0.0, 4, "0"),
        (None, 4, "–"),
        (float("nan"), 4, "–"),
    ],
)
def test_plain_numbers(value, digits, text):
    assert plain(value, digits) == text


def test_numbers_at_the_human_edge():
    assert human(0.6307, "m") == ("630.7", "mm")
    assert human(2.096e8, "Pa") == ("209.6", "MPa")
    assert human(0.25, "rad") == ("0.2500 (14.3°)", "rad")
    assert human(None, "m") == ("–", "mm")
    assert with_uncertainty(66.0861, 0.0331) == "66.086 ± 0.033"
    assert with_uncertainty(66.0861, 3.31) == "66.1 ± 3.3"
    assert with_uncertainty(66.0861, 0.0) == "66.09"
    assert with_uncertainty(2.8371e-4, 1.734e-7) == "0.00028371 ± 0.00000017"
    assert with_uncertainty(2.8371e-6, 1.734e-9) == "(2.8371 ± 0.0017) × 10⁻⁶"
    assert with_uncertainty(-3.0e-9, 2.04e-8) == "(−0.3 ± 2.0) × 10⁻⁸"
    assert percent(-0.0891) == "−8.9 %"
    assert fixed(-1e-9, 3) == "0.000"
    assert fixed(-0.2016, 3) == "−0.202"
    assert [seconds(t) for t in (0.0204, 4.7, 250.0, None)] == ["20.4 ms", "4.7 s", "4.2 min", "–"]
    assert kilobytes(415_001) == "415.0\u00a0kB"
