"""A torque that acts once is found in time and size, and nothing is where none acted."""

from dataclasses import replace

import pytest

from rsea_core.effects.load_disturbance import LoadDisturbance
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.pulses import pulses
from rsea_core.identify.law_search.screening import Projection
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.horizons import parameters, without_slow_torque
from rsea_core.identify.multistep.log_nuisances import nuisances
from rsea_core.identify.window_diagnosis import diagnose_windows
from tests.cases.one_axis import axis_case, axis_recording, axis_rig

PULSE = LoadDisturbance(start_s=5.0, end_s=6.2, peak_Nm=0.08)


def test_a_pulse_is_named_with_its_time_and_size(tmp_path):
    case = axis_case(tmp_path, axis_recording(PULSE, seed=5), rig=axis_rig())
    document = diagnose_windows(case).document
    assert document["verdict"] == "missing-physics"
    (effect,) = document["effects"]
    found = {name: entry["value"] for name, entry in effect["parameters"].items()}
    assert effect["name"] == "load-disturbance"
    assert found["recording"] == "axis5.csv"
    assert found["start_s"] == pytest.approx(PULSE.start_s, abs=0.1)
    assert found["end_s"] == pytest.approx(PULSE.end_s, abs=0.1)
    assert found["peak_Nm"] == pytest.approx(PULSE.peak_Nm, rel=0.15)


def test_a_pulse_is_named_with_a_recording_held_out_in_which_nothing_acted(tmp_path):
    unseen = axis_recording(seed=6, role="validation")
    pushed = axis_recording(PULSE, seed=5)
    found = diagnose_windows(axis_case(tmp_path, pushed, unseen, rig=axis_rig()))
    assert found.conclusion.found.acts_once
    assert found.conclusion.held_out is None
    assert found.document["verdict"] == "missing-physics"


@pytest.mark.parametrize("seed", [5, 6])
def test_an_axis_that_nothing_pushed_has_no_candidate(tmp_path, seed):
    case = axis_case(tmp_path, axis_recording(seed=seed), rig=axis_rig())
    problem = MultistepProblem(case)
    estimator, base, _ = parameters(problem, Hypothesis(laws=nuisances(case)), lambda _: None)
    assert pulses(Projection(without_slow_torque(estimator), base)) == []


def test_a_pulse_is_located_although_the_time_scale_of_the_motion_is_long(tmp_path):
    # as with steady rotation, where the spread of the angle grows with the recording
    case = axis_case(tmp_path, axis_recording(PULSE, seed=5), rig=axis_rig())
    problem = MultistepProblem(case)
    estimator, base, _ = parameters(problem, Hypothesis(laws=nuisances(case)), lambda _: None)
    own = without_slow_torque(estimator)
    own = own.having([replace(t, scale=replace(t.scale, time_s=4.0)) for t in own.tracks])
    start_s, width_s, *_ = pulses(Projection(own, base))[0].start
    assert start_s == pytest.approx(PULSE.start_s, abs=0.6)
    assert start_s + width_s == pytest.approx(PULSE.end_s, abs=0.6)
