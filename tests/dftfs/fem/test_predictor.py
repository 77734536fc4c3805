"""Hermite extrapolation is exact for polynomials and makes no guess out of its reach."""

import numpy as np
import pytest

from dftfs.fem.predictor import extrapolated, hermite


def along(coefficients, t):
    """(t, value, rate) of a vector polynomial."""
    value = np.array([np.polyval(c, t) for c in coefficients])
    rate = np.array([np.polyval(np.polyder(c), t) for c in coefficients])
    return t, value, rate


@pytest.mark.parametrize(("count", "degree"), [(2, 3), (3, 5)])
def test_states_with_rates_extrapolate_polynomials_exactly(count, degree):
    coefficients = np.random.default_rng(count).normal(size=(4, degree + 1))
    points = [along(coefficients, t) for t in (0.1, 0.35, 0.5)[-count:]]
    for t in (0.62, 0.4, -0.3):
        np.testing.assert_allclose(hermite(points, t), along(coefficients, t)[1], atol=1e-12)


def test_no_prediction_from_one_state_or_far_beyond_the_last_increment():
    coefficients = np.random.default_rng(7).normal(size=(2, 4))
    points = [along(coefficients, t) for t in (0.0, 0.1)]
    assert extrapolated(points[:1], 0.2) is None
    assert extrapolated(points, 0.5) is None
    assert extrapolated(points, 0.2) is not None


def test_a_path_that_turned_back_to_an_old_parameter_uses_only_what_came_after():
    coefficients = np.random.default_rng(8).normal(size=(2, 4))
    there_and_back = [along(coefficients, t) for t in (0.2, 0.3, 0.2)]
    np.testing.assert_allclose(
        extrapolated(there_and_back, 0.1), along(coefficients, 0.1)[1], atol=1e-12
    )
