"""A fit that says that it has arrived is at its optimum, with few simulations."""

import numpy as np
import pytest

from rsea_core.effects.registry import LoadFriction
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.multistep.criteria import FIRST_STEP, STEP_ERROR
from rsea_core.identify.multistep.estimator import Estimator
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.horizons import parameters, with_fine_steps
from rsea_core.identify.multistep.log_nuisances import nuisances
from rsea_core.identify.multistep.tracks import initial_track
from tests.cases.one_axis import pendulum_case


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pendulum")
    return pendulum_case(folder, LoadFriction(coulomb_Nm=2e-3), seed=1)


def fitted(case, count=None):
    """A fit from the rig file's values, and the Jacobians that it took."""
    problem = MultistepProblem(case)
    estimator = Estimator(problem, [initial_track(e) for e in problem.fitted])
    h = Hypothesis(laws=nuisances(case))
    taken = []
    jacobian = estimator.jacobian
    estimator.jacobian = lambda *given: taken.append(1) or jacobian(*given)
    return estimator, estimator.fit(h, problem.start(h), iterations=30), len(taken)


def test_a_fit_that_has_arrived_has_no_slope_and_a_second_fit_gains_nothing(case):
    estimator, fit, _ = fitted(case)
    assert fit.arrived
    again = estimator.fit(fit.hypothesis, fit.x, iterations=30)
    assert fit.cost - again.cost < max(1e-5 * abs(fit.cost), 0.05)


def test_a_fit_from_the_rig_file_arrives_after_six_jacobians_at_most(case):
    _, fit, taken = fitted(case)
    assert fit.arrived
    assert taken <= 6


def test_a_fit_that_begins_where_another_ended_simulates_no_jacobian_again(case):
    estimator, fit, _ = fitted(case)
    problem, machines = estimator.problem, []
    made = problem.trial_machine
    problem.trial_machine = lambda *given: machines.append(1) or made(*given)
    estimator.fit(fit.hypothesis, fit.x, iterations=1)
    assert len(machines) <= 3  # damped steps alone


def test_steps_are_shortened_until_no_innovation_shows_them(case):
    h = Hypothesis(laws=nuisances(case))
    estimator, base, _ = parameters(MultistepProblem(case), h, lambda _: None)
    fine, base = with_fine_steps(estimator, base, lambda _: None)
    share = fine.problem.step_share
    assert share <= FIRST_STEP
    half = MultistepProblem(case, step_share=0.5 * share)
    other = Estimator(half, [initial_track(e) for e in half.fitted])
    moved = [a - b for a, b in zip(fine.residuals([(h, base.x)]), whole(other, fine, h, base.x),
                                   strict=True)]  # fmt: skip
    white = [t.innovations(r) for t, r in zip(fine.tracks, moved, strict=True)]
    assert max(float(np.sqrt(np.mean(e**2))) for e in white) <= STEP_ERROR


def whole(other, like, h, x):
    """Residuals of another problem's experiments in the windows of an estimator."""
    found = []
    for t, e in zip(like.tracks, other.problem.fitted, strict=True):
        machine = [other.problem.trial_machine(e, h, x)]
        found.append(e.measured[None] - e.readings(e.runs(machine, t.windows), machine, t.windows))
    return found
