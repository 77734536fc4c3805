"""A spring's stiffness grows with the deflection, its square, or both, by the ratio of tangents."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rsea_core.effects.spring_hardening import (
    LEAST_TANGENT,
    HARDENING_AT_rad,
    SpringHardening,
    extent_rad,
    regions_of,
)

K = 40.0
RATIOS, SHARES = st.floats(-3.0, 5.0), st.floats(-2.0, 3.0)


def torque_and_tangent(regions, d):
    """Of a spring's table."""
    _, anchor, c0, c1, c2, c3 = regions[np.searchsorted(regions[:-1, 0], d, side="right")].T
    s = d - anchor
    return c0 + s * (c1 + s * (c2 + s * c3)), c1 + s * (2.0 * c2 + 3.0 * s * c3)


@given(ratio=RATIOS, share=SHARES)
def test_the_tangent_at_the_contracts_deflection_has_the_ratio(ratio, share):
    regions = regions_of(K, ratio, 1.0, share)
    if extent_rad(ratio, 1.0, share) > HARDENING_AT_rad:
        _, tangent = torque_and_tangent(regions, np.array([HARDENING_AT_rad]))
        assert tangent[0] == pytest.approx(ratio * K, rel=1e-9)


@given(ratio=RATIOS, share=SHARES)
def test_the_law_is_odd_continuous_and_never_softer_than_its_least_tangent(ratio, share):
    regions, d = regions_of(K, ratio, 0.4, share), np.linspace(0.0, 0.6, 601)
    torque, tangent = torque_and_tangent(regions, d)
    other, _ = torque_and_tangent(regions, -d)
    assert other == pytest.approx(-torque, abs=1e-9 * K)
    assert np.diff(torque) == pytest.approx(tangent[:-1] * 1e-3, abs=5e-3 * np.abs(tangent).max())
    assert tangent.min() >= (LEAST_TANGENT - 1e-6) * K


def test_shares_of_none_and_all_are_duffings_cubic_and_a_square():
    d, growth = np.linspace(0.0, 0.29, 30), 1.6 - 1.0
    cubic, _ = torque_and_tangent(regions_of(K, 1.6, 0.3, 0.0), d)
    assert cubic == pytest.approx(K * (d + growth / 3.0 * d**3 / 0.15**2), rel=1e-12)
    square, _ = torque_and_tangent(regions_of(K, 1.6, 0.3, 1.0), d)
    assert square == pytest.approx(K * (d + growth / 2.0 * d * np.abs(d) / 0.15), rel=1e-12)


def test_the_law_says_its_formula():
    plain = SpringHardening(stiffness_ratio_at_0p15rad=1.6).equation()
    both = SpringHardening(stiffness_ratio_at_0p15rad=1.6, quadratic_share=0.5).equation()
    assert plain == "f(d) = K_s (d + 8.8889 d^3) up to 0.3 rad, linear beyond"
    assert both == "f(d) = K_s (d + 1 |d| d + 4.4444 d^3) up to 0.3 rad, linear beyond"
