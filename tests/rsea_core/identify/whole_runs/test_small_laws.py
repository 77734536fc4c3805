"""A law that is small beside another one is found if it explains what that one leaves."""

import numpy as np
import pytest

from rsea_core.effects.load_disturbance import LoadDisturbance
from rsea_core.effects.load_friction import LoadFriction
from rsea_core.effects.spring_parallel import SpringParallel
from rsea_core.identify.law_search.search import laws_of
from rsea_core.identify.multistep.command_timing import AS_LOGGED
from rsea_core.identify.multistep.criteria import LEAST_EXCESS, LEAST_OF_LEFT
from rsea_core.identify.whole_runs.search import WholeSearch
from tests.cases.one_axis import axis_recording
from tests.cases.whole_runs import searched_axis

SPRING, FRICTION = "spring-parallel/linear", "load-friction/coulomb"
STIFF = SpringParallel(stiffness_Nm_per_rad=0.01)
SMALL = LoadFriction(coulomb_Nm=0.001)


def sprung(folder, *terms, seed: int = 1) -> WholeSearch:
    """A search that took the spring of an axis."""
    found, own, plain = searched_axis(folder, axis_recording(*terms, seed=seed), timing=AS_LOGGED)
    laws = [law for law in laws_of(found) if law.key in (SPRING, FRICTION)]
    search = WholeSearch(own, plain, found, laws, 0.0)
    assert search.add(lambda text: None)
    assert [law.key for law in search.taken] == [SPRING]
    return search


@pytest.fixture(scope="module")
def with_friction(tmp_path_factory):
    """A search that took the larger of two laws, and what was left then."""
    search = sprung(tmp_path_factory.mktemp("two"), STIFF, SMALL)
    return search, search.excess()


def test_a_small_law_that_explains_what_a_large_one_leaves_is_taken(with_friction):
    search, left = with_friction
    assert LEAST_EXCESS < left < LEAST_OF_LEFT * search.plain_excess()
    assert search.add_last(lambda text: None)
    assert [law.key for law in search.taken] == [SPRING, FRICTION]
    assert search.excess() < 0.15 * left


def test_a_small_torque_that_acts_once_is_taken_if_it_explains_what_a_large_law_leaves(tmp_path):
    pulse = LoadDisturbance(start_s=5.0, end_s=6.0, peak_Nm=0.003)
    search = sprung(tmp_path, STIFF, pulse)
    left = search.excess()
    assert LEAST_EXCESS < left < LEAST_OF_LEFT * search.plain_excess()
    assert search.add_last(lambda text: None)
    assert [law.effect for law in search.taken] == ["spring-parallel", "load-disturbance"]
    assert search.excess() < 0.05 * left


def test_no_law_is_taken_where_one_leaves_noise_alone(tmp_path):
    assert not sprung(tmp_path, STIFF).add_last(lambda text: None)


def test_a_complete_model_leaves_the_noise_of_the_counts(tmp_path):
    # parameters alone explain single counts by an unknown torque and underestimate the noise
    stiff = SpringParallel(stiffness_Nm_per_rad=0.3)
    assert sprung(tmp_path, stiff, seed=2).left() < 1.2


@pytest.mark.parametrize(("share", "taken"), [(1.01, False), (0.5, True)])
def test_a_further_law_must_explain_a_stated_share_of_what_others_leave(tmp_path, share, taken):
    assert sprung(tmp_path, STIFF, SMALL).add_last(lambda text: None, share) == taken


def test_a_plainer_form_takes_the_place_of_one_whose_further_values_explain_nothing(tmp_path):
    found, own, plain = searched_axis(tmp_path, axis_recording(STIFF, seed=1), timing=AS_LOGGED)
    forms = {law.key: law for law in laws_of(found)}
    search = WholeSearch(own, plain, found, [forms["spring-parallel/cubic"]], 0.0)
    assert search.add(lambda text: None)
    search.laws = list(forms.values())
    taken = search.taken[0]
    assert not search.plainer_form(taken, lambda text: None, least=np.inf)
    assert search.plainer_form(taken, lambda text: None, least=0.0)
    assert [law.key for law in search.taken] == [SPRING]
