"""Laws of the machine predict rows that they were not fitted to; laws that follow a path do not."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.effects.load_disturbance import LoadDisturbance
from rsea_core.effects.load_flexibility import LoadFlexibility
from rsea_core.effects.spring_parallel import SpringParallel
from rsea_core.identify.law_search.candidate_fits import fitted
from rsea_core.identify.law_search.hold_out import part_of
from rsea_core.identify.law_search.pulses import pulses
from rsea_core.identify.law_search.screening import Projection, screen
from rsea_core.identify.law_search.search import laws_of
from rsea_core.identify.multistep.kalman_filter import huber_squares
from rsea_core.identify.whole_runs.unseen import (
    needed,
    predicted_cost,
    recordings_held_out,
    unpredicted_recordings,
    unseen_share,
    without,
)
from tests.cases.one_axis import axis_recording
from tests.cases.whole_runs import searched_axis

SPRING = SpringParallel(stiffness_Nm_per_rad=0.01)


@pytest.fixture(scope="module")
def sprung(tmp_path_factory):
    """A search of an axis with a hidden spring, and parameters alone in the sensors' noise."""
    return searched_axis(tmp_path_factory.mktemp("sprung"), axis_recording(SPRING, seed=1))


@pytest.fixture(scope="module")
def true_law(sprung):
    found, own, plain = sprung
    laws = [law for law in laws_of(found) if law.key == "spring-parallel/linear"]
    return fitted(own, plain, screen(own, plain, laws)[0])


@pytest.fixture(scope="module")
def pulse(sprung):
    _, own, plain = sprung
    return best_pulse(own, plain)


def test_a_law_of_the_machine_predicts_unseen_rows_evenly(sprung, true_law):
    found, own, plain = sprung
    predicts, ratio = needed(own, true_law, true_law.hypothesis.laws[-1], plain)
    assert predicts
    assert ratio > 10.0
    assert unseen_share(found, own, true_law, plain, lambda text: None) < 0.05


def test_a_torque_that_acts_once_does_not_predict_what_a_spring_does(sprung, pulse):
    found, own, plain = sprung
    assert pulse.cost < plain.cost - 100.0  # as a fit, it is worth much
    assert unseen_share(found, own, pulse, plain, lambda text: None) > 0.3


def best_pulse(own, plain):
    return fitted(own, plain, pulses(Projection(own, plain))[0])


@pytest.mark.parametrize(("tolerances", "refuted"), [(0.0, False), (0.5, True)])
def test_a_recording_held_out_refutes_a_pulse_whose_values_predict_it_worse(
    tmp_path, tolerances, refuted
):
    disturbance = LoadDisturbance(start_s=5.0, end_s=6.2, peak_Nm=0.08)
    found, own, plain = searched_axis(
        tmp_path, axis_recording(disturbance, seed=5), axis_recording(seed=6, role="validation")
    )
    fit = best_pulse(own, plain)
    off = np.eye(fit.x.size)[[p.key for p in own.problem.nominals].index("load_inertia_kgm2")]
    fit = replace(fit, x=fit.x + tolerances * off)
    assert np.isinf(unseen_share(found, own, fit, plain, lambda text: None)) == refuted


def test_a_recording_held_out_that_equals_a_fitted_one_has_its_innovations(tmp_path):
    stiffness = (2.0 * np.pi * 4.0) ** 2 * 0.02 * 0.3 * 0.7  # a free link of 4 Hz
    link = LoadFlexibility(link_stiffness_Nm_per_rad=stiffness, outer_fraction=0.3)
    fitted_one = part_of(axis_recording(link, seed=1), 300, 1200)
    copy = replace(fitted_one, file="copy.csv", role="validation")
    found, own, plain = searched_axis(tmp_path, fitted_one, copy)
    trial = plain.hypothesis, plain.x
    other = recordings_held_out(found, own, trial)
    seen, unseen = (np.std(e.innovations([trial])[0]) for e in (own, other))
    assert seen > 3.0  # the link is missing
    assert unseen == pytest.approx(seen, rel=0.05)


def test_a_fit_without_a_law_is_that_of_the_others(sprung, true_law):
    _, own, plain = sprung
    less = without(own, true_law, true_law.hypothesis.laws[-1])
    assert less.hypothesis.laws == plain.hypothesis.laws
    assert less.cost == pytest.approx(plain.cost, rel=1e-3)
    assert np.all(np.isfinite(less.x))


@pytest.mark.parametrize("terms", [(), (SPRING,)])
def test_recordings_held_out_that_parameters_do_not_predict_are_listed(tmp_path, terms):
    """What the fitted recording does not show: here the machine is another one."""
    other = axis_recording(*terms, seed=6, role="validation")
    found, _, _ = searched_axis(tmp_path, axis_recording(seed=5), other)
    assert unpredicted_recordings(found) == [other.file] * len(terms)


def test_values_may_move_in_a_prediction_as_far_as_the_fit_does_not_know_them(sprung, true_law):
    _, own, _ = sprung
    h, x = true_law.hypothesis, own.fit(true_law.hypothesis, true_law.x, iterations=12).x
    best = cost_of(own, h, x)
    few = own.having([replace(t, seen=0.05) for t in own.tracks])
    index = [p.key for p in own.problem.nominals].index("load_inertia_kgm2")
    moved = x + 0.1 * np.eye(x.size)[index]
    wrong = cost_of(own, h, moved) - best
    assert wrong > 100.0
    little, much = (predicted_cost(own, fitted, h, moved) - best for fitted in (few, own))
    assert 0.0 <= little < 0.1 * wrong  # few rows do not show the value
    assert much > 5.0 * little  # all rows do


def cost_of(own, h, x) -> float:
    return 0.5 * sum(float(np.sum(huber_squares(e))) for e in own.innovations([(h, x)]))
