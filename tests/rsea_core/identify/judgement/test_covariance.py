"""Uncertainties of fitted values agree with brute force and closed forms."""

import numpy as np
import pytest

from rsea_core.identify.judgement.covariance import (
    Spread,
    between_laws,
    jackknife,
    jackknife_of_identifiable,
)


def _recordings(rng: np.random.Generator, common: float, count: int = 5):
    """Linear recordings y = J x + noise, each with an error that holds all through it."""
    found = []
    for _ in range(count):
        J = np.array([1.0, 0.0]) + rng.standard_normal((40, 2))
        found.append((J, J @ [2.0, -1.0] + common * rng.standard_normal() + rng.normal(size=40)))
    return found


def _solve(recordings, prior):
    H = sum(J.T @ J for J, _ in recordings) + prior
    return np.linalg.solve(H, sum(J.T @ y for J, y in recordings))


def _parts(recordings, x):
    return [J.T @ J for J, _ in recordings], [J.T @ (J @ x - y) for J, y in recordings]


@pytest.mark.parametrize("weight", [0.0, 3.0])
def test_jackknife_of_a_linear_fit_is_that_of_refits_without_each_recording(weight):
    recordings = _recordings(np.random.default_rng(3), common=0.5)
    prior = weight**2 * np.eye(2)
    x = _solve(recordings, prior)
    refits = np.array(
        [_solve(recordings[:b] + recordings[b + 1 :], prior) for b in range(len(recordings))]
    )
    centred = refits - refits.mean(axis=0)
    expected = (len(recordings) - 1) / len(recordings) * centred.T @ centred
    assert jackknife(*_parts(recordings, x), prior) == pytest.approx(expected, rel=1e-6, abs=1e-9)


def test_a_single_recording_has_no_jackknife():
    recordings = _recordings(np.random.default_rng(1), common=0.5, count=1)
    x = _solve(recordings, np.eye(2))
    assert not jackknife(*_parts(recordings, x), np.eye(2)).any()


def test_a_value_that_one_recording_alone_determines_has_no_variance_in_the_jackknife():
    recordings = _recordings(np.random.default_rng(2), common=0.5)
    one = [(J * [1.0, b == 0], y) for b, (J, y) in enumerate(recordings)]
    x = _solve(one, 1e-6 * np.eye(2))
    found = jackknife_of_identifiable(*_parts(one, x), np.zeros((2, 2)))
    assert found[0, 0] > 0.0
    assert not found[1].any()


def test_jackknife_sees_errors_that_hold_all_through_a_recording_and_white_noise_does_not():
    rng = np.random.default_rng(8)
    errors, seen, believed = [], [], []
    for _ in range(400):
        recordings = _recordings(rng, common=1.0)
        x = _solve(recordings, np.zeros((2, 2)))
        parts = _parts(recordings, x)
        errors.append(x[0] - 2.0)
        seen.append(jackknife(*parts, np.zeros((2, 2)))[0, 0])
        believed.append(np.linalg.inv(sum(parts[0]))[0, 0])
    truth = np.var(errors)
    assert np.mean(seen) == pytest.approx(truth, rel=0.3)
    assert np.mean(believed) < 0.2 * truth


def test_errors_that_cancel_in_a_figure_cancel_in_its_variance():
    together = np.array([[4.0, -4.0], [-4.0, 4.0]])
    alone = np.diag([0.01, 0.09])
    spread = Spread(sources=(together, alone))
    assert spread.variance(np.array([1.0, 1.0])) == pytest.approx(0.1)
    np.testing.assert_allclose(spread.std, [2.0, 2.0])
    moved = spread.with_move(np.array([0.3, 0.0]))
    assert moved.variance(np.array([1.0, 1.0])) == pytest.approx(0.19)


def test_laws_that_fit_alike_share_the_variance_and_far_ones_add_none():
    # two laws of equal weight, 2 apart from the best: half of 2 squared
    assert between_laws(1.0, [(3.0, 0.0)], 12.0) == pytest.approx(2.0)
    assert between_laws(1.0, [], 12.0) == 0.0
    assert between_laws(1.0, [(3.0, 1e4)], 12.0) == pytest.approx(0.0, abs=1e-12)


def test_an_amplitude_whose_phase_is_not_seen_is_off_by_what_the_other_phase_may_be():
    spread = Spread(sources=(np.diag([0.01**2, 3.0**2]),))
    seen = np.array([1.0, 0.0])

    def size(x):
        return float(np.hypot(*x))

    assert spread.variance(np.array([1.0, 0.0])) == pytest.approx(0.01**2)
    assert spread.mean_square(size, seen) == pytest.approx(0.01**2 + (np.sqrt(10.0) - 1.0) ** 2)
    line = np.array([2.0, -1.0])
    straight = spread.mean_square(lambda x: float(line @ x), seen)
    assert straight == pytest.approx(spread.variance(line))
