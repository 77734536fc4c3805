"""Lengths, tangents and curvatures of the spiral agree with independent numerics."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from dftfs.errors import DesignError
from dftfs.spring.centreline import FermatSpiral
from dftfs.spring.edges import Arc, OffsetEdge, Segment

SPIRAL = FermatSpiral(inner_radius_m=0.01838, outer_radius_m=0.07507, turns=1.9, rotation_rad=0.4)


def test_fermat_spiral_runs_from_inner_to_outer_radius_in_its_turns():
    assert np.hypot(*SPIRAL.point(SPIRAL.start)) == pytest.approx(0.01838, rel=1e-13)
    assert np.hypot(*SPIRAL.point(SPIRAL.end)) == pytest.approx(0.07507, rel=1e-13)
    assert SPIRAL.end - SPIRAL.start == pytest.approx(2 * np.pi * 1.9, rel=1e-13)
    # thesis errata S4: c^2 = (R_o^2 - R_i^2) / (2 pi n), not the golden ratio
    assert SPIRAL.scale_m**2 == pytest.approx((0.07507**2 - 0.01838**2) / (3.8 * np.pi), rel=1e-13)


def test_arc_length_agrees_with_adaptive_quadrature_and_inverts():
    length = quad(lambda t: float(SPIRAL.speed(t)), SPIRAL.start, SPIRAL.end, epsabs=1e-14)[0]
    assert SPIRAL.length(SPIRAL.start, SPIRAL.end) == pytest.approx(length, rel=1e-12)
    theta = SPIRAL.parameter_at_length(SPIRAL.start, [0.1, 0.37])
    assert [SPIRAL.length(SPIRAL.start, t) for t in theta] == pytest.approx([0.1, 0.37], rel=1e-12)


def test_tangent_normal_and_curvature_agree_with_finite_differences():
    theta, h = np.linspace(SPIRAL.start, SPIRAL.end, 7), 1e-5
    derivative = (SPIRAL.point(theta + h) - SPIRAL.point(theta - h)) / (2 * h)
    np.testing.assert_allclose(
        SPIRAL.tangent(theta), derivative / SPIRAL.speed(theta)[:, None], atol=1e-9
    )
    np.testing.assert_allclose(np.hypot(*derivative.T), SPIRAL.speed(theta), rtol=1e-9)
    turned = (SPIRAL.tangent(theta + h) - SPIRAL.tangent(theta - h)) / (2 * h)
    # curvature is positive towards the axis, the normal points away from it
    turn_rate = -np.sum(turned * SPIRAL.normal(theta), axis=1) / SPIRAL.speed(theta)
    np.testing.assert_allclose(SPIRAL.curvature(theta), turn_rate, rtol=1e-8)


@given(offset=st.floats(-4e-3, 4e-3), start=st.floats(0.85, 5.0), span=st.floats(0.1, 6.0))
@settings(max_examples=25, deadline=None)
def test_offset_edge_length_and_area_are_those_of_a_fine_polygon(offset, start, span):
    edge = OffsetEdge(name="e", centreline=SPIRAL, offset_m=offset, start=start, end=start + span)
    points = edge.point(np.linspace(0, 1, 40001))
    step = np.diff(points, axis=0)
    assert edge.length_m == pytest.approx(np.sum(np.hypot(*step.T)), rel=1e-7)
    fan = 0.5 * np.sum(points[:-1, 0] * points[1:, 1] - points[1:, 0] * points[:-1, 1])
    assert edge.area_m2 == pytest.approx(fan, rel=1e-7)
    assert edge.reversed().area_m2 == pytest.approx(-edge.area_m2, rel=1e-12)


def test_arc_and_segment_areas_close_a_half_disc():
    arc = Arc(name="a", centre_m=(0.3, -0.2), radius_m=0.7, start_rad=0.5, end_rad=0.5 + np.pi)
    chord = Segment(name="c", start_m=tuple(arc.point(1.0)), end_m=tuple(arc.point(0.0)))
    assert arc.area_m2 + chord.area_m2 == pytest.approx(np.pi * 0.49 / 2, rel=1e-12)


def test_radii_out_of_order_are_refused_with_both_values():
    with pytest.raises(DesignError, match=r"inner_radius_mm = 80 .* outer_radius_mm = 75"):
        FermatSpiral(inner_radius_m=0.08, outer_radius_m=0.075, turns=2.0)
