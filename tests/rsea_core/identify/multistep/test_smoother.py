"""The smoother agrees with batch least squares where starts are wide and sensors are fine."""

import numpy as np
import pytest
from scipy.linalg import expm, solve_triangular

from rsea_core.identify.multistep.kalman_filter import smoothed

ROWS, ROW_s = 120, 2e-3
WHEEL, LOAD, STIFFNESS = 3.06, 0.1025, 189.0  # kg m2, Nm/rad: an elastic joint
READINGS = np.array([6e-5, 2.4e-5, 0.06]) ** 2  # wheel and load angle [rad2], torque [Nm2]


def machine(torque_Nm):
    """Transition, its noise by unknown torques, and readings of wheel and load."""
    rates = np.zeros((4, 4))
    rates[0, 1] = rates[2, 3] = 1.0
    rates[1, [0, 2]] = np.array([-STIFFNESS, STIFFNESS]) / WHEEL
    rates[3, [0, 2]] = np.array([STIFFNESS, -STIFFNESS]) / LOAD
    step = np.zeros((4, 2))
    step[1, 0], step[3, 1] = ROW_s / WHEEL, ROW_s / LOAD
    read = np.array([[1.0, 0, 0, 0], [0, 0, 1.0, 0], [STIFFNESS, 0, -STIFFNESS, 0]])
    return expm(rates * ROW_s), torque_Nm * step, read


def batch(A, step, C, start, readings):
    """Estimates and standard deviations (n, 4) by QR of all equations at once.

    Unknowns are the first state and the torque of each row, each in its own deviation.
    """
    count = 4 + 2 * (ROWS - 1)
    states = np.zeros((ROWS, 4, count))
    states[0, :, :4] = np.diag(np.sqrt(start))
    for row in range(1, ROWS):
        states[row] = A @ states[row - 1]
        states[row, :, 4 + 2 * (row - 1) : 6 + 2 * (row - 1)] += step
    noise = np.sqrt(READINGS)[:, None]
    left = np.concatenate([np.eye(count), *((C @ x) / noise for x in states)])
    right = np.concatenate([np.zeros(count), *(readings / noise.T)])
    Q, R = np.linalg.qr(left)
    found = states @ solve_triangular(R, Q.T @ right)
    spread = states @ solve_triangular(R, np.eye(count))
    return found, np.sqrt(np.sum(spread**2, axis=2))


@pytest.mark.parametrize("torque_Nm", [1e-4, 1e-2, 1.0])
def test_wide_starts_keep_their_deviations(torque_Nm):
    A, step, C = machine(torque_Nm)
    start = np.array([1.0, 10.0, 1.0, 10.0]) ** 2
    rng = np.random.default_rng(3)
    x, readings = np.array([0.01, -0.02, 0.012, 0.5]), np.zeros((ROWS, 3))
    for row in range(ROWS):
        readings[row] = C @ x + np.sqrt(READINGS) * rng.standard_normal(3)
        x = A @ x + step @ rng.standard_normal(2)
    mode = np.zeros(ROWS, np.int64)
    estimate, variance = smoothed(
        A[None], (step @ step.T)[None], mode, C, READINGS, start[None], readings
    )
    found, spread = batch(A, step, C, start, readings)
    # a first speed's variance is 1e2 less a number that differs from it by 4e-9
    assert np.sqrt(variance[0]) == pytest.approx(spread[0], rel=0.1)
    assert np.sqrt(variance[1:]) == pytest.approx(spread[1:], rel=1e-6)
    assert np.max(np.abs(estimate - found) / spread) < 2e-3
