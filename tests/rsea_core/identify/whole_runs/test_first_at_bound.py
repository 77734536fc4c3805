"""A law that ends at a bound when it is alone may be right beside another law."""

from dataclasses import replace

from rsea_core.effects.load_friction import LoadFriction
from rsea_core.effects.spring_parallel import SpringParallel
from rsea_core.identify.law_search.candidate_fits import at_bound
from rsea_core.identify.law_search.search import laws_of
from rsea_core.identify.multistep.command_timing import AS_LOGGED
from rsea_core.identify.whole_runs.search import WholeSearch
from tests.cases.one_axis import axis_recording
from tests.cases.whole_runs import searched_axis

SPRING, FRICTION = "spring-parallel/linear", "load-friction/coulomb"


def searched(folder, least_Nm_per_rad: float) -> WholeSearch:
    """A search of an axis with spring and friction, its spring at least as stiff as a bound."""
    terms = SpringParallel(stiffness_Nm_per_rad=0.02), LoadFriction(coulomb_Nm=0.1)
    recording = axis_recording(*terms, seed=1)
    found, own, plain = searched_axis(folder, recording, timing=AS_LOGGED)
    laws = {law.key: law for law in laws_of(found)}
    stiffness, rest = laws[SPRING].unknowns
    spring = replace(laws[SPRING], unknowns=(replace(stiffness, low=least_Nm_per_rad), rest))
    search = WholeSearch(own, plain, found, [spring, laws[FRICTION]], 1.6)
    search.add_all(lambda text: None)
    return search


def test_a_law_at_a_bound_is_taken_where_another_law_moves_it_from_there(tmp_path):
    search = searched(tmp_path, 0.016)  # alone 0.014, with friction 0.019
    assert SPRING not in [law.key for law in search.taken]
    other = search.begun_at_bound(lambda text: None)
    assert {law.key for law in other.taken} == {SPRING, FRICTION}
    assert other.left() < 1.2
    assert not any(at_bound(other.own.problem, other.fit, law) for law in other.taken)


def test_a_law_that_stays_at_its_bound_is_not_taken(tmp_path):
    assert searched(tmp_path, 0.03).begun_at_bound(lambda text: None) is None


def test_a_law_at_a_bound_that_explains_little_is_not_followed(tmp_path):
    search = searched(tmp_path, 0.016)
    search.best_at_bound = replace(search.best_at_bound, gain=0.1 * search.best_at_bound.gain)
    assert search.begun_at_bound(lambda text: None) is None
