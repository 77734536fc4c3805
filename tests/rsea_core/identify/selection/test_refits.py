"""A further effect is sought where data ask for it, and dropped where it gains nothing."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rsea_core.effects.registry import GearFriction
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.fitting.jacobian import current_factor, moved_along, torque_factor
from rsea_core.identify.fitting.least_squares import Fitter
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.selection import search as se
from rsea_core.identify.selection.criteria import (
    FULL,
    PRICE,
    ROOM,
    TEMPERATURE,
    Search,
)
from rsea_core.identify.selection.final_refinement import restore_prior
from rsea_core.identify.selection.refits import drop, parts_of, revisit
from rsea_core.identify.selection.starting_points import prior_restoring_candidates
from tests.cases.planted import fit_at, planted

SCALED, LED = "sensor-scale/factor@torque_Nm", "sensor-scale/factor@current_A"


def test_a_torque_sensor_of_free_scale_lets_all_torques_go_home(tmp_path):
    problem = planted(tmp_path)
    fitter = Fitter(problem, far=10.0)
    keys = ("gear-friction/coulomb", SCALED)
    fit = fit_at(problem, fitter, keys)
    along = torque_factor(fitter, fit)
    assert torque_factor(fitter, fit_at(problem, fitter, keys[:1])) is None, "the sensor weighs"
    x = moved_along(problem, fit, along, np.log(1.15) / 0.01)
    away = fit_at(problem, fitter, keys, x)
    np.testing.assert_allclose(away.msni, fit.msni, rtol=1e-6)  # though the wheel has no unknown
    (_, was), (_, now) = (problem.values(fit.hypothesis, at) for at in (fit.x, x))
    assert now[0]["coulomb_Nm"] == pytest.approx(1.15 * was[0]["coulomb_Nm"], rel=1e-9)
    assert now[1]["scale"] == pytest.approx(was[1]["scale"] / 1.15, rel=1e-9)
    assert away.prior_cost > fit.prior_cost + 2.0
    home = restore_prior(fitter, away)
    np.testing.assert_allclose(home.x, fit.x, atol=1e-2)
    np.testing.assert_allclose(home.msni, fit.msni, rtol=1e-6)


def test_a_current_sensor_of_free_scale_lets_all_that_makes_the_current_go_home(tmp_path):
    problem = planted(tmp_path)
    fitter = Fitter(problem, far=10.0)
    keys = ("drive-saturation/sag", LED)
    laws = catalogue(problem.case)
    x = problem.start(Hypothesis(laws=tuple(laws[key] for key in keys)), ((0.4,), (1.0,)))
    fit = fit_at(problem, fitter, keys, x)
    along = current_factor(fitter, fit)
    assert current_factor(fitter, fit_at(problem, fitter, keys[:1])) is None, "the sensor reads it"
    away = fit_at(problem, fitter, keys, moved_along(problem, fit, along, np.log(1.15) / 0.01))
    np.testing.assert_allclose(away.msni, fit.msni, rtol=1e-3)
    (values, _), (moved, now) = (problem.values(fit.hypothesis, at.x) for at in (fit, away))
    for key in ("terminal_resistance_ohm", "terminal_inductance_H", "torque_constant_Nm_per_A"):
        assert moved[key] == pytest.approx(values[key] / 1.15, rel=1e-9)
    assert now[0]["source_resistance_ohm"] == pytest.approx(0.4 / 1.15, rel=1e-9)
    assert now[1]["scale"] == pytest.approx(1.0 / 1.15, rel=1e-9)
    home = restore_prior(fitter, away)
    np.testing.assert_allclose(home.x[: len(problem.nominals)], 0.0, atol=0.05)


def test_of_candidates_those_bring_parameters_home_with_which_their_priors_cost_less(tmp_path):
    problem = planted(tmp_path)
    plain = Hypothesis()
    x = problem.start(plain)
    x[:4] = 2.0
    base = SimpleNamespace(hypothesis=plain, x=x)
    shifts = [0.0 * x, -0.5 * x, -x, 0.5 * x, -0.1 * x]
    found = [SimpleNamespace(shift=shift) for shift in shifts]
    assert prior_restoring_candidates(problem, base, found) == [found[2], found[1]]


@pytest.mark.parametrize(("free", "short", "wanted"), [
    ((1.0, 5.0), (1.0, 1.2), False), ((1.0, 5.0), (1.0, 3.0), True), ((1.0, 1.2), (1.0, 3.0), False)
])  # fmt: skip
def test_a_further_effect_is_wanted_where_free_runs_and_short_ones_leave_more_than_noise(
    free, short, wanted
):
    search = SimpleNamespace(short_msni=lambda _: np.array(short))
    assert se.leaves_more_than_noise(search, SimpleNamespace(msni=np.array(free))) is wanted
    assert ROOM > 1.2


def test_a_free_run_that_came_back_in_step_is_no_further_effect_where_short_runs_gain_nothing(
    tmp_path, monkeypatch
):
    problem = planted(tmp_path)
    base = fit_at(problem, Fitter(problem), ())
    more = fit_at(problem, Fitter(problem), ("load-drag/quadratic",))
    search = Search(problem=problem, fitter=None, nominal_msni=base.msni, parameters=base)
    short = {}
    monkeypatch.setattr(Search, "short_msni", lambda _, fit: short[fit.hypothesis.key])
    short[base.hypothesis.key] = np.array([5.0, 6.0])
    reported: list[str] = []
    for power, found in (((4.9, 6.0), False), ((1.0, 6.0), True), ((7.0, 6.0), False)):
        short[more.hypothesis.key] = np.array(power)
        assert se.gains_in_short_runs(search, base, more, reported.append) is found
    assert len(reported) == 3


def test_parameters_far_from_home_are_worth_a_law_that_brings_them_back(tmp_path):
    problem = planted(tmp_path)
    fit = fit_at(problem, Fitter(problem), ())
    far, near = replace(fit, prior_cost=30.0), replace(fit, prior_cost=5.0)
    assert se.is_far_from_prior(far)
    assert not se.is_far_from_prior(replace(fit, prior_cost=se.WORTH_FURTHER))
    search = Search(problem=problem, fitter=None, nominal_msni=fit.msni, parameters=fit)
    assert se.restores_prior(search, far, near)
    assert not se.restores_prior(search, far, replace(fit, prior_cost=15.0))
    assert not se.restores_prior(search, near, replace(fit, prior_cost=0.0))
    worse = replace(near, msni=3.0 * np.maximum(near.msni, 0.8))
    assert not se.restores_prior(search, far, worse), "readings may not pay for it"


def test_with_an_imperfect_law_likelihoods_are_tempered_and_priors_are_not(tmp_path):
    problem = planted(tmp_path)
    fitter = Fitter(problem, far=10.0)
    fit = fit_at(problem, fitter, ("gear-friction/coulomb",))
    search = Search(problem=problem, fitter=fitter, nominal_msni=fit.msni, parameters=fit)
    dearer = replace(fit, prior_cost=fit.prior_cost + 3.0)
    assert search.tempered(fit) - search.tempered(dearer) == pytest.approx(3.0)
    worse = replace(fit, msni=1.1 * np.maximum(fit.msni, 0.9))
    gap = search.likelihood(fit.msni) - search.likelihood(worse.msni)
    assert search.tempered(fit) - search.tempered(worse) == pytest.approx(gap / TEMPERATURE)


def test_jointly_with_a_further_effect_the_next_best_laws_of_the_first_are_tried_again(tmp_path):
    problem = planted(tmp_path)
    laws = catalogue(problem.case)
    values = {"coulomb": 0.0, "stribeck": -1.0, "asymmetric": -2.0, "presliding": -3.0}
    n = len(problem.nominals)

    def made(score: float, *keys: str) -> SimpleNamespace:
        hypothesis = Hypothesis(laws=tuple(laws[key] for key in keys))
        x = problem.start(hypothesis)
        x[n:] += 0.01 * len(keys)
        return SimpleNamespace(hypothesis=hypothesis, x=x, msni=np.full(2, 3.0), value=score)

    alone = [made(value, f"gear-friction/{name}") for name, value in values.items()]
    tried = []

    class Trying:
        def fit(self, hypothesis, x, **_):
            tried.append((hypothesis.laws[0].law, x))
            score = 10.0 + PRICE + (1.0 if hypothesis.laws[0].law == "asymmetric" else -0.1)
            return SimpleNamespace(hypothesis=hypothesis, x=x, msni=np.full(2, 2.0), value=score)

    search = SimpleNamespace(
        problem=problem, fitter=Trying(), ranked=lambda: alone, keep=lambda fit: fit,
        score=lambda fit: fit.value, effort=FULL,
    )  # fmt: skip
    both = made(10.0, "gear-friction/coulomb", "load-drag/quadratic")
    found = revisit(search, both, lambda _: None)
    assert [name for name, _ in tried] == ["stribeck", "asymmetric"]
    assert len(tried) == FULL.revisits
    assert found.hypothesis.key == "gear-friction/asymmetric + load-drag/quadratic"
    first, second = parts_of(problem, found)
    np.testing.assert_array_equal(first, alone[2].x[n:])
    np.testing.assert_array_equal(second, parts_of(problem, both)[1])
    quiet = replace_power(both, 1.0)
    assert revisit(search, quiet, lambda _: None) is quiet


def replace_power(fit: SimpleNamespace, power: float) -> SimpleNamespace:
    return SimpleNamespace(**(vars(fit) | {"msni": np.full(2, power)}))


@pytest.mark.parametrize("there", [False, True])
def test_an_effect_that_only_led_out_of_a_hollow_is_dropped_again(tmp_path, there):
    """The best fit without it is far behind, and the fit as it is, without it, is not."""
    problem = planted(tmp_path, GearFriction(coulomb_Nm=0.02))
    keys, offset = ("gear-friction/coulomb", "sensor-offset/constant@torque_Nm"), 0.4 * there
    for prepared in problem.fitted:
        prepared.measured[:, prepared.channels.index("torque_Nm")] += offset
    fitter, laws = Fitter(problem, far=10.0), catalogue(problem.case)
    hypothesis = Hypothesis(laws=tuple(laws[key] for key in keys))
    fit = fit_at(problem, fitter, keys, problem.start(hypothesis, ((0.02,), (offset,))))
    first = fit_at(problem, fitter, keys[:1], fit.x[:-1])
    hollow = replace(first, msni=np.full_like(first.msni, 20.0 if there else 900.0))
    search = Search(problem=problem, fitter=fitter, nominal_msni=first.msni, parameters=first)
    search.fits = {hollow.hypothesis.key: hollow}
    left = drop(search, fit, lambda reported: None)
    assert (keys[1] in left.hypothesis.key) is there
