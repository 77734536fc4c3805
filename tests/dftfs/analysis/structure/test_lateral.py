"""The spring alone holds the rim softly, and from three arms on equally in every direction."""

from dataclasses import replace

import numpy as np
import pytest

from dftfs.analysis.meshing.blocks import MeshSizing
from dftfs.analysis.meshing.sector_mesh import full_mesh
from dftfs.analysis.structure.lateral import (
    lateral_curve,
    lateral_stiffness,
    softest_lateral_stiffness,
)
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.design import load_design
from dftfs.errors import DesignError
from tests.cases import round_off


def test_two_arms_hold_the_rim_with_about_40_newtons_a_millimetre():
    """spec/spring.md: only about 40 N/mm, which makes a bearing mandatory."""
    problem = TorsionProblem(design=load_design("ref"), dimension=2)
    values = [lateral_stiffness(problem, direction_rad=a) for a in (0.0, 0.7, 1.4)]
    assert np.mean(values) == pytest.approx(40e3, rel=0.15)
    assert softest_lateral_stiffness(problem) <= min(values)


def test_three_arms_are_equally_stiff_in_every_direction():
    changes = {"n_arms": "3", "turns": "1.2", "thickness_mm": "6"}
    problem = TorsionProblem(design=load_design("al1", changes), dimension=2)
    values = [lateral_stiffness(problem, direction_rad=a) for a in (0.0, 0.4, 1.1)]
    assert np.ptp(values) < 1e-6 * np.mean(values)


def test_lateral_curve_starts_at_rest_and_is_pressed_sideways_by_one_arm_only():
    coarse = MeshSizing(across=2, along=1.2, fillet=2.0, growth=1.0, ring=1.2)
    two = TorsionProblem(design=load_design("al1"), dimension=2, sizing=coarse)
    low, rest, high = lateral_curve(two, [0.2, -0.15])
    assert (low.deflection_rad, rest.deflection_rad, high.deflection_rad) == (-0.15, 0, 0.2)
    wanted = softest_lateral_stiffness(two)
    rounding = round_off.of_stiffness(
        full_mesh(two.sector, 2), two.design.material, ("x", "y"), wanted, two.design.width_m
    )
    assert rest.softest_N_per_m == pytest.approx(wanted, rel=rounding)
    assert low.softest_N_per_m != pytest.approx(high.softest_N_per_m, rel=1e-3)
    assert low.force_N == rest.force_N == high.force_N == 0.0
    one = replace(two, design=load_design("al1", {"n_arms": "1"}))
    rest, turned = lateral_curve(one, [0.1])
    assert rest.force_N == pytest.approx(0.0, abs=1e-9)
    # nearly straight through rest: a secant of the coupling between turn and shift
    half = lateral_curve(one, [0.05])[1]
    assert turned.force_N == pytest.approx(2 * half.force_N, rel=0.1)
    assert turned.force_N > 1.0


def test_lateral_curve_is_of_the_planar_problem_only():
    with pytest.raises(DesignError, match="planar"):
        lateral_curve(TorsionProblem(design=load_design("al1")), [0.1])
