"""An unknown signal is found at the port where it enters, with its size."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import block_diag

from rsea_core.effects.registry import LoadDisturbance
from rsea_core.identify.fitting.least_squares import Fitter
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.judgement.residual import favoured_by_screening, unexplained_residual
from rsea_core.identify.judgement.verdict import is_unchanged
from rsea_core.identify.locate.signal_filter import SignalModel, signal_likelihoods
from rsea_core.identify.locate.unknown_input import (
    LEVELS,
    fit_jointly,
    model_of,
    profiled_log_posterior,
    ranked_ports,
    smoothed_signal,
)
from rsea_core.identify.result.conclusion import Conclusion
from rsea_core.identify.result.diagnosis_json import document_of
from tests.cases.planted import misread, parameters_of, planted


def test_the_likelihood_of_readings_is_that_of_the_dense_gaussian(tmp_path):
    problem = planted(tmp_path)
    fit = Fitter(problem).fit(Hypothesis(), problem.start(Hypothesis()), iterations=1)
    model = model_of(problem, fit, problem.prepared[1])
    n, p = 12, len(model.channels)
    A, C, Q, P = model.with_input("G", 0.15)
    size = 0.3
    Q[0, 0], P[0, 0] = Q[0, 0] * size**2, P[0, 0] * size**2
    steps = model.transitions(A)[:n]
    # covariance of all readings: states are sums of what start and noise put into them
    states = np.zeros((n, n, *Q.shape))
    spread = P
    for i in range(n):
        states[i, i] = spread
        ahead = spread
        for j in range(i + 1, n):
            ahead = steps[j - 1] @ ahead
            states[j, i], states[i, j] = ahead, ahead.T
        spread = steps[i] @ spread @ steps[i].T + Q
    whole = np.block([[C @ states[i, j] @ C.T for j in range(n)] for i in range(n)])
    whole += block_diag(*[model.R] * n)
    left = np.random.default_rng(0).standard_normal((n, 2, p)) * np.sqrt(np.diag(model.R))
    dets, grams = np.zeros(1), np.zeros((1, 2, 2))
    signal = SignalModel(A, C, model.R, Q, P, model.modes[:n], model.drive[:n])
    signal_likelihoods(left, signal, np.ones(1), dets, grams)
    flat = left.swapaxes(0, 1).reshape(2, -1)
    assert dets[0] == pytest.approx(np.linalg.slogdet(whole)[1], rel=1e-9)
    np.testing.assert_allclose(grams[0], flat @ np.linalg.solve(whole, flat.T), rtol=1e-7)


def test_profiling_the_unknowns_out_is_the_best_over_all_of_them():
    rng = np.random.default_rng(1)
    rows = rng.standard_normal((40, 4))
    stats = [(np.array([2.0]), (rows.T @ rows)[None])]
    prior = (np.array([0.5, 1.0, 2.0]), np.array([0.3, -0.2, 0.1]))

    def value(move):
        left = rows[:, 0] + rows[:, 1:] @ move
        return -0.5 * (2.0 + left @ left + np.sum(prior[0] * (prior[1] + move) ** 2))

    log_posterior, move, covariance = profiled_log_posterior(stats, [0], prior)
    assert log_posterior == pytest.approx(value(move))
    for step in 1e-3 * rng.standard_normal((20, 3)):
        assert value(move + step) < log_posterior
    np.testing.assert_allclose(
        np.linalg.inv(covariance), rows[:, 1:].T @ rows[:, 1:] + np.diag(prior[0])
    )


def test_a_disturbance_of_the_load_enters_at_the_load_with_its_size(tmp_path):
    pulse = LoadDisturbance(start_s=1.0, end_s=1.5, peak_Nm=0.4)
    search = parameters_of(planted(tmp_path, pulse))
    ranked = ranked_ports(search.problem, search.parameters)
    assert ranked[0].port == "L"
    found = fit_jointly(search.problem, search.parameters, ranked[0])
    time, value, std = smoothed_signal(search.problem, Hypothesis(), found, 1)
    inside = (time > 1.05) & (time < 1.45)
    assert np.mean(value[inside]) == pytest.approx(0.4, abs=0.03)
    assert np.mean(np.abs(value[time > 1.7])) < 0.03
    assert np.mean(std[inside]) < 0.1


@pytest.mark.parametrize(
    ("column", "error"),
    [
        ("load_angle_rad", lambda t, c: 0.004 * np.sin(40.0 * c["load_angle_rad"]) * (t > 0.2)),
        ("motor_angle_rad", lambda t, c: 0.05 * np.floor(np.maximum(t - 0.5, 0.0) / 0.3)),
        ("torque_Nm", lambda t, c: np.clip(c["torque_Nm"], -0.5, 0.5) - c["torque_Nm"]),
    ],
)
def test_a_sensor_that_errs_by_no_known_law_is_located(tmp_path, column, error):
    search = parameters_of(misread(tmp_path, column, error))
    left = unexplained_residual(search)
    assert left.subsystem == f"sensor:{column}"
    for trace, prepared in zip(left.traces, search.problem.fitted, strict=True):
        expected = error(prepared.recording.time_s, prepared.recording.columns)
        there = np.interp(trace.time_s, prepared.recording.time_s, expected)
        if column != "torque_Nm":  # a clipped reading does not say what it would have been
            assert np.sqrt(np.mean((trace.value - there) ** 2)) < 0.3 * np.std(there) + 1e-3
    if column != "torque_Nm":  # without it the scale of all torques rests on the priors
        values, _ = search.problem.values(Hypothesis(), left.fit.x)
        assert values["spring_stiffness_Nm_per_rad"] == pytest.approx(65.0, rel=0.01)
    assert column in left.sentence()


def test_an_unexplained_diagnosis_reports_values_jointly_with_the_unknown_signal(tmp_path):
    search = parameters_of(
        misread(tmp_path, "motor_angle_rad", lambda t, c: 0.05 * np.floor(t / 0.4))
    )
    conclusion = Conclusion(search)
    document = document_of(conclusion)
    assert document["verdict"] == "unexplained"
    assert document["location"]["subsystem"] == "sensor:motor_angle_rad"
    assert document["remainder"]["port"] == "Y:motor_angle_rad"
    assert not conclusion.fit.hypothesis.laws
    columns = conclusion.residual.columns()
    assert set(columns) == {"recording", "time_s", "unknown_rad", "std_rad"}
    assert set(np.unique(columns["recording"])) == {1.0, 2.0}
    moved = document["parameters_corrected"]["load_mass_kg"]
    assert abs(moved["to"] - moved["from"]) < 3.0 * moved["std"] + 0.005 * moved["from"]


def test_levels_begin_with_no_signal_at_all():
    assert LEVELS[0] == 0.0
    assert np.all(np.diff(LEVELS) > 0.0)


def test_an_effect_that_leaves_a_large_part_of_the_mismatch_alone_is_not_the_answer(tmp_path):
    fit = parameters_of(planted(tmp_path)).parameters
    before = replace(fit, msni=np.array([58.0, 45.0, 1.1]))
    assert is_unchanged(before, replace(fit, msni=np.array([4.9, 43.0, 1.1])))
    assert not is_unchanged(before, replace(fit, msni=np.array([4.9, 12.0, 1.1])))
    assert not is_unchanged(before, replace(fit, msni=np.array([4.9, 4.9, 1.1])))
    minor = replace(fit, msni=np.array([1400.0, 1200.0, 160.0]))
    assert not is_unchanged(minor, replace(fit, msni=np.array([370.0, 300.0, 110.0])))
    # short runs: of one that lost step, and of a recording in which nothing at all was done
    lost = replace(fit, msni=np.array([4.9, 43.0, 1.1]))
    assert not is_unchanged(before, lost, (np.array([20.0, 9.0, 1.0]), np.array([1.2, 1.1, 1.0])))
    assert is_unchanged(before, lost, (np.array([20.0, 9.0, 1.0]), np.array([1.2, 9.0, 1.0])))
    small = replace(fit, msni=np.array([900.0, 400.0, 16.0]))
    after, shorts = replace(fit, msni=np.array([1.0, 1.0, 16.0])), np.array([90.0, 40.0, 6.0])
    assert not is_unchanged(small, after)
    assert is_unchanged(small, after, (shorts, np.array([1.0, 1.0, 6.0])))


@pytest.mark.parametrize(("behind", "taken"), [(100.0, 1), (5e4, 0)])
def test_of_two_places_the_likelier_is_the_one_where_readings_tell_them_apart(behind, taken):
    gain = 5e6
    tried = [
        SimpleNamespace(ranked=SimpleNamespace(port=port, gain=gain), log_posterior=-gap)
        for port, gap in (("S", 0.0), ("Y:motor_angle_rad", behind))
    ]
    liked = SimpleNamespace(law=SimpleNamespace(subsystem="sensor:motor_angle_rad"))
    assert favoured_by_screening(SimpleNamespace(candidates=[liked]), tried) is tried[taken]
