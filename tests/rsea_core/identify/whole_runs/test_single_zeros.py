"""A reading whose zero differs in one recording is told from one that has an offset in all."""

import numpy as np
import pytest

from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.horizons import parameters
from rsea_core.identify.whole_runs.sensor_noise import in_sensor_noise
from rsea_core.identify.whole_runs.single_zeros import (
    single_zeros,
    with_single_zeros,
    zeros_of,
)
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import Case
from rsea_core.recordings.recording import Recording
from tests.cases.bench_recordings import PENDULUM, WITHOUT_ANCHORS, multisine, recorded

TIME, TORQUE = np.arange(1000) * 4e-3, "torque_Nm"
ZERO_Nm = 0.1  # five deviations of the sensor


def begun(zeros):
    """Parameters alone of a bench whose torque sensor has a zero of its own in each recording."""
    made = []
    for j, zero in enumerate(zeros):
        duty = multisine(TIME)[:: 1 if j else -1]
        _, columns = recorded(ActuatorModel(WITHOUT_ANCHORS), TIME, PENDULUM, sensors=(TORQUE,),
                              seed=j, duty=duty)  # fmt: skip
        columns[TORQUE] = columns[TORQUE] + zero
        made.append(Recording(file=f"rec{j}.csv", role="identification", load=PENDULUM,
                              columns=columns, sample_time_s=4e-3))  # fmt: skip
    case = Case(name="zeros", folder=None, rig=WITHOUT_ANCHORS, recordings=tuple(made))
    problem = MultistepProblem(case)
    estimator, base, horizon = parameters(problem, Hypothesis(), lambda text: None)
    found = Found(problem=problem, base_estimator=estimator, base=base, estimator=estimator,
                  best=base, horizon=horizon)  # fmt: skip
    own = in_sensor_noise(estimator)
    return found, own, own.fit(base.hypothesis, base.x, iterations=12)


def test_a_zero_of_one_recording_is_named_and_held_by_the_error_model():
    found, own, fit = begun((0.0, ZERO_Nm))
    at = own.tracks[1].experiment.channels.index(TORQUE)
    assert single_zeros(own, fit) == [(1, at)]
    other = with_single_zeros(found, own, fit, lambda text: None)
    again = in_sensor_noise(other.base_estimator, other.base)
    trial = [(other.base.hypothesis, other.base.x)]
    left = again.residuals(trial)[1][0][:, at]
    assert np.mean(left) == pytest.approx(ZERO_Nm, abs=0.01)  # no parameter absorbed it
    white = again.innovations(trial)[1][0][:, at]
    assert abs(np.mean(white[50:])) < 0.3
    assert np.std(white[50:]) < 1.3
    assert [t.zeros for t in again.tracks] == [(), (at,)]
    assert single_zeros(again, other.base) == []  # a reading has at most one
    ((file, column, size),) = zeros_of(again, *trial[0])
    assert (file, column) == ("rec1.csv", TORQUE)
    assert size == pytest.approx(ZERO_Nm, abs=0.01)


def test_an_offset_of_all_recordings_is_no_zero_of_one():
    found, own, fit = begun((ZERO_Nm, ZERO_Nm))
    assert single_zeros(own, fit) == []
    assert with_single_zeros(found, own, fit, lambda text: None) is found
