"""Condensed stiffness, frequencies and buckling loads of meshes agree with closed forms.

Sources: Przemieniecki, Theory of Matrix Structural Analysis (1968), 5.6 (beam with shear);
Timoshenko, Young & Weaver, Vibration Problems in Engineering (1974), 5; Timoshenko & Gere, Theory
of Elastic Stability (1961), 2.2 (Euler), 6.3 (Prandtl 1899, Michell 1899).
"""

from functools import cache

import numpy as np
import pytest
from scipy.sparse import coo_array

from dftfs.errors import SolveError
from dftfs.fem.constraints import clamped
from dftfs.fem.linear_model import (
    RIGID_MOTIONS,
    condensed,
    lowest_modes,
    mass_matrix,
    reduction,
    rigid_motions,
    tangent_matrix,
)
from dftfs.fem.mesh import TaggedMesh, extruded
from dftfs.fem.newton import solve_path
from dftfs.fem.problem import StaticProblem
from tests.cases.fem import straight_bar

E_PA, DENSITY = 70e9, 2700.0
LENGTH, HEIGHT, WIDTH = 0.4, 0.010, 0.008  # along x, y, z


@cache
def bar(along: int = 20, across: int = 4, layers: int = 4) -> TaggedMesh:
    """A straight bar on the x axis, its middle at the origin's height."""
    planar = straight_bar(LENGTH, HEIGHT, along, across)
    return extruded(planar, np.linspace(-WIDTH / 2, WIDTH / 2, layers + 1))


def stiffness(mesh: TaggedMesh, **displaced):
    return tangent_matrix(mesh, youngs_modulus_Pa=E_PA, poisson_ratio=0.0, **displaced)


def clamped_at_root(mesh: TaggedMesh, **changes):
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    held[mesh.boundary_nodes("low1")] = True
    return reduction(mesh, held=held, **changes)


def torsion_constant(wide: float, thin: float) -> float:
    """Saint-Venant's series for a rectangle."""
    odd = np.arange(1, 40, 2)
    sum_ = np.sum(np.tanh(odd * np.pi * wide / (2 * thin)) / odd**5)
    return wide * thin**3 / 3 * (1 - 192 * thin / (np.pi**5 * wide) * sum_)


def beam_end_stiffness() -> np.ndarray:
    """6 x 6 at the end of a clamped beam with shear, bar along x."""
    area, shear = HEIGHT * WIDTH, E_PA / 2
    found = np.zeros((6, 6))
    found[0, 0] = E_PA * area / LENGTH
    found[3, 3] = shear * torsion_constant(HEIGHT, WIDTH) / LENGTH
    for across, turn, side, inertia in (
        (1, 5, -1, WIDTH * HEIGHT**3 / 12),
        (2, 4, +1, HEIGHT * WIDTH**3 / 12),
    ):
        bending = E_PA * inertia
        phi = 12 * bending / (shear * area * 5 / 6 * LENGTH**2)
        found[across, across] = 12 * bending / (LENGTH**3 * (1 + phi))
        found[turn, turn] = (4 + phi) * bending / (LENGTH * (1 + phi))
        found[across, turn] = found[turn, across] = side * 6 * bending / (LENGTH**2 * (1 + phi))
    return found


def test_end_stiffness_of_a_bar_is_that_of_a_beam_with_shear():
    mesh = bar()
    tip = mesh.boundary_nodes("high1")
    motions = rigid_motions(mesh, tip, RIGID_MOTIONS, (LENGTH, 0, 0))
    found = condensed(stiffness(mesh), clamped_at_root(mesh, tied=[tip], interfaces=[motions]))
    wanted = beam_end_stiffness()
    scale = np.sqrt(np.outer(np.diag(wanted), np.diag(wanted)))
    assert np.linalg.eigvalsh(found / scale).min() > 0
    assert found / scale == pytest.approx(wanted / scale, abs=0.008)


def test_a_loose_body_has_no_condensed_stiffness():
    mesh = bar(2, 2, 1)
    motions = rigid_motions(mesh, mesh.boundary_nodes("high1"), ("x",))
    loose = reduction(mesh, held=np.zeros(mesh.nodes.shape, dtype=bool), interfaces=[motions])
    with pytest.raises(SolveError, match="can move freely"):
        condensed(stiffness(mesh), loose)


def modes_of_the_bar(count: int, **changes) -> np.ndarray:
    mesh = bar()
    transform = clamped_at_root(mesh, **changes).transform
    mass = mass_matrix(mesh, density_kg_per_m3=DENSITY)
    values, vectors, below = lowest_modes(
        (transform.T @ stiffness(mesh) @ transform).tocsr(),
        (transform.T @ mass @ transform).tocsr(),
        count,
    )
    assert below == 0
    gram = vectors.T @ (transform.T @ mass @ transform) @ vectors
    assert gram == pytest.approx(np.eye(count), abs=1e-8)
    return np.sqrt(values)


def test_mass_is_volume_times_density_in_every_direction():
    mesh = bar()
    mass = mass_matrix(mesh, density_kg_per_m3=DENSITY)
    rigid = rigid_motions(mesh, np.arange(len(mesh.nodes)), RIGID_MOTIONS)
    found = np.diag((rigid.T @ mass @ rigid).toarray())
    total = DENSITY * LENGTH * HEIGHT * WIDTH
    assert found[:3] == pytest.approx(total, rel=1e-12)
    assert found[5] == pytest.approx(total * (LENGTH**2 / 3 + HEIGHT**2 / 12), rel=1e-9)


def test_cantilever_has_the_frequencies_of_a_slender_beam():
    """(k L)^2 sqrt(E I / (rho A L^4)), k L = 1.8751, 4.6941; shear and rotation below 0.5 %."""
    found = modes_of_the_bar(4)
    line = DENSITY * HEIGHT * WIDTH
    slow, fast = (
        np.array([1.875104, 4.694091]) ** 2
        * np.sqrt(E_PA * HEIGHT * WIDTH * side**2 / 12 / (line * LENGTH**4))
        for side in (WIDTH, HEIGHT)
    )
    assert found == pytest.approx(np.sort([*slow, *fast]), rel=0.005)


@pytest.mark.parametrize("ratio", [1.0, 50.0])
def test_torsion_oscillator_swings_as_its_characteristic_equation_says(ratio):
    """A shaft with a disc: tan(b) b = I_shaft / J, omega = b sqrt(G J_t / (rho I_p)) / L."""
    polar = HEIGHT * WIDTH * (HEIGHT**2 + WIDTH**2) / 12
    shaft = DENSITY * polar * LENGTH
    mesh = bar()
    tip = mesh.boundary_nodes("high1")
    motions = rigid_motions(mesh, tip, ("rx",), (LENGTH, 0, 0))
    parts = clamped_at_root(mesh, tied=[tip], interfaces=[motions])
    transform = parts.transform
    mass = transform.T @ mass_matrix(mesh, density_kg_per_m3=DENSITY) @ transform
    at = np.array([len(parts.free)])
    disc = coo_array((np.array([ratio * shaft]), (at, at)), shape=mass.shape)
    reduced = (transform.T @ stiffness(mesh) @ transform).tocsr()
    values, vectors, _ = lowest_modes(reduced, (mass + disc).tocsr(), 5)
    twists = np.abs(vectors[at[0]]) > 1e-3 * np.abs(vectors[at[0]]).max()
    low, high = 1e-6, np.pi / 2 - 1e-9
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if np.tan(middle) * middle < 1 / ratio else (low, middle)
    rigidity = E_PA / 2 * torsion_constant(HEIGHT, WIDTH)
    wanted = low / LENGTH * np.sqrt(rigidity / (DENSITY * polar))
    assert np.sqrt(values[twists].min()) == pytest.approx(wanted, rel=0.006)


def strip(length: float, height: float, thin: float, along: int) -> TaggedMesh:
    """Half the thickness of a strip in the plane x, y; ``bottom`` is its mid-plane."""
    return extruded(straight_bar(length, height, along, 8), np.array([0.0, thin / 2]))


def buckling_load(
    length: float, height: float, thin: float, along: int, axis: int, guess: float, nu: float
) -> float:
    """Dead load at the tip at which the flat equilibrium of a clamped strip tips over."""
    mesh = strip(length, height, thin, along)
    root, tip = mesh.boundary_nodes("low1"), mesh.boundary_nodes("high1")
    middle = np.setdiff1d(mesh.boundary_nodes("bottom"), root)
    line = tip[np.isclose(mesh.nodes[tip, 1], 0)]
    share = np.zeros(mesh.nodes.shape)
    share[line, axis] = -1 / len(line) / 2  # half the thickness carries half the load
    path = solve_path(
        StaticProblem(
            mesh=mesh,
            youngs_modulus_Pa=E_PA,
            poisson_ratio=nu,
            supports=(clamped(root), clamped(middle, components=(2,))),
            dead_load_N=lambda t: (t * share, share),
        ),
        [0.97 * guess, 1.03 * guess],
    )
    held = np.zeros(mesh.nodes.shape, dtype=bool)
    held[np.ix_(root, (1, 2))], held[np.ix_(middle, (0, 1))] = True, True
    fixed = np.isclose(mesh.nodes[root, 1], 0) if axis == 1 else np.full(len(root), True)
    held[root[fixed]] = True  # where it twists, the root may warp, but not turn
    transform = reduction(mesh, held=held).transform
    mass = (transform.T @ mass_matrix(mesh, density_kg_per_m3=DENSITY) @ transform).tocsr()
    lowest, unstable = [], []
    for state in path.states[-2:]:
        tangent = tangent_matrix(
            mesh,
            youngs_modulus_Pa=E_PA,
            poisson_ratio=nu,
            displacement_m=state.displacement_m,
        )
        reduced = (transform.T @ tangent @ transform).tocsr()
        values, _, below = lowest_modes(reduced, mass, 1)
        lowest.append(values[0])
        unstable.append(below)
    assert unstable == [0, 1]
    return guess * (0.97 + 0.06 * lowest[0] / (lowest[0] - lowest[1]))


def test_clamped_column_buckles_at_eulers_load():
    """P = pi^2 E I / (4 L^2) for bending out of the mirror plane."""
    length, height, thin = 0.2, 0.01, 0.004
    euler = np.pi**2 * E_PA * height * thin**3 / 12 / (4 * length**2)
    found = buckling_load(length, height, thin, 20, 0, euler, 0.0)
    assert found == pytest.approx(euler, rel=0.005)


def test_deep_strip_tips_over_at_prandtls_load():
    """P = 4.013 sqrt(B C) / L^2, over sqrt((1 - B / A) (1 - C / A)) for bending before it.

    A, B: bending stiffness in the plane and out of it; C: of torsion.
    """
    length, height, thin = 0.8, 0.02, 0.002
    strong, weak = E_PA * thin * height**3 / 12, E_PA * height * thin**3 / 12
    twist = E_PA / 2 * torsion_constant(height, thin)
    prandtl = 4.013 * np.sqrt(weak * twist) / length**2
    prandtl /= np.sqrt((1 - weak / strong) * (1 - twist / strong))
    found = buckling_load(length, height, thin, 30, 1, prandtl, 0.0)
    assert found == pytest.approx(prandtl, rel=0.01)
