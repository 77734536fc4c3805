"""The planar rod follows the elastica and curved-beam theory; springs of rods, finite elements.

Mattiasson, "Numerical results from large deflection beam and frame problems analysed by means of
elliptic integrals", Int. J. Numer. Methods Eng. 17 (1981) 145-153. The spring's figures
are those of reference runs with CalculiX (C3D20, 121 k unknowns) and of a contact prototype.
"""

import numpy as np
import pytest

from dftfs.analysis.meshing.blocks import MeshSizing
from dftfs.analysis.meshing.sector_mesh import sector_mesh
from dftfs.fem.constraints import clamped, cyclic_symmetry, rigid_rotation
from dftfs.fem.newton import linear_tangent
from dftfs.fem.problem import StaticProblem
from dftfs.spring.clearance import sample_coil_gap
from dftfs.spring.outline import build_outline
from dftfs.spring.parameters import SpiralParameters
from dftfs.spring.planar_rod import Rod, solve_rod, twist_rod
from dftfs.spring.rod import RootLengths, arm_rod, curved_bar_inertia, rod_curve
from dftfs.spring.rod_contact import contact_onset, state_clearance
from tests.cases.spring import FIT, REF

WIDTH_M, E_PA, NU = 7.34e-3, 68e9, 0.33
LENGTH_M, RIGIDITY_NM2 = 0.25, 0.8
CLAMPED = RootLengths(hub_m=0.0, slit_m=0.0)

# P L^2 / (E I), (L - x_tip) / L, y_tip / L
CANTILEVER_END_LOAD = [
    (1.0, 0.05643, 0.30172),
    (2.0, 0.16064, 0.49346),
    (4.0, 0.32894, 0.66996),
    (10.0, 0.55500, 0.81061),
]


def straight_rod(elements: int, *, line_stiffness: float = 1e7) -> Rod:
    """Along x; ``line_stiffness`` is EA L^2 / EI, the shear stiffness half of it."""
    along = np.linspace(0, LENGTH_M, 2 * elements + 1)
    axial = line_stiffness * RIGIDITY_NM2 / LENGTH_M**2
    return Rod(
        nodes_m=np.column_stack([along, np.zeros_like(along)]),
        angles_rad=np.zeros_like(along),
        bending_stiffness_Nm2=RIGIDITY_NM2,
        axial_stiffness_N=axial,
        shear_stiffness_N=axial / 2,
    )


def arc_rod(radius_m: float, sweep_rad: float, elements: int, **stiffness) -> Rod:
    """Starts at the origin along x and bends to the left."""
    angle = np.linspace(0, sweep_rad, 2 * elements + 1)
    return Rod(
        nodes_m=radius_m * np.column_stack([np.sin(angle), 1 - np.cos(angle)]),
        angles_rad=angle,
        **stiffness,
    )


@pytest.mark.parametrize(("load", "shortening", "deflection"), CANTILEVER_END_LOAD)
def test_tip_of_end_loaded_cantilever_matches_mattiasson(load, shortening, deflection):
    state = solve_rod(straight_rod(60), tip_force_N=(0.0, load * RIGIDITY_NM2 / LENGTH_M**2))
    tip = state.tip_m / LENGTH_M
    np.testing.assert_allclose([1 - tip[0], tip[1]], [shortening, deflection], rtol=0, atol=1e-5)


@pytest.mark.parametrize("turn", [-1.3, 2.0, 2 * np.pi, 9.0])
def test_end_moment_rolls_a_cantilever_into_an_arc(turn):
    """Exact: u / L = sin a / a - 1, w / L = (1 - cos a) / a with a = M L / (E I)."""
    state = solve_rod(straight_rod(40), tip_moment_Nm=turn * RIGIDITY_NM2 / LENGTH_M)
    exact = [np.sin(turn) / turn, (1 - np.cos(turn)) / turn]
    np.testing.assert_allclose(state.tip_m / LENGTH_M, exact, rtol=0, atol=2e-7)
    np.testing.assert_allclose(state.rotation_rad[-1], turn, rtol=1e-10)


@pytest.mark.parametrize("change", [-0.9, 1.6])
def test_end_moment_changes_the_radius_of_an_arc(change):
    """Exact: 1 / R becomes 1 / R + M / (E I), the length stays."""
    radius, sweep, rigidity = 0.06, 2.2, 13.0
    rod = arc_rod(
        radius,
        sweep,
        40,
        bending_stiffness_Nm2=rigidity,
        axial_stiffness_N=1e7 * rigidity / radius**2,
        shear_stiffness_N=1e7 * rigidity / radius**2,
    )
    state = solve_rod(rod, tip_moment_Nm=change * rigidity / radius)
    bent_radius, bent_sweep = radius / (1 + change), sweep * (1 + change)
    exact = bent_radius * np.array([np.sin(bent_sweep), 1 - np.cos(bent_sweep)])
    np.testing.assert_allclose(state.tip_m, exact, rtol=0, atol=2e-7 * radius)


def test_quarter_circle_adds_bending_stretching_and_shear():
    """Load along the clamped end's tangent: pi P R / 4 (R^2 / EI + 1 / EA + 1 / GA_s).

    At the angle a from the clamped end M = P R cos a, N = P cos a, V = P sin a; Castigliano.
    Timoshenko, Strength of Materials Part I, "Deflection of curved bars".
    """
    radius, load = 0.05, 2e-3
    rigidity, axial, shear = 13.0, 2.1e4, 0.9e4
    rod = arc_rod(
        radius,
        np.pi / 2,
        12,
        bending_stiffness_Nm2=rigidity,
        axial_stiffness_N=axial,
        shear_stiffness_N=shear,
    )
    moved = solve_rod(rod, tip_force_N=(load, 0.0)).tip_m[0] - radius
    exact = np.pi * load * radius / 4 * (radius**2 / rigidity + 1 / axial + 1 / shear)
    np.testing.assert_allclose(moved, exact, rtol=2e-5)


def test_error_falls_with_the_fourth_power_of_the_element_length():
    load = (0.3 * RIGIDITY_NM2 / LENGTH_M**2, 3 * RIGIDITY_NM2 / LENGTH_M**2)
    tips = [
        solve_rod(straight_rod(n, line_stiffness=400.0), tip_force_N=load).tip_m
        for n in (4, 8, 16, 64)
    ]
    errors = [np.linalg.norm(tip - tips[-1]) for tip in tips[:-1]]
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all(orders > 3.7), orders


@pytest.mark.parametrize("thickness_over_radius", [0.0, 1e-4, 0.3, 0.9])
def test_curved_bar_inertia_holds_the_energy_of_golovins_stresses(thickness_over_radius):
    """U per angle = M^2 R / (2 E I) = integral of (s_r^2 + s_t^2 - 2 nu s_r s_t) / (2 E) r dr.

    Stresses: Timoshenko & Goodier, Theory of Elasticity, "Pure bending of curved bars".
    """
    thickness, width, moment = 5e-3, 7e-3, 3.0
    got = curved_bar_inertia(thickness, width, thickness_over_radius / thickness)
    straight = width * thickness**3 / 12
    if thickness_over_radius < 0.01:
        np.testing.assert_allclose(got, straight, rtol=1e-8)
        return
    radius = thickness / thickness_over_radius
    a, b = radius - thickness / 2, radius + thickness / 2
    log = np.log(b / a)
    scale = -4 * moment / (width * ((b**2 - a**2) ** 2 - 4 * (a * b * log) ** 2))
    x, w = np.polynomial.legendre.leggauss(40)
    r = radius + thickness / 2 * x
    common = b**2 * np.log(r / b) + a**2 * np.log(a / r)
    radial = scale * ((a * b / r) ** 2 * log + common)
    around = scale * (-((a * b / r) ** 2) * log + common + b**2 - a**2)
    energy = (
        width * thickness / 4 * np.sum(w * r * (radial**2 + around**2 - 2 * NU * radial * around))
    )
    np.testing.assert_allclose(got, moment**2 * radius / (2 * energy), rtol=1e-9)


def test_reference_spring_follows_the_solid_finite_element_curve():
    """REF, torque at 0.023 k rad, k = 1..10, CalculiX C3D20 with 121 k unknowns; 65.432 at rest."""
    solid = [1.50420, 3.00676, 4.50769, 6.00698, 7.50466]
    solid += [9.00073, 10.49520, 11.98810, 13.47944, 14.96926]
    curve = rod_curve(build_outline(REF), WIDTH_M, E_PA, NU, 0.023 * np.arange(1, 11))
    np.testing.assert_allclose(curve.torque_Nm, solid, rtol=1.5e-3)
    np.testing.assert_allclose(curve.stiffness_Nm_per_rad, 65.432, rtol=1.5e-3)


def test_fit_spring_has_the_published_stiffness_and_unwinds_as_calculix_does():
    """FIT: 66.0..66.1 Nm/rad (published 66.10), 13.013 Nm at 0.196 rad unwinding."""
    curve = rod_curve(build_outline(FIT), WIDTH_M, E_PA, NU, [-0.196])
    np.testing.assert_allclose(curve.stiffness_Nm_per_rad, 66.05, rtol=2e-3)
    np.testing.assert_allclose(curve.torque_Nm, [-13.013], rtol=3e-3)


def test_arm_clamped_at_the_feet_is_two_to_three_percent_too_stiff():
    outline = build_outline(REF)
    curve = rod_curve(outline, WIDTH_M, E_PA, NU, [0.0], roots=CLAMPED)
    assert 0.020 < curve.stiffness_Nm_per_rad / 65.432 - 1 < 0.028


NOT_FITTED = [
    {"inner": 16.0, "outer": 66.0, "thickness": 6.2, "turns": 1.6, "n_arms": 2, "fillet": 1.4},
    {"inner": 22.0, "outer": 80.0, "thickness": 5.0, "turns": 1.2, "n_arms": 3, "fillet": 0.6},
    {
        "inner": 20.0,
        "outer": 72.0,
        "thickness": 6.8,
        "turns": 1.7,
        "n_arms": 2,
        "fillet": 0.7,
        "rim_gap": 0.6807,  # a neck of half the thickness between slit and tip
    },
]


@pytest.mark.parametrize("case", NOT_FITTED, ids=["two arms", "three arms", "narrow neck"])
def test_rod_with_roots_agrees_with_plane_stress_finite_elements(case):
    """Designs outside the calibration of benchmarks/root_compliance.py."""
    thickness = case["thickness"] * 1e-3
    rim = case["outer"] * 1e-3 + case.get("rim_gap", 0.5) * thickness
    p = SpiralParameters(
        inner_radius_m=case["inner"] * 1e-3,
        outer_radius_m=case["outer"] * 1e-3,
        turns=case["turns"],
        n_arms=case["n_arms"],
        thickness_m=thickness,
        fillet_radius_m=case["fillet"] * 1e-3,
        tip_radius_m=0.3e-3,
        bore_radius_m=case["inner"] * 1e-3 - thickness,
        hub_radius_m=case["inner"] * 1e-3,
        rim_inner_radius_m=rim,
        rim_outer_radius_m=rim + thickness,
    )
    outline = build_outline(p)
    mesh = sector_mesh(outline, MeshSizing())
    finite_elements = p.n_arms * linear_tangent(
        StaticProblem(
            mesh=mesh,
            youngs_modulus_Pa=E_PA,
            poisson_ratio=NU,
            thickness_m=WIDTH_M,
            supports=(clamped(mesh.boundary_nodes("bore"), components=(0, 1)),),
            drive=rigid_rotation(mesh, mesh.boundary_nodes("rim_outer")),
            cyclic=cyclic_symmetry(mesh, p.n_arms),
        )
    )
    rod = rod_curve(outline, WIDTH_M, E_PA, NU, [0.0]).stiffness_Nm_per_rad
    np.testing.assert_allclose(rod, finite_elements, rtol=3e-3)


def test_reference_spring_touches_where_finite_elements_say():
    """REF: unwinding 0.156 rad, 10.2 Nm, the tip on the last coil; winding 0.32 rad, 21 Nm."""
    onset = contact_onset(build_outline(REF), WIDTH_M, E_PA, NU)
    unwinding, winding = onset.unwinding, onset.winding
    np.testing.assert_allclose(unwinding.deflection_rad, -0.156, rtol=0.01)
    np.testing.assert_allclose(unwinding.torque_Nm, -10.2, rtol=0.01)
    np.testing.assert_allclose(winding.deflection_rad, 0.32, rtol=0.02)
    np.testing.assert_allclose(winding.torque_Nm, 21.0, rtol=0.02)
    tip = REF.centreline.point(REF.centreline.end)
    tip -= REF.thickness_m / 2 * REF.centreline.normal(REF.centreline.end)
    angle = unwinding.deflection_rad
    turned = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) @ tip
    assert np.linalg.norm(unwinding.at_m - turned) < REF.thickness_m / 4
    assert 57e-3 < np.hypot(*winding.at_m) < 59e-3


def test_fit_spring_touches_within_two_percent_of_finite_elements():
    """FIT: unwinding 0.204 rad, 13.6 Nm; winding 0.370 rad, 24.3 Nm (prototype)."""
    onset = contact_onset(build_outline(FIT), WIDTH_M, E_PA, NU)
    found = [onset.unwinding, onset.winding]
    np.testing.assert_allclose([c.deflection_rad for c in found], [-0.204, 0.370], rtol=0.02)
    np.testing.assert_allclose([c.torque_Nm for c in found], [-13.6, 24.3], rtol=0.02)


def test_gap_is_open_before_the_onset_and_gone_at_it():
    outline = build_outline(FIT)
    onset = contact_onset(outline, WIDTH_M, E_PA, NU)
    arm = arm_rod(outline, WIDTH_M, E_PA, NU)
    samples = sample_coil_gap(outline, FIT.outer_radius_m / 80)
    for contact in (onset.unwinding, onset.winding):
        gaps = [
            state_clearance(arm, samples, twist_rod(arm.rod, share * contact.deflection_rad))
            for share in (0.5, 0.9, 0.99, 1.0)
        ]
        smallest = np.array([gap.smallest_m for gap in gaps])
        assert np.all(np.diff(smallest) < 0)
        assert smallest[2] > 1e-6 > abs(smallest[3])


def test_no_contact_is_reported_within_a_small_limit():
    onset = contact_onset(build_outline(FIT), WIDTH_M, E_PA, NU, limit_rad=0.25)
    assert onset.winding is None
    assert onset.unwinding is not None
    assert onset.limit_rad == 0.25
