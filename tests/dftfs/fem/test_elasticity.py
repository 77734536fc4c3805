"""Plane and solid elasticity agree with the closed forms of bars, rings and patches."""

from dataclasses import replace

import numpy as np
import pytest

from dftfs.fem.constraints import Drive, clamped, cyclic_symmetry, rigid_rotation
from dftfs.fem.loads import proportional, traction_forces
from dftfs.fem.mesh import TaggedMesh, extruded
from dftfs.fem.newton import StaticProblem, linear_tangent, solve_path
from dftfs.fem.recover import cauchy_stress, gauss_points_m, recover_stress
from tests.cases.fem import SIDES, mapped_mesh, ring_part, straight_bar, wrinkled

YOUNG, POISSON, THICKNESS = 68e9, 0.33, 0.007


def moved(nodes, motion):
    """A drive in every direction by t * field (k, dim)."""
    return Drive(
        nodes=nodes,
        motion=lambda t: (t * motion, motion, 0 * motion),
        components=tuple(range(motion.shape[1])),
    )


def golovin(inner, outer):
    """Pure bending of a curved bar per unit moment and thickness.

    Returns the opening angle per angle of bar over (moment / E), and the hoop stress at r.

    Source: Timoshenko & Goodier, Theory of Elasticity, art. 29 (eqs. 52-54), rotation of the
    ends 8 M (b^2 - a^2) / (E N) per radian.
    """
    log = np.log(outer / inner)
    n = (outer**2 - inner**2) ** 2 - 4 * inner**2 * outer**2 * log**2

    def hoop(r):
        return (4 / n) * (
            -(inner**2) * outer**2 / r**2 * log
            + outer**2 * np.log(r / outer)
            + inner**2 * np.log(inner / r)
            + outer**2
            - inner**2
        )

    return 8 * (outer**2 - inner**2) / n, hoop


def test_curved_bar_in_pure_bending_matches_golovin():
    """Stiffness to 1e-5 and hoop stress to 3e-4 of its peak, everywhere in the bar.

    Half a ring: one end on its line, the other turned about the ring's centre and free to slide
    radially, which is how sections of the exact solution move (plane, about the centre).
    """
    inner, outer = 0.020, 0.031  # thick: the straight-beam formula is 20 % off inside
    mesh = ring_part(inner, outer, np.pi, 48, 12)
    start, end = mesh.boundary_nodes("low2"), mesh.boundary_nodes("high2")
    pin = start[np.abs(mesh.nodes[start, 0] - inner).argmin()]
    turn = replace(rigid_rotation(mesh, end), components=(1,))
    problem = StaticProblem(
        mesh=mesh,
        youngs_modulus_Pa=YOUNG,
        poisson_ratio=POISSON,
        thickness_m=THICKNESS,
        supports=(clamped(start, (1,)), clamped(np.array([pin]), (0,))),
        drive=turn,
    )
    flexibility, hoop = golovin(inner, outer)
    stiffness = linear_tangent(problem)
    assert stiffness == pytest.approx(YOUNG * THICKNESS / (flexibility * np.pi), rel=1e-5)

    state = solve_path(problem, [1e-6]).states[-1]
    stress = cauchy_stress(problem, state.displacement_m, per_direction=2)
    points = gauss_points_m(mesh, per_direction=2)
    radius = np.hypot(points[..., 0], points[..., 1])
    around = np.stack([-points[..., 1], points[..., 0]], axis=-1) / radius[..., None]
    found = np.einsum("eqi,eqij,eqj->eq", around, stress, around)
    # turning the end forwards opens the bar: the inner fibre is pulled
    exact = state.drive_force / THICKNESS * hoop(radius)
    np.testing.assert_allclose(found, exact, atol=3e-4 * np.abs(exact).max())


def test_pressed_ring_matches_lame():
    """A ring forced open at the bore, one leaning seventh of it under cyclic symmetry.

    Plane stress, u = A r + B / r with no stress at the rim: Timoshenko & Goodier, art. 28.
    """
    inner, outer, opening = 0.013, 0.029, 1e-8
    mesh = ring_part(inner, outer, 2 * np.pi / 7, 6, 8, lean_rad=0.5)
    bore, rim = mesh.boundary_nodes("low1"), mesh.boundary_nodes("high1")
    outward = mesh.nodes[bore] / inner
    problem = StaticProblem(
        mesh=mesh,
        youngs_modulus_Pa=YOUNG,
        poisson_ratio=POISSON,
        thickness_m=THICKNESS,
        drive=moved(bore, outward),
        cyclic=cyclic_symmetry(mesh, 7, cut_low="low2", cut_high="high2"),
    )
    state = solve_path(problem, [opening]).states[-1]
    # sigma_r = E / (1 - nu^2) (A (1 + nu) - B (1 - nu) / r^2)
    ratio = (1 - POISSON) / (1 + POISSON) / outer**2  # A / B
    b = opening / (ratio * inner + 1 / inner)
    a = ratio * b
    at_rim = np.linalg.norm(state.displacement_m[rim], axis=1)
    np.testing.assert_allclose(at_rim, a * outer + b / outer, rtol=1e-5)
    modulus = YOUNG / (1 - POISSON**2)
    pressure = -modulus * (a * (1 + POISSON) - b * (1 - POISSON) / inner**2)
    # conjugate to the radial opening: the whole radial force on one seventh of the bore
    assert state.drive_force == pytest.approx(
        pressure * 2 * np.pi * inner / 7 * THICKNESS, rel=1e-5
    )
    stress = cauchy_stress(problem, state.displacement_m, per_direction=2)
    points = gauss_points_m(mesh, per_direction=2)
    radius = np.hypot(points[..., 0], points[..., 1])
    around = np.stack([-points[..., 1], points[..., 0]], axis=-1) / radius[..., None]
    hoop = np.einsum("eqi,eqij,eqj->eq", around, stress, around)
    exact = modulus * (a * (1 + POISSON) + b * (1 - POISSON) / radius**2)
    np.testing.assert_allclose(hoop, exact, rtol=5e-4)


def distorted(dim):
    """A block of irregular elements with curved inner edges."""
    block = mapped_mesh(3, 3, lambda s, t: (0.3 * s, 0.2 * t))
    if dim == 3:
        block = extruded(block, np.array([0.0, 0.08, 0.2]))
    nodes, hull = block.nodes.copy(), np.unique(np.concatenate(list(block.boundaries.values())))
    inside = np.setdiff1d(np.arange(len(nodes)), hull)
    nodes[inside] += wrinkled(block, 0.008, seed=3)[inside]
    return replace(block, nodes=nodes), hull


GRADIENT = np.array([[0.11, -0.23, 0.05], [0.31, 0.08, -0.12], [-0.04, 0.17, -0.09]])


@pytest.mark.parametrize("dim", [2, 3])
def test_patch_of_distorted_elements_holds_a_large_uniform_strain(dim):
    """The hull follows u = H x; the inside must, and the stress is F S F^T / det F throughout.

    The patch test: Irons & Razzaque (1972); here at finite strain, where it holds as well.
    """
    mesh, hull = distorted(dim)
    gradient = GRADIENT[:dim, :dim]
    problem = StaticProblem(
        mesh=mesh,
        youngs_modulus_Pa=YOUNG,
        poisson_ratio=POISSON,
        thickness_m=THICKNESS if dim == 2 else None,
        drive=moved(hull, mesh.nodes[hull] @ gradient.T),
    )
    state = solve_path(problem, [1.0]).states[-1]
    np.testing.assert_allclose(state.displacement_m, mesh.nodes @ gradient.T, atol=1e-12)

    f = np.eye(dim) + gradient
    strain = (f.T @ f - np.eye(dim)) / 2
    shear = YOUNG / (2 * (1 + POISSON))
    if dim == 3:
        lam = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
        jacobian = np.linalg.det(f)
    else:
        lam = YOUNG * POISSON / (1 - POISSON**2)
        through = -POISSON / (1 - POISSON) * np.trace(strain)  # strain that keeps S_zz = 0
        jacobian = np.linalg.det(f) * np.sqrt(1 + 2 * through)
    second = lam * np.trace(strain) * np.eye(dim) + 2 * shear * strain
    exact = f @ second @ f.T / jacobian
    found = cauchy_stress(problem, state.displacement_m)
    np.testing.assert_allclose(found, np.broadcast_to(exact, found.shape), rtol=1e-9)


def test_plane_stress_is_the_limit_of_thin_solids():
    """Large bending of a ring's part: the solid's excess, at held ends, falls with thickness."""
    planar = ring_part(0.020, 0.030, 1.5, 8, 2)
    forces = {}
    for thickness in (None, 0.004, 0.002):
        mesh = planar if thickness is None else extruded(planar, np.array([0.0, thickness / 2]))
        low, high = mesh.boundary_nodes("low2"), mesh.boundary_nodes("high2")
        supports = [clamped(low, (0, 1))]
        if mesh.dim == 3:
            supports.append(clamped(mesh.boundary_nodes("bottom"), (2,)))
        problem = StaticProblem(
            mesh=mesh,
            youngs_modulus_Pa=YOUNG,
            poisson_ratio=POISSON,
            thickness_m=1.0 if mesh.dim == 2 else None,
            supports=tuple(supports),
            drive=rigid_rotation(mesh, high, axial_fixed=False),
        )
        per_width = 1.0 if thickness is None else 2 / thickness
        forces[thickness] = per_width * solve_path(problem, [0.3]).states[-1].drive_force
    thick, thin = forces[0.004] / forces[None] - 1, forces[0.002] / forces[None] - 1
    assert abs(thin) < 1e-3
    assert 1.8 < thick / thin < 4.5


def test_stretched_bar_follows_saint_venant_kirchhoff():
    """Uniaxial, to twice the length: force A E (s^3 - s) / 2, Cauchy stress with the reduced area.

    Source: Holzapfel, Nonlinear Solid Mechanics (2000), 6.5: S = E E_GL along the bar.
    """
    length, side = 0.11, 0.03
    mesh = extruded(straight_bar(length, side, 3, 1), np.array([0.0, side / 2, side]))
    end = mesh.boundary_nodes("high1")
    drawn = replace(moved(end, np.tile([length, 0.0, 0.0], (len(end), 1))), components=(0,))
    corner = int(np.abs(mesh.nodes - mesh.nodes.min(axis=0)).sum(axis=1).argmin())
    start = mesh.boundary_nodes("low1")
    floor = start[np.abs(mesh.nodes[start, 2]) < 1e-12]
    problem = StaticProblem(
        mesh=mesh,
        youngs_modulus_Pa=YOUNG,
        poisson_ratio=POISSON,
        supports=(
            clamped(start, (0,)),
            clamped(floor, (2,)),
            clamped(np.array([corner]), (1,)),
        ),
        drive=drawn,
    )
    for state in solve_path(problem, [0.3, 1.0, -0.25]).states[1:]:
        s = 1 + state.t
        axial = YOUNG * (s**2 - 1) / 2
        assert state.drive_force / length == pytest.approx(side**2 * axial * s, rel=1e-9)
        slope = side**2 * YOUNG * (3 * s**2 - 1) / 2
        assert state.drive_stiffness / length == pytest.approx(slope, rel=1e-7)
        lateral = 1 - POISSON * (s**2 - 1)  # squared stretch across the bar
        sigma = recover_stress(problem, state.displacement_m)
        np.testing.assert_allclose(sigma.von_mises_Pa, abs(axial) * s / lateral, rtol=1e-8)


def stepped_bar(small, large, radius, density):
    """Upper half of a stepped flat bar, two grids joined: under the fillet, and the shoulder."""
    base, shoulder = small / 2, large / 2
    run = 2.0 * small

    def surface(s):
        """Top of the lower grid: the small flat, the fillet, then level with the fillet's end."""
        flat, arc = s < 0.4, (s >= 0.4) & (s < 0.7)
        angle = np.pi / 2 * (s - 0.4) / 0.3
        x = np.where(flat, -run + run * (s / 0.4) ** 0.7, np.where(arc, radius * np.sin(angle), 0))
        level = radius + run * np.maximum((s - 0.7) / 0.3, 0) ** 1.5
        x = np.where(s >= 0.7, level, x)
        y = np.where(flat, base, np.where(arc, base + radius * (1 - np.cos(angle)), base + radius))
        return x, y

    def lower(s, t):
        x, y = surface(s)
        x_axis = np.interp(s, [0, 0.4, 0.7, 1], [-run, -0.15 * small, 0.25 * small, radius + run])
        part = 1 - (1 - t) ** 1.6
        return x_axis + part * (x - x_axis), part * y

    along = 20 * density
    under = mapped_mesh(along, 6 * density, lower)
    columns = round(0.3 * along)

    def upper(s, t):
        x, _ = surface(0.7 + 0.3 * s)
        return x, base + radius + (shoulder - base - radius) * t

    over = mapped_mesh(columns, 4 * density, upper)
    nodes = np.concatenate([under.nodes, over.nodes])
    _, first, number = np.unique(
        np.round(nodes / small, 9), axis=0, return_index=True, return_inverse=True
    )
    number = number.ravel()
    cells = np.concatenate([number[under.cells], number[over.cells + len(under.nodes)]])
    ends = np.concatenate(
        [
            number[under.facets("high1")],
            number[over.facets("high1") + len(under.nodes)],
        ]
    )
    tags = {"axis": number[under.facets("low2")], "small": number[under.facets("low1")]}
    return TaggedMesh(nodes=nodes[first], cells=cells, boundaries={**tags, "large": ends})


def test_shoulder_fillet_concentrates_stress_as_in_peterson():
    """Stepped flat bar in tension, D/d = 2, r/d = 0.2: K_t to 3 %, steady under refinement.

    Pilkey & Pilkey, Peterson's Stress Concentration Factors, chart 3.1 (the fit for
    2 <= h/r <= 20).
    """
    small, large, radius = 0.02, 0.04, 0.004
    step = (large - small) / 2 / radius
    root, share = np.sqrt(step), (large - small) / large
    fit = (
        1.020 + 1.009 * root - 0.048 * step,
        -0.065 - 0.165 * root - 0.007 * step,
        -3.459 + 1.266 * root - 0.016 * step,
        3.505 - 2.109 * root + 0.069 * step,
    )
    published = sum(c * share**k for k, c in enumerate(fit))
    factors = []
    for density in (2, 3):
        mesh = stepped_bar(small, large, radius, density)
        nominal = 1e5
        load = traction_forces(mesh, "small", np.array([-nominal, 0.0]), thickness_m=THICKNESS)
        problem = StaticProblem(
            mesh=mesh,
            youngs_modulus_Pa=YOUNG,
            poisson_ratio=POISSON,
            thickness_m=THICKNESS,
            supports=(
                clamped(mesh.boundary_nodes("axis"), (1,)),
                clamped(mesh.boundary_nodes("large"), (0,)),
            ),
            dead_load_N=proportional(load),
        )
        state = solve_path(problem, [1.0]).states[-1]
        stress = recover_stress(problem, state.displacement_m)
        factors.append(stress.von_mises_Pa.max() / nominal)
        peak = mesh.nodes[stress.von_mises_Pa.argmax()]
        assert 0 < peak[0] < radius  # in the fillet
    assert factors[-1] == pytest.approx(published, rel=0.03)
    assert factors[0] == pytest.approx(factors[1], rel=0.01)


def test_boundaries_of_the_test_meshes_are_complete():
    assert set(straight_bar(0.1, 0.02, 2, 1).boundaries) == set(SIDES)
