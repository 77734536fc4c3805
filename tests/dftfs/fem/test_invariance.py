"""Objectivity, consistent tangents, symmetry and free choice of units hold for any displacement."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from dftfs.fem.assembly import STATUS_INVERTED, ElasticBody
from dftfs.fem.constraints import clamped, dof_map, rigid_rotation
from dftfs.fem.mesh import extruded, rotation_about_z
from dftfs.fem.newton import StaticProblem, solve_path
from dftfs.fem.recover import recover_stress, von_mises
from tests.cases.fem import ring_part, wrinkled
from tests.cases.round_off import EPS

YOUNG, POISSON, THICKNESS = 68e9, 0.33, 0.007
PLANE = ring_part(0.02, 0.03, 1.1, 3, 2, lean_rad=0.3)
SOLID = extruded(PLANE, np.array([0.0, 0.004, 0.007]))
FEW = settings(max_examples=8, deadline=None)
SEEDS = st.integers(0, 2**31)
ANGLES = st.floats(-20.0, 20.0)
MESHES = pytest.mark.parametrize("mesh", [PLANE, SOLID], ids=["plane stress", "solid"])


def body_of(mesh):
    """An elastic body held nowhere but at one node (the pattern needs no more)."""
    dofs = dof_map(mesh, (clamped(np.array([0])),), None, None)
    thickness = THICKNESS if mesh.dim == 2 else 1.0
    return ElasticBody(
        mesh, dofs, youngs_modulus_Pa=YOUNG, poisson_ratio=POISSON, thickness_m=thickness
    )


def turn_of(mesh, angle, seed):
    """A rotation: about z in the plane, about any axis in space."""
    if mesh.dim == 2:
        return rotation_about_z(angle, 2)
    axis = np.random.default_rng(seed).normal(size=3)
    return Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).as_matrix()


@MESHES
@FEW
@given(angle=ANGLES, shift_m=st.floats(-0.1, 0.1), seed=SEEDS)
def test_a_rigid_motion_of_any_size_needs_no_force(mesh, angle, shift_m, seed):
    turn = turn_of(mesh, angle, seed)
    moved = mesh.nodes @ turn.T + shift_m * np.arange(1, mesh.dim + 1)
    found = body_of(mesh).forces(moved - mesh.nodes)
    # displacements are rounded, and an element's strain is their difference over its length;
    # compared are the forces and the energy of that strain
    ends = mesh.nodes[mesh.cells[:, :2]]
    shortest_m = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).min()
    displaced_m = np.abs(moved - mesh.nodes).max()
    strain = 2 * mesh.cells.shape[1] * EPS * max(displaced_m, 0.03) / shortest_m
    meeting = 2**mesh.dim  # elements in a node
    assert np.abs(found.force_N).max() < meeting * strain * YOUNG * 0.01 * THICKNESS
    assert found.energy_J < strain**2 * YOUNG * 0.01**2 * THICKNESS
    assert found.det_F_min == pytest.approx(1, abs=mesh.dim * strain)


@MESHES
@FEW
@given(angle=ANGLES, seed=SEEDS)
def test_turning_a_deformed_body_turns_its_forces_and_keeps_its_stress(mesh, angle, seed):
    turn = turn_of(mesh, angle, seed)
    u = wrinkled(mesh, 2e-4, seed)
    turned = (mesh.nodes + u) @ turn.T - mesh.nodes
    body = body_of(mesh)
    before, after = body.forces(u), body.forces(turned)
    scale = np.abs(before.force_N).max()
    np.testing.assert_allclose(after.force_N, before.force_N @ turn.T, rtol=0, atol=1e-11 * scale)
    assert after.energy_J == pytest.approx(before.energy_J, rel=1e-11)


@MESHES
@FEW
@given(angle=ANGLES, seed=SEEDS)
def test_turning_the_mesh_turns_all_results(mesh, angle, seed):
    turn = turn_of(mesh, angle, seed)
    u = wrinkled(mesh, 2e-4, seed)
    before = body_of(mesh).forces(u)
    after = body_of(replace(mesh, nodes=mesh.nodes @ turn.T)).forces(u @ turn.T)
    scale = np.abs(before.force_N).max()
    np.testing.assert_allclose(after.force_N, before.force_N @ turn.T, rtol=0, atol=1e-11 * scale)


@MESHES
@FEW
@given(seed=SEEDS)
def test_forces_are_the_slope_of_the_energy_and_the_tangent_that_of_the_forces(mesh, seed):
    body = body_of(mesh)
    u, direction = wrinkled(mesh, 2e-4, seed), wrinkled(mesh, 1.0, seed + 1)
    step = 1e-8
    ahead, behind = body.forces(u + step * direction), body.forces(u - step * direction)
    here, product = body.tangent(u, direction)
    np.testing.assert_array_equal(here.force_N, body.forces(u).force_N)
    power = (ahead.energy_J - behind.energy_J) / (2 * step)
    assert np.vdot(here.force_N, direction) == pytest.approx(power, rel=1e-6)
    slope = (ahead.force_N - behind.force_N) / (2 * step)
    np.testing.assert_allclose(product, slope, rtol=0, atol=1e-6 * np.abs(slope).max())


@MESHES
@FEW
@given(seed=SEEDS)
def test_the_sparse_tangent_is_symmetric_and_the_one_of_the_elements(mesh, seed):
    """The upper triangle, applied both ways, against products formed element by element."""
    body, dofs = body_of(mesh), dof_map(mesh, (clamped(np.array([0])),), None, None)
    u = wrinkled(mesh, 2e-4, seed)
    a, b = (np.random.default_rng(seed + k).normal(size=dofs.n_free) for k in (1, 2))
    _, product_a = body.tangent(u, dofs.expand(a))
    _, product_b = body.tangent(u, dofs.expand(b))
    np.testing.assert_allclose(
        body.multiply(a), dofs.restrict(product_a), rtol=0, atol=1e-11 * np.abs(product_a).max()
    )
    assert b @ body.multiply(a) == pytest.approx(a @ dofs.restrict(product_b), rel=1e-9)


@MESHES
def test_the_same_input_gives_the_same_bits(mesh):
    u = wrinkled(mesh, 2e-4, seed=9)
    first, second = body_of(mesh), body_of(mesh)
    assert first.tangent(u, u)[0].force_N.tobytes() == second.tangent(u, u)[0].force_N.tobytes()
    assert first.stiffness.tobytes() == second.stiffness.tobytes()


@MESHES
def test_an_inverted_element_is_a_status_that_names_the_cell(mesh):
    u = np.zeros_like(mesh.nodes)
    u[mesh.cells[2]] = -1.5 * (mesh.nodes[mesh.cells[2]] - mesh.nodes[mesh.cells[2]].mean(axis=0))
    found = body_of(mesh).forces(u)
    assert found.status == STATUS_INVERTED
    assert found.det_F_min < 0
    assert found.cell >= 0


@MESHES
def test_lengths_in_millimetres_and_moduli_in_megapascals_give_the_same_spring(mesh):
    """Torque scales by 1e3 from m, Pa to mm, MPa; angles and ratios don't scale."""
    torque, stress = [], []
    for length, modulus in ((1.0, 1.0), (1e3, 1e-6)):
        scaled = replace(mesh, nodes=mesh.nodes * length)
        problem = StaticProblem(
            mesh=scaled,
            youngs_modulus_Pa=YOUNG * modulus,
            poisson_ratio=POISSON,
            thickness_m=THICKNESS * length if mesh.dim == 2 else None,
            supports=(clamped(scaled.boundary_nodes("low1")),),
            drive=rigid_rotation(scaled, scaled.boundary_nodes("high1")),
        )
        state = solve_path(problem, [0.05]).states[-1]
        torque.append(state.drive_force)
        stress.append(recover_stress(problem, state.displacement_m).von_mises_Pa)
    assert torque[1] == pytest.approx(1e3 * torque[0], rel=1e-10)
    np.testing.assert_allclose(1e6 * stress[1], stress[0], rtol=1e-9)


@FEW
@given(seed=SEEDS)
def test_von_mises_stress_is_that_of_the_principal_stresses(seed):
    """Also of a plane tensor, whose third principal stress is zero: Timoshenko, art. 80."""
    square = np.random.default_rng(seed).normal(size=(5, 3, 3))
    tensor = square + square.transpose(0, 2, 1)
    for dim in (3, 2):
        part = tensor[:, :dim, :dim]
        principal = np.zeros((5, 3))
        principal[:, :dim] = np.linalg.eigvalsh(part)
        a, b, c = principal.T
        exact = np.sqrt(((a - b) ** 2 + (b - c) ** 2 + (c - a) ** 2) / 2)
        np.testing.assert_allclose(von_mises(part), exact, rtol=1e-12)
