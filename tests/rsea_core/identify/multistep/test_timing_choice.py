"""Which timings of the commands are tried, and when rows have one mean command."""

import numpy as np
import pytest

import rsea_core.identify.multistep.timing_choice as timing_choice
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.multistep.command_timing import CommandTiming, RowTimes
from rsea_core.identify.multistep.log_nuisances import nuisances
from rsea_core.identify.multistep.timing_choice import parameters_with_timing, with_mean_commands
from tests.cases.one_axis import axis_case, axis_recording, axis_rig


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """Parameters of an axis whose command moves linearly between 1200 rows."""
    case = axis_case(
        tmp_path_factory.mktemp("linear"), axis_recording(seed=1, linear=True), rig=axis_rig()
    )
    h, linear = Hypothesis(laws=nuisances(case)), CommandTiming(linear=True)
    estimator, base, _ = parameters_with_timing(case, h, lambda text: None, timing=linear)
    return estimator, base


def rows_cut(estimator):
    return [e.finer for e in estimator.problem.prepared]


def test_a_short_recording_keeps_parts_of_rows(fitted):
    estimator, base = fitted
    assert rows_cut(with_mean_commands(estimator, base)) == [3]


def test_a_long_recording_has_undivided_rows_that_predict_alike(fitted, monkeypatch):
    estimator, base = fitted
    monkeypatch.setattr(timing_choice, "LONG_ROWS", 1000)
    monkeypatch.setattr(timing_choice, "LOST_IN_NOISE", 0.6)  # rows are a 50th of a cycle here
    other = with_mean_commands(estimator, base)
    assert rows_cut(other) == [1]
    before, after = (e.innovations([(base.hypothesis, base.x)])[0] for e in (estimator, other))
    assert 0.0 < np.sqrt(np.mean((before - after) ** 2)) < timing_choice.LOST_IN_NOISE


def test_rows_whose_innovations_change_keep_their_parts(fitted, monkeypatch):
    estimator, base = fitted
    monkeypatch.setattr(timing_choice, "LONG_ROWS", 1000)
    monkeypatch.setattr(timing_choice, "LOST_IN_NOISE", 1e-6)
    assert with_mean_commands(estimator, base) is estimator


@pytest.mark.parametrize(
    ("limits", "timings"),
    [
        ({"SAME_END": 0.0, "UNLIKELY_TIMING": 100.0}, [False]),
        ({"UNLIKELY_TIMING": np.inf}, [False]),
        ({"SAME_END": 0.0, "UNLIKELY_TIMING": np.inf}, [False, True]),
    ],
    ids=["far less likely", "the start does not matter", "neither"],
)
def test_horizons_are_grown_with_another_timing_only_if_it_can_be_right(
    tmp_path, monkeypatch, limits, timings
):
    """The commands are held: with linear ones the readings are 180 to 7800 units less likely.

    Both growths with held ones end at the same values, so that no start is in doubt.
    """
    grown, plain = [], timing_choice.parameters

    def recorded(problem, h, say, *, output_errors=False, delay=None):
        if output_errors:
            grown.append(problem.timing.linear)
        return plain(problem, h, say, output_errors=output_errors, delay=delay)

    monkeypatch.setattr(timing_choice, "parameters", recorded)
    monkeypatch.setattr(timing_choice, "DOUBTED_ERROR", 0.0)  # any fit is in doubt
    for name, limit in limits.items():
        monkeypatch.setattr(timing_choice, name, limit)
    case = axis_case(tmp_path, axis_recording(seed=1), rig=axis_rig())
    parameters_with_timing(case, Hypothesis(laws=nuisances(case)), lambda text: None)
    assert grown == timings


def test_a_fit_in_doubt_is_grown_again_with_the_timing_that_it_has(tmp_path, monkeypatch):
    """Linear commands at even times are two changes away from what the file contract says."""
    used = CommandTiming(linear=True, rows=RowTimes.READINGS)
    case = axis_case(tmp_path, axis_recording(seed=1, uneven=0.02), rig=axis_rig())
    assert used not in timing_choice.timings(case, timing_choice.AS_LOGGED)
    h, grown, plain = Hypothesis(laws=nuisances(case)), [], timing_choice.parameters

    def recorded(problem, h, say, *, output_errors=False, delay=None):
        if output_errors:
            grown.append(problem.timing)
        return plain(problem, h, say, output_errors=output_errors, delay=delay)

    def changed(estimator, fit, case, say):
        monkeypatch.setattr(timing_choice, "DOUBTED_ERROR", 0.0)  # from here on a fit is in doubt
        return plain(timing_choice.MultistepProblem(case, timing=used), h, say)[:2]

    monkeypatch.setattr(timing_choice, "parameters", recorded)
    monkeypatch.setattr(timing_choice, "with_better_timing", changed)
    parameters_with_timing(case, h, lambda text: None)
    assert grown[0] == used
