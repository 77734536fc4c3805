"""Every other centreline works with the same rod model, elements and CAD as Fermat's."""

import math

import numpy as np
import pytest

from dftfs.analysis.sizing.rod_candidate import assess_values
from dftfs.analysis.sizing.task import load_task
from dftfs.analysis.study.closed_form_design import closed_form_design
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.design import design_toml, load_design
from dftfs.errors import DesignError
from dftfs.fem.newton import linear_tangent
from dftfs.spring.centreline import CENTRELINES, GoldenSpiral
from dftfs.spring.planar_rod import twist_stiffness
from dftfs.spring.rod import RootLengths, arm_rod

GOLDEN_TURNS = math.log(75.07 / 18.38) / (4 * math.log((1 + math.sqrt(5)) / 2))
TURNS = {"archimedean": 1.9, "logarithmic": 1.3, "golden": GOLDEN_TURNS, "fermat": 1.9}


def curve(kind):
    return CENTRELINES[kind](
        inner_radius_m=0.01838, outer_radius_m=0.07507, turns=TURNS[kind], rotation_rad=0.4
    )


def design(kind, **changes):
    given = {"centreline": kind, "turns": f"{TURNS[kind]:.6f}", **changes}
    return load_design("ref", given)


@pytest.mark.parametrize("kind", TURNS)
def test_a_spiral_runs_between_its_radii_with_the_frame_of_its_own_points(kind):
    line, h = curve(kind), 1e-5
    assert np.hypot(*line.point(line.start)) == pytest.approx(0.01838, rel=1e-12)
    assert np.hypot(*line.point(line.end)) == pytest.approx(0.07507, rel=1e-12)
    assert line.end - line.start == pytest.approx(2 * np.pi * TURNS[kind], rel=1e-12)
    assert np.arctan2(*line.point(line.start)[::-1]) == pytest.approx(0.4)
    theta = np.linspace(line.start, line.end, 9)
    derivative = (line.point(theta + h) - line.point(theta - h)) / (2 * h)
    np.testing.assert_allclose(np.hypot(*derivative.T), line.speed(theta), rtol=1e-8)
    direction = derivative / line.speed(theta)[:, None]
    np.testing.assert_allclose(line.tangent(theta), direction, atol=1e-8)
    turned = (line.tangent(theta + h) - line.tangent(theta - h)) / (2 * h)
    turn_rate = -np.sum(turned * line.normal(theta), axis=1) / line.speed(theta)
    np.testing.assert_allclose(line.curvature(theta), turn_rate, rtol=1e-7)


def test_archimedes_has_one_pitch_and_his_arc_length():
    line = curve("archimedean")
    theta = np.linspace(line.start, line.end - 2 * np.pi, 5)
    steps = line.radius(theta + 2 * np.pi) - line.radius(theta)
    np.testing.assert_allclose(steps, (0.07507 - 0.01838) / 1.9, rtol=1e-12)

    def primitive(t):  # of sqrt(1 + t^2)
        return (t * math.sqrt(1 + t * t) + math.asinh(t)) / 2

    exact = line.pitch_m * (primitive(line.end) - primitive(line.start))
    assert line.length(line.start, line.end) == pytest.approx(exact, rel=1e-12)


def test_the_logarithmic_spiral_keeps_its_angle_and_has_its_arc_length():
    line = curve("logarithmic")
    k = line.growth_per_rad
    exact = (0.07507 - 0.01838) * math.sqrt(1 + k * k) / k
    assert line.length(line.start, line.end) == pytest.approx(exact, rel=1e-12)
    theta = np.linspace(line.start, line.end, 5)
    away = line.point(theta) / line.radius(theta)[:, None]
    angle = np.arccos(np.sum(away * line.tangent(theta), axis=1))
    np.testing.assert_allclose(angle, math.atan(1 / k), rtol=1e-12)


def test_the_golden_spiral_grows_by_the_golden_ratio_a_quarter_turn_and_has_no_choice_of_turns():
    line = curve("golden")
    golden = line.radius(line.start + np.pi / 2) / line.radius(line.start)
    assert golden == pytest.approx((1 + math.sqrt(5)) / 2, rel=1e-12)
    with pytest.raises(DesignError, match=r"has 0\.731 turns"):
        GoldenSpiral(inner_radius_m=0.01838, outer_radius_m=0.07507, turns=1.9)


@pytest.mark.parametrize(("kind", "tolerance"), [("archimedean", 0.002), ("logarithmic", 0.002)])
def test_rod_and_plane_stress_elements_agree_on_other_centrelines(kind, tolerance):
    """The root lengths were fitted on Fermat's spiral: they are of the roots, not of the curve."""
    spring = design(kind)
    problem = TorsionProblem(design=spring, dimension=2)
    elements = problem.copies * linear_tangent(problem.static_problem())
    rod = closed_form_design(spring)
    assert rod.stiffness_Nm_per_rad == pytest.approx(elements, rel=tolerance)
    assert rod.contact_onset["winding"].torque_Nm > 0 > rod.contact_onset["unwinding"].torque_Nm


def test_the_golden_arm_is_too_short_and_steep_for_the_rods_roots_by_no_more_than_5_percent():
    spring = design("golden")
    problem = TorsionProblem(design=spring, dimension=2)
    elements = problem.copies * linear_tangent(problem.static_problem())
    rod = spring.n_arms * twist_stiffness(
        arm_rod(spring.outline, spring.width_m, 68e9, spring.material.poisson_ratio).rod
    )
    assert rod == pytest.approx(elements, rel=0.05)


def test_a_slender_arm_of_any_curve_twists_by_its_length():
    """K = E I / L where both ends turn about the axis: thin strip, clamped at the feet, many turns.

    The forces at the ends stiffen it by what does not vanish with the thickness: below 5 % here.
    """
    for kind, turns in (("archimedean", 6), ("fermat", 6)):
        spring = design(
            kind,
            turns=str(turns),
            thickness_mm="0.5",
            fillet_radius_mm="0.2",
            bore_radius_mm="15",
            rim_inner_radius_mm="75.32",
            tip_radius_mm="0.05",
        )
        none = RootLengths(hub_m=0.0, slit_m=0.0)
        arm = arm_rod(spring.outline, spring.width_m, 68e9, 0.33, roots=none)
        inertia = spring.width_m * spring.spiral.thickness_m**3 / 12
        pure = 68e9 * inertia / arm.rod.length_m
        assert twist_stiffness(arm.rod) == pytest.approx(pure, rel=0.05)


def test_constant_pitch_holds_its_coils_apart_for_longer_than_fermat_in_both_directions():
    fermat, other = (
        closed_form_design(design(kind)).contact_onset for kind in ("fermat", "archimedean")
    )
    for side in ("winding", "unwinding"):
        assert abs(other[side].deflection_rad) > 1.5 * abs(fermat[side].deflection_rad)


@pytest.mark.needs_cad
def test_files_read_back_are_the_part_on_a_logarithmic_centreline(tmp_path):
    from dftfs.cad.export import export_part

    spring = design("logarithmic")
    made = export_part(
        spring.outline,
        spring.width_m,
        "log",
        tmp_path,
        density_kg_per_m3=2700,
        material="al-6061-t6",
        formats=("dxf",),
    )
    assert made.dxf_arcs.deviation_m <= 2e-6


def test_fibonacci_is_another_name_of_fermat_and_an_unknown_curve_is_refused(tmp_path):
    assert load_design("ref", {"centreline": "fibonacci"}).outline.area_m2 == pytest.approx(
        load_design("ref").outline.area_m2, rel=1e-15
    )
    with pytest.raises(DesignError, match="known are fermat"):
        load_design("ref", {"centreline": "clothoid"})
    path = tmp_path / "a.toml"
    path.write_text(design_toml(design("archimedean")))
    assert load_design(str(path)).spiral.curve == "archimedean"


def test_a_task_may_be_sized_on_another_centreline():
    task = load_task("default", {"centreline": "archimedean"})
    values = {"thickness_mm": 6.9, "inner_radius_mm": 16.0, "outer_radius_mm": 60.0}
    found = assess_values(task, {**values, "turns": 1.44, "fillet_radius_mm": 2.1})
    fermat = assess_values(
        load_task("default", {}), {**values, "turns": 1.44, "fillet_radius_mm": 2.1}
    )
    assert found.gap_left_m > fermat.gap_left_m
    with pytest.raises(DesignError, match="centreline"):
        load_task("default", {"centreline": "straight"})
