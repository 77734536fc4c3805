"""Friction between coils takes the work put in as heat; without it the loop is closed."""

import numpy as np
import pytest

from dftfs.analysis.meshing.blocks import MeshSizing
from dftfs.analysis.strength.friction_loop import BALANCE, friction_loop, loop_checks
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.solve import solve_torsion
from dftfs.cli.main import main
from dftfs.design import load_design
from dftfs.errors import DesignError
from dftfs.report.figures.friction import friction_loop_figure

COARSE = MeshSizing(across=2, along=1.0, fillet=2.0, growth=1.0, ring=1.2)


@pytest.fixture(scope="module")
def al1():
    problem = TorsionProblem(design=load_design("al1"), dimension=2, sizing=COARSE)
    return problem, solve_torsion(problem, states_per_direction=3)


def test_heat_of_a_cycle_is_the_work_put_in_and_never_falls(al1):
    loop = friction_loop(*al1, 0.2, -0.27, steps=18)
    assert loop.external_work_J > 1e-4 * loop.strain_energy_J
    assert loop.loss_J == pytest.approx(loop.external_work_J, rel=BALANCE)
    assert np.all(np.diff(loop.dissipated_J) >= 0)
    assert loop.width_Nm.min() >= -1e-6 * loop.widest[0]
    assert loop.widest[0] == pytest.approx(
        np.abs(loop.torque_Nm - loop.torque_Nm[::-1]).max(), rel=1e-9
    )
    assert all(check.passed is not False for check in loop_checks(loop))
    assert loop.torque_Nm[[0, -1]] == pytest.approx(0.0, abs=1e-6)
    assert "loading" in friction_loop_figure(loop).alt


def test_no_friction_no_loop(al1):
    loop = friction_loop(*al1, 0.0, -0.24, steps=6)
    assert loop.loss_J == 0.0
    assert loop.imbalance == 0.0
    assert loop.torque_Nm == pytest.approx(loop.torque_Nm[::-1], abs=1e-6)


@pytest.mark.parametrize(
    ("coefficient", "turn_rad", "message"),
    [(0.2, -0.1, "must lie beyond the first contact"), (-1, -0.28, "contact-friction = -1")],
)
def test_a_loop_without_contact_or_sense_is_refused(al1, coefficient, turn_rad, message):
    with pytest.raises(DesignError, match=message):
        friction_loop(*al1, coefficient, turn_rad)


@pytest.mark.parametrize(
    "options",
    [
        ("--loop-rad", "-0.28"),
        ("--contact-friction", "3"),
        ("--contact-friction", "0.2", "--loop-rad", "0"),
    ],
)
def test_bad_options_of_a_loop_are_one_line_and_status_2(capsys, options):
    assert main(["verify", "al1", *options]) == 2
    error = capsys.readouterr().err.strip()
    assert "\n" not in error
