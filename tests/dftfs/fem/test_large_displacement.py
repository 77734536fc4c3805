"""Slender solids follow elliptic integrals, exact arcs and beams through large displacements."""

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from dftfs.fem.constraints import clamped, rigid_rotation
from dftfs.fem.loads import proportional, traction_forces
from dftfs.fem.mesh import extruded
from dftfs.fem.newton import StaticProblem, solve_path
from tests.cases.fem import mapped_mesh, straight_bar

LENGTH, HEIGHT, WIDTH = 0.25, 0.0025, 0.006
YOUNG = 71e9
RIGIDITY = YOUNG * WIDTH * HEIGHT**3 / 12


def node_at(mesh, *point):
    return int(np.linalg.norm(mesh.nodes - np.array(point), axis=1).argmin())


# P L^2 / (E I), (L - x_tip) / L, y_tip / L: Mattiasson, Int. J. Numer. Methods Eng. 17 (1981) 145,
# elliptic integrals; recomputed from the elastica with scipy.solve_bvp
END_LOADED_CANTILEVER = [
    (1.0, 0.05643, 0.30172),
    (2.0, 0.16064, 0.49346),
    (4.0, 0.32894, 0.66996),
    (10.0, 0.55500, 0.81061),
]


@pytest.mark.parametrize("solid", [False, True], ids=["plane stress", "solid"])
def test_cantilever_with_dead_tip_shear_matches_mattiasson(solid):
    """To 0.1 % (the elastica neither shears nor stretches: 1e-4 at this slenderness)."""
    planar = straight_bar(LENGTH, HEIGHT, 48, 1)
    mesh = extruded(planar, np.array([0.0, WIDTH])) if solid else planar
    thickness = 1.0 if solid else WIDTH
    direction = np.zeros(mesh.dim)
    direction[1] = RIGIDITY / LENGTH**2 / (HEIGHT * WIDTH)
    load = traction_forces(mesh, "high1", direction, thickness_m=thickness)
    problem = StaticProblem(
        mesh=mesh,
        youngs_modulus_Pa=YOUNG,
        poisson_ratio=0.0,
        thickness_m=None if solid else WIDTH,
        supports=(clamped(mesh.boundary_nodes("low1")),),
        dead_load_N=proportional(load),
    )
    tip = node_at(mesh, *(LENGTH, 0.0, 0.0)[: mesh.dim])
    path = solve_path(problem, [case[0] for case in END_LOADED_CANTILEVER], max_step=2.0)
    for force, shortening, deflection in END_LOADED_CANTILEVER:
        u = path.at(force).displacement_m[tip] / LENGTH
        np.testing.assert_allclose([-u[0], u[1]], [shortening, deflection], rtol=1e-3)


def test_a_strip_a_thousand_times_longer_than_thick_matches_mattiasson():
    """Where round-off of the axial stiffness, not the equations, limits the residual."""
    height = LENGTH / 1000
    rigidity = YOUNG * WIDTH * height**3 / 12
    mesh = straight_bar(LENGTH, height, 480, 1)
    traction = np.array([0.0, rigidity / LENGTH**2 / (height * WIDTH)])
    problem = StaticProblem(
        mesh=mesh,
        youngs_modulus_Pa=YOUNG,
        poisson_ratio=0.0,
        thickness_m=WIDTH,
        supports=(clamped(mesh.boundary_nodes("low1")),),
        dead_load_N=proportional(traction_forces(mesh, "high1", traction, thickness_m=WIDTH)),
    )
    tip = node_at(mesh, LENGTH, 0.0)
    state = solve_path(problem, [4.0]).states[-1]
    _, shortening, deflection = END_LOADED_CANTILEVER[2]
    u = state.displacement_m[tip] / LENGTH
    np.testing.assert_allclose([-u[0], u[1]], [shortening, deflection], rtol=2e-4)


def test_cantilever_rolls_up_to_a_full_circle_under_an_end_moment():
    """The end face is turned and free to translate: its reaction is a pure moment.

    Exact for a thin strip: an arc of angle a = M L / (E I); u/L = sin a / a - 1,
    w/L = (1 - cos a) / a. To 0.2 % of L and of the moment.
    """
    mesh = straight_bar(LENGTH, HEIGHT, 48, 1)
    end = mesh.boundary_nodes("high1")
    problem = StaticProblem(
        mesh=mesh,
        youngs_modulus_Pa=YOUNG,
        poisson_ratio=0.0,
        thickness_m=WIDTH,
        supports=(clamped(mesh.boundary_nodes("low1")),),
        drive=rigid_rotation(mesh, end, centre_m=(LENGTH, 0.0), free_translation=True),
    )
    tip = node_at(mesh, LENGTH, 0.0)
    quarters = np.arange(1, 5) * np.pi / 2
    path = solve_path(problem, quarters, initial_step=0.2)
    for angle in quarters:
        state = path.at(angle)
        exact = np.array([np.sin(angle) / angle - 1, (1 - np.cos(angle)) / angle])
        np.testing.assert_allclose(state.displacement_m[tip] / LENGTH, exact, atol=2e-3)
        assert state.drive_force == pytest.approx(RIGIDITY * angle / LENGTH, rel=2e-3)
        # nothing but the moment acts on the end
        shear = state.reaction_N[end].sum(axis=0)
        assert np.abs(shear).max() < 1e-6 * RIGIDITY / LENGTH**2
    # the strip is a closed ring without extension: its middle line keeps its length
    middle = np.flatnonzero(mesh.nodes[:, 1] == 0.0)
    line = (mesh.nodes + path.at(quarters[-1]).displacement_m)[middle]
    radius = LENGTH / (2 * np.pi)
    np.testing.assert_allclose(np.hypot(line[:, 0], line[:, 1] - radius), radius, rtol=2e-3)


# force, tip position: Bathe & Bolourchi, Int. J. Numer. Methods Eng. 14 (1979) 961; the digits of
# Simo & Vu-Quoc, Comput. Methods Appl. Mech. Eng. 58 (1986) 79
BEND_45 = {300.0: (58.84, 22.33, 40.08), 450.0: (52.32, 18.62, 48.39), 600.0: (47.23, 15.79, 53.37)}
BEND_RADIUS, BEND_YOUNG = 100.0, 1e7  # a section of 1 x 1, no Poisson's ratio


def kirchhoff_bend_tip(force, torsion_constant):
    """Tip of the 45 degree bend as an inextensible rod, by collocation on its equations.

    r' = R e1, q' = q (0, k) / 2, m' = -r' x F e3 with R^T m = C (k - k0): Antman, Nonlinear
    Problems of Elasticity (2005), ch. 8; q the unit quaternion of R.
    """
    compliance = 1 / (BEND_YOUNG * np.array([torsion_constant / 2, 1 / 12, 1 / 12]))
    natural = np.array([0.0, 0.0, 1 / BEND_RADIUS])

    def gradients(_, y):
        w, vector, moment = y[3], y[4:7], y[7:10]

        def turned(v, sign):
            cross = 2 * np.cross(vector, v, axis=0)
            return v + sign * w * cross + np.cross(vector, cross, axis=0)

        axis = turned(np.broadcast_to([[1.0], [0.0], [0.0]], vector.shape), 1)
        bend = natural[:, None] + compliance[:, None] * turned(moment, -1)
        spin = w * bend + np.cross(vector, bend, axis=0)
        twist = -np.sum(vector * bend, axis=0)
        couple = -np.cross(axis, [0.0, 0.0, force], axisb=0, axisa=0, axisc=0)
        return np.vstack([axis, twist / 2, spin / 2, couple])

    def ends(first, last):
        return np.concatenate([first[:3], first[3:7] - [1, 0, 0, 0], last[7:]])

    s = np.linspace(0, BEND_RADIUS * np.pi / 4, 60)
    angle = s / BEND_RADIUS
    zero = np.zeros_like(s)
    arc = [BEND_RADIUS * np.sin(angle), BEND_RADIUS * (1 - np.cos(angle)), zero]
    guess = np.vstack([*arc, np.cos(angle / 2), zero, zero, np.sin(angle / 2), zero, zero, zero])
    solution = solve_bvp(gradients, ends, s, guess, tol=1e-7, max_nodes=20000)
    assert solution.success
    return solution.y[:3, -1]


def test_45_degree_bend_matches_bathe_and_bolourchi():
    """Bending, twist and shortening in space by hex20: the tip to 1 % as published.

    Published beams take 1/6 as the torsion constant of the square (the sum of its second
    moments), a solid has 0.1406: against a Kirchhoff rod with that, the tip is right to 0.3 %.
    """

    def bend(s, t):
        angle, r = np.pi / 4 * s, BEND_RADIUS + 0.5 - t
        return r * np.sin(angle), BEND_RADIUS - r * np.cos(angle)

    mesh = extruded(mapped_mesh(24, 2, bend), np.linspace(-0.5, 0.5, 3))
    problem = StaticProblem(
        mesh=mesh,
        youngs_modulus_Pa=BEND_YOUNG,
        poisson_ratio=0.0,
        supports=(clamped(mesh.boundary_nodes("low1")),),
        dead_load_N=proportional(traction_forces(mesh, "high1", np.array([0.0, 0.0, 1.0]))),
    )
    tip = node_at(mesh, *bend(1.0, 0.5), 0.0)
    path = solve_path(problem, list(BEND_45), initial_step=100.0)
    for force, published in BEND_45.items():
        position = mesh.nodes[tip] + path.at(force).displacement_m[tip]
        assert np.linalg.norm(position - published) < 1e-2 * np.linalg.norm(published)
        rod = kirchhoff_bend_tip(force, 0.140577)
        assert np.linalg.norm(position - rod) < 3e-3 * np.linalg.norm(rod)


def test_published_bend_is_that_of_a_rod_with_the_wrong_torsion_constant():
    """The oracle above reproduces the published digits when given their 1/6."""
    for force, published in BEND_45.items():
        rod = kirchhoff_bend_tip(force, 1 / 6)
        assert np.linalg.norm(rod - published) < 5e-3 * np.linalg.norm(published)
