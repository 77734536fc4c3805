"""Contact of facet sets agrees with closed forms and does not depend on the step size.

Sources: Taylor & Papadopoulos, On a patch test for contact problems in two dimensions (1991);
Johnson, Contact Mechanics (1985), 4.2; Timoshenko's beam with a support that closes.
"""

from dataclasses import replace

import numpy as np
import pytest

from dftfs.fem.assembly import ElasticBody
from dftfs.fem.constraints import clamped, dof_map
from dftfs.fem.contact import ContactBody
from dftfs.fem.contacting_body import ContactingBody
from dftfs.fem.elements import facet_table
from dftfs.fem.mesh import extruded
from dftfs.fem.newton import solve_path
from dftfs.fem.problem import StaticProblem
from dftfs.fem.recover import cauchy_stress
from tests.cases.contact import E_PA, cylinder_on_flat, pushed, sagitta, surfaces, two_blocks
from tests.cases.fem import mapped_mesh, side_by_side, straight_bar, wrinkled


@pytest.mark.parametrize("dim", [2, 3])
def test_contact_tangent_is_the_derivative_of_contact_forces(dim):
    mesh = two_blocks(dim)
    dofs = dof_map(mesh, (clamped(mesh.boundary_nodes("low_low2")),), None, None)
    body = ElasticBody(mesh, dofs, youngs_modulus_Pa=1.0, poisson_ratio=0.3, thickness_m=1.0)
    soft = {"stiffness_Pa_per_m": 1e6, "smoothing_m": 2e-3, "reach_m": 0.02, "deepest_m": 0.02}
    contact = surfaces(mesh, "up_low2", "low_high2", **soft)
    both = ContactingBody(body, ContactBody(mesh, contact, 1.0))
    u = wrinkled(mesh, 5e-4, 3)
    along = wrinkled(mesh, 1.0, 4)
    along[dofs.prescribed] = 0.0
    step = 1e-7
    evaluation, product = both.tangent(u, along)
    assert evaluation.contact_energy_J > 100 * body.forces(u).energy_J
    difference = (both.forces(u + step * along).force_N - both.forces(u - step * along).force_N) / (
        2 * step
    )
    assert product == pytest.approx(difference, abs=2e-5 * np.abs(difference).max())
    free = np.array([along[node, i] for node, i in _free_entries(dofs)])
    assert both.multiply(free) == pytest.approx(dofs.restrict(product), rel=1e-9, abs=1e-9)
    energy = (both.forces(u + step * along).energy_J - both.forces(u - step * along).energy_J) / (
        2 * step
    )
    assert energy == pytest.approx(float((evaluation.force_N * along).sum()), rel=1e-6)


def _free_entries(dofs):
    where = np.argwhere(dofs.dof[:-1] >= 0)
    return where[np.argsort(dofs.dof[:-1][dofs.dof[:-1] >= 0])]


@pytest.mark.parametrize("dim", [2, 3])
def test_patch_test_carries_uniform_pressure_across_unlike_meshes(dim):
    """Uniform compression of two blocks whose meshes do not match: within 1 % everywhere."""
    height, compression, stiffness = 0.02, 2e-5, 1e13
    low = mapped_mesh(5, 2, lambda s, t: (0.06 * s, height * (t - 1)))
    up = mapped_mesh(7, 2, lambda s, t: (0.06 * s, height * t))
    mesh = side_by_side(low=low, up=up)
    if dim == 3:
        mesh = extruded(mesh, np.array([0.0, 0.01, 0.02]))
    points = {"points_per_direction": 6}
    down = (0.0, -1.0) if dim == 2 else (0.0, -1.0, 0.0)
    left = np.union1d(mesh.boundary_nodes("low_low1"), mesh.boundary_nodes("up_low1"))
    base = mesh.boundary_nodes("low_low2")
    supports = [clamped(left, components=(0,)), clamped(base, components=(1,))]
    if dim == 3:
        supports.append(clamped(mesh.boundary_nodes("bottom"), components=(2,)))
    problem = StaticProblem(
        mesh=mesh,
        youngs_modulus_Pa=E_PA,
        poisson_ratio=0.3,
        thickness_m=0.02 if dim == 2 else None,
        supports=tuple(supports),
        drive=pushed(mesh, "up_high2", down),
        contact=surfaces(mesh, "up_low2", "low_high2", stiffness_Pa_per_m=stiffness, **points),
    )
    state = solve_path(problem, [compression]).states[-1]
    wanted = compression / (2 * height / E_PA + 1 / stiffness)
    stress = cauchy_stress(problem, state.displacement_m)[..., 1, 1]
    assert stress == pytest.approx(np.full(stress.shape, -wanted), rel=0.01)
    assert state.touch.pressure_Pa == pytest.approx(
        np.full(state.touch.pressure_Pa.shape, wanted), rel=0.01
    )


def test_hertz_cylinder_on_a_flat_has_its_pressure_and_width():
    """p0 = sqrt(P E* / (pi R)), a = sqrt(4 P R / (pi E*)) per width; plane stress: E* = E / 2."""
    radius = 1.0
    mesh = cylinder_on_flat(radius, 0.25, 0.3)
    problem = StaticProblem(
        mesh=mesh,
        youngs_modulus_Pa=E_PA,
        poisson_ratio=0.3,
        thickness_m=1.0,
        supports=(
            clamped(mesh.boundary_nodes("low_low2")),
            clamped(mesh.boundary_nodes("up_high2"), components=(0,)),
        ),
        drive=pushed(mesh, "up_high2", (0.0, -1.0)),
        contact=surfaces(mesh, "up_low2", "low_high2", stiffness_Pa_per_m=3e14),
    )
    state = solve_path(problem, [2e-4]).states[-1]
    force, effective = state.drive_force, E_PA / 2
    p0 = np.sqrt(force * effective / (np.pi * radius))
    width = np.sqrt(4 * force * radius / (np.pi * effective))
    x = mesh.nodes[mesh.facets("up_low2")][..., 0] @ facet_table(2, 3).values.T
    pressure = state.touch.pressure_Pa
    assert pressure.max() == pytest.approx(p0, rel=0.02)
    # p^2 = p0^2 (1 - x^2 / a^2): a straight line in x^2
    inside = np.abs(x) < 0.8 * width
    fit = np.polyfit(x[inside] ** 2, pressure[inside] ** 2, 1)
    assert np.sqrt(-fit[1] / fit[0]) == pytest.approx(width, rel=0.02)
    assert np.sqrt(fit[1]) == pytest.approx(p0, rel=0.02)


def stopped_cantilever() -> tuple[StaticProblem, float, float, float]:
    """A slender bar, tip pushed down, with a round stop under it; knee, stiffness before, after."""
    length, height, gap, at, nose, wide = 1.0, 0.01, 1e-4, 0.6, 2e-3, 1e-3
    bar = straight_bar(length, height, 60, 1)
    stop = mapped_mesh(
        12,
        2,
        lambda s, t: (
            at + wide * (s - 0.5),
            -height / 2 - gap - wide * (1 - t) - t * sagitta(nose, wide * (s - 0.5)),
        ),
    )
    mesh = side_by_side(bar=bar, stop=stop)
    problem = StaticProblem(
        mesh=mesh,
        youngs_modulus_Pa=E_PA,
        poisson_ratio=0.0,
        thickness_m=0.01,
        supports=(
            clamped(mesh.boundary_nodes("bar_low1")),
            clamped(mesh.boundary_nodes("stop_low2")),
        ),
        drive=pushed(mesh, "bar_high1", (0.0, -1.0)),
        contact=surfaces(mesh, "stop_high2", "bar_low2", smoothing_m=1e-8, stiffness_Pa_per_m=1e14),
    )
    bending, shear = E_PA * 0.01 * height**3 / 12, 5 / 6 * E_PA / 2 * 0.01 * height
    tip = length**3 / (3 * bending) + length / shear
    cross = at**2 * (3 * length - at) / (6 * bending) + at / shear
    own = at**3 / (3 * bending) + at / shear
    return problem, gap * tip / cross, 1 / tip, 1 / (tip - cross**2 / own)


@pytest.mark.parametrize("steps", [1, 2, 7, 40])
def test_cantilever_meeting_a_stop_has_its_bilinear_law_at_any_step_size(steps):
    problem, knee, before, after = stopped_cantilever()
    path = solve_path(problem, np.linspace(0, 3 * knee, steps + 1)[1:])
    state = path.states[-1]
    assert state.drive_force == pytest.approx(before * knee + after * 2 * knee, rel=1e-3)
    assert state.drive_stiffness == pytest.approx(after, rel=1e-3)
    assert path.states[0].drive_stiffness == pytest.approx(before, rel=1e-3)


def test_contact_lets_go_again_when_the_load_returns():
    problem, knee, before, _ = stopped_cantilever()
    path = solve_path(problem, [2 * knee, 0.5 * knee])
    assert path.states[-1].drive_force == pytest.approx(0.5 * knee * before, rel=1e-3)
    assert path.states[-1].touch.pressure_Pa.max() == 0.0


def test_augmentation_takes_the_penetration_of_a_soft_penalty_out():
    problem, knee, before, after = stopped_cantilever()
    soft = replace(problem.contact, law=replace(problem.contact.law, stiffness_Pa_per_m=2e11))
    wanted = before * knee + after * 2 * knee
    errors, depths = [], []
    for augmentations in (0, 12):
        contact = replace(soft, law=replace(soft.law, augmentations=augmentations))
        state = solve_path(replace(problem, contact=contact), [3 * knee]).states[-1]
        errors.append(abs(state.drive_force / wanted - 1))
        depths.append(state.touch.penetration_m)
    assert depths[1] < 0.1 * depths[0]
    assert errors[1] < 1e-3 < errors[0]
