"""The noise of a reading finer than its scatter is not taken for an unknown torque."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.multistep.estimator import Estimator
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.noise_estimate import estimated_noise
from rsea_core.identify.multistep.tracks import initial_track, prepared
from tests.cases.one_axis import axis_case, axis_recording, axis_rig

SCATTER_rad = 6e-3
FINE_COUNTS = 1 << 20  # a count is 6 urad


@pytest.fixture(scope="module")
def scattered(tmp_path_factory):
    """An axis whose fine encoder is read with white noise, and what its simulation leaves."""
    plain = axis_recording(seed=3)
    noise = np.random.default_rng(4).normal(0.0, SCATTER_rad, plain.rows)
    columns = {**plain.columns, "motor_angle_rad": plain["motor_angle_rad"] + noise}
    rig = replace(axis_rig(), motor_encoder_counts_per_rev=FINE_COUNTS)
    case = axis_case(tmp_path_factory.mktemp("fine"), replace(plain, columns=columns), rig=rig)
    problem = MultistepProblem(case)
    estimator = Estimator(problem, [initial_track(e) for e in problem.fitted])
    h = Hypothesis()
    return estimator.tracks, [r[0] for r in estimator.residuals([(h, problem.start(h))])]


@pytest.mark.parametrize("torque_share", [1.0, 10.0])
def test_noise_begun_at_the_encoders_floor_with_large_torques_ends_at_the_scatter(
    scattered, torque_share
):
    tracks, residuals = scattered
    trapped = [
        prepared(
            t, noise=replace(t.noise, inputs=torque_share * t.noise.inputs,
                             readings=0.5 * t.experiment.floor_of_each),
        )
        for t in tracks
    ]  # fmt: skip
    (found,) = estimated_noise(trapped, residuals)
    read_rad = found.noise.readings[0] * found.block**0.5
    assert read_rad == pytest.approx(SCATTER_rad, rel=0.2)
    assert found.noise.inputs[0] < 0.1 * trapped[0].noise.inputs[0]
