"""Edges, rod and elements of a tapered strip agree, and a taper of nothing is none."""

import numpy as np
import pytest

from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.design import design_toml, load_design
from dftfs.errors import DesignError
from dftfs.fem.newton import linear_tangent
from dftfs.spring.outline import coil_gap
from dftfs.spring.planar_rod import Rod, twist_stiffness
from dftfs.spring.rod import arm_rod
from dftfs.spring.rod_kernel import element_nodes

RIM_MM = {"thinner": 6.5, "thicker": 8.3}


def tapered(rim_mm, **changes):
    return load_design("al1", {"rim_thickness_mm": f"{rim_mm}", **changes})


def rod_stiffness(design):
    material = design.material
    arm = arm_rod(
        design.outline, design.width_m, material.youngs_modulus_Pa, material.poisson_ratio
    )
    return design.n_arms * twist_stiffness(arm.rod)


@pytest.mark.parametrize("rim_mm", RIM_MM.values(), ids=RIM_MM)
def test_edges_of_a_taper_have_the_tangents_length_and_area_of_their_points(rim_mm):
    outline = tapered(rim_mm).outline
    for name in ("arm_outer:0", "arm_inner:0"):
        edge, t = outline.edge(name), np.linspace(0.02, 0.98, 41)
        step = (edge.point(t + 1e-6) - edge.point(t - 1e-6)) / 2e-6
        np.testing.assert_allclose(
            edge.tangent(t), step / np.linalg.norm(step, axis=1)[:, None], atol=1e-7
        )
        fine = edge.point(np.linspace(0, 1, 40001))
        chord = np.diff(fine, axis=0)
        assert edge.length_m == pytest.approx(np.hypot(*chord.T).sum(), rel=1e-7)
        x, y = fine[:-1].T
        assert edge.area_m2 == pytest.approx(
            0.5 * np.sum(x * chord[:, 1] - y * chord[:, 0]), rel=1e-6
        )


@pytest.mark.parametrize("rim_mm", RIM_MM.values(), ids=RIM_MM)
def test_rod_of_a_taper_is_within_half_a_percent_of_its_elements(rim_mm):
    design = tapered(rim_mm)
    problem = TorsionProblem(design=design, dimension=2)
    elements = problem.copies * linear_tangent(problem.static_problem())
    assert rod_stiffness(design) == pytest.approx(elements, rel=5e-3)
    uniform = rod_stiffness(load_design("al1"))
    assert (elements > uniform) == (rim_mm > 7.7)


def test_tapered_cantilever_rod_bends_as_its_compliance_integral_says():
    """Tip moment on a straight rod: turn = integral of M ds / (E I), I growing as h^3."""
    s = np.linspace(0, 1.0, 81)
    height = 0.02 * (1 + 0.8 * s)
    inertia = 1e-2 * height**3 / 12
    rod = Rod(
        nodes_m=np.column_stack([s, 0 * s]),
        angles_rad=0 * s,
        bending_stiffness_Nm2=(70e9 * inertia)[element_nodes(len(s))],
        axial_stiffness_N=70e9 * 1e-2 * height,
        shear_stiffness_N=20e9 * 1e-2 * height,
    )
    # turned about its own start: moment and force at the end do what a clamped-clamped bar does
    flexibility = np.zeros((2, 2))
    fine = np.linspace(0, 1.0, 20001)
    bending = 70e9 * 1e-2 * (0.02 * (1 + 0.8 * fine)) ** 3 / 12
    shear = 20e9 * 1e-2 * 0.02 * (1 + 0.8 * fine)
    lever = 1 - fine
    for i, a in enumerate((lever, np.ones_like(fine))):
        for k, b in enumerate((lever, np.ones_like(fine))):
            flexibility[i, k] = np.trapezoid(a * b / bending, fine)
    flexibility[0, 0] += np.trapezoid(1 / shear, fine)
    stiffness = np.linalg.inv(flexibility)
    carried = np.array([1.0, 1.0])  # a unit turn about the origin lifts the end by its distance
    assert twist_stiffness(rod) == pytest.approx(carried @ stiffness @ carried, rel=1e-5)


def test_a_taper_to_the_same_thickness_is_no_taper():
    same, plain = tapered(7.7), load_design("al1")
    assert same.spiral.taper is None
    assert same.outline.area_m2 == plain.outline.area_m2
    assert rod_stiffness(same) == rod_stiffness(plain)


def test_gap_between_coils_counts_both_thicknesses():
    thin, plain = tapered(6.5).spiral, load_design("al1").spiral
    theta = np.array([thin.centreline.end - 0.1])
    behind = theta - thin.pitch_rad
    wider = (7.7e-3 - thin.thickness_at(theta) + 7.7e-3 - thin.thickness_at(behind)) / 2
    np.testing.assert_allclose(coil_gap(thin, theta) - coil_gap(plain, theta), wider, atol=2e-5)


def test_a_tapered_design_is_written_and_read_back(tmp_path):
    design = tapered(6.5)
    file = tmp_path / "t.toml"
    file.write_text(design_toml(design))
    assert load_design(str(file)).spiral == design.spiral


@pytest.mark.needs_cad
def test_a_tapered_design_is_cut(tmp_path):
    from dftfs.cad.export import export_part

    design = tapered(6.5)
    made = export_part(
        design.outline,
        design.width_m,
        "t",
        tmp_path,
        density_kg_per_m3=2700.0,
        material="al-6061-t6",
    )
    assert abs(made.step.volume_error) < 1e-6


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rim_mm": -1.0}, "rim_thickness_mm = -1 must be positive"),
        ({"rim_mm": 6.5, "hub_radius_mm": "34"}, "a fillet reaches into the tapered part"),
    ],
)
def test_tapers_that_are_none_are_refused_in_one_line(changes, message):
    with pytest.raises(DesignError, match=message):
        tapered(**changes)
