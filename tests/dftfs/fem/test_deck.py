"""Decks and VTK files state the solved problem: CalculiX finds our torque within 1e-5."""

import shutil
import subprocess

import numpy as np
import pytest

from benchmarks.calculix_deck import torques_Nm
from dftfs.analysis.meshing.blocks import MeshSizing
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.ring_fields import HALVES, on_ring, ring_model, ring_of, ring_steps
from dftfs.design import load_design
from dftfs.errors import SolveError
from dftfs.fem.deck import deck
from dftfs.fem.vtu import pvd_text, vtu_text

COARSE = MeshSizing(across=2, along=1.6, fillet=2.0, growth=1.2, ring=1.5)
AT_RAD = [0.02]


@pytest.fixture(scope="module")
def solved():
    problem = TorsionProblem(design=load_design("al1"), sizing=COARSE)
    return problem, ring_of(problem), ring_steps(problem, AT_RAD)


def test_the_ring_carries_the_sectors_fields_turned_with_each_arm(solved):
    problem, ring, (step,) = solved
    rim = ring.boundary_nodes("rim_outer")
    x, y, _ = ring.nodes[rim].T
    moved = ring.nodes[rim] + step.displacement_m[rim]
    c, s = np.cos(AT_RAD[0]), np.sin(AT_RAD[0])
    np.testing.assert_allclose(
        moved[:, :2], np.stack([c * x - s * y, s * x + c * y], 1), atol=1e-12
    )
    place = on_ring(problem, problem.mesh.nodes)
    np.testing.assert_allclose(place, ring.nodes, atol=1e-12)
    assert step.von_mises_Pa.shape == (len(ring.nodes),)


def test_both_dialects_name_the_same_sets_and_differ_in_the_fields_they_ask_for(solved):
    problem, ring, _ = solved
    model = ring_model(problem, ring)
    texts = {
        d: deck(model, AT_RAD, tight=False, dialect=d, every_step=True, heading="al1")
        for d in ("calculix", "abaqus")
    }
    head = {d: text[: text.index("*STEP")] for d, text in texts.items()}
    assert head["calculix"] == head["abaqus"]
    for name in ("BORE", "RIM", "MIRROR"):
        assert f"*NSET, NSET={name}\n" in head["abaqus"]
    for name, facets in model.surfaces.items():
        rows = head["abaqus"].partition(f"*SURFACE, NAME={name}\n")[2].partition("\n*")[0]
        assert len(rows.splitlines()) == len(facets)
    assert "*NODE FILE" in texts["calculix"]
    assert "*OUTPUT, FIELD\n*NODE OUTPUT\nU, RF" in texts["abaqus"]
    with pytest.raises(SolveError, match="known are calculix, abaqus"):
        deck(model, AT_RAD, tight=False, dialect="ansys")


def test_vtk_reads_the_mesh_and_the_fields(solved, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    _, ring, (step,) = solved
    path = tmp_path / "a.vtu"
    fields = {"displacement_m": step.displacement_m, "von_mises_Pa": step.von_mises_Pa}
    path.write_text(vtu_text(ring, fields))
    grid = pyvista.read(path)
    np.testing.assert_allclose(grid.points, ring.nodes, atol=1e-9)
    assert grid.n_cells == len(ring.cells)
    assert set(grid.celltypes) == {25}
    np.testing.assert_allclose(grid.point_data["displacement_m"], step.displacement_m, atol=1e-9)
    assert 'timestep="0.02" file="a.vtu"' in pvd_text([(0.02, "a.vtu")])


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
def test_calculix_finds_our_torque(solved, tmp_path):
    problem, ring, (step,) = solved
    model = ring_model(problem, ring)
    (tmp_path / "a.inp").write_text(deck(model, AT_RAD, tight=True, direct=False, every_step=True))
    subprocess.run(["ccx", "-i", "a"], cwd=tmp_path, check=True, capture_output=True)
    torque = HALVES * torques_Nm((tmp_path / "a.dat").read_text(), model, len(AT_RAD))
    assert torque[0] == pytest.approx(step.torque_Nm, rel=1e-5)
