"""Bearing and free centre agree where the arms balance and differ for one arm."""

import pytest

from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.solve import solve_torsion
from dftfs.design import load_design
from dftfs.errors import DesignError
from dftfs.fem.newton import linear_tangent
from tests.cases import round_off


def test_two_arms_give_the_same_curve_with_bearing_and_free_centre():
    """spec/spring.md: by two-fold symmetry the same answer."""
    design = load_design("ref")
    rounding = round_off.of_planar_torsion(TorsionProblem(design=design, dimension=2), 65.0)
    bearing, free = (
        solve_torsion(
            TorsionProblem(design=design, dimension=2, boundary=boundary), states_per_direction=3
        )
        for boundary in ("bearing", "free-centre")
    )
    assert free.stiffness_Nm_per_rad == pytest.approx(bearing.stiffness_Nm_per_rad, rel=rounding)
    for direction in ("winding", "unwinding"):
        touch, same = free.contact_onset[direction], bearing.contact_onset[direction]
        assert touch.torque_Nm == pytest.approx(same.torque_Nm, rel=1e-5)
        assert touch.deflection_rad == pytest.approx(same.deflection_rad, rel=1e-5)
    assert bearing.mesh.nodes < free.mesh.nodes


def test_one_arm_is_softer_where_its_rim_may_find_its_own_place():
    """A single arm pushes the rim aside; a bearing holds it and so adds stiffness."""
    design = load_design("ref", {"n_arms": "1"})
    bearing, free = (
        linear_tangent(
            TorsionProblem(design=design, dimension=2, boundary=boundary).static_problem()
        )
        for boundary in ("bearing", "free-centre")
    )
    assert free < 0.99 * bearing


def test_solid_free_centre_is_the_solid_bearing():
    design = load_design("ref")
    values = []
    for boundary in ("bearing", "free-centre"):
        problem = TorsionProblem(design=design, dimension=3, boundary=boundary)
        values.append(problem.copies * linear_tangent(problem.static_problem()))
    assert values[1] == pytest.approx(values[0], rel=1e-7)


def test_unknown_boundary_condition_names_the_known_ones():
    with pytest.raises(DesignError, match=r"'torque' is unknown; known are bearing, free-centre"):
        TorsionProblem(design=load_design("ref"), boundary="torque")
