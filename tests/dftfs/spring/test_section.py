"""The section of a curved strip agrees with a textbook's crane hook and the exact curved bar."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dftfs.errors import DesignError
from dftfs.spring.section import (
    curvature_correction_factor,
    curved_strip_stress,
    in_plane_inertia,
    section_area,
    wide_strip_factor,
)

few = settings(deadline=None, max_examples=40, derandomize=True)
sizes = st.floats(1e-3, 30e-3)
ratios = st.floats(0.55, 500.0)


def _golovin_n(inner: float, outer: float) -> float:
    return (outer**2 - inner**2) ** 2 - 4.0 * (inner * outer * np.log(outer / inner)) ** 2


def _golovin_stress(moment_Nm, width_m, inner_m, outer_m, radius_m):
    """Exact circumferential stress of a curved bar in pure bending; straightening is positive.

    Golovin 1881; Timoshenko & Goodier, Theory of Elasticity, "Pure bending of curved bars".
    """
    a, b, r = inner_m, outer_m, radius_m
    shape = -((a * b / r) ** 2) * np.log(b / a) + b**2 * np.log(r / b) + a**2 * np.log(a / r)
    return -4.0 * moment_Nm / (width_m * _golovin_n(a, b)) * (shape + b**2 - a**2)


def test_crane_hook_of_shigley_is_reproduced():
    """16.9 kpsi inside, -5.63 kpsi outside.

    Budynas & Nisbett, Shigley's Mechanical Engineering Design, Example 3-15: rectangle 0.75 in
    by 4 in, inner radius 2 in, 5000 lbf through the centre of curvature, r_n = 3.641 in. The
    numbers are homogeneous in the units, so they enter in inch, lbf and psi as they stand.
    """
    force, width, depth, centroid = 5000.0, 0.75, 4.0, 4.0
    concave, convex = curved_strip_stress(force * centroid, depth, width, centroid)
    direct = force / section_area(depth, width)
    assert (concave[0] + direct) / 1e3 == pytest.approx(16.9, abs=0.05)
    assert (convex[0] + direct) / 1e3 == pytest.approx(-5.63, abs=0.01)


@pytest.mark.parametrize(
    ("ratio", "concave_exact", "convex_exact", "concave_winkler", "convex_winkler"),
    [
        (1.3, 73.05, -61.35, 72.98, -61.27),
        (2.0, 7.755, -4.917, 7.725, -4.863),
        (3.0, 2.292, -1.130, 2.285, -1.095),
    ],
)
def test_hyperbolic_and_exact_stress_match_the_table_of_timoshenko(
    ratio, concave_exact, convex_exact, concave_winkler, convex_winkler
):
    """Coefficients m of sigma = m M / a^2 for b / a = 1.3, 2, 3 and unit width.

    Timoshenko & Goodier, Theory of Elasticity, "Pure bending of curved bars", table of the
    linear, hyperbolic and exact distributions: Winkler's is within 0.4 % on the concave face.
    """
    concave, convex = curved_strip_stress(1.0, ratio - 1.0, 1.0, (1.0 + ratio) / 2.0)
    assert concave[0] == pytest.approx(concave_winkler, rel=7e-4)
    assert convex[0] == pytest.approx(convex_winkler, rel=7e-4)
    exact = [_golovin_stress(1.0, 1.0, 1.0, ratio, radius) for radius in (1.0, ratio)]
    assert exact == pytest.approx([concave_exact, convex_exact], rel=7e-4)
    assert abs(concave[0] / exact[0] - 1.0) < 4e-3


def test_correction_factor_at_the_hub_of_the_thesis_spring():
    """1.16 at R_i / w1 = 18.38 / 7.7 = 2.39: errata S13."""
    assert curvature_correction_factor(18.38 / 7.7)[0] == pytest.approx(1.1617, abs=1e-4)


def test_straight_limit_is_six_m_over_b_t_squared():
    """Strength of materials: 6 M / (w2 w1^2), at R = inf and, to 1/3 of t / R, before."""
    moment, thickness, width = 3.7, 7.7e-3, 4.2e-3
    straight = 6.0 * moment / (width * thickness**2)
    concave, convex = curved_strip_stress(moment, thickness, width, [np.inf, 1e4 * thickness])
    assert concave == pytest.approx([straight, straight * (1.0 + 1e-4 / 3.0)], rel=1e-8)
    assert convex == pytest.approx([-straight, -straight * (1.0 - 1e-4 / 3.0)], rel=1e-8)


def test_series_and_closed_form_meet_without_a_step():
    """The branch at t / (2 R) = 0.03 must not show: the closed forms, in extended precision."""
    x = np.array([1e-2, 0.0299999, 0.03, 0.0300001, 0.2], dtype=np.longdouble)
    radius = (0.5 / x).astype(float)
    g = (1 - x / np.arctanh(x)) / x**2
    factor = (1 - g * x) / (3 * g * (1 - x))
    assert curvature_correction_factor(radius) == pytest.approx(factor.astype(float), rel=1e-11)


@few
@given(ratio=ratios, thickness=sizes, width=sizes, moment=st.floats(-50.0, 50.0))
def test_winkler_stress_balances_the_moment_and_no_force(ratio, thickness, width, moment):
    """Gauss quadrature of the hyperbola through the two faces gives N = 0 and M back."""
    radius = ratio * thickness
    concave, convex = curved_strip_stress(moment, thickness, width, radius)
    nodes, weights = np.polynomial.legendre.leggauss(120)
    r = radius + nodes * thickness / 2
    inner, outer = radius - thickness / 2, radius + thickness / 2
    slope = (concave[0] - convex[0]) / (1.0 / inner - 1.0 / outer)
    stress = concave[0] + slope * (1.0 / r - 1.0 / inner)
    area_weight = weights * thickness * width / 2
    scale = abs(moment) + 1e-12
    assert abs(np.sum(stress * area_weight)) * thickness < 1e-8 * scale
    assert -np.sum(stress * (r - radius) * area_weight) == pytest.approx(moment, abs=1e-8 * scale)


@few
@given(ratio=ratios, factor=st.floats(1.01, 3.0))
def test_correction_factor_exceeds_one_and_falls_with_the_radius(ratio, factor):
    tight, wide = curvature_correction_factor([ratio, factor * ratio])
    assert tight > wide > 1.0


@few
@given(ratio=ratios, thickness=sizes, width=sizes, scale=st.floats(0.05, 20.0))
def test_stress_falls_with_the_cube_of_length(ratio, thickness, width, scale):
    base = curved_strip_stress(2.5, thickness, width, ratio * thickness)
    lengths = np.array([thickness, width, ratio * thickness]) * scale
    scaled = curved_strip_stress(2.5, *lengths)
    for before, after in zip(base, scaled, strict=True):
        assert after * scale**3 == pytest.approx(before, rel=1e-9)


def test_stress_is_a_vector_along_an_arm_and_odd_in_the_moment():
    radius = np.array([18.38e-3, 40e-3, 75.07e-3])
    moment = np.array([2.0, 7.5, -3.0])
    concave, convex = curved_strip_stress(moment, 7.7e-3, 7.34e-3, radius)
    back = curved_strip_stress(-moment, 7.7e-3, 7.34e-3, radius)
    one = [curved_strip_stress(m, 7.7e-3, 7.34e-3, r) for m, r in zip(moment, radius, strict=True)]
    assert concave.shape == convex.shape == (3,)
    np.testing.assert_allclose(concave, -back[0])
    np.testing.assert_allclose(convex, [face[1][0] for face in one])


def test_area_and_inertias_of_the_rectangle():
    """Timoshenko: b h, b h^3 / 12."""
    assert section_area(7.7e-3, 7.34e-3) == pytest.approx(56.518e-6)
    assert in_plane_inertia(7.7e-3, 7.34e-3) == pytest.approx(279.2460e-12, rel=1e-6)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: section_area(0.0, 1e-3), r"thickness_m = 0\.0 must be positive"),
        (lambda: in_plane_inertia(1e-3, -2e-3), r"width_m = -0\.002 must be positive"),
        (lambda: section_area(np.nan, 1e-3), "thickness_m = nan must be positive"),
        (
            lambda: curved_strip_stress(1.0, 8e-3, 5e-3, [9e-3, 4e-3]),
            r"radius_m\[1\] = 0\.004 must exceed thickness_m / 2 = 0\.004: .* fold",
        ),
        (lambda: curvature_correction_factor(np.nan), r"radius_m\[0\] = nan must exceed"),
        (lambda: curvature_correction_factor(0.5), r"radius_m\[0\] = 0\.5 must exceed"),
        (lambda: curved_strip_stress(np.nan, 8e-3, 5e-3, 1.0), "moment_Nm = nan must be finite"),
        (
            lambda: curved_strip_stress([1.0, 2.0], 8e-3, 5e-3, [1.0, 1.0, 1.0]),
            "moment_Nm has 2 values and radius_m 3",
        ),
    ],
)
def test_impossible_sections_are_refused_with_field_and_limit(call, message):
    with pytest.raises(DesignError, match=message):
        call()


@pytest.mark.parametrize("nu", [0.3, 0.342])
def test_a_wide_strip_bends_from_a_beam_to_a_plate(nu):
    """Lamb's edge problem solved by differences: D u_yyyy + E t u / R^2 = 0, u_yy = -nu k."""
    radius, thickness = 25e-3, 1e-3
    widths = np.array([0.5e-3, 5e-3, 15e-3, 30e-3, 1.0])
    got = [float(wide_strip_factor(w, thickness, 1 / radius, nu)[0]) for w in widths]
    assert got[0] == pytest.approx(1, abs=1e-5)
    assert got[-1] == pytest.approx(1 / (1 - nu**2), rel=2e-3)
    assert np.all(np.diff(got) > 0)
    for width, factor in zip(widths[1:4], got[1:4], strict=True):
        n = 801
        step = width / (n - 1)
        second = (np.eye(n, k=1) - 2 * np.eye(n) + np.eye(n, k=-1))[1:-1] / step**2
        weight = np.full(n, step)
        weight[[0, -1]] = step / 2
        inner = weight[1:-1, None]
        # twice the energy over D, with k = 1: u_yy^2 + 2 nu u_yy + 12 (1 - nu^2) (u / (R t))^2
        bed = np.diag(weight) * 12 * (1 - nu**2) / (radius * thickness) ** 2
        u = np.linalg.solve(second.T @ (inner * second) + bed, -nu * (second.T @ inner)[:, 0])
        moment = width + nu * (inner[:, 0] @ (second @ u))
        assert factor == pytest.approx(moment / width / (1 - nu**2), rel=1e-3)


def test_the_series_of_a_narrow_strip_meets_the_closed_form():
    nu, thickness, curvature = 0.3, 1e-3, 10.0
    width = 0.1 / (3 * (1 - nu**2)) ** 0.25 / np.sqrt(curvature / thickness)
    below, above = (wide_strip_factor(s * width, thickness, curvature, nu) for s in (0.999, 1.001))
    assert below == pytest.approx(above, abs=1e-8)
