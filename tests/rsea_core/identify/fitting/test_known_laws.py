"""Laws that the rig file states are in the nominal machine until a found one takes their place."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.effects.registry import LoadFriction
from rsea_core.identify.candidates.catalogue import catalogue, known_laws
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.terms.known import KnownTerm
from tests.cases.one_axis import axis_case, axis_recording, axis_rig

STATED = KnownTerm(term=LoadFriction(coulomb_Nm=0.15), stated=("coulomb_Nm",))


@pytest.fixture(scope="module")
def problem(tmp_path_factory):
    case = axis_case(tmp_path_factory.mktemp("axis"), axis_recording(seed=1), rig=axis_rig())
    return Problem(replace(case, known=(STATED,)))


def numbers_of(problem: Problem, hypothesis: Hypothesis) -> np.ndarray:
    """The machine's numbers where a search would begin."""
    return problem.trial_machine(problem.fitted[0], hypothesis, problem.start(hypothesis)).fx


def test_the_nominal_machine_has_the_laws_that_the_file_states(problem):
    (law,) = problem.nominal.laws
    assert [law.key] == [w.key for w in known_laws(problem.case)]
    assert problem.nominal.effects == ()
    stated, without = numbers_of(problem, problem.nominal), numbers_of(problem, Hypothesis())
    assert stated.max() > 0.0 == without.max()
    assert 0.15 in stated


@pytest.mark.parametrize(
    "found", ["load-friction/stribeck", "gear-friction/stribeck", "load-friction-angle/once a turn"]
)
def test_a_found_law_of_the_effect_takes_its_place(problem, found):
    law = catalogue(problem.case)[found]
    together = Hypothesis(laws=(*problem.nominal.laws, law))
    assert not problem.acts(problem.nominal.laws[0], together)
    alone = numbers_of(problem, Hypothesis(laws=(law,)))
    assert np.array_equal(numbers_of(problem, together), alone)


def test_a_found_law_of_another_effect_acts_together_with_it(problem):
    law = catalogue(problem.case)["load-drag/quadratic"]
    together = Hypothesis(laws=(*problem.nominal.laws, law))
    assert problem.acts(problem.nominal.laws[0], together)
    assert 0.15 in numbers_of(problem, together)
