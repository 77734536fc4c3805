"""Coulomb friction of facet sets agrees with closed forms and leaves no force over.

Sources: Coulomb's law for a sliding block; Johnson, Contact Mechanics (1985), 7.2 (partial slip of
cylinders: Cattaneo 1938, Mindlin 1949).
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dftfs.errors import SolveError
from dftfs.fem.assembly import ElasticBody
from dftfs.fem.constraints import Drive, clamped, dof_map
from dftfs.fem.contact import ContactBody
from dftfs.fem.contacting_body import ContactingBody
from dftfs.fem.elements import facet_table
from dftfs.fem.mesh import extruded
from dftfs.fem.newton import PathState, solve_path
from dftfs.fem.problem import StaticProblem
from tests.cases.contact import E_PA, cylinder_on_flat, law, surfaces, two_blocks
from tests.cases.fem import mapped_mesh, side_by_side, wrinkled

DOWN_M, AREA_M2 = 2e-5, 0.03 * 0.02


def pressed_and_shifted(mesh, boundary: str, down_m: float) -> Drive:
    """Nodes moved down by ``down_m`` for t up to 1, then along x by (t - 1) ``down_m``."""
    nodes = mesh.boundary_nodes(boundary)
    unit = np.zeros((len(nodes), mesh.dim))
    first, then = unit.copy(), unit.copy()
    first[:, 1], then[:, 0] = -down_m, down_m

    def motion(t: float):
        if t <= 1:
            return t * first, first, unit
        return first + (t - 1) * then, then, unit

    return Drive(nodes=nodes, motion=motion, components=tuple(range(mesh.dim)))


def sliding_block(dim: int, coefficient: float) -> StaticProblem:
    """A short block on a long one, its top pressed down and pushed along."""
    low = mapped_mesh(8, 1, lambda s, t: (0.08 * s - 0.02, 0.02 * (t - 1)))
    up = mapped_mesh(3, 2, lambda s, t: (0.03 * s, 0.01 * t))
    mesh = side_by_side(low=low, up=up)
    if dim == 3:
        mesh = extruded(mesh, np.array([0.0, 0.02]))
    base = clamped(mesh.boundary_nodes("low_low2"))
    return StaticProblem(
        mesh=mesh,
        youngs_modulus_Pa=E_PA,
        poisson_ratio=0.3,
        thickness_m=0.02 if dim == 2 else None,
        supports=(base,),
        drive=pressed_and_shifted(mesh, "up_high2", DOWN_M),
        contact=surfaces(
            mesh,
            "up_low2",
            "low_high2",
            stiffness_Pa_per_m=1e13,
            friction_coefficient=coefficient,
        ),
    )


def friction_and_weight(problem: StaticProblem, state: PathState) -> tuple[float, float]:
    """Forces on the driven nodes: along x, and down."""
    total = state.reaction_N[problem.drive.nodes].sum(axis=0)
    return float(total[0]), float(-total[1])


@pytest.mark.parametrize("dim", [2, 3])
def test_sliding_block_needs_mu_times_its_weight_and_turns_the_work_into_heat(dim):
    mu = 0.3
    problem = sliding_block(dim, mu)
    shifts = [3.0, 5.0, 7.0, 9.0]
    states = solve_path(problem, [1.0, *(1 + s for s in shifts)]).states
    for state in states[-3:]:
        friction_force, weight = friction_and_weight(problem, state)
        assert friction_force == pytest.approx(mu * weight, rel=5e-4)  # the base bends a little
        assert state.friction.sliding == pytest.approx(1.0, abs=1e-6)
    travelled = DOWN_M * (shifts[-1] - shifts[-2])
    heat = states[-1].friction.dissipated_J - states[-2].friction.dissipated_J
    assert heat == pytest.approx(friction_force * travelled, rel=0.002)


def test_block_below_the_cone_sticks_with_the_stiffness_of_block_and_stick_in_series():
    problem = sliding_block(2, 5.0)
    far = solve_path(problem, [1.0, 1.02]).states[-1]
    nothing = solve_path(problem, [1.0]).states[-1]
    friction_force = friction_and_weight(problem, far)[0] - friction_and_weight(problem, nothing)[0]
    glued = replace(problem.contact.law, stick_ratio=1e4)
    rigid = replace(problem, contact=replace(problem.contact, law=glued))
    ends = [friction_and_weight(rigid, s)[0] for s in solve_path(rigid, [1.0, 1.02]).states[-2:]]
    series = 1 / (1 / (ends[1] - ends[0]) + 1 / (1e13 * AREA_M2 * 0.02 * DOWN_M))
    assert far.friction.dissipated_J < 1e-3 * far.friction.stored_J
    assert friction_force == pytest.approx(series, rel=0.02)


@settings(max_examples=6, deadline=None)
@given(
    coefficient=st.floats(0.02, 1.0),
    turns=st.lists(st.floats(-6, 6), min_size=2, max_size=4),
)
def test_dissipation_never_falls_and_no_traction_leaves_the_cone(coefficient, turns):
    problem = sliding_block(2, coefficient)
    drive = problem.drive

    def motion(s: float):  # along s the block is pressed first, then pushed to and fro
        t = np.interp(s, np.arange(len(turns) + 2), [0, 1, *(1 + abs(turn) for turn in turns)])
        return drive.motion(float(t))

    problem = replace(problem, drive=replace(drive, motion=motion))
    goals = np.arange(0.25, len(turns) + 1.01, 0.25)
    states = solve_path(problem, goals).states
    heat = np.array([s.friction.dissipated_J for s in states])
    assert np.all(np.diff(heat) >= 0)
    for state in states:
        limit = coefficient * state.touch.pressure_Pa
        assert np.all(state.friction.traction_Pa <= limit + 1e-5 * limit.max() + 1e-9)


def test_partial_slip_of_a_cylinder_has_the_stick_zone_of_cattaneo_and_mindlin():
    """q = mu (p - c/a p*), stick within c = a sqrt(1 - Q / (mu P))."""
    radius, mu, depth, hard = 1.0, 0.4, 2e-4, {"stiffness_Pa_per_m": 3e14}
    mesh = cylinder_on_flat(radius, 0.25, 0.3, finer=3)
    contact = surfaces(mesh, "up_low2", "low_high2", **hard, friction_coefficient=mu)
    problem = StaticProblem(
        mesh=mesh,
        youngs_modulus_Pa=E_PA,
        poisson_ratio=0.3,
        thickness_m=1.0,
        supports=(clamped(mesh.boundary_nodes("low_low2")),),
        drive=pressed_and_shifted(mesh, "up_high2", depth),
        contact=contact,
    )
    smooth = replace(problem, contact=replace(contact, law=law(**hard)))
    pressed = solve_path(smooth, [1.0]).states[-1:]
    state = solve_path(problem, [1.2, 1.4], start=pressed).states[-1]
    friction_force, weight = friction_and_weight(problem, state)
    assert friction_force / (mu * weight) == pytest.approx(0.62, abs=0.05)
    x = np.abs(mesh.nodes[mesh.facets("up_low2")][..., 0] @ facet_table(2, 3).values.T)
    half = np.sqrt(4 * weight * radius / (np.pi * E_PA / 2))
    stick = half * np.sqrt(1 - friction_force / (mu * weight))
    limit, traction = mu * state.touch.pressure_Pa, state.friction.traction_Pa
    slides = traction >= 0.999 * limit
    assert slides[(x > 1.05 * stick) & (x < 0.95 * half)].all()
    assert not slides[x < 0.95 * stick].any()
    inner = x < 0.8 * stick
    wanted = np.sqrt(1 - (x[inner] / half) ** 2)
    wanted -= stick / half * np.sqrt(1 - (x[inner] / stick) ** 2)
    wanted *= mu * 2 * weight / (np.pi * half)
    assert traction[inner] == pytest.approx(wanted, rel=0.02)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("coefficient", [50.0, 0.05])
def test_friction_tangent_is_the_derivative_of_its_forces_for_sticking_and_sliding(
    dim, coefficient
):
    mesh = two_blocks(dim)
    dofs = dof_map(mesh, (clamped(mesh.boundary_nodes("low_low2")),), None, None)
    body = ElasticBody(mesh, dofs, youngs_modulus_Pa=1.0, poisson_ratio=0.3, thickness_m=1.0)
    soft = {"stiffness_Pa_per_m": 1e6, "smoothing_m": 2e-3, "reach_m": 0.02, "deepest_m": 0.02}
    contact = surfaces(mesh, "up_low2", "low_high2", **soft, friction_coefficient=coefficient)
    both = ContactingBody(body, ContactBody(mesh, contact, 1.0))
    plain = ContactingBody(
        body, ContactBody(mesh, surfaces(mesh, "up_low2", "low_high2", **soft), 1.0)
    )
    start = wrinkled(mesh, 5e-4, 3)
    both.contact.restore(start, None)
    shifted = start + wrinkled(mesh, 1e-6, 6)
    shifted[np.unique(mesh.facets("up_low2")), 0] += 1e-5 if coefficient > 1 else 4e-4
    along = wrinkled(mesh, 1.0, 4)
    along[dofs.prescribed] = 0.0
    step = 1e-7

    def friction_forces(u):
        return both.forces(u).force_N - plain.forces(u).force_N

    found = both.tangent(shifted, along)[1] - plain.tangent(shifted, along)[1]
    wanted = friction_forces(shifted + step * along) - friction_forces(shifted - step * along)
    wanted /= 2 * step
    # what the tangent leaves out is of the order of traction over length
    scale = np.abs(plain.tangent(shifted, along)[1]).max()
    assert np.abs(wanted).max() > (0.3 if coefficient > 1 else 0.0) * scale
    assert found == pytest.approx(wanted, abs=0.01 * scale)


@pytest.mark.parametrize("dim", [2, 3])
def test_friction_leaves_neither_force_nor_moment_over(dim):
    mesh = two_blocks(dim)
    dofs = dof_map(mesh, (clamped(mesh.boundary_nodes("low_low2")),), None, None)
    body = ElasticBody(mesh, dofs, youngs_modulus_Pa=1.0, poisson_ratio=0.3, thickness_m=1.0)
    soft = {"stiffness_Pa_per_m": 1e6, "smoothing_m": 2e-3, "reach_m": 0.02, "deepest_m": 0.02}
    contact = surfaces(mesh, "up_low2", "low_high2", **soft, friction_coefficient=0.3)
    both = ContactingBody(body, ContactBody(mesh, contact, 1.0))
    start = wrinkled(mesh, 5e-4, 3)
    both.contact.restore(start, None)
    u = start + wrinkled(mesh, 3e-4, 6)
    force, place = both.forces(u).force_N, mesh.nodes + u
    scale = np.abs(force).sum()
    assert both.contact.friction.active.any()
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * scale
    moment = place[:, 0] * force[:, 1] - place[:, 1] * force[:, 0]
    assert abs(moment.sum()) < 1e-12 * scale


@pytest.mark.parametrize("wrong", [{"friction_coefficient": -0.1}, {"stick_ratio": 0.0}])
def test_friction_out_of_range_is_refused(wrong):
    with pytest.raises(SolveError, match="contact: friction_coefficient="):
        law(**wrong)
