"""The spring's mesh covers the outline exactly and is the same in every sector."""

from dataclasses import replace

import numpy as np
import pytest

from dftfs.analysis.meshing.blocks import MeshSizing
from dftfs.analysis.meshing.planar_mesh import corner_quality
from dftfs.analysis.meshing.sector_mesh import full_mesh, sector_mesh, solid_mesh
from dftfs.errors import DesignError, MeshError
from dftfs.fem.mesh import jacobian_determinants
from dftfs.spring.outline import build_outline
from tests.cases.spring import FIT, ONE_ARM, REF, THREE_ARMS

# gmsh's Frontal-Delaunay for quads folds the hub's block of one and the rim's block of the other
FOLDED_HUB = replace(
    FIT,
    outer_radius_m=0.0676784590197185,
    turns=1.3058879612972296,
    thickness_m=0.008712205981352085,
    fillet_radius_m=0.0016579267530974007,
    rim_inner_radius_m=0.07203456201039456,
    rim_outer_radius_m=0.08074676799174663,
)
FOLDED_RIM = replace(
    FIT,
    outer_radius_m=0.0824729872631318,
    turns=2.194511961729785,
    thickness_m=0.006527054725512611,
    fillet_radius_m=0.0006212763302084711,
    rim_inner_radius_m=0.0857365146258881,
    rim_outer_radius_m=0.09226356935140072,
)
CASES = {
    "fit": FIT,
    "ref": REF,
    "three arms": THREE_ARMS,
    "one arm": ONE_ARM,
    "folded hub": FOLDED_HUB,
    "folded rim": FOLDED_RIM,
}
GAUSS_3X3 = np.outer([5, 8, 5], [5, 8, 5]).ravel() / 18**2  # on the unit square


@pytest.fixture(scope="module", params=CASES.values(), ids=CASES.keys())
def outline(request):
    return build_outline(request.param)


@pytest.fixture(scope="module")
def sector(outline):
    return sector_mesh(outline)


def area(mesh):
    return float(np.sum(jacobian_determinants(mesh) @ GAUSS_3X3))


def test_mesh_area_is_the_outlines(outline, sector):
    """Quadratic edges through exact points: the area is off by the fourth power of the size."""
    n_arms = outline.parameters.n_arms
    assert n_arms * area(sector) == pytest.approx(outline.area_m2, rel=2e-5)
    assert area(full_mesh(sector, n_arms)) == pytest.approx(outline.area_m2, rel=2e-5)


def test_every_boundary_node_lies_on_its_exact_edge(outline, sector):
    p = outline.parameters
    for name, radius in (
        ("bore", p.bore_radius_m),
        ("rim_outer", p.rim_outer_radius_m),
        ("hub", p.hub_radius_m),
        ("rim_inner", p.rim_inner_radius_m),
    ):
        nodes = sector.nodes[sector.boundary_nodes(name)]
        np.testing.assert_allclose(np.hypot(*nodes.T), radius, rtol=1e-12)
    edge = outline.edge("arm_inner:0").point(np.linspace(0, 1, 200001))
    nodes = sector.nodes[sector.boundary_nodes("arm_inner")]
    for node in nodes[::9]:
        assert np.min(np.hypot(*(edge - node).T)) < 4e-6  # half a sample of the comparison curve


def test_elements_are_usable(sector):
    quality = corner_quality(sector.nodes[sector.cells[:, :4]])
    assert quality.min() > 0.1
    assert np.percentile(quality, 5) > 0.6


def test_solid_mesh_keeps_boundaries_and_volume():
    outline = build_outline(FIT)
    sector = sector_mesh(outline)
    solid = solid_mesh(sector, np.array([0.0, 2e-3, 3.67e-3]))
    assert set(solid.boundaries) == set(sector.boundaries) | {"bottom", "top"}
    weights = np.einsum("i,j,k->ijk", *[np.array([5, 8, 5]) / 18] * 3).ravel()
    volume = float(np.sum(jacobian_determinants(solid) @ weights))
    assert volume == pytest.approx(area(sector) * 3.67e-3, rel=1e-12)


def test_sizing_controls_elements_across_the_strip():
    outline = build_outline(REF)
    fine = sector_mesh(outline, MeshSizing(across=4))
    coarse = sector_mesh(outline, MeshSizing(across=2))
    inner, outer = fine.boundaries["arm_inner"], coarse.boundaries["arm_inner"]
    assert len(inner) == pytest.approx(len(outer), rel=0.1)
    assert len(fine.cells) > 1.2 * len(coarse.cells)
    with pytest.raises(DesignError, match=r"across = 3 must be an even number"):
        MeshSizing(across=3)


def test_same_outline_gives_the_same_mesh():
    first, second = sector_mesh(build_outline(REF)), sector_mesh(build_outline(REF))
    np.testing.assert_array_equal(first.nodes, second.nodes)
    np.testing.assert_array_equal(first.cells, second.cells)


def test_an_arm_too_short_for_roots_and_strip_is_refused_in_one_line():
    short = replace(THREE_ARMS, turns=0.25)
    with pytest.raises(MeshError, match=r"too short or too steep .* more turns would work"):
        sector_mesh(build_outline(short))
    stub = replace(FIT, turns=0.35, hub_radius_m=62e-3, fillet_radius_m=1e-3)
    with pytest.raises(DesignError, match=r"turns = 0.35: .* turns above 0\.\d+ would work"):
        sector_mesh(build_outline(stub))
