"""The misfit of whole recordings: the worst reading's errors, and what they cost above noise.

That noise is the sensor's: what changes more slowly is the model's error.
"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.signal import lfilter

from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.multistep.estimator import Estimator
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.kalman_filter import huber_squares
from rsea_core.identify.multistep.tracks import initial_track, prepared
from rsea_core.identify.whole_runs.sensor_noise import (
    excess,
    in_sensor_noise,
    misfit,
    std_of_differences,
    std_of_fourth_differences,
)
from tests.cases.one_axis import axis_case, axis_recording, axis_rig


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


def test_differences_show_the_standard_deviation_of_noise_and_not_a_drift():
    size, lasts_rows = 4e-3, 4.0
    white = np.random.default_rng(7).normal(0.0, size, (20_000, 1))
    keeps = np.exp(-1.0 / lasts_rows)
    coloured = lfilter([np.sqrt(1.0 - keeps**2)], [1.0, -keeps], white, axis=0)
    drift = np.linspace(0.0, 100.0 * size, len(white))[:, None]
    assert std_of_differences(white + drift, 1) == pytest.approx(size, rel=0.03)
    assert std_of_differences(coloured + drift, 20) == pytest.approx(size, rel=0.05)


@pytest.mark.parametrize("drift_rad_per_s", [0.0, 0.5])
def test_noise_estimated_too_large_is_limited_to_the_sensors_noise_with_and_without_a_drift(
    tmp_path, drift_rad_per_s
):
    given, size = axis_recording(seed=8), 4e-3
    errors = np.random.default_rng(9).normal(0.0, size, given.rows)
    angle = given["motor_angle_rad"] + errors + drift_rad_per_s * given.time_s
    recording = replace(given, columns={**given.columns, "motor_angle_rad": angle})
    problem = MultistepProblem(axis_case(tmp_path, recording, rig=axis_rig()))
    h = Hypothesis()
    estimator = Estimator(problem, [initial_track(e) for e in problem.fitted])
    loud = [prepared(t, noise=replace(t.noise, readings=0.0 * t.noise.readings + 0.5))
            for t in estimator.tracks]  # fmt: skip
    fit = estimator.fit(h, problem.start(h))
    (track,) = in_sensor_noise(estimator.having(loud), fit).tracks
    assert track.noise.readings[0] * track.block**0.5 == pytest.approx(size, rel=0.2)


@pytest.mark.parametrize("size", [1e-4, 1e-2])
def test_fourth_differences_show_the_noise_of_a_reading_and_not_its_motion(size):
    rows = np.arange(20_000)
    motion = 30.0 * np.sin(2.0 * np.pi * rows / 400.0) + 1e-3 * rows  # 2e-7 rad of it is left
    noise = np.random.default_rng(9).normal(0.0, size, rows.size)
    found = std_of_fourth_differences((motion + noise)[:, None])
    np.testing.assert_allclose(found, size, rtol=0.05)  # six standard errors of 20,000 rows
