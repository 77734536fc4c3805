"""A law of the machine holds beyond the windows that it was fitted in, or it is not believed."""

from types import SimpleNamespace

import numpy as np
import pytest

from rsea_core.identify.law_search import window_lengths
from rsea_core.identify.law_search.hold_out import HeldOut
from rsea_core.identify.law_search.window_lengths import error_left_beyond, fails_in_longer_windows


def found_with(monkeypatch, horizon, plain: float, left: float, *, longer: bool = False):
    """What a search found whose fits are wrong by these errors in the windows after `horizon`."""
    asked = []

    def estimator(error):
        own = SimpleNamespace(error=error, fit=lambda h, x, iterations: SimpleNamespace(x=x))
        own.having = lambda tracks: own
        return own

    fit = SimpleNamespace(hypothesis=None, x=np.zeros(1))
    monkeypatch.setattr(window_lengths, "with_windows", lambda own, length: asked.append(length))
    monkeypatch.setattr(window_lengths, "relative_error", lambda own, h, x: own.error)
    found = SimpleNamespace(
        horizon=horizon, predicts_longer=longer, steps=[None], base=fit, best=fit,
        base_estimator=estimator(plain), estimator=estimator(left), complete=False,
    )  # fmt: skip
    return found, asked


@pytest.mark.parametrize(("horizon", "longer"), [(1.0, 4.0), (16.0, None)])
def test_the_share_is_that_of_errors_in_the_next_longer_windows(monkeypatch, horizon, longer):
    found, asked = found_with(monkeypatch, horizon, 0.5, 0.1)
    assert error_left_beyond(found) == pytest.approx(0.2)
    assert asked == [longer, longer]


def test_whole_recordings_leave_nothing_longer_to_ask(monkeypatch):
    found, asked = found_with(monkeypatch, None, 0.5, 0.1)
    assert error_left_beyond(found) is None
    assert asked == []


def test_windows_in_which_parameters_predict_nothing_say_nothing(monkeypatch):
    found, _ = found_with(monkeypatch, 1.0, 2.5, 2.4)
    assert error_left_beyond(found) is None


def test_laws_that_made_the_windows_longer_have_held_beyond_theirs(monkeypatch):
    found, asked = found_with(monkeypatch, 4.0, 0.5, 0.5, longer=True)
    assert error_left_beyond(found) is None
    assert asked == []


@pytest.mark.parametrize(
    ("left", "ratio", "no_further"), [(0.48, 0.0, True), (0.48, 5.0, False), (0.3, 0.0, False)]
)
def test_laws_that_predict_recordings_held_out_evenly_need_not_hold_in_longer_windows(
    monkeypatch, left, ratio, no_further
):
    found, _ = found_with(monkeypatch, 1.0, 0.5, left)
    assert fails_in_longer_windows(found, HeldOut(gain=30.0, ratio=ratio)) == no_further


@pytest.mark.parametrize(("settles_at", "horizon"), [(0.1, None), (5.0, 16.0)])
def test_windows_are_not_taken_in_which_a_fit_in_its_own_noise_predicts_nothing(
    monkeypatch, settles_at, horizon
):
    """Free turret, 29001 s18: an error of 0.18 became 5 where unknown torques were estimated."""
    found, _ = found_with(monkeypatch, 16.0, 0.5, 0.1)
    end = SimpleNamespace(error=settles_at)
    found.lost, found.best = window_lengths.LOST, SimpleNamespace(hypothesis=None, x=np.zeros(1))
    found.estimator.tracks = []
    monkeypatch.setattr(window_lengths, "smooth", lambda *given: None)
    monkeypatch.setattr(window_lengths, "with_noise", lambda own, h, x: own)
    monkeypatch.setattr(window_lengths, "settled", lambda own, fit, once: (end, fit))
    window_lengths.lengthen(found, lambda text: None)
    assert found.horizon == horizon
    assert (found.estimator is end) == (horizon is None)
