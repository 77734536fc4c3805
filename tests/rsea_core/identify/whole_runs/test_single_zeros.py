"""A reading whose zero differs in one recording is told from one that has an offset in all."""

import numpy as np
import pytest

from rsea_core.engines.fixed_step.replay import Replay
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.horizons import parameters
from rsea_core.identify.whole_runs.sensor_noise import excess, in_sensor_noise
from rsea_core.identify.whole_runs.single_zeros import (
    single_zeros,
    with_single_zeros,
    zeros_of,
)
from rsea_core.machine.inputs import Inputs
from rsea_core.machine.rig import Rig
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
    return begun_of(case)


def begun_of(case):
    """Parameters alone of a case: by windows, and fitted to whole recordings."""
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


def swung(zeros):
    """Parameters alone of a pendulum that is let go; its speed alone is read, each with a zero."""
    rig = Rig(name="pendulum", parts=("load",), load_inertia_kgm2=0.01, load_mass_kg=0.2,
              load_distance_m=0.15, load_viscous_Nms_per_rad=1e-3,
              gravity_angle_offset_rad=0.0)  # fmt: skip
    made, fine, every = [], 1e-3 * np.arange(10_000), slice(700, None, 10)
    time = fine[every] - fine[700]
    for j, zero in enumerate(zeros):
        start_rad = 0.6 + 0.4 * j
        inputs = Inputs(time_s=fine, load=PENDULUM, initial_load_angle_rad=start_rad,
                        initial_motor_angle_rad=start_rad)  # fmt: skip
        speed = np.gradient(Replay.of(inputs, step_s=1e-3).run(ActuatorModel(rig))[:, 1], fine)
        noise = 0.01 * np.random.default_rng(j).standard_normal(time.size)
        columns = {"time_s": time, "load_velocity_rad_per_s": speed[every] + noise + zero}
        made.append(Recording(file=f"rec{j}.csv", load=PENDULUM, columns=columns,
                              sample_time_s=1e-2, initial_rest=False))  # fmt: skip
    case = Case(name="pendulum", folder=None, rig=rig, recordings=tuple(made))
    return begun_of(case)


def test_a_zero_that_the_smoothed_motion_has_taken_up_is_found_by_smoothing_anew():
    found, own, fit = swung((0.0, 0.06))
    assert single_zeros(own, fit) == []  # most of it is in the motion, and in parameters
    other = with_single_zeros(found, own, fit, lambda text: None)
    assert [t.zeros for t in other.base_estimator.tracks] == [(), (0,)]
    again = in_sensor_noise(other.base_estimator, other.base)
    anew = again.fit(other.base.hypothesis, other.base.x, iterations=12)
    before = excess(own, fit.hypothesis, fit.x)
    assert excess(again, anew.hypothesis, anew.x) < 0.1 * before
    ((file, _, size),) = zeros_of(again, anew.hypothesis, anew.x)
    assert file == "rec1.csv"
    assert size == pytest.approx(0.06, abs=0.015)


def test_no_zero_is_found_in_a_pendulum_whose_sensor_has_none():
    found, own, fit = swung((0.0, 0.0))
    assert with_single_zeros(found, own, fit, lambda text: None) is found
