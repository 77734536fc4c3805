"""Loops that run faster than their log: noisy commands are smoothed, constants not biased."""

from dataclasses import replace

import numpy as np
import pytest

import rsea_core.identify.multistep.timing_choice as timing_choice
import rsea_core.identify.window_fit as window_fit
import rsea_core.identify.window_verdict as window_verdict
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.investigate import investigate
from rsea_core.identify.multistep.command_timing import (
    AS_LOGGED,
    CommandTiming,
    mean_commands,
    timings,
    turns_often,
)
from rsea_core.identify.multistep.criteria import FAST_SHARE
from rsea_core.identify.multistep.log_nuisances import nuisances
from rsea_core.identify.multistep.timing_choice import parameters_with_timing
from rsea_core.identify.window_diagnosis import diagnose_windows
from rsea_core.identify.window_verdict import WindowVerdict, with_evidence
from tests.cases.fast_loop import fast_loop_recording, fast_loop_rig
from tests.cases.one_axis import axis_case

ROW_s, N = 0.02, 400
GRID = ROW_s * np.arange(N)
NOISE = np.random.default_rng(8).standard_normal(N)


def test_smoothed_commands_are_an_unbiased_regressor_where_logged_ones_are_not():
    """Errors in variables: noise in a regressor lowers the estimated slope."""
    true = np.sin(2.0 * np.pi * 0.4 * GRID) + 0.5 * np.sin(2.0 * np.pi * 0.6 * GRID)
    logged = true + 0.8 * np.random.default_rng(4).standard_normal(N)
    found = mean_commands(logged, 0.0)
    assert np.polyfit(logged, true, 1)[0] < 0.6
    assert np.polyfit(found, true, 1)[0] == pytest.approx(1.0, abs=0.05)
    assert np.std(found - true) < 0.35 * 0.8


def test_a_share_of_what_smoothing_removes_is_added_again():
    command = GRID + np.random.default_rng(5).standard_normal(N)
    none, half, all_of_it = (mean_commands(command, share) for share in (0.0, 0.5, 1.0))
    np.testing.assert_allclose(half, 0.5 * (none + command), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(all_of_it, command, rtol=0.0, atol=1e-12)


def test_a_straight_command_is_its_own_mean():
    np.testing.assert_allclose(mean_commands(3.0 - GRID, 0.0), 3.0 - GRID, rtol=0.0, atol=1e-12)


def test_smoothed_commands_stay_within_those_of_the_log():
    """A command at its limit: a smoother overshoots next to it, and a duty of 1.07 is none."""
    limited = np.clip(3.0 * np.sin(2.0 * np.pi * GRID) + NOISE, -1.0, 1.0)
    assert np.max(np.abs(mean_commands(limited, FAST_SHARE))) <= 1.0


@pytest.mark.parametrize(
    ("command", "often"),
    [
        (np.sin(2.0 * np.pi * 1.9 * GRID), False),  # 26 rows in a cycle
        (np.repeat(np.random.default_rng(6).choice([-1.0, 1.0], N // 4), 4), False),
        (np.random.default_rng(7).standard_normal(N), True),
        (np.zeros(N), False),
        (np.zeros(2), False),
    ],
    ids=["sine", "binary", "noise", "none", "two rows"],
)
def test_noise_reverses_often_and_held_inputs_do_not(command, often):
    assert turns_often(command) is often


def test_smoothed_commands_are_tried_where_commands_reverse_often(tmp_path):
    case = axis_case(tmp_path, fast_loop_recording(seed=1), rig=fast_loop_rig())
    smooth = CommandTiming(linear=True, fast_share=FAST_SHARE)
    assert timings(case, AS_LOGGED) == [CommandTiming(linear=True), smooth]
    assert timings(case, smooth) == [CommandTiming(), CommandTiming(linear=True)]


def test_a_sound_axis_in_a_loop_faster_than_its_log_lacks_no_physics(tmp_path):
    case = axis_case(tmp_path, fast_loop_recording(seed=1), rig=fast_loop_rig())
    found = diagnose_windows(case, quick=True)
    assert found.document["verdict"] in ("no-mismatch", "parameters-only")
    assert found.conclusion.problem.timing.fast_share == FAST_SHARE
    moved = found.conclusion.fit.x[: len(found.conclusion.problem.nominals)]
    assert np.max(np.abs(moved)) < 2.0
    assert any("smoothed commands" in note.text for note in found.findings)


@pytest.mark.parametrize("timing", [CommandTiming(linear=True), None], ids=["logged", "chosen"])
def test_noisy_commands_of_the_log_bias_the_torque_constant_and_smoothed_ones_do_not(
    tmp_path, timing
):
    case = axis_case(tmp_path, fast_loop_recording(seed=1), rig=fast_loop_rig())
    h = Hypothesis(laws=nuisances(case))
    estimator, base, _ = parameters_with_timing(case, h, lambda text: None, timing=timing)
    moved = base.x[estimator.problem.names(h).index("torque_constant_Nm_per_A")]
    assert moved < -3.5 if timing else abs(moved) < 1.0


def test_noisy_commands_of_a_loop_that_runs_at_the_rate_of_its_log_are_not_smoothed(tmp_path):
    recording = fast_loop_recording(seed=1, per_row=1)
    assert turns_often(recording["current_command_A"])
    case = axis_case(tmp_path, recording, rig=fast_loop_rig())
    h = Hypothesis(laws=nuisances(case))
    estimator, *_ = parameters_with_timing(case, h, lambda text: None)
    assert estimator.problem.timing == AS_LOGGED


def test_smoothed_commands_are_also_fitted_without_output_errors_where_a_fit_is_in_doubt(
    tmp_path, monkeypatch
):
    made, plain = [], timing_choice.parameters

    def recorded(problem, h, say, *, output_errors=False, delay=None):
        made.append((problem.timing.smooth, output_errors))
        return plain(problem, h, say, output_errors=output_errors, delay=delay)

    monkeypatch.setattr(timing_choice, "parameters", recorded)
    case = axis_case(tmp_path, fast_loop_recording(seed=1), rig=fast_loop_rig())
    parameters_with_timing(case, Hypothesis(laws=nuisances(case)), lambda text: None)
    assert {(True, True), (True, False), (False, True)} <= set(made)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """A quick search on a sound axis, whose commands it smooths, and its case."""
    folder = tmp_path_factory.mktemp("loop")
    case = axis_case(folder, fast_loop_recording(seed=1), rig=fast_loop_rig())
    return investigate(case, quick=True), case


@pytest.mark.parametrize(
    ("module", "limits"),
    [
        (window_fit, {"UNBELIEVED": 0.5}),
        (window_verdict, {"DEPENDENT": 2.0, "DOUBTED_ERROR": 0.0}),
        (window_verdict, {"SHAPE_GAIN": -np.inf, "SHAPE_RATIO": -np.inf, "LEAST_RATIO": -np.inf}),
    ],
    ids=["moved value", "dependent innovations", "unknown torque"],
)
def test_what_smoothed_commands_leave_is_no_evidence(found, monkeypatch, module, limits):
    """The same search is `unexplained` if its commands were as logged."""
    search, case = found
    for name, value in limits.items():
        monkeypatch.setattr(module, name, value)
    assert WindowVerdict(search, case).verdict == "parameters-only"
    monkeypatch.setattr(CommandTiming, "smooth", False)
    assert WindowVerdict(search, case).verdict == "unexplained"


@pytest.mark.parametrize(("smooth", "kept"), [(True, 0), (False, 1)])
def test_laws_that_fail_in_longer_windows_are_dropped_where_commands_are_smoothed(
    found, monkeypatch, smooth, kept
):
    search, _ = found
    search = replace(search, steps=[object()])
    monkeypatch.setattr(window_verdict, "beyond_chance", lambda found: (found, None))
    monkeypatch.setattr(window_verdict, "gain_over_named", lambda found, say: None)
    monkeypatch.setattr(window_verdict, "fails_in_longer_windows", lambda found, unseen: True)
    monkeypatch.setattr(window_verdict, "explains_only_negligible_torque", lambda found: False)
    monkeypatch.setattr(CommandTiming, "smooth", smooth)
    assert len(with_evidence(search, lambda text: None)[0].steps) == kept
