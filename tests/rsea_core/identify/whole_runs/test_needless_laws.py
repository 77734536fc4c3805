"""A law that was taken first leaves the search when a later one explains what it stood for."""

import pytest

from rsea_core.effects.spring_parallel import SpringParallel
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.law_search.search import laws_of
from rsea_core.identify.multistep.horizons import parameters_with_timing
from rsea_core.identify.multistep.log_nuisances import nuisances
from rsea_core.identify.whole_runs.search import WholeSearch
from rsea_core.identify.whole_runs.sensor_noise import in_sensor_noise, misfit
from tests.cases.one_axis import axis_case, axis_recording, axis_rig


@pytest.fixture(scope="module")
def search(tmp_path_factory):
    """A search of an axis with a spring, which is offered friction first."""
    spring = SpringParallel(stiffness_Nm_per_rad=0.01)
    case = axis_case(
        tmp_path_factory.mktemp("sprung"), axis_recording(spring, seed=1), rig=axis_rig()
    )
    h = Hypothesis(laws=nuisances(case))
    estimator, base, horizon = parameters_with_timing(case, h, lambda text: None)
    found = Found(problem=estimator.problem, base_estimator=estimator, base=base,
                  estimator=estimator, best=base, horizon=horizon)  # fmt: skip
    own = in_sensor_noise(estimator)
    plain = own.fit(base.hypothesis, base.x, iterations=12)
    return WholeSearch(own, plain, found, [], 0.0)


def offered(search, key):
    search.laws = [law for law in laws_of(search.found) if law.key == key]
    return search.add(lambda text: None)


def test_a_law_that_another_made_needless_is_taken_out(search):
    own, plain = search.own, search.plain
    assert misfit(own, plain.hypothesis, plain.x) > 3.0
    took_friction = offered(search, "load-disturbance/pulse") or offered(search, "load-drag/power")
    assert offered(search, "spring-parallel/linear")
    search.prune(lambda text: None)
    assert took_friction
    assert [law.key for law in search.taken] == ["spring-parallel/linear"]
    assert search.left() < 1.2
