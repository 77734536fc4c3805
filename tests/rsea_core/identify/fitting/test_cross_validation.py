"""Predictions over windows have the error of closed forms, and held-out data prefers the truth."""

import numpy as np
import pytest

import rsea_core.effects.layout as e
from rsea_core.errors import RecordingError
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.fitting.cross_validation import (
    cross_validate,
    fit_windows,
    window_errors,
    windowed,
    without_overlap,
)
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.fitting.window_predictions import cut
from tests.cases.recorded import CARRIAGE, carriage_case

FRICTION = {
    e.WHEEL_DRY: 1.0, e.GEAR_FORWARD: 12.0, e.GEAR_BACKWARD: 12.0, e.VISCOUS_SKEW: 35.0,
}  # fmt: skip


def test_the_true_machine_predicts_windows_down_to_the_sensor(tmp_path):
    problem = Problem(carriage_case(tmp_path), step_s=1e-3)
    plain = Hypothesis()
    pieces = [cut(problem, problem.prepared[0], 2.0)]
    error = window_errors(problem, plain, problem.start(plain), pieces)[0]
    assert error.windows == 5
    assert error.rmse < 2e-5  # the start's speed is smoothed from readings of 2e-6


def test_a_force_that_is_not_modelled_makes_the_error_of_a_free_mass(tmp_path):
    # e(t) = (F/B) (t - (1 - exp(-B t / M)) M / B): viscous friction holds the mass back
    force, T = 5.0, 1.5
    problem = Problem(carriage_case(tmp_path, offset=force), step_s=1e-3)
    plain = Hypothesis()
    error = window_errors(
        problem, plain, problem.start(plain), [cut(problem, problem.prepared[0], T)]
    )[0]
    M, B = CARRIAGE["load_inertia_kgm2"], CARRIAGE["load_viscous_Nms_per_rad"]
    t = np.linspace(0.0, T, 20001)
    expected = np.sqrt(np.mean(((force / B) * (t - (1.0 - np.exp(-B * t / M)) * M / B)) ** 2))
    assert error.rmse == pytest.approx(expected, rel=0.05)


def test_windows_find_viscous_friction_that_differs_by_direction(tmp_path):
    problem = Problem(carriage_case(tmp_path, fx=FRICTION), step_s=1e-3)
    law = catalogue(problem.case)["gear-friction/direction-dependent"]
    hypothesis = Hypothesis(laws=(law,))
    windows = windowed(problem, 2.0)
    fit = fit_windows(windows, hypothesis, problem.start(hypothesis))
    _, (values,) = problem.values(hypothesis, fit.x)
    assert values["coulomb_Nm"] == pytest.approx(12.0, rel=0.08)
    viscous = sum(v for key, v in problem.values(hypothesis, fit.x)[0].items() if "viscous" in key)
    assert values["viscous_asymmetry"] * viscous == pytest.approx(35.0, rel=0.08)
    assert values["asymmetry"] == pytest.approx(0.0, abs=0.05)


def test_cross_validation_prefers_the_law_that_is_there(tmp_path):
    problem = Problem(carriage_case(tmp_path, fx=FRICTION), step_s=1e-3)
    laws, found = catalogue(problem.case), {}
    windows = windowed(problem, 2.0)
    for key in ("gear-friction/coulomb", "gear-friction/direction-dependent"):
        hypothesis = Hypothesis(laws=(laws[key],))
        fit = fit_windows(windows, hypothesis, problem.start(hypothesis))
        found[key] = cross_validate(windows, hypothesis, fit.x, folds=3).errors[0].rmse
    assert found["gear-friction/direction-dependent"] < 0.2 * found["gear-friction/coulomb"]


def test_no_window_that_is_fitted_shares_time_with_a_held_out_one():
    starts = np.arange(0, 91, 5)
    windows = np.stack([starts, starts + 10], axis=1)
    held = np.array([[20, 30], [60, 70]])
    for (a, b), kept in zip(windows, without_overlap(windows, held), strict=True):
        overlap = any(a < d and b > c for c, d in held)
        assert kept == (not overlap)


def test_a_recording_shorter_than_a_window_is_refused_in_one_line(tmp_path):
    problem = Problem(carriage_case(tmp_path, seconds=1.0), step_s=1e-3)
    with pytest.raises(RecordingError, match=r"run\.csv: too short for windows of 2\.5 s"):
        windowed(problem, 2.5)
