"""The CalculiX side of `benchmarks/random_designs.py` reads, meshes and measures what it says."""

import importlib
import subprocess
import sys

import numpy as np
import pytest

from benchmarks.calculix_fields import frd_fields, regional_peaks_Pa, smallest_gap_m
from benchmarks.calculix_step_mesh import StepMeshSizing, step_ring
from dftfs.design import load_design
from dftfs.spring.clearance import measure_clearance, sample_coil_gap
from dftfs.spring.edges import rotate
from tests.cases.places import ROOT

FRD = """    1C
 -4  DISP        4    1
 -5  D1          1    2    1    0
 -1         2 1.00000E+00-2.00000E+00 3.00000E+00
 -1         1-7.00000E-03 8.00000E+00-9.00000E+00
 -3
    1PSTEP                         2           1           1
 -4  STRESS      6    1
 -1         1 1.00000E+00-2.00000E+00 3.00000E+00-4.00000E+00 5.00000E+00-6.00000E+00
 -3
 -4  DISP        4    1
 -1         1 0.00000E+00 0.00000E+00 0.00000E+00
 -3
"""


def test_blocks_of_a_name_are_read_step_by_step_with_nodes_in_order():
    first, second = frd_fields(FRD, "DISP", 3)
    np.testing.assert_allclose(first, [[-7e-3, 8, -9], [1, -2, 3]])
    np.testing.assert_allclose(second, [[0, 0, 0]])
    (stress,) = frd_fields(FRD, "STRESS", 6)
    np.testing.assert_allclose(stress, [[1, -2, 3, -4, 5, -6]])


@pytest.fixture(scope="module")
def ring():
    sizing = StepMeshSizing(across=2, fillet=4, growth=0.5)
    return step_ring(ROOT / "cad_out" / "al1.step", load_design("al1"), sizing)


@pytest.mark.needs_cad
def test_the_mesh_of_the_step_file_has_the_outlines_area_and_boundaries(ring):
    design = load_design("al1")
    p = design.spiral
    corners = ring.nodes[ring.cells[:, :4], :2]
    x, y = np.moveaxis(corners, -1, 0)
    area = 0.5 * np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1))
    assert area == pytest.approx(design.outline.area_m2, rel=2e-3)  # chords for curves
    assert np.ptp(ring.nodes[:, 2]) == pytest.approx(design.width_m / 2)
    for name, radius in (("bore", p.bore_radius_m), ("rim_outer", p.rim_outer_radius_m)):
        nodes = ring.nodes[ring.boundary_nodes(name)]
        np.testing.assert_allclose(np.hypot(nodes[:, 0], nodes[:, 1]), radius, rtol=1e-6)
    for name in ("floor", "ceiling"):
        assert 2 * len(ring.facets(f"gap_{name}")) == pytest.approx(len(ring.facets(name)), rel=0.1)


@pytest.mark.needs_cad
def test_the_gap_of_the_undeformed_and_of_a_squeezed_ring_is_the_outlines(ring):
    design = load_design("al1")
    exact = sample_coil_gap(design.outline, 5e-5)
    nearest = measure_clearance(exact.floor_m, exact.ceiling_m, deepest_m=3e-3).smallest_m
    outline = design.outline
    rest = smallest_gap_m(ring, np.zeros_like(ring.nodes), outline)
    assert rest == pytest.approx(nearest, rel=5e-3)  # the zone ends within the points' spacing
    squeezed = smallest_gap_m(ring, -0.25 * ring.nodes, outline)
    assert squeezed == pytest.approx(0.75 * rest, rel=1e-6)
    turned = np.zeros_like(ring.nodes)
    turned[:, :2] = rotate(ring.nodes[:, :2], 0.7) - ring.nodes[:, :2]
    assert smallest_gap_m(ring, turned, outline) == pytest.approx(rest, rel=1e-6)


@pytest.mark.needs_cad
def test_a_peak_is_counted_to_the_region_where_it_stands(ring):
    p = load_design("al1").spiral
    radii, reach = (p.hub_radius_m, p.rim_inner_radius_m), 2e-3
    for name, region in (("notch", "hub notch"), ("slit", "rim slit")):
        stress = np.ones(len(ring.nodes))
        stress[ring.boundary_nodes(name)[0]] = 5.0
        peaks = regional_peaks_Pa(ring, stress, reach, radii)
        assert peaks == {"hub notch": 1.0, "rim slit": 1.0, "arm body": 1.0} | {region: 5.0}
    middle = np.argmin(np.abs(np.hypot(*ring.nodes[:, :2].T) - 0.05))
    stress = np.ones(len(ring.nodes))
    stress[middle] = 3.0
    assert regional_peaks_Pa(ring, stress, reach, radii)["arm body"] == 3.0


@pytest.fixture
def bench(monkeypatch):
    """The benchmark as it is run: its folder on the path."""
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    return importlib.import_module("random_designs")


@pytest.mark.needs_cad
def test_a_design_depends_on_seed_and_number_only(bench):
    assert bench.drawn(0, 2) == bench.drawn(0, 2)
    designs = [bench.drawn(seed, number) for seed in (0, 1) for number in range(4)]
    assert len({design.spiral for design in designs}) == len(designs)
    assert {design.n_arms for design in designs} <= {2, 3, 4}
    assert any(design.spiral.rim_thickness_m is not None for design in designs)


@pytest.mark.needs_cad
def test_the_first_contact_is_where_the_line_through_the_last_gaps_is_zero(bench):
    deflection, torque = -np.array([0.1, 0.2, 0.3]), -np.array([6.0, 12.0, 18.0])
    turned, touched = bench.onset_by_gap(deflection, torque, [9e-3, 3e-3, 1e-3])
    assert (turned, touched) == (pytest.approx(-0.35), pytest.approx(-21.0))


@pytest.mark.needs_cad
def test_the_distribution_counts_failures_apart(bench):
    stress = [{"error": 0.01, "within": True}, {"error": -0.04, "within": False}]
    solved = {
        "torque_error": [1e-4, 3e-4],
        "onset": {"error": 1e-3},
        "contact_torque_error": [],
        "stress": stress,
    }
    found = bench.summary([solved, {"failure": "no coils touch within 1 rad"}])
    assert (found["designs"], found["failed"]) == (2, 1)
    assert found["errors"]["torque"]["worst"] == 3e-4
    assert found["errors"]["peak stress"]["worst"] == 0.04
    assert "torque past the knee" not in found["errors"]
    assert found["stress_within_stated_error"] == [1, 2]


@pytest.mark.needs_cad
def test_without_ccx_the_benchmark_says_so_and_ends_with_2():
    done = subprocess.run(
        [sys.executable, str(ROOT / "benchmarks" / "random_designs.py"), "--count", "1"],
        env={"PATH": "", "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 2
    assert done.stderr == "ccx is missing: apt-get install calculix-ccx (Debian)\n"
