"""Cogging of an axis that turns freely is found with its number of waves and its harmonic.

A wave of another number follows much of what the true one does: that it lowers the error proves
nothing until its neighbours were tried.
"""

import numpy as np
import pytest

from rsea_core.effects.motor_cogging import MotorCogging
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.candidate_fits import fitted
from rsea_core.identify.law_search.screening import Projection, screen, screen_again
from rsea_core.identify.law_search.search import laws_of
from rsea_core.identify.multistep.log_nuisances import nuisances
from rsea_core.identify.multistep.timing_choice import parameters_with_timing
from rsea_core.identify.whole_runs.forms import alike, holds
from rsea_core.identify.whole_runs.search import WholeSearch
from rsea_core.identify.whole_runs.sensor_noise import in_sensor_noise, misfit
from rsea_core.identify.whole_runs.taken_laws import Trial
from tests.cases.one_axis import axis_case, axis_recording, axis_rig
from tests.cases.whole_runs import found_by_parameters

AMPLITUDE_Nm, HARMONIC_Nm = 0.004, 0.002


@pytest.fixture(scope="module")
def searched(tmp_path_factory):
    """A search of an axis that cogs 12 times a turn, with parameters alone so far."""
    cogging = MotorCogging(
        amplitude_Nm=AMPLITUDE_Nm, cycles_per_rev=12.0, phase_rad=0.7,
        amplitude_2_Nm=HARMONIC_Nm, cycles_2_per_rev=24.0, phase_2_rad=-1.0,
    )  # fmt: skip
    folder = tmp_path_factory.mktemp("cogging")
    case = axis_case(folder, axis_recording(cogging, seed=1), rig=axis_rig())
    estimator, base, horizon = parameters_with_timing(
        case, Hypothesis(laws=nuisances(case)), lambda text: None
    )
    found = found_by_parameters(estimator, base, horizon)
    own = in_sensor_noise(estimator)
    plain = own.fit(base.hypothesis, base.x, iterations=12)
    return WholeSearch(own, plain, found, laws_of(found), 1.6)


def named(search: WholeSearch, number: int):
    return next(w for w in search.laws if w.key == f"motor-cogging/{number} per turn")


def test_a_screening_at_the_sizes_found_puts_the_true_number_first(searched):
    laws = [w for w in searched.laws if w.effect == MotorCogging.effect]
    screened = screen(searched.own, searched.plain, laws)
    assert not any(c.law.follows for c in screened)
    again = screen_again(searched.own, searched.plain, screened)
    assert again[0].law is named(searched, 12)


def test_a_wave_of_a_neighbouring_number_is_replaced_by_the_true_one_with_its_harmonic(searched):
    own, plain, wrong = searched.own, searched.plain, named(searched, 14)
    c = screen(own, plain, [wrong])[0]
    fit = fitted(own, plain, c, factors=(1.0, 0.3, 0.1))
    searched.fit, searched.taken = fit, [wrong]
    gain, left = plain.cost - fit.cost, misfit(own, fit.hypothesis, fit.x)
    searched.rivals = {wrong.key: [Trial(candidate=c, fit=fit, gain=gain, left=left)]}
    searched.nearest_number(wrong, lambda text: None)
    assert [w.law for w in searched.taken] == ["12 per turn, two waves"]
    assert searched.left() < 1.3 < left
    fit = searched.fit
    values = own.problem.values(fit.hypothesis, fit.x)[1][-1]
    root = Projection(own, fit).L  # of the information matrix
    deviation = np.sqrt(np.diag(np.linalg.inv(root @ root.T)))
    scale = max(u.scale for u in fit.hypothesis.laws[-1].unknowns)
    of_first, of_second = ("", slice(-4, -2), AMPLITUDE_Nm), ("2_", slice(-2, None), HARMONIC_Nm)
    for kind, wave, truth in (of_first, of_second):
        found = float(np.hypot(values[f"sin_{kind}Nm"], values[f"cos_{kind}Nm"]))
        assert abs(found - truth) < 3.0 * scale * max(deviation[wave])


def test_numbers_that_no_fit_changes_tell_laws_apart(searched):
    twelve, two = named(searched, 12), named(searched, 12).richer[0]
    forms = {w.law: w for w in searched.laws if w.effect == MotorCogging.effect}
    assert [w.law for w in alike(twelve, searched.laws)][:2] == ["11 per turn", "13 per turn"]
    assert holds(forms[two], twelve)
    assert not holds(twelve, twelve)
    assert not holds(forms["13 per turn, two waves"], twelve)
    assert not holds(forms["13 per turn"], twelve)
