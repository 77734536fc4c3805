"""The misfit of whole recordings: the worst reading's errors, and what they cost above noise."""

from types import SimpleNamespace

import numpy as np
import pytest

from rsea_core.identify.multistep.kalman_filter import huber_squares
from rsea_core.identify.whole_runs.sensor_noise import excess, misfit


def machine(*innovations):
    """An estimator whose innovations (rows, readings) of each recording are given."""
    return SimpleNamespace(innovations=lambda trials: [e[None] for e in innovations])


@pytest.mark.parametrize("size", [0.5, 1.0, 2.0])
def test_the_misfit_is_the_worst_readings_root_mean_square(size):
    quiet = np.tile([[0.1, -0.1]], (100, 1))
    loud = np.tile([[0.1, size], [0.1, -size]], (50, 1))
    found = misfit(machine(quiet, loud), None, None)
    assert found == pytest.approx(np.sqrt(huber_squares(size)))
    assert found == pytest.approx(size, rel=0.12)  # Huber's squares begin as squares


def test_a_few_rows_that_read_nonsense_do_not_decide():
    rows = np.random.default_rng(1).normal(size=(2000, 1))
    rows[::500] = 25.0
    assert np.sqrt(np.mean(rows**2)) > 1.4
    assert misfit(machine(rows), None, None) < 1.2


def test_what_noise_alone_leaves_has_no_excess():
    rows = np.random.default_rng(2).normal(size=(5000, 2))
    assert excess(machine(0.9 * rows), None, None) == 0.0
    twice = excess(machine(np.full((100, 1), 1.2)), None, None)
    assert twice == pytest.approx(50.0 * (huber_squares(1.2) - 1.0))
