"""Quantised readings count once, and their edges carry the information in time."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rsea_core.identify.smoothing.encoder_quantisation import UNIFORM, count_of, noise_of, sharpened

COUNT = 2.0 * np.pi / 8192


def quantised(angle, phase=0.3):
    return (np.floor(angle / COUNT + phase) + 0.5 - phase) * COUNT


def test_a_resting_encoder_knows_one_count_however_long_it_rests():
    _, variance = sharpened(np.full(500, 3 * COUNT), COUNT)
    assert 1.0 / np.sum(1.0 / variance) == pytest.approx(COUNT**2 * UNIFORM)


def test_a_fast_encoder_is_taken_as_read():
    reading = quantised(np.linspace(0.0, 1.0, 300))  # some four counts a row
    value, variance = sharpened(reading, COUNT)
    assert np.array_equal(value, reading)
    assert np.all(variance == COUNT**2 * UNIFORM)


@given(speed=st.floats(0.02, 0.5), phase=st.floats(0.0, 1.0), sign=st.sampled_from([-1.0, 1.0]))
@settings(max_examples=60, deadline=None)
def test_edges_of_a_slow_motion_lie_within_their_stated_error(speed, phase, sign):
    angle = sign * speed * COUNT * np.arange(400.0)
    reading = quantised(angle, phase)
    value, variance = sharpened(reading, COUNT)
    edges = np.flatnonzero(variance < 0.5 * COUNT**2 * UNIFORM)
    error = (value - angle)[edges]
    # a uniform error stays within sqrt(3) of its standard deviation
    assert np.all(np.abs(error) <= np.sqrt(3.0 * variance[edges]) + 1e-12)


def test_edges_carry_most_of_the_information_of_a_slow_motion():
    angle = 0.05 * COUNT * np.arange(400.0)
    value, variance = sharpened(quantised(angle), COUNT)
    best = np.sum((value - angle) / variance) / np.sum(1.0 / variance)
    assert abs(best) < 0.03 * COUNT
    assert np.sqrt(1.0 / np.sum(1.0 / variance)) < 0.02 * COUNT


def test_count_is_found_in_the_readings_and_not_where_there_is_none():
    angle = 0.2 * np.sin(np.arange(3000) * 0.01)
    assert count_of(quantised(angle)) == pytest.approx(COUNT, rel=1e-6)
    rng = np.random.default_rng(1)
    assert count_of(angle + 1e-3 * rng.standard_normal(angle.size)) is None
    assert count_of(np.zeros(100)) is None


def test_noise_of_a_smooth_signal():
    rng = np.random.default_rng(2)
    signal = np.sin(np.arange(5000) * 0.01) + 0.02 * rng.standard_normal(5000)
    assert noise_of(signal) == pytest.approx(0.02, rel=0.05)
