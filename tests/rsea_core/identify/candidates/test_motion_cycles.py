"""The rate of a recording's motion is that of the motion, whatever its sensor's noise."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.identify.candidates.motion_cycles import motion_rate, rate_without_noise
from tests.cases.one_axis import axis_recording

RATE = 3.0  # rad/s
ROW_s = 1e-3


def recording(noise: float):
    r = axis_recording(seed=1)
    time_s = ROW_s * np.arange(8000)
    angle = np.sin(RATE * time_s) + noise * np.random.default_rng(7).standard_normal(time_s.size)
    columns = {"time_s": time_s, "motor_angle_rad": angle}
    return replace(r, columns=columns, sample_time_s=ROW_s, logged=None)


def test_without_noise_it_is_the_rate_of_a_sine():
    assert rate_without_noise(recording(0.0)) == pytest.approx(RATE, rel=0.03)


def test_noise_of_a_fast_log_does_not_count_as_motion():
    noisy = recording(0.05)
    assert motion_rate(noisy) > 10.0 * RATE
    assert rate_without_noise(noisy) == pytest.approx(RATE, rel=0.15)


def test_noise_alone_is_no_motion():
    r = recording(0.0)
    angle = np.random.default_rng(8).standard_normal(r.rows)
    still = replace(r, columns={"time_s": r.time_s, "motor_angle_rad": angle})
    assert rate_without_noise(still) < 0.1 * motion_rate(still)
