"""Intervals of constants cover the truth as often as they say, ambiguities included."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import rsea_core.machine.quantities as q
from dftfs.proof.scoring import corrected, score_case
from rsea_core.effects.variant import Law, Unknown
from rsea_core.engines.fixed_step.replay import Replay
from rsea_core.identify.candidates.rig_parameters import Nominal, unstated_std
from rsea_core.identify.fitting.jacobian import ELECTRIC, common_factor, jacobian_at
from rsea_core.identify.fitting.least_squares import Fit, Fitter
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.judgement.covariance import LAW_SPREAD, Spread, covariance, law_moves
from rsea_core.identify.judgement.quantisation_error import PLACES, places, rounding
from rsea_core.identify.result.diagnosis_json import corrected_parameters
from rsea_core.identify.selection.final_refinement import restore_prior
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import Case
from rsea_core.recordings.recording import Recording
from tests.cases.planted import RIG


class Made:
    """A problem whose innovations are a given function of the unknowns."""

    def __init__(self, function, nominals):
        self.function, self.nominals = function, nominals
        self.case = SimpleNamespace(rig=RIG, known=())
        size = function(np.zeros(len(nominals))).size
        self.fitted = [SimpleNamespace(whitener=SimpleNamespace(size=size))]

    def bounds(self, hypothesis):
        return np.full(len(self.nominals), -12.0), np.full(len(self.nominals), 12.0)

    def prior(self, hypothesis):
        return np.zeros(len(self.nominals)), np.ones(len(self.nominals))

    def innovations(self, hypothesis, X, recordings=None):
        return [np.array([self.function(x)[:, None] for x in X])]


def made_fit(problem: Made, x) -> tuple[Fitter, Fit]:
    fitter = Fitter(problem)
    cost, power, _ = fitter.evaluate(Hypothesis(), np.array([x]))
    prior = 0.5 * float(np.sum(np.square(x)))
    fit = Fit(hypothesis=Hypothesis(), x=np.array(x), cost=cost[0], prior_cost=prior, msni=power[0])
    return fitter, fit


def electric() -> tuple[Nominal, ...]:
    return tuple(
        Nominal(key=key, value=v, tolerance=s)
        for key, v, s in zip(ELECTRIC, (48.0, 4.0, 0.3, 4e-3), (0.02, 0.15, 0.08, 0.1), strict=True)
    )


def rough(x) -> np.ndarray:
    """Innovations of ratios to the supply only, thrown out by the least change of them."""
    logs = np.array([0.02, 0.15, 0.08, 0.1]) * x
    ratios = logs[1:] - logs[0]
    t = np.linspace(0.0, 1.0, 50)
    smooth = (
        40.0 * ratios[0] * np.sin(3 * t) + 30.0 * ratios[1] * t + 5.0 * ratios[2] * np.cos(9 * t)
    )
    return smooth + 0.3 * np.sin(4e3 * ratios.sum() + 20 * t)


def test_the_jacobian_of_linear_innovations_is_their_matrix():
    M = np.random.default_rng(2).standard_normal((60, 4)) @ np.diag([1.0, 100.0, 1e-3, 1.0])
    fitter, fit = made_fit(Made(lambda x: M @ x + 1.0, electric()), np.array([0.3, -0.2, 0.1, 0.0]))
    found = jacobian_at(fitter, fit)
    np.testing.assert_allclose(found.columns[0][:, :, 0].T, M, rtol=1e-6, atol=1e-7)
    steep = Made(lambda x: 1e3 * M @ x + 1.0, electric())
    assert common_factor(*made_fit(steep, np.zeros(4))) is None


def test_columns_say_nothing_along_a_factor_that_nothing_shows_however_rough_replays_are():
    fitter, fit = made_fit(Made(rough, electric()), np.array([0.5, 0.1, -0.2, 0.3]))
    along = common_factor(fitter, fit)
    columns = jacobian_at(fitter, fit).columns[0][:, :, 0]
    assert np.linalg.norm(along @ columns) < 1e-9 * np.linalg.norm(along[:, None] * columns)
    assert np.linalg.norm(columns) > 1.0


def test_the_common_factor_goes_to_where_tolerances_want_it_and_changes_no_innovation():
    problem = Made(rough, electric())
    fitter, fit = made_fit(problem, np.array([5.0, 1.3, 1.2, 1.2]))
    home = restore_prior(fitter, fit)
    along = common_factor(fitter, fit)
    assert along @ home.x == pytest.approx(0.0, abs=1e-12)
    assert home.prior_cost < 0.2 * fit.prior_cost
    assert home.cost - fit.cost == pytest.approx(home.prior_cost - fit.prior_cost)
    before, after = problem.innovations(None, np.array([fit.x, home.x]))[0]
    np.testing.assert_allclose(after, before, atol=1e-9)


def test_counters_that_begin_anywhere_are_off_as_a_whole_by_a_twelfth_of_a_square_count():
    count = 0.01
    began, stood = places()
    assert sorted(began) == pytest.approx(sorted(stood))
    busy = rounding(np.tile(np.linspace(0.0, 3.0, 30001), (PLACES, 1)), count, began)
    whole = np.mean(busy, axis=1)  # what all readings of a recording are off by
    assert np.mean((busy - whole[:, None]) ** 2) == pytest.approx(count**2 / 12.0, rel=0.01)
    assert np.mean(whole**2) == pytest.approx(count**2 / 12.0, rel=0.03)


def test_a_law_that_differs_from_piece_to_piece_moves_what_the_pieces_confuse_with_it():
    unknowns = (
        Unknown(name="coulomb_Nm", unit="Nm", low=0.0, high=9.0, scale=0.5),
        Unknown(name="angle_rad", unit="rad", low=-9.0, high=9.0, scale=1.0),
    )
    law = Law(
        effect="gear-friction", law="made", subsystem="gear", unknowns=unknowns,
        starts=((1.0, 0.0),), write=lambda values, trial, where: None,
    )  # fmt: skip
    fit = SimpleNamespace(x=np.array([0.0, 4.0, 1.0]), hypothesis=Hypothesis(laws=(law,)))
    pieces = [np.arange(9.0).reshape(3, 3), np.eye(3)]
    moves = law_moves(SimpleNamespace(nominals=[None]), fit, pieces)
    expected = [LAW_SPREAD * 4.0 * H[:, 1] for H in pieces]  # the angle is no size
    np.testing.assert_allclose(moves, expected)


def test_a_mass_is_known_no_better_than_the_distance_it_hangs_at():
    assert unstated_std(RIG, "load_mass_kg") == pytest.approx(0.003)
    assert unstated_std(replace(RIG, anchors=("load_distance_m",)), "load_mass_kg") == 0.0
    stated = replace(RIG, tolerances=(("load_distance_m", 0.002),))
    assert unstated_std(stated, "load_mass_kg") == pytest.approx(0.0006)


def _conclusion(unbalance, between=0.0):
    keys = ("load_mass_kg", "gravity_angle_offset_rad")
    own = (
        Nominal(key=keys[0], value=0.3, tolerance=0.03),
        Nominal(key=keys[1], value=0.0, tolerance=0.015, additive=True),
    )
    x = np.array([0.5, -6.0])
    return SimpleNamespace(
        spread=Spread(sources=(np.diag([0.04, 0.01]),)), unbalance=unbalance, case=Case,
        problem=SimpleNamespace(nominals=own), fit=SimpleNamespace(x=x, hypothesis=Hypothesis()),
        nominal={p.key: p.at(v) for p, v in zip(own, x, strict=True)},
        between=lambda j: between,
    )  # fmt: skip


def test_gravity_that_an_unbalance_has_moved_is_not_identifiable():
    for unbalance, seen in ((None, True), ({"name": "load-unbalance"}, False)):
        conclusion = _conclusion(unbalance)
        conclusion.case, conclusion.laws = SimpleNamespace(rig=RIG, known=()), ()
        found = corrected_parameters(conclusion)
        assert all(entry["identifiable"] is seen for entry in found.values())
        off = found["gravity_angle_offset_rad"]
        assert (off["std"] >= abs(off["to"])) is not seen


def test_what_laws_that_fit_alike_differ_by_joins_the_interval_of_a_constant():
    stds = []
    for between in (0.0, 0.03):
        conclusion = _conclusion(None, between)
        conclusion.case, conclusion.laws = SimpleNamespace(rig=RIG, known=()), ()
        stds.append(corrected_parameters(conclusion)["gravity_angle_offset_rad"]["std"])
    assert stds[0] == pytest.approx(0.1 * 0.015)
    assert stds[1] == pytest.approx(0.2 * 0.015)  # root of 0.01 and 0.03


def test_constants_that_an_effect_redefines_or_outside_physics_surrounds_are_not_scored(tmp_path):
    for name in ("output", "truth", "nominal"):
        (tmp_path / f"{name}.csv").write_text("time_s,torque_Nm\n0,0\n1,1\n")
    keys = ("contact_stiffness_Nm_per_rad", "spring_stiffness_Nm_per_rad")
    label = {
        "level": "plain", "effects": ["contact-nonlinear"], "rivals": [], "effect_subsystem": {},
        "parameters_true_vs_rig": {key: [60.0, 61.0] for key in keys}, "parameters": {},
        "hidden_test": {"nrmse": {}}, "verdicts": {}, "subsystems": {},
    }  # fmt: skip
    entries = {key: {"to": 61.5, "std": 0.5, "identifiable": True} for key in keys}
    found = {"parameters_corrected": entries, "effects": [{"name": "contact-nonlinear"}]}
    assert [p.name for p in corrected(label, found)] == [keys[1]]
    assert len(score_case("a", label, found, tmp_path, None).constants) == 1
    outside = label | {"level": "outside", "effects": [], "nearest_names": ["contact-nonlinear"]}
    assert score_case("a", outside, found, tmp_path, None).constants == ()


# ---- coverage


def _recording(rig: Rig, kind: str, rng: np.random.Generator) -> Recording:
    """A reading of the engine in steps of an eighth, 4 s at 500 Hz, counted from anywhere."""
    t = 0.002 * np.arange(2000)
    if kind == "locked":
        duty = 0.08 * np.sin(2 * np.pi * 0.4 * t)
    else:
        phase = rng.uniform(0.0, 6.0, 4)
        duty = sum(
            0.05 * (np.sin(2 * np.pi * f * t + a) - np.sin(a))
            for f, a in zip((0.7, 1.9, 4.1, 7.3), phase, strict=True)
        )
    duty = np.round(duty, 5)
    inputs = Inputs(time_s=t, duty=duty, load=Load(kind=kind))
    out = Replay.of(inputs, step_s=1.25e-4).run(ActuatorModel(rig, ()))
    count = 2 * np.pi / 8192
    began = rng.uniform(0.0, 1.0, 2) * count
    columns = {
        "time_s": t,
        "duty": duty,
        "motor_angle_rad": q.quantise_angle(out[:, 0] + began[0], 8192),
        "load_angle_rad": q.quantise_angle(out[:, 1] + began[1], 8192),
        "current_A": out[:, 3] + 0.005 * rng.standard_normal(t.size),
        "torque_Nm": out[:, 2] + 0.02 * rng.standard_normal(t.size),
    }
    return Recording(file=f"{kind}.csv", load=Load(kind=kind), columns=columns, sample_time_s=0.002)


def test_intervals_of_constants_hold_where_encoders_count_from_anywhere_and_replays_step(tmp_path):
    keys = (
        "gravity_angle_offset_rad",
        "load_inertia_kgm2",
        "spring_stiffness_Nm_per_rad",
        "load_viscous_Nms_per_rad",
        "torque_constant_Nm_per_A",
        "motor_inertia_kgm2",
    )
    z = {key: [] for key in keys}
    for seed in range(8):
        rng = np.random.default_rng(seed)
        changes = {k: getattr(RIG, k) * np.exp(0.01 * rng.standard_normal()) for k in keys[1:]}
        rig = replace(RIG, gravity_angle_offset_rad=0.003 * rng.standard_normal(), **changes)
        made = tuple(_recording(rig, kind, rng) for kind in ("locked", "pendulum"))
        problem = Problem(
            Case(name="known", folder=tmp_path, rig=RIG, recordings=made), step_s=1e-3
        )
        fitter = Fitter(problem, far=10.0)
        fit = fitter.fit(Hypothesis(), problem.start(Hypothesis()), iterations=12, central=True)
        fit = restore_prior(fitter, fit)
        std = covariance(fitter, fit)[0].std
        for j, p in enumerate(problem.nominals):
            if p.key in keys:
                true = getattr(rig, p.key)
                x = true / p.tolerance if p.additive else np.log(true / p.value) / p.tolerance
                z[p.key].append((fit.x[j] - x) / std[j])
    held = np.mean(np.abs(np.concatenate(list(z.values()))) < 1.96)
    assert held >= 0.9
    offset = np.sqrt(np.mean(np.square(z["gravity_angle_offset_rad"])))
    assert 0.4 < offset < 1.5
