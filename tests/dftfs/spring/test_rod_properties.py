"""Energy, symmetry, balance and scaling hold for every rod and every spring made of rods."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dftfs.errors import DesignError, SolveError
from dftfs.spring.outline import build_outline
from dftfs.spring.planar_rod import Rod, solve_rod, twist_rod, twist_stiffness
from dftfs.spring.rod import (
    RootLengths,
    arm_rod,
    curved_bar_inertia,
    neck_turn,
    rod_curve,
    root_lengths,
    slit_neck_m,
)
from dftfs.spring.rod_contact import contact_onset
from dftfs.spring.rod_kernel import evaluate
from tests.cases import round_off
from tests.cases.spring import FIT, REF, THREE_ARMS

WIDTH_M, E_PA, NU = 7.34e-3, 68e9, 0.33
SPRINGS = {"fit": FIT, "ref": REF, "three arms": THREE_ARMS}
few = settings(deadline=None, max_examples=15, derandomize=True)
deflections = st.floats(-0.4, 0.4).filter(lambda d: abs(d) > 1e-3)


def curve(parameters, deflections_rad, *, width_m=WIDTH_M, youngs_modulus_Pa=E_PA):
    return rod_curve(build_outline(parameters), width_m, youngs_modulus_Pa, NU, deflections_rad)


def rounding_Nm(parameters, factor=1.0):
    """Rounding of a spring's torque, of all its arms."""
    arm = arm_rod(build_outline(parameters), WIDTH_M, factor * E_PA, NU)
    return parameters.n_arms * round_off.of_rod_torque_Nm(arm.rod)


def bent_rod(turned: float = 0.0) -> Rod:
    """A wavy, slender line of varying stiffness; ``turned`` about the origin."""
    s = np.linspace(0, 1, 41)
    angle = 0.4 + 0.9 * np.sin(2.3 * s)
    steps = 0.01 * np.column_stack([np.cos(angle), np.sin(angle)])
    nodes = np.array([0.03, -0.02]) + np.concatenate([[[0, 0]], np.cumsum(steps[1:], axis=0)])
    cosine, sine = np.cos(turned), np.sin(turned)
    return Rod(
        nodes_m=nodes @ np.array([[cosine, sine], [-sine, cosine]]),
        angles_rad=angle + turned,
        bending_stiffness_Nm2=3.0 + s,
        axial_stiffness_N=4e4 - 1e4 * s,
        shear_stiffness_N=1.7e4,
    )


@given(seed=st.integers(0, 10_000))
@few
def test_tangent_is_the_symmetric_derivative_of_the_gradient_of_the_energy(seed):
    tables = bent_rod().tables
    rng = np.random.default_rng(seed)
    dofs = tables.start + 0.05 * rng.normal(size=tables.start.shape)
    direction = rng.normal(size=dofs.shape)
    step = 1e-6
    (e_low, r_low, _), (e_high, r_high, _) = (
        evaluate(tables, dofs + sign * step * direction) for sign in (-1, 1)
    )
    _, residual, band = evaluate(tables, dofs)
    size = dofs.size
    full = np.zeros((size, size))
    for offset in range(-8, 9):
        rows = np.arange(max(0, offset), min(size, size + offset))
        full[rows, rows - offset] = band[8 + offset, rows - offset]
    np.testing.assert_allclose(full, full.T, rtol=0, atol=1e-13 * np.abs(full).max())
    flat = direction.ravel()
    scale = np.abs(full @ flat).max()
    assert np.abs((r_high - r_low) / (2 * step) - full @ flat).max() < 1e-6 * scale
    assert abs((e_high - e_low) / (2 * step) - residual @ flat) < 1e-6 * abs(e_high)


@given(turned=st.floats(-3, 3), force=st.floats(-40, 40), moment=st.floats(-4, 4))
@few
def test_turning_rod_and_load_together_turns_the_answer(turned, force, moment):
    load = np.array([force, 15.0])
    cosine, sine = np.cos(turned), np.sin(turned)
    turn = np.array([[cosine, -sine], [sine, cosine]])
    here = solve_rod(bent_rod(), load, moment)
    there = solve_rod(bent_rod(turned), turn @ load, moment)
    np.testing.assert_allclose(there.nodes_m, here.nodes_m @ turn.T, rtol=0, atol=1e-9)
    np.testing.assert_allclose(there.strain_energy_J, here.strain_energy_J, rtol=1e-7, atol=1e-12)


def test_a_rigid_turn_stores_nothing():
    tables = bent_rod().tables
    turned = bent_rod(0.7).tables.start.copy()
    turned[:, 2] = 0.7
    energy, residual, _ = evaluate(tables, turned)
    assert energy < 1e-20
    assert np.abs(residual).max() < 1e-8


@given(force=st.floats(-60, 60), moment=st.floats(-5, 5))
@few
def test_forces_at_both_ends_of_a_cantilever_balance(force, moment):
    state = solve_rod(bent_rod(), (force, -20.0), moment)
    np.testing.assert_allclose(state.end_force_N, [force, -20.0], rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(state.start_force_N, -state.end_force_N, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(state.start_torque_Nm, -state.end_torque_Nm, rtol=1e-6, atol=1e-8)


def test_a_straight_rod_answers_opposite_loads_with_mirrored_shapes():
    s = np.linspace(0, 0.3, 31)
    rod = Rod(
        nodes_m=np.column_stack([s, 0 * s]),
        angles_rad=0 * s,
        bending_stiffness_Nm2=2.0,
        axial_stiffness_N=1e5,
        shear_stiffness_N=3e4,
    )
    up, down = (solve_rod(rod, (0.0, f), m) for f, m in ((70.0, 3.0), (-70.0, -3.0)))
    np.testing.assert_allclose(down.nodes_m, up.nodes_m * [1, -1], rtol=0, atol=1e-12)


def test_a_spiral_spring_is_not_symmetric_in_the_deflection():
    winding, unwinding = curve(REF, [0.3, -0.3]).torque_Nm
    assert abs(winding + unwinding) > 1e-3 * winding


@pytest.mark.parametrize("name", SPRINGS)
def test_hub_torque_balances_rim_torque(name):
    arm = arm_rod(build_outline(SPRINGS[name]), WIDTH_M, E_PA, NU)
    for deflection in (-0.35, 0.2, 0.6):
        state = twist_rod(arm.rod, deflection)
        assert np.sign(state.end_torque_Nm) == np.sign(deflection)
        rounding = round_off.of_rod_torque_Nm(arm.rod)
        assert state.start_torque_Nm == pytest.approx(-state.end_torque_Nm, abs=rounding)
        np.testing.assert_allclose(state.start_force_N, -state.end_force_N, rtol=1e-7)


@given(deflection=deflections, name=st.sampled_from(sorted(SPRINGS)))
@few
def test_work_of_the_torque_is_the_strain_energy(deflection, name):
    x, w = np.polynomial.legendre.leggauss(6)
    at = deflection * (1 + x) / 2
    result = curve(SPRINGS[name], [*at, deflection])
    work = deflection / 2 * np.sum(w * result.torque_Nm[:-1])
    np.testing.assert_allclose(work, result.strain_energy_J[-1], rtol=1e-8)


@given(deflection=deflections, name=st.sampled_from(sorted(SPRINGS)))
@few
def test_tangent_is_the_slope_of_the_torque(deflection, name):
    step = 1e-4
    result = curve(SPRINGS[name], [deflection - step, deflection, deflection + step])
    slope = (result.torque_Nm[2] - result.torque_Nm[0]) / (2 * step)
    np.testing.assert_allclose(result.tangent_Nm_per_rad[1], slope, rtol=1e-6)


def test_tangent_at_rest_is_the_stiffness():
    result = curve(REF, [0.0])
    assert result.torque_Nm[0] == pytest.approx(0.0, abs=rounding_Nm(REF))
    assert result.peak_bending_stress_Pa[0] == pytest.approx(0.0, abs=10.0)
    np.testing.assert_allclose(result.tangent_Nm_per_rad[0], result.stiffness_Nm_per_rad)


@given(scale=st.floats(0.02, 50.0))
@few
def test_a_scaled_spring_has_the_scaled_torque(scale):
    """Lengths by s, E the same: torque and stiffness by s^3, angles and stresses unchanged."""
    lengths = {
        n: getattr(FIT, n) * scale
        for n in FIT.__dataclass_fields__
        if n.endswith("_m") and getattr(FIT, n)
    }
    large = curve(replace(FIT, **lengths), [-0.2, 0.3], width_m=WIDTH_M * scale)
    small = curve(FIT, [-0.2, 0.3])
    np.testing.assert_allclose(large.torque_Nm, small.torque_Nm * scale**3, rtol=1e-7)
    np.testing.assert_allclose(
        large.stiffness_Nm_per_rad, small.stiffness_Nm_per_rad * scale**3, rtol=1e-7
    )
    np.testing.assert_allclose(
        large.peak_bending_stress_Pa, small.peak_bending_stress_Pa, rtol=1e-6
    )


@given(factor=st.floats(0.1, 9.0))
@few
def test_torque_is_linear_in_width_and_in_youngs_modulus(factor):
    base = curve(THREE_ARMS, [-0.2, 0.3])
    wide = curve(THREE_ARMS, [-0.2, 0.3], width_m=factor * WIDTH_M)
    stiff = curve(THREE_ARMS, [-0.2, 0.3], youngs_modulus_Pa=factor * E_PA)
    rounding = rounding_Nm(THREE_ARMS, max(factor, 1.0))
    for other in (wide, stiff):
        assert other.torque_Nm == pytest.approx(factor * base.torque_Nm, abs=rounding)
    np.testing.assert_allclose(wide.peak_bending_stress_Pa, base.peak_bending_stress_Pa, rtol=1e-8)


@given(angle=st.floats(-6, 6))
@few
def test_turning_the_whole_spring_changes_no_torque(angle):
    turned = curve(replace(REF, start_angle_rad=angle), [-0.15, 0.25])
    here = curve(REF, [-0.15, 0.25])
    assert turned.torque_Nm == pytest.approx(here.torque_Nm, abs=rounding_Nm(REF))
    cosine, sine = np.cos(angle), np.sin(angle)
    expected = here.centreline_m @ np.array([[cosine, sine], [-sine, cosine]])
    np.testing.assert_allclose(turned.centreline_m, expected, rtol=0, atol=1e-9)


def test_order_of_the_deflections_does_not_matter():
    asked = np.array([0.2, -0.1, 0.05, 0.0, 0.35, -0.3])
    mixed, sorted_ = curve(FIT, asked), curve(FIT, np.sort(asked))
    in_order = mixed.torque_Nm[np.argsort(asked)]
    assert in_order == pytest.approx(sorted_.torque_Nm, abs=rounding_Nm(FIT))
    np.testing.assert_array_equal(mixed.deflection_rad, asked)


def test_winding_tightens_and_unwinding_opens_the_arm_along_its_free_length():
    outline = build_outline(REF)
    result = curve(REF, [-0.1, 0.0, 0.2])
    assert result.bending_moment_Nm.shape == (3, len(result.arc_length_m))
    assert result.centreline_m.shape == (*result.section_rotation_rad.shape, 2)
    assert 0 < result.arc_length_m[0] < result.arc_length_m[-1] < outline.free_arm_length_m
    feet = REF.centreline.point(np.array([outline.feet.notch_theta, outline.feet.slit_theta]))
    np.testing.assert_allclose(result.centreline_m[1, [0, -1]], feet, rtol=0, atol=1e-12)
    assert np.all(result.bending_moment_Nm[2] > 0)
    assert np.all(result.bending_moment_Nm[0] < 0)


@given(hub=st.floats(0, 8e-3), slit=st.floats(0, 8e-3))
@few
def test_longer_roots_make_a_softer_spring(hub, slit):
    outline = build_outline(REF)
    stiffness = [
        twist_stiffness(
            arm_rod(outline, WIDTH_M, E_PA, NU, roots=RootLengths(hub_m=h, slit_m=s)).rod
        )
        for h, s in ((hub, slit), (hub + 1e-3, slit), (hub, slit + 1e-3))
    ]
    assert stiffness[1] < stiffness[0]
    assert stiffness[2] < stiffness[0]


@pytest.mark.parametrize("name", SPRINGS)
def test_roots_are_some_tenths_of_the_thickness_long(name):
    p = SPRINGS[name]
    roots = root_lengths(build_outline(p))
    assert 0.5 < roots.slit_m / p.thickness_m < roots.hub_m / p.thickness_m < 1.2


def test_neck_turns_as_between_deep_cracks_or_not_at_all():
    """32 / (12 pi) / l^2 for sharp notches near each other; wide necks and blunt notches."""
    np.testing.assert_allclose(neck_turn(0.05, 0.0), 32 / (12 * np.pi) / 0.05**2, rtol=1e-3)
    assert neck_turn(4.0, 0.2) < 1e-6
    assert np.all(np.diff(neck_turn(np.linspace(0.1, 4, 50), 0.1)) < 0)
    assert np.all(np.diff(neck_turn(0.4, np.linspace(0, 0.5, 50))) > 0)


def test_neck_is_what_lies_between_the_two_fillets():
    outline = build_outline(THREE_ARMS)
    edges = {edge.name: edge for loop in outline.coil_gaps for edge in loop}
    t = np.linspace(0, 1, 2000)
    # the slit beside arm 0 ends in the coil gap before it, the last of the loops
    slit, tip = edges["slit_fillet:2"].point(t), edges["tip_fillet:0"].point(t)
    nearest = min(np.min(np.linalg.norm(tip - point, axis=1)) for point in slit)
    np.testing.assert_allclose(slit_neck_m(outline), nearest, rtol=1e-4)


def test_contact_is_a_matter_of_shape_alone():
    """Deflections at contact are free of E and width, torques proportional to both."""
    outline = build_outline(REF)
    base = contact_onset(outline, WIDTH_M, E_PA, NU, limit_rad=0.5)
    other = contact_onset(outline, 2 * WIDTH_M, 3 * E_PA, NU, limit_rad=0.5)
    for one, two in ((base.winding, other.winding), (base.unwinding, other.unwinding)):
        np.testing.assert_allclose(two.deflection_rad, one.deflection_rad, rtol=1e-5)
        np.testing.assert_allclose(two.torque_Nm, 6 * one.torque_Nm, rtol=1e-5)


def test_unreachable_deflection_is_refused_by_name():
    with pytest.raises(SolveError, match=r"deflection in rad of -20 cannot be reached"):
        curve(FIT, [-20.0])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"nodes_m": np.zeros((4, 2))}, r"shape \(4, 2\)"),
        ({"angles_rad": np.zeros(7)}, "angles_rad has shape"),
        ({"angles_rad": np.full(5, 2.0)}, "does not run along"),
        ({"bending_stiffness_Nm2": 0.0}, "bending_stiffness_Nm2 = 0 must be positive and finite"),
        ({"axial_stiffness_N": np.nan}, "axial_stiffness_N = nan must be positive and finite"),
    ],
)
def test_unusable_rods_are_refused(change, message):
    s = np.linspace(0, 1, 5)
    fields = {
        "nodes_m": np.column_stack([s, 0 * s]),
        "angles_rad": 0 * s,
        "bending_stiffness_Nm2": 2.0,
        "axial_stiffness_N": 3.0,
        "shear_stiffness_N": 4.0,
    }
    with pytest.raises(DesignError, match=message):
        Rod(**{**fields, **change})


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0.0, E_PA, NU), "width"),
        ((WIDTH_M, -1.0, NU), "youngs_modulus_Pa = -1.0 must be positive"),
        ((WIDTH_M, E_PA, 0.5), "poisson_ratio = 0.5 must be between"),
    ],
)
def test_unusable_spring_numbers_are_refused(arguments, message):
    with pytest.raises(DesignError, match=message):
        rod_curve(build_outline(FIT), *arguments, [0.1])


def test_unusable_deflections_roots_and_limits_are_refused():
    outline = build_outline(FIT)
    with pytest.raises(DesignError, match="deflections_rad must be finite"):
        rod_curve(outline, WIDTH_M, E_PA, NU, [0.1, np.nan])
    with pytest.raises(DesignError, match=r"hub_m = -0\.001 must be 0 or more"):
        RootLengths(hub_m=-1e-3, slit_m=0.0)
    with pytest.raises(DesignError, match=r"limit_rad = 0\.0 must be positive"):
        contact_onset(outline, WIDTH_M, E_PA, NU, limit_rad=0.0)
    with pytest.raises(DesignError, match="folds onto itself"):
        curved_bar_inertia(5e-3, WIDTH_M, 500.0)
