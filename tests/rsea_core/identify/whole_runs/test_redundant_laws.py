"""A law that was taken first is removed when a later one explains what it explained."""

import pytest

from rsea_core.effects.spring_parallel import SpringParallel
from rsea_core.identify.law_search.search import laws_of
from rsea_core.identify.whole_runs.search import WholeSearch
from rsea_core.identify.whole_runs.sensor_noise import misfit
from tests.cases.one_axis import axis_recording
from tests.cases.whole_runs import searched_axis

SPRING = "spring-parallel/linear"


@pytest.fixture(scope="module")
def search(tmp_path_factory):
    """A search of an axis with a spring that the rig file does not state."""
    spring = SpringParallel(stiffness_Nm_per_rad=0.01)
    recording = axis_recording(spring, seed=1)
    found, own, plain = searched_axis(tmp_path_factory.mktemp("sprung"), recording)
    return WholeSearch(own, plain, found, [], 0.0)


def add_one_of(search, laws):
    search.laws = laws
    assert search.add(lambda text: None)


def test_a_law_that_another_one_made_redundant_is_removed(search):
    own, plain, laws = search.own, search.plain, laws_of(search.found)
    add_one_of(search, [law for law in laws if law.effect == "load-drag"])
    first = misfit(own, search.fit.hypothesis, search.fit.x)
    assert SPRING not in [law.key for law in search.taken]
    assert first < misfit(own, plain.hypothesis, plain.x)
    add_one_of(search, [law for law in laws if law.key == SPRING])
    assert len(search.taken) == 2
    search.prune(lambda text: None)
    assert [law.key for law in search.taken] == [SPRING]
    assert search.left() < 1.2 < first
