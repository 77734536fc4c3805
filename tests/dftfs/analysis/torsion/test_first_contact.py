"""The first contact is where the gap is zero, also if the gap falls much faster shortly before."""

from types import SimpleNamespace

import numpy as np
import pytest

from dftfs.analysis.meshing.blocks import MeshSizing
from dftfs.analysis.torsion.contact_path import path_to_contact
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.design import load_design

COARSE = MeshSizing(across=2, along=1.0, fillet=2.0, growth=1.0, ring=1.2)
EXPECTED_rad, THICKNESS_m = 0.1, 7.7e-3


@pytest.mark.parametrize("steeper", [1.0, 30.0])
def test_the_gap_is_zero_at_the_first_contact(steeper):
    """A gap of the largest displacement with a kink: other points of the edges become nearest."""
    problem = TorsionProblem(design=load_design("al1"), dimension=2, sizing=COARSE)
    static = problem.static_problem()
    found = []

    def clearance(moved=None):
        moved = np.zeros((1, 2)) if moved is None else moved
        left = 8.3e-3 - float(np.max(np.linalg.norm(moved, axis=1)))
        gap = left if left > 0.05e-3 else 0.05e-3 - steeper * (0.05e-3 - left)
        found.append(gap)
        return SimpleNamespace(smallest_m=gap, at_m=np.zeros(2))

    problem.__dict__["coil_gap"] = SimpleNamespace(clearance=clearance)
    path_to_contact(problem, static, 1.0, EXPECTED_rad, 2, [], "auto")
    assert abs(found[-1]) < 1e-4 * THICKNESS_m  # of the state at the contact
