"""Candidates of whole recordings are compared in steps that hardly change their errors."""

import numpy as np
import pytest

from rsea_core.effects.load_friction import LoadFriction
from rsea_core.identify.multistep.command_timing import CommandTiming
from rsea_core.identify.multistep.criteria import COARSE_SHARE
from rsea_core.identify.whole_runs.coarse_steps import in_coarse_steps, with_costs_of
from rsea_core.identify.whole_runs.parameters_alone import step_error
from rsea_core.identify.whole_runs.sensor_noise import misfit
from tests.cases.one_axis import axis_recording
from tests.cases.whole_runs import searched_axis


@pytest.fixture(scope="module")
def axis(tmp_path_factory):
    """An axis with friction that its rig file lacks, its command linear between rows."""
    recording = axis_recording(LoadFriction(coulomb_Nm=0.05), seed=1, linear=True)
    folder = tmp_path_factory.mktemp("axis")
    _, own, plain = searched_axis(folder, recording, timing=CommandTiming(linear=True))
    return own, plain


def test_errors_of_many_deviations_are_compared_in_undivided_rows(axis):
    own, plain = axis
    left = misfit(own, plain.hypothesis, plain.x)
    coarse = in_coarse_steps(own, plain, left)
    assert coarse.problem.steps.parts_of_row == 1 < own.problem.steps.parts_of_row
    assert 0.0 < step_error(own, coarse, plain) < COARSE_SHARE * left


def test_steps_stay_where_coarse_ones_would_change_the_errors(axis):
    own, plain = axis
    assert in_coarse_steps(own, plain, 1e-6) is own


def test_a_fit_of_coarse_steps_is_judged_in_fine_ones(axis):
    own, plain = axis
    coarse = in_coarse_steps(own, plain, np.inf)
    fit = with_costs_of(own, coarse.fit(plain.hypothesis, plain.x, iterations=2))
    assert fit.cost == own.costs([(fit.hypothesis, fit.x)])[0]
    assert fit.cost == pytest.approx(own.tempering * fit.negative_log_likelihood + fit.prior_cost)
