"""A factor that constants share is told from errors of single constants."""

from math import gamma

import numpy as np
import pytest

from rsea_core.identify.selection.criteria import SCALE_LOG_ODDS
from rsea_core.identify.selection.prior_accuracy import (
    ACCURACIES,
    FREEDOM,
    log_density,
    shared_factor,
)

TOLERANCES = np.array([0.15, 0.1, 0.08, 0.08, 0.15, 0.7, 0.15, 0.05, 0.7])
ALONG = np.where(np.arange(9) < 3, 1.0, 0.0) / TOLERANCES
KNOWN = np.full(9, 0.02)


def test_three_constants_by_a_common_factor_show_it_where_the_others_stay_at_their_priors():
    own = np.array([0.1, -0.2, 0.1, -0.2, 0.1, 0.0, -0.2, 0.1, 0.1])
    log_odds, factor = shared_factor(own + np.log(1.13) * ALONG, KNOWN, ALONG)
    assert log_odds > SCALE_LOG_ODDS
    assert factor == pytest.approx(np.log(1.13), abs=0.02)
    worse, _ = shared_factor(8.0 * own + np.log(1.13) * ALONG, KNOWN, ALONG)
    assert worse < 2.0, "an owner who knows no constant better may be wrong three times"


@pytest.mark.parametrize("bad", range(9))
def test_one_bad_constant_is_no_factor(bad):
    moves = np.array([0.1, -0.2, 0.1, -0.2, 0.1, 0.0, -0.2, 0.1, 0.1])
    moves[bad] = 2.0
    assert shared_factor(moves, KNOWN, ALONG)[0] < 1.0


def test_constants_that_recordings_do_not_know_say_nothing():
    moves = np.log(1.3) * ALONG
    unknown = np.where(ALONG > 0.0, 0.9, 0.02)
    assert shared_factor(moves, unknown, ALONG)[0] == -np.inf
    wide = np.where(ALONG > 0.0, 0.6, 0.02)
    assert shared_factor(moves, wide, ALONG)[0] < shared_factor(moves, KNOWN, ALONG)[0] - 3.0


def test_odds_are_no_more_often_wrong_than_they_say():
    rng = np.random.default_rng(8)
    accuracy = rng.choice(ACCURACIES, size=(1500, 1))
    moves = np.hypot(accuracy, KNOWN) * rng.standard_t(FREEDOM, size=(1500, 9))
    log_odds = np.array([shared_factor(one, KNOWN, ALONG)[0] for one in moves])
    for odds in (3.0, 10.0, 20.0):  # a ratio of k to one has a chance of at most 1/k
        assert np.mean(log_odds > np.log(odds)) <= 1.0 / odds
    assert log_odds.max() < SCALE_LOG_ODDS


def test_the_density_is_that_of_student_but_for_its_constant():
    at = np.linspace(-200.0, 200.0, 40001)
    constant = np.sqrt(FREEDOM * np.pi) * gamma(FREEDOM / 2.0) / gamma((FREEDOM + 1.0) / 2.0)
    one = np.exp(log_density(at[:, None], np.array([0.05])))
    assert np.ptp(at) / at.size * one.sum() == pytest.approx(constant, rel=1e-3)
