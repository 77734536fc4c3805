"""A whole recording begins without speed where its case says so, and else as it was smoothed."""

import numpy as np
import pytest

import rsea_core.engines.event_driven.states as k
from rsea_core.identify.multistep.estimator import initial_estimator
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.whole_runs.sensor_noise import in_sensor_noise
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import Case
from rsea_core.recordings.recording import Recording
from tests.cases.bench_recordings import PENDULUM, WITHOUT_ANCHORS, multisine, recorded

TIME, SPEEDS = np.arange(200) * 4e-3, [k.WW, k.WL]


@pytest.mark.parametrize("initial_rest", [True, False])
def test_the_smoothed_speed_of_a_start_at_rest_is_not_taken(initial_rest):
    _, columns = recorded(
        ActuatorModel(WITHOUT_ANCHORS), TIME, PENDULUM, duty=multisine(TIME) * (TIME > 0.1)
    )
    r = Recording(file="rec.csv", role="identification", load=PENDULUM, columns=columns,
                  sample_time_s=4e-3, initial_rest=initial_rest)  # fmt: skip
    case = Case(name="start", folder=None, rig=WITHOUT_ANCHORS, recordings=(r,))
    estimator = initial_estimator(MultistepProblem(case))
    for t in estimator.tracks:
        t.motion[0, SPEEDS] = 0.3, -0.2
    (track,) = in_sensor_noise(estimator).tracks
    expected = [0.0, 0.0] if initial_rest else [0.3, -0.2]
    assert track.windows.motion[0, SPEEDS].tolist() == expected
    assert np.all(track.motion_std[0, SPEEDS] > 0.0)  # the filter may still correct it


@pytest.mark.parametrize("off", [0.002, 0.05])
def test_an_angle_far_from_the_smoothed_one_begins_as_it_is_read(off):
    """Shares of its spread; what is within a hundredth may be a zero of the encoder."""
    _, columns = recorded(ActuatorModel(WITHOUT_ANCHORS), TIME, PENDULUM, duty=multisine(TIME))
    r = Recording(file="rec.csv", role="identification", load=PENDULUM, columns=columns,
                  sample_time_s=4e-3)  # fmt: skip
    case = Case(name="start", folder=None, rig=WITHOUT_ANCHORS, recordings=(r,))
    estimator = initial_estimator(MultistepProblem(case))
    load = columns["load_angle_rad"]
    smoothed = load[0] + off * np.std(load)
    for t in estimator.tracks:
        t.motion[0, k.TL] = smoothed
    (track,) = in_sensor_noise(estimator).tracks
    assert track.windows.motion[0, k.TL] == pytest.approx(load[0] if off > 0.01 else smoothed)
