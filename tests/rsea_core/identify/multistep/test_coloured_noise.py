"""Coloured readings are told from white ones, and unknown torques no longer take their part."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.multistep.coloured_noise import with_coloured_readings
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.horizons import parameters, with_noise
from rsea_core.identify.multistep.log_nuisances import nuisances
from rsea_core.identify.multistep.tracks import prepared
from tests.cases.one_axis import ROW_s, axis_case, axis_recording, axis_rig

SIZE, LASTS_rows = 4e-3, 4.0
ANGLE = "motor_angle_rad"


def silent(_):
    """No progress."""


def with_errors(coloured: bool):
    """An axis whose angle is read with errors of one size, coloured or white."""
    given = axis_recording(seed=5)
    white = np.random.default_rng(6).normal(0.0, SIZE, given.rows)
    keeps = np.exp(-1.0 / LASTS_rows)
    errors = lfilter([np.sqrt(1.0 - keeps**2)], [1.0, -keeps], white) if coloured else white
    angles = {name: v + errors for name, v in given.columns.items() if name == ANGLE}
    return replace(given, columns={**given.columns, **angles})


def white_estimator(folder, coloured: bool):
    """Parameters of the axis, and the estimator before colour is looked for."""
    case = axis_case(folder, with_errors(coloured), rig=axis_rig())
    h = Hypothesis(laws=nuisances(case))
    own, base, _ = parameters(MultistepProblem(case), h, silent)
    plain = [prepared(t, noise=replace(t.noise, colours=np.zeros(0), colour_time_s=0.0))
             for t in own.tracks]  # fmt: skip
    return with_noise(own.having(plain), h, base.x, steps=(3.0, 1.8, 1.3)), h, base.x


def test_coloured_readings_get_their_time_and_size_and_relieve_the_unknown_torque(tmp_path):
    white, h, x = white_estimator(tmp_path, coloured=True)
    (before,) = white.tracks
    (after,) = with_coloured_readings(white, h, x, silent).tracks
    at = after.experiment.channels.index(ANGLE)
    assert after.noise.colour_time_s == pytest.approx(3.0 * ROW_s)  # the nearest that is tried
    assert after.noise.colours[at] == pytest.approx(SIZE, rel=0.35)
    assert after.noise.inputs[0] < 0.5 * before.noise.inputs[0]


def test_white_readings_stay_white(tmp_path):
    white, h, x = white_estimator(tmp_path, coloured=False)
    assert with_coloured_readings(white, h, x, silent) is white


def test_a_coloured_reading_keeps_its_variance_from_row_to_row(tmp_path):
    white, _, _ = white_estimator(tmp_path, coloured=False)
    (track,) = white.tracks
    sizes = np.full(len(track.experiment.channels), SIZE)
    noise = replace(track.noise, colours=sizes, colour_time_s=LASTS_rows * ROW_s)
    errors = prepared(track, noise=noise).errors
    for mode in np.unique(errors.mode):
        for at in errors.colours:
            kept = errors.A[mode, at, at]
            assert kept == pytest.approx(np.exp(-1.0 / LASTS_rows))
            assert kept**2 * SIZE**2 + errors.Q[mode, at, at] == pytest.approx(SIZE**2)
