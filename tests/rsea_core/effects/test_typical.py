"""How uncertain the loop of a spring is at an amplitude far beyond those recorded."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.effects.spring_hysteresis import LOOP_AT_rad, SpringBoucWen, SpringHysteresis
from rsea_core.effects.typical import KNOWN_TO, RANGE
from rsea_core.identify.candidates.typical_magnitudes import own_magnitudes
from tests.cases.one_axis import axis_case, axis_recording, axis_rig

RATIO = 40.0


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    return axis_case(tmp_path_factory.mktemp("axis"), axis_recording(seed=1), rig=axis_rig())


def deflected(case, amplitude_rad: float, relative: bool = True):
    deflection = amplitude_rad / (0.5 * RANGE)
    return replace(own_magnitudes(case), deflection_rad=deflection, relative=relative)


def test_a_loop_far_beyond_the_recorded_amplitude_may_grow_in_proportion_to_it(case):
    typical = deflected(case, LOOP_AT_rad / KNOWN_TO / RATIO)
    u = (np.arange(100_000) + 0.5) / 100_000
    expected = np.sqrt(np.mean((RATIO**u - 1.0) ** 2))
    assert typical.spread_of_loop(LOOP_AT_rad) == pytest.approx(expected, rel=1e-6)


def test_a_loop_near_the_recorded_amplitude_has_no_error_of_extrapolation(case):
    assert deflected(case, 1.01 * LOOP_AT_rad / KNOWN_TO).spread_of_loop(LOOP_AT_rad) is None
    beyond = deflected(case, 0.99 * LOOP_AT_rad / KNOWN_TO).spread_of_loop(LOOP_AT_rad)
    assert 0.0 < beyond < 0.02
    assert deflected(case, 1e-4, relative=False).spread_of_loop(LOOP_AT_rad) is None


@pytest.mark.parametrize("kind", [SpringHysteresis, SpringBoucWen])
def test_every_law_of_a_loop_states_it(case, kind):
    typical = deflected(case, LOOP_AT_rad / KNOWN_TO / RATIO)
    spreads = {law.form_spread for law in kind.candidates(typical)}
    assert spreads == {typical.spread_of_loop(LOOP_AT_rad)}
