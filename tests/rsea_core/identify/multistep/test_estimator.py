"""A fit that says that it has converged is at its optimum, with few simulations."""

import numpy as np
import pytest

import rsea_core.identify.multistep.steps as steps_module
from rsea_core.effects.registry import LoadFriction
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.multistep.criteria import STEP_ERROR
from rsea_core.identify.multistep.estimator import Estimator
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.horizons import parameters
from rsea_core.identify.multistep.log_nuisances import nuisances
from rsea_core.identify.multistep.tracks import initial_track
from tests.cases.one_axis import pendulum_case


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pendulum")
    return pendulum_case(folder, LoadFriction(coulomb_Nm=2e-3), seed=1)


def fitted(case, off: float = 0.0, target_cost: float = np.inf):
    """A fit from values so many tolerances off the rig file's, and the Jacobians that it took."""
    problem = MultistepProblem(case)
    estimator = Estimator(problem, [initial_track(e) for e in problem.fitted])
    h = Hypothesis(laws=nuisances(case))
    x = problem.start(h)
    x[: len(problem.nominals)] += off
    taken = []
    jacobian = estimator.jacobian
    estimator.jacobian = lambda *given, **how: taken.append(1) or jacobian(*given, **how)
    return estimator, estimator.fit(h, x, iterations=30, target_cost=target_cost), len(taken)


def test_a_fit_that_has_converged_has_no_slope_and_a_second_fit_gains_nothing(case):
    estimator, fit, _ = fitted(case)
    assert fit.converged
    again = estimator.fit(fit.hypothesis, fit.x, iterations=30)
    assert fit.cost - again.cost < max(1e-5 * abs(fit.cost), 0.05)


def test_corrected_jacobians_lead_to_the_same_optimum_with_fewer_new_ones(case, monkeypatch):
    _, fit, taken = fitted(case, off=3.0)
    monkeypatch.setattr(steps_module, "CORRECTIONS", 0)
    _, plain, each_step = fitted(case, off=3.0)
    assert fit.converged
    assert plain.converged
    assert abs(fit.cost - plain.cost) < max(1e-5 * abs(fit.cost), 0.05)
    assert taken < each_step


def test_shared_derivatives_lead_to_the_same_optimum_with_fewer_new_ones(case):
    """Friction beside parameters alone, with derivatives by these where there is no friction."""
    estimator, plain, _ = fitted(case)
    friction = next(w for w in catalogue(case).values() if w.effect == LoadFriction.effect)
    h = Hypothesis(laws=(*plain.hypothesis.laws, friction))
    x = np.concatenate([plain.x, estimator.problem.start(h)[plain.x.size :]])
    derivatives = estimator.jacobian
    ends = []
    for given in (None, derivatives(plain.hypothesis, plain.x)[1]):
        new = []

        def counted(*args, shared=None, _new=new, **how):
            _new.append(x.size - (0 if shared is None else len(shared[0])))
            return derivatives(*args, shared=shared, **how)

        estimator.jacobian = counted
        estimator.fit(h, x, iterations=3, shared=given)
        ends.append((sum(new), estimator.fit(h, x, iterations=30, shared=given)))
    (all_new, best), (fewer, other) = ends
    assert best.converged
    assert other.converged
    assert abs(best.cost - other.cost) < max(1e-5 * abs(best.cost), 0.05)
    assert fewer < all_new


def test_a_fit_that_cannot_reach_the_cost_needed_ends_and_one_that_can_is_unchanged(case):
    _, fit, taken = fitted(case, off=3.0)
    _, other, same = fitted(case, off=3.0, target_cost=fit.cost + 10.0)
    assert (other.cost, same) == (fit.cost, taken)
    _, early, fewer = fitted(case, off=3.0, target_cost=fit.cost - 1e6)
    assert not early.converged
    assert fewer == 1 < taken


def test_a_fit_that_begins_where_another_ended_simulates_no_jacobian_again(case):
    estimator, fit, _ = fitted(case)
    problem, machines = estimator.problem, []
    made = problem.trial_machine
    problem.trial_machine = lambda *given: machines.append(1) or made(*given)
    estimator.fit(fit.hypothesis, fit.x, iterations=1)
    assert len(machines) <= 8  # steps alone, damped and curved: fewer than its unknowns


def test_steps_are_shortened_until_no_innovation_shows_them(tmp_path):
    """A pendulum without friction read twenty times a cycle to 2^-20 of a turn, in 10 ms steps."""
    case = pendulum_case(tmp_path, seed=1, row_s=0.05, counts=2**20)
    h = Hypothesis(laws=nuisances(case))
    estimator, base, _ = parameters(MultistepProblem(case), h, lambda _: None)
    steps = estimator.problem.steps
    assert steps.fineness < 1.0
    half = MultistepProblem(case, steps=steps._replace(fineness=0.5 * steps.fineness))
    for t, e in zip(estimator.tracks, half.fitted, strict=True):
        machine = [half.trial_machine(e, h, base.x)]
        (found,) = estimator.residuals([(h, base.x)])
        finer = e.measured[None] - e.readings(e.runs(machine, t.windows), machine, t.windows)
        moved = t.innovations(found) - t.innovations(finer)
        assert np.sqrt(np.mean(moved**2)) <= STEP_ERROR
