"""Plane stress is a start for the solid: fewer factorisations, the same equilibrium."""

import pytest

from dftfs.analysis.meshing.blocks import MeshSizing
from dftfs.analysis.torsion import contact_path
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.design import load_design

COARSE = MeshSizing(across=2, along=1.0, fillet=2.0, growth=1.0, ring=1.2)
NEAR_rad = 0.2


def states(problem: TorsionProblem) -> list:
    """States of al1 unwinding: before the first contact, at it, and in contact."""
    static = problem.static_problem()
    path = contact_path.path_to_contact(
        problem, static, -1.0, NEAR_rad, 1, [0.9 * NEAR_rad], "auto"
    )
    return list(contact_path.continued_in_contact(problem, path, -1.1 * NEAR_rad, 1, []).states)


def test_the_solid_finds_the_same_states_with_fewer_factorisations(monkeypatch):
    problem = TorsionProblem(design=load_design("al1"), dimension=3, sizing=COARSE)
    guessed = states(problem)
    monkeypatch.setattr(contact_path, "planar_guess", lambda *_, **__: None)
    plain = states(problem)
    assert len(guessed) == len(plain) > 3
    for one, other in zip(guessed, plain):
        assert one.t == pytest.approx(other.t, rel=1e-7)
        assert one.drive_force == pytest.approx(other.drive_force, rel=1e-7)
    spent = [sum(state.factorisations for state in found) for found in (guessed, plain)]
    assert spent[0] <= 0.6 * spent[1]


def test_a_problem_in_the_plane_needs_no_guess():
    problem = TorsionProblem(design=load_design("al1"), dimension=2, sizing=COARSE)
    assert contact_path.planar_guess(problem, [0.0, 0.1], contact=False, solver="auto") is None
