"""Elastic-plastic bodies agree with the closed forms of bending, springback and return mapping.

Sources: Hill, The Mathematical Theory of Plasticity (1950), IV.6 (bending of a bar); Simo &
Hughes, Computational Inelasticity (1998), box 3.2.
"""

import numpy as np
import pytest

from dftfs.errors import SolveError
from dftfs.fem.constraints import Drive, clamped, dof_map
from dftfs.fem.mesh import TaggedMesh, extruded
from dftfs.fem.newton import solve_path
from dftfs.fem.plastic_body import PlasticBody
from dftfs.fem.plasticity import Hardening, plastic_law, radial_return
from dftfs.fem.problem import StaticProblem
from tests.cases.fem import straight_bar, wrinkled

E_PA, NU, YIELD_PA = 70e9, 0.33, 275e6
LENGTH, HEIGHT, WIDTH = 0.005, 0.01, 0.005


def bent_bar(hardening_Pa: float, mesh: TaggedMesh) -> StaticProblem:
    """Ends stay plane and turn against each other by t; sides are free everywhere."""
    end = mesh.boundary_nodes("high1")
    arm = np.zeros((len(end), mesh.dim))
    arm[:, 0] = -mesh.nodes[end, 1]
    root = mesh.boundary_nodes("low1")
    middle = root[np.abs(mesh.nodes[root, 1]) < 1e-9]
    supports = [clamped(root, components=(0,)), clamped(middle[:1], components=(1,))]
    if mesh.dim == 3:
        supports.append(clamped(mesh.boundary_nodes("bottom"), components=(2,)))
    return StaticProblem(
        mesh=mesh,
        youngs_modulus_Pa=E_PA,
        poisson_ratio=NU,
        thickness_m=WIDTH if mesh.dim == 2 else None,
        supports=tuple(supports),
        drive=Drive(nodes=end, motion=lambda t: (t * arm, arm, 0 * arm), components=(0,)),
        hardening=Hardening(yield_strength_Pa=YIELD_PA, hardening_Pa=hardening_Pa),
    )


def moment(curvature: float, hardening_Pa: float) -> float:
    """Of a rectangular bar of linear hardening: elastic core, straight stress beyond."""
    half, tangent = HEIGHT / 2, E_PA * hardening_Pa / (E_PA + hardening_Pa)
    core = min(YIELD_PA / E_PA / curvature, half)
    elastic = E_PA * curvature * core**3 / 3
    plastic = (YIELD_PA - tangent * YIELD_PA / E_PA) * (half**2 - core**2) / 2
    plastic += tangent * curvature * (half**3 - core**3) / 3
    return 2 * WIDTH * (elastic + plastic)


@pytest.mark.parametrize(("dim", "hardening_Pa"), [(2, 0.0), (2, 7e9), (3, 7e9)])
def test_bent_bar_has_the_moment_springback_and_permanent_set_of_the_closed_form(dim, hardening_Pa):
    mesh = straight_bar(LENGTH, HEIGHT, 2, 12)
    if dim == 3:
        mesh = extruded(mesh, np.array([0.0, WIDTH]))
    first = 2 * YIELD_PA / E_PA / HEIGHT * LENGTH  # rotation at first yield
    problem = bent_bar(hardening_Pa, mesh)
    there = np.linspace(0, 3 * first, 13)[1:]
    path = solve_path(problem, [0.5 * first, *there, 2.5 * first, 2.4 * first])
    elastic = 2 * WIDTH * E_PA * (HEIGHT / 2) ** 3 / 3 / LENGTH
    assert path.at(0.5 * first).drive_force == pytest.approx(0.5 * first * elastic, rel=2e-3)
    loaded, back, further = (path.at(t) for t in (3 * first, 2.5 * first, 2.4 * first))
    wanted = moment(3 * first / LENGTH, hardening_Pa)
    assert loaded.drive_force == pytest.approx(wanted, rel=0.01)
    # unloading is elastic: the line through two states meets zero moment at the permanent set
    slope = (back.drive_force - further.drive_force) / (0.1 * first)
    assert slope == pytest.approx(elastic, rel=0.01)
    left = further.t - further.drive_force / slope
    springback = wanted / elastic
    assert 3 * first - left == pytest.approx(springback, rel=0.01)
    assert left == pytest.approx(3 * first - springback, rel=0.01)
    unloaded = solve_path(problem, [*there, left]).states[-1]
    assert abs(unloaded.drive_force) < 2e-3 * wanted


def test_plastic_strain_lies_where_the_stress_was_highest_and_keeps_the_volume():
    problem = bent_bar(7e9, straight_bar(LENGTH, HEIGHT, 2, 12))
    first = 2 * YIELD_PA / E_PA / HEIGHT * LENGTH
    history = solve_path(problem, [first, 2 * first]).states[-1].history
    trace = history[..., :3].sum(axis=-1)
    assert np.abs(trace).max() < 1e-12
    across = history[..., 6].reshape(2, 12, 9).max(axis=(0, 2))
    assert across[0] == pytest.approx(across[-1], rel=0.05)
    assert across[4:8].max() == 0.0 < across[0]


@pytest.mark.parametrize("dim", [2, 3])
def test_plastic_tangent_is_the_derivative_of_the_forces(dim):
    mesh = straight_bar(0.02, HEIGHT, 2, 1)
    if dim == 3:
        mesh = extruded(mesh, np.array([0.0, WIDTH]))
    dofs = dof_map(mesh, (clamped(mesh.boundary_nodes("low1")),), None, None)
    body = PlasticBody(
        mesh, dofs, youngs_modulus_Pa=E_PA, poisson_ratio=NU, thickness_m=1.0,
        hardening=Hardening(yield_strength_Pa=YIELD_PA, saturation_Pa=400e6, hardening_Pa=1e9),
    )  # fmt: skip
    u, along, step = wrinkled(mesh, 5e-5, 1), wrinkled(mesh, 1.0, 2), 1e-11
    u[dofs.prescribed] = along[dofs.prescribed] = 0.0
    _, product = body.tangent(u, along)
    up, down = (body.forces(u + sign * step * along).force_N for sign in (1, -1))
    difference = (up - down) / (2 * step)
    assert product == pytest.approx(difference, abs=1e-4 * np.abs(difference).max())
    assert np.count_nonzero(body.commit(u)[..., 6]) > 10


def test_stress_after_the_return_is_on_the_yield_surface():
    law = plastic_law(Hardening(yield_strength_Pa=YIELD_PA, hardening_Pa=2e9), E_PA, NU)
    S, C, new = np.empty(6), np.empty((6, 6)), np.empty(7)
    strain = np.array([0.01, -0.004, 0.002, 0.006, -0.003, 0.001])
    radial_return(strain, np.zeros(7), law, S, C, new)
    deviator = S.copy()
    deviator[:3] -= S[:3].mean()
    equivalent = np.sqrt(1.5 * (np.sum(deviator[:3] ** 2) + 2 * np.sum(deviator[3:] ** 2)))
    assert equivalent == pytest.approx(YIELD_PA + 2e9 * new[6], rel=1e-12)
    assert np.abs(C - C.T).max() < 1e-12 * C.max()


def test_a_saturation_below_the_yield_strength_is_refused():
    with pytest.raises(SolveError, match=r"saturation_Pa=100000000.0 is below"):
        Hardening(yield_strength_Pa=2e8, saturation_Pa=1e8)
