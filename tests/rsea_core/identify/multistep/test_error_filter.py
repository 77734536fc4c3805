"""The filter of a prediction's errors: exact discretisation, white innovations, the true noise."""

from types import SimpleNamespace

import numpy as np
import pytest

import rsea_core.machine.plant as mp
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.multistep.error_filter import Readings, discretised
from rsea_core.identify.multistep.estimator import Estimator, independent_share
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.kalman_filter import Filter, filter_gains, innovations, smoothed
from rsea_core.identify.multistep.noise_estimate import estimated_noise
from rsea_core.identify.multistep.tracks import initial_track, prepared, start_variances
from rsea_core.recordings.case import Case
from tests.cases.one_axis import axis_case, axis_recording, axis_rig
from tests.cases.planted import RIG, recording

ROW_s = 0.02


def double_integrator(density: float):
    """Position and speed under a white force, the position read."""
    A, Q = discretised(np.array([[0.0, 1.0], [0.0, 0.0]]), np.diag([0.0, density]), ROW_s)
    return A[None], Q[None], np.array([[1.0, 0.0]])


def test_the_covariance_of_a_row_is_that_of_integrated_white_noise():
    """Van Loan's integral of a double integrator is h^3/3, h^2/2, h in closed form."""
    A, Q, _ = double_integrator(3.0)
    h = ROW_s
    exact = 3.0 * np.array([[h**3 / 3.0, h**2 / 2.0], [h**2 / 2.0, h]])
    assert pytest.approx(exact, rel=1e-9) == Q[0]
    assert pytest.approx(np.array([[1.0, h], [0.0, 1.0]]), rel=1e-12) == A[0]


def test_the_covariance_of_a_stiff_machine_is_its_stationary_one():
    """White noise through a winding 200 times faster than a row: variance q / (2 a)."""
    a, h, density = 5000.0, 0.04, 3.0
    A, Q = discretised(np.array([[-a]]), np.array([[density]]), h)
    assert pytest.approx(density / (2.0 * a), rel=1e-9) == Q[0, 0]
    assert 0.0 <= A[0, 0] < 1e-60


def simulated(density: float, noise: float, n: int, seed: int):
    A, Q, C = double_integrator(density)
    rng = np.random.default_rng(seed)
    root, x, read = np.linalg.cholesky(Q[0]), np.zeros(2), np.empty((n, 1))
    for t in range(n):
        read[t] = C @ x + noise * rng.standard_normal()
        x = A[0] @ x + root @ rng.standard_normal(2)
    return A, Q, C, read


def test_innovations_of_the_filters_own_machine_are_white_with_variance_one():
    n, noise = 4000, 0.01
    A, Q, C, read = simulated(0.5, noise, n, 3)
    begins, mode = np.zeros(n, bool), np.zeros(n, np.int64)
    begins[0] = True
    gain, root = filter_gains(A, Q, mode, C, np.array([noise**2]), np.full((1, 2), 1e-4), begins)
    given = Filter(A, mode, C, gain, root, begins)
    e = innovations(given, read[None])
    many = innovations(given, np.stack(11 * [read]))  # side by side
    assert np.array_equal(many[9:], np.concatenate([e, e]))
    white = e[0, 50:, 0]
    assert np.var(white) == pytest.approx(1.0, abs=4.0 * np.sqrt(2.0 / white.size))
    for lag in (1, 2, 5):
        assert abs(np.mean(white[lag:] * white[:-lag])) < 4.0 / np.sqrt(white.size)


def test_the_smoother_errs_by_what_it_says():
    n, noise = 1500, 0.01
    A, Q, C, read = simulated(0.5, noise, n, 4)
    rng = np.random.default_rng(4)  # the same draws: the states once more
    root, x, states = np.linalg.cholesky(Q[0]), np.zeros(2), np.empty((n, 2))
    for t in range(n):
        states[t] = x
        rng.standard_normal()
        x = A[0] @ x + root @ rng.standard_normal(2)
    found, variance = smoothed(
        A, Q, np.zeros(n, np.int64), C, np.array([noise**2]), np.full((1, 2), 1e-4), read
    )
    off = (found - states) / np.sqrt(variance)
    assert np.mean(off[20:-20] ** 2) == pytest.approx(1.0, abs=0.25)


def test_the_noise_of_a_recording_is_found_and_its_innovations_are_independent(tmp_path):
    """A machine that is the model's: no unknown torque, the encoder's counts, all rows count."""
    rig = axis_rig()
    case = axis_case(tmp_path, axis_recording(seed=5), rig=rig)
    problem = MultistepProblem(case)
    plain = Hypothesis()
    x = problem.start(plain)
    estimator = Estimator(problem, [initial_track(e) for e in problem.fitted])
    residual = [r[0] for r in estimator.residuals([(plain, x)])]
    tracks = estimated_noise(estimator.tracks, residual)
    noise, scale = tracks[0].noise, tracks[0].scale
    assert noise.inputs[0] < 0.01 * scale.torque_Nm[0]
    count = 2.0 * np.pi / 4096
    assert noise.readings[0] == pytest.approx(count / np.sqrt(12.0), rel=0.5)
    assert independent_share(estimator.having(tracks), plain, x) > 0.2


def test_readings_begin_with_an_unknown_zero_except_that_of_a_torque_sensor(tmp_path):
    case = Case(name="planted", folder=tmp_path, rig=RIG,
                recordings=(recording((), "locked", "locked.csv", 1),))  # fmt: skip
    (experiment,) = MultistepProblem(case).fitted
    track = initial_track(experiment)
    (start,) = start_variances(track, track.errors)
    floors = dict(zip(experiment.channels, experiment.floor_of_each, strict=True))
    zero = dict(zip(experiment.channels, track.errors.constants, strict=True))
    assert start[zero["load_angle_rad"]] == pytest.approx(floors["load_angle_rad"] ** 2)
    assert zero["torque_Nm"] == -1
    track = prepared(track, zeros=(experiment.channels.index("torque_Nm"),))
    zero = dict(zip(experiment.channels, track.errors.constants, strict=True))
    (start,) = start_variances(track, track.errors)
    spread = np.var(experiment.measured[:, experiment.channels.index("torque_Nm")])
    assert start[zero["torque_Nm"]] == pytest.approx(spread)


@pytest.mark.parametrize(
    ("channels", "structure", "found"),
    [
        (("motor_angle_rad", "load_angle_rad", "current_A"), mp.RIGID_FREE, [1]),
        (("current_A", "motor_velocity_rad_per_s"), mp.RIGID_FREE, []),
        (("current_A", "motor_velocity_rad_per_s", "load_velocity_rad_per_s"), mp.RIGID_FREE, [2]),
        (("motor_angle_rad", "load_angle_rad", "torque_Nm"), mp.ELASTIC_FREE, [0, 1]),
        (("torque_Nm", "motor_velocity_rad_per_s"), mp.ELASTIC_FREE, []),
    ],
)
def test_the_first_angle_or_speed_is_the_reference_whatever_is_read_before_it(
    channels, structure, found
):
    """A zero of the only speed would absorb an amplifier's offset."""
    plant = SimpleNamespace(structure=structure)
    assert Readings(channels).with_zeros(plant) == found
    assert Readings(channels, zeros=(0,)).with_zeros(plant) == sorted({0, *found})
