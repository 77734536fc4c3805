"""Confidence of a law: that something is there, and which of the laws that explain it."""

from types import SimpleNamespace

import numpy as np
import pytest

from rsea_core.effects.gear_friction import GearFriction
from rsea_core.effects.load_friction import LoadFriction
from rsea_core.effects.load_friction_angle import LoadFrictionAngle
from rsea_core.effects.sensor_scale import SensorScale
from rsea_core.effects.spring_hardening import SpringHardening
from rsea_core.identify import window_confidence
from rsea_core.identify.law_search.hold_out import HeldOut
from rsea_core.identify.window_confidence import (
    step_confidence,
    step_presence,
)
from rsea_core.machine.rig import Rig


def law(kind, sensor=None):
    return SimpleNamespace(effect=kind.effect, sensor=sensor, kind=kind)


def found(taken, *rivals, gain=200.0, ratio=30.0, tempering=1.0, doubt=None, complete=False,
          explained=1.0):  # fmt: skip
    step = SimpleNamespace(law=taken, gain=gain, ratio=ratio, tempering=tempering, rivals=rivals,
                           doubt=doubt)  # fmt: skip
    problem = SimpleNamespace(case=SimpleNamespace(rig=Rig.preset("rsea-bench")))
    return SimpleNamespace(steps=[step], problem=problem, complete=complete, explained=explained)


@pytest.fixture(autouse=True)
def predicted_without(monkeypatch):
    monkeypatch.setattr(window_confidence, "makes_predictable", lambda _: False)


def test_an_even_gain_without_rivals_is_convincing():
    assert step_confidence(found(law(GearFriction)), 0, None) == pytest.approx(0.97)


def test_a_law_that_explains_as_much_halves_which_and_leaves_that_something_is_there():
    alike = found(law(GearFriction), (law(SpringHardening), 200.0))
    assert step_confidence(alike, 0, None) == pytest.approx(0.5, abs=0.01)
    assert step_presence(alike, 0, None) > 0.97


def test_laws_that_leave_only_the_sensors_noise_are_judged_by_their_rivals_alone():
    rival = (law(SpringHardening), 190.0)
    weak = {"ratio": 0.0, "complete": True}
    sure = found(law(GearFriction), rival, doubt=1.0, **weak)
    assert step_confidence(sure, 0, None) == pytest.approx(0.97)
    doubtful = found(law(GearFriction), rival, doubt=10.0, **weak)
    assert step_confidence(doubtful, 0, None) == pytest.approx(1.0 / (1.0 + np.exp(-1.0)))


def test_a_law_that_is_nearly_all_is_as_probable_as_the_share_that_it_explains():
    nearly = found(law(GearFriction), complete=True, explained=0.88)
    assert step_confidence(nearly, 0, None) == pytest.approx(0.88)


def test_the_same_effect_in_another_reading_is_no_rival():
    motor, load = law(SensorScale, "motor_angle_rad"), law(SensorScale, "load_angle_rad")
    assert step_confidence(found(load, (motor, 200.0)), 0, None) == pytest.approx(0.97)


def test_a_law_that_contains_the_one_found_is_no_rival_but_the_plain_one_is():
    plain, angle = law(LoadFriction), law(LoadFrictionAngle)
    assert step_confidence(found(plain, (angle, 200.0)), 0, None) == pytest.approx(0.97)
    assert step_confidence(found(angle, (plain, 200.0)), 0, None) == pytest.approx(0.5, abs=0.01)


def test_dependent_innovations_lower_the_ratio_and_only_where_parameters_predicted(monkeypatch):
    weak = found(law(GearFriction), ratio=5.5, tempering=0.08)
    assert step_presence(weak, 0, None) == 0.0
    monkeypatch.setattr(window_confidence, "makes_predictable", lambda _: True)
    assert 0.6 < step_presence(weak, 0, None) < 0.8


def test_recordings_held_out_are_evidence_of_their_own_for_the_first_law():
    weak = found(law(GearFriction), ratio=4.0)
    alone = step_presence(weak, 0, HeldOut(gain=9.0))
    seen = step_presence(weak, 0, HeldOut(gain=9.0, ratio=3.0))
    assert alone == pytest.approx(step_presence(weak, 0, None))
    assert seen == pytest.approx(step_presence(found(law(GearFriction), ratio=5.0), 0, None))


def test_a_loss_on_rows_held_out_is_never_claimed():
    assert step_presence(found(law(GearFriction)), 0, HeldOut(gain=-1.0)) < 0.5
