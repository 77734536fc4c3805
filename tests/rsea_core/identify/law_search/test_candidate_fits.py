"""What is compared is comparable: laws at one share of independent innovations, mass by prior."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rsea_core.effects.load_disturbance import disturbance
from rsea_core.effects.load_unbalance import unbalance
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.law_search import candidate_fits
from rsea_core.identify.law_search.candidate_fits import (
    at_bound,
    cost_of_mass,
    even_ratio,
    gain_of,
    values_at_bound,
)
from rsea_core.identify.law_search.screening import Candidate
from rsea_core.identify.multistep.criteria import EVEN
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.multistep.experiment import Hypothesis, MultistepProblem
from tests.cases.one_axis import axis_case, axis_recording, axis_rig, pendulum_case


def estimate(cost: float) -> Estimate:
    return Estimate(hypothesis=Hypothesis(), x=np.zeros(1), cost=cost,
                    negative_log_likelihood=cost, prior_cost=0.0, converged=True)  # fmt: skip


def test_two_fits_that_are_as_likely_gain_alike_at_one_share():
    few, many = (Estimator(None, [], tempering=share) for share in (0.4, 1.0))
    base, fit = estimate(100.0), estimate(40.0)
    assert gain_of(few, base, fit) == pytest.approx(24.0)
    assert gain_of(few, base, fit, 1.0) == gain_of(many, base, fit) == pytest.approx(60.0)


@pytest.mark.parametrize(("cosine", "expected"), [(0.0, 12.5), (0.05, 12.5), (1.0, 0.0)])
def test_an_unbalance_along_the_stated_gravity_costs_what_a_mass_at_its_bound_costs(
    tmp_path, cosine, expected
):
    problem = MultistepProblem(pendulum_case(tmp_path, seed=1))
    law = unbalance(0.1)
    h = Hypothesis(laws=(law,))
    x = problem.start(h, [(0.1, 0.1 * cosine)])
    c = Candidate(law=law, start=(0.1, 0.0), gain=1.0, held_out=1.0, deviation=0.0, size=1.0)
    entry = (c, None, replace(estimate(0.0), hypothesis=h, x=x))
    assert cost_of_mass(problem, entry) == pytest.approx(expected)


def test_a_value_at_a_bound_that_belongs_to_its_law_is_found_and_others_are_stopped(tmp_path):
    law = disturbance("", 0, (1.0, 0.5, 0.02), 0.1, 20.0)
    problem = MultistepProblem(pendulum_case(tmp_path, seed=1))
    h = Hypothesis(laws=(law,))
    x = problem.start(h, [(1.0, 0.5, 5.0, 1.0)])  # fifty torques at its peak, flanks throughout
    fit = replace(estimate(0.0), hypothesis=h, x=x)
    assert values_at_bound(problem, fit, law) == ("peak_Nm",)


@pytest.mark.parametrize(("rise_K", "bound"), [(350.0, False), (450.0, True)])
def test_a_fitted_winding_may_be_a_third_hotter_than_insulation_allows(
    tmp_path, monkeypatch, rise_K, bound
):
    rig = replace(axis_rig(), terminal_resistance_ohm=1.0)
    case = axis_case(tmp_path, axis_recording(seed=1), rig=rig)
    problem = MultistepProblem(case)
    law = catalogue(case, relative=True)["drive-thermal/winding, case and magnets"]
    h = Hypothesis(laws=(law,))
    fit = replace(estimate(0.0), hypothesis=h, x=problem.start(h, [law.starts[0]]))
    monkeypatch.setattr(candidate_fits, "peak_rise_K", lambda *given: rise_K)
    assert at_bound(problem, fit, law) == bound


def test_what_each_recording_shows_once_is_even_between_recordings():
    """A constant of a reading: all of its gain is in the first row of each recording."""
    rows, recordings = 400, 3
    track = SimpleNamespace(
        experiment=SimpleNamespace(recording=SimpleNamespace(sample_time_s=0.01)), block=1,
        scale=SimpleNamespace(time_s=0.1),
    )  # fmt: skip
    own = SimpleNamespace(tracks=[track] * recordings, tempering=1.0)
    before = [np.full((1, rows, 1), 0.5) for _ in range(recordings)]
    after = [e.copy() for e in before]
    for e in before:
        e[0, 0] = 4.0
    whole = even_ratio(own, before, after, whole=True)
    assert whole == pytest.approx(np.sqrt(recordings) / EVEN)  # all alike
    assert even_ratio(own, before, after) < 0.5 * whole
