"""Laws of the machine predict rows that they were not fitted to; laws that follow a path do not."""

import numpy as np
import pytest

from rsea_core.effects.spring_parallel import SpringParallel
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.candidate_fits import fitted
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.law_search.pulses import pulses
from rsea_core.identify.law_search.screening import Projection, screen
from rsea_core.identify.law_search.search import laws_of
from rsea_core.identify.multistep.horizons import parameters_with_timing
from rsea_core.identify.multistep.log_nuisances import nuisances
from rsea_core.identify.whole_runs.sensor_noise import in_sensor_noise
from rsea_core.identify.whole_runs.unseen import needed, unseen_share, without
from tests.cases.one_axis import axis_case, axis_recording, axis_rig


@pytest.fixture(scope="module")
def sprung(tmp_path_factory):
    """A search of an axis with a hidden spring, and parameters alone in the sensors' noise."""
    spring = SpringParallel(stiffness_Nm_per_rad=0.01)
    case = axis_case(
        tmp_path_factory.mktemp("sprung"), axis_recording(spring, seed=1), rig=axis_rig()
    )
    h = Hypothesis(laws=nuisances(case))
    estimator, base, horizon = parameters_with_timing(case, h, lambda text: None)
    found = Found(problem=estimator.problem, base_estimator=estimator, base=base,
                  estimator=estimator, best=base, horizon=horizon)  # fmt: skip
    own = in_sensor_noise(estimator)
    return found, own, own.fit(base.hypothesis, base.x, iterations=12)


@pytest.fixture(scope="module")
def true_law(sprung):
    found, own, plain = sprung
    laws = [law for law in laws_of(found) if law.key == "spring-parallel/linear"]
    return fitted(own, plain, screen(own, plain, laws)[0])


@pytest.fixture(scope="module")
def pulse(sprung):
    _, own, plain = sprung
    return fitted(own, plain, pulses(Projection(own, plain))[0])


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


def test_a_fit_without_a_law_is_that_of_the_others(sprung, true_law):
    _, own, plain = sprung
    less = without(own, true_law, true_law.hypothesis.laws[-1])
    assert less.hypothesis.laws == plain.hypothesis.laws
    assert less.cost == pytest.approx(plain.cost, rel=1e-3)
    assert np.all(np.isfinite(less.x))
