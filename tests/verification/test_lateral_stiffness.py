"""The rim held by the spring alone: soft, and the same in every direction from three arms on."""

import numpy as np
import pytest

from dftfs.analysis.lateral import lateral_stiffness, softest_lateral_stiffness
from dftfs.analysis.torsion_problem import TorsionProblem
from dftfs.design import load_design


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
