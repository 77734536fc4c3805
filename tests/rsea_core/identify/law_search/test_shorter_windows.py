"""If parameters alone predict long windows badly, laws are searched for in shorter ones too."""

import pytest

from rsea_core.effects.motor_cogging import MotorCogging
from rsea_core.identify.law_search.screening import screen
from rsea_core.identify.law_search.search import add_all, begun, laws_of
from rsea_core.identify.law_search.window_lengths import in_shorter_windows, predicts_closer
from rsea_core.identify.multistep.criteria import DOUBTED_ERROR
from rsea_core.identify.multistep.horizons import relative_error
from tests.cases.one_axis import axis_case, axis_recording, axis_rig

CYCLES = 7


def search(folder, *terms):
    """Parameters alone of an axis whose rig file lacks some terms."""
    recordings = (axis_recording(*terms, seed=seed) for seed in (3, 4))
    return begun(axis_case(folder, *recordings, rig=axis_rig()), None, lambda text: None)


@pytest.fixture(scope="module")
def detents(tmp_path_factory):
    """An axis that cogging stops at times, which parameters alone do not predict."""
    cogging = MotorCogging(amplitude_Nm=0.8, cycles_per_rev=CYCLES, phase_rad=0.8)
    return search(tmp_path_factory.mktemp("detents"), cogging)


def test_the_windows_are_those_that_parameters_alone_predict_closely(detents):
    shorter = in_shorter_windows(detents, lambda text: None)
    whole = relative_error(detents.base_estimator, detents.base.hypothesis, detents.base.x)
    assert whole > DOUBTED_ERROR
    error = relative_error(shorter.estimator, shorter.base.hypothesis, shorter.base.x)
    assert error <= DOUBTED_ERROR
    assert shorter.horizon < (detents.horizon or float("inf"))
    assert not predicts_closer(shorter, detents)  # without a law they are no better
    best = screen(shorter.estimator, shorter.base, laws_of(shorter))[0]
    assert best.law.effect == MotorCogging.effect
    assert best.law.law.startswith(f"{CYCLES} per turn")


def test_the_law_that_is_found_there_predicts_closer(detents):
    shorter = in_shorter_windows(detents, lambda text: None)
    add_all(shorter, [w for w in laws_of(shorter) if w.kind is MotorCogging], lambda text: None)
    assert shorter.steps[0].law.law.startswith(f"{CYCLES} per turn")
    assert shorter.predicts_longer
    assert predicts_closer(shorter, detents)


def test_a_machine_that_parameters_predict_needs_none(tmp_path):
    assert in_shorter_windows(search(tmp_path), lambda text: None) is None
