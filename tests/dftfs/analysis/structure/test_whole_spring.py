"""Stiffness in six directions, frequencies and stability agree with independent solutions."""

from dataclasses import replace

import numpy as np
import pytest

from dftfs.analysis.meshing.blocks import MeshSizing
from dftfs.analysis.structure.buckling import stability
from dftfs.analysis.structure.lateral import softest_lateral_stiffness
from dftfs.analysis.structure.linear_spring import HALVES, IN_PLANE, OUT_OF_PLANE, WholeSpring
from dftfs.analysis.structure.modes import locked_modes, turning_modes
from dftfs.analysis.structure.rim_stiffness import RimStiffness, rim_stiffness
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.design import load_design
from dftfs.errors import DesignError
from dftfs.fem.linear_model import RIGID_MOTIONS
from dftfs.fem.mesh import TaggedMesh, rotation_about_z
from dftfs.fem.newton import linear_tangent
from tests.cases import round_off

COARSE = MeshSizing(across=2, along=1.6, fillet=2.0, growth=1.2, ring=1.5)


def spring(name: str = "al1", **changes) -> WholeSpring:
    return WholeSpring(design=load_design(name, changes), sizing=COARSE, layers=1)


@pytest.fixture(scope="module")
def al1() -> WholeSpring:
    return spring()


def rounding(spring: WholeSpring, *motions: str) -> float:
    """Relative rounding of the stiffnesses in some of the six directions."""
    whole = np.diag(rim_stiffness(spring).matrix)[[RIGID_MOTIONS.index(m) for m in motions]]
    return round_off.of_stiffness(spring.mesh, spring.design.material, motions, whole / HALVES)


def test_torsion_of_the_six_is_that_of_the_turned_sector(al1):
    wanted = al1.torsion.copies * linear_tangent(al1.torsion.static_problem())
    found = rim_stiffness(al1).torsion_Nm_per_rad
    assert found == pytest.approx(wanted, rel=rounding(al1, "rz"))


def test_lateral_stiffness_of_the_six_is_that_of_plane_stress(al1):
    plane = TorsionProblem(design=al1.design, dimension=2, sizing=COARSE)
    found = rim_stiffness(al1).lateral_N_per_m[0]
    assert found == pytest.approx(softest_lateral_stiffness(plane), rel=2e-3)


@pytest.mark.parametrize("angle_rad", [0.3, -1.1])
def test_six_by_six_turns_with_the_frame(al1, angle_rad):
    turned = WholeSpring(design=al1.design, sizing=COARSE, layers=1)
    mesh = al1.mesh
    turn = rotation_about_z(angle_rad, 3)
    turned.__dict__["mesh"] = TaggedMesh(
        nodes=mesh.nodes @ turn.T, cells=mesh.cells, boundaries=dict(mesh.boundaries)
    )
    found, wanted = rim_stiffness(turned).matrix, rim_stiffness(al1).turned(-angle_rad).matrix
    scale = np.sqrt(np.outer(np.diag(wanted), np.diag(wanted)))
    assert found / scale == pytest.approx(wanted / scale, abs=rounding(al1, *RIGID_MOTIONS))


def test_three_arms_are_equally_stiff_in_every_direction_of_the_plane():
    found = rim_stiffness(spring(n_arms="3", turns="1.2", thickness_mm="6"))
    low, high = found.lateral_N_per_m
    assert high == pytest.approx(low, rel=1e-6)
    assert found.tilt_Nm_per_rad[1] == pytest.approx(found.tilt_Nm_per_rad[0], rel=1e-6)


def test_a_matrix_that_no_spring_has_is_refused():
    with pytest.raises(DesignError, match="symmetric"):
        RimStiffness(matrix=np.eye(6) + np.eye(6, k=1))
    with pytest.raises(DesignError, match="positive definite"):
        RimStiffness(matrix=np.diag([1.0, 1, 1, 1, 1, -1]))


def test_a_heavy_load_on_the_rim_swings_at_the_root_of_stiffness_over_inertia(al1):
    """And with a hub that turns too, against it: both inertias in series."""
    torsion, load, hub = rim_stiffness(al1).torsion_Nm_per_rad, 2.0, 0.5
    own = al1.inertia_kg_m2 / 2  # between none and all of the spring's own
    one = turning_modes(al1, load_inertia_kg_m2=load).modes[0]
    assert one.turning > 0.99
    assert 2 * np.pi * one.frequency_Hz == pytest.approx(np.sqrt(torsion / (load + own)), rel=1e-3)
    two = turning_modes(al1, load_inertia_kg_m2=load, hub_inertia_kg_m2=hub).modes[0]
    together = torsion * (1 / (load + own) + 1 / (hub + own))
    assert 2 * np.pi * two.frequency_Hz == pytest.approx(np.sqrt(together), rel=2e-3)


def test_frequencies_fall_as_the_density_rises_and_lock_what_turned(al1):
    locked = locked_modes(al1, 1)
    heavier = replace(al1.design.material, density_kg_per_m3=4 * 2700.0)
    design = replace(al1.design, material=heavier)
    factor = np.sqrt(al1.design.material.density_kg_per_m3 / 10800.0)
    slow = locked_modes(WholeSpring(design=design, sizing=COARSE, layers=1), 1)
    assert [m.frequency_Hz for m in slow.modes] == pytest.approx(
        [factor * m.frequency_Hz for m in locked.modes], rel=1e-6
    )
    free = turning_modes(al1)
    assert free.modes[0].frequency_Hz < locked.lowest(IN_PLANE).frequency_Hz
    with pytest.raises(DesignError, match="load-inertia"):
        turning_modes(al1, load_inertia_kg_m2=-1.0)


def test_a_strip_wider_than_thick_stays_flat_and_a_foil_does_not(al1):
    wide = stability(al1, [0.1])
    assert wide.stable
    assert wide.states[0].frequency_Hz == pytest.approx(
        locked_modes(al1, 1).lowest(OUT_OF_PLANE).frequency_Hz, rel=1e-6
    )
    foil = stability(spring(width_mm="0.5"), [0.15, 0.35])
    assert not foil.stable
    assert foil.critical_rad is not None
    assert 0 < foil.critical_rad < 0.35
    with pytest.raises(DesignError, match="in one direction"):
        stability(al1, [0.1, -0.2])
