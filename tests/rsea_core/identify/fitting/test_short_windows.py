"""Short runs of the true machine leave noise, and their starts and laws follow closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from rsea_core.effects.drive_thermal import (
    CASE_TO_AIR_W_per_K,
    COPPER_per_K,
    initial_rises,
)
from rsea_core.effects.known_variants import laws_by_key
from rsea_core.effects.registry import GearFriction, MotorCogging
from rsea_core.effects.variant import RunConditions, TrialMachine
from rsea_core.engines.fixed_step.body_steps import NO_FRICTION, Body, bristle_step
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.fitting.least_squares import Fitter
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.fitting.short_windows import LONGER_s, SHORT_s, prepared_for_short_runs
from rsea_core.identify.judgement.unmodelled_gravity import gravity_moved
from rsea_core.identify.selection.false_alarm_rate import (
    bootstrap_recordings,
    coloured,
    false_alarm_threshold,
)
from rsea_core.identify.selection.search import investigate
from rsea_core.machine.spring_table import table_tangent, table_torque
from tests.cases.planted import planted


@pytest.fixture(scope="module")
def dry(tmp_path_factory):
    return planted(tmp_path_factory.mktemp("dry"), GearFriction(coulomb_Nm=0.05))


def test_short_runs_of_the_true_machine_leave_noise(dry):
    law = catalogue(dry.case)["gear-friction/coulomb"]
    true = Hypothesis(laws=(law,))
    x = dry.start(true, [(0.05,)])
    fitter = Fitter(dry)
    for recordings in prepared_for_short_runs(dry, SHORT_s, LONGER_s):
        _, power, _ = fitter.evaluate(true, x[None], recordings)
        assert np.all(power < 1.6), "the true machine from smoothed starts"
        _, without, _ = fitter.evaluate(Hypothesis(), x[None, :-1], recordings)
        assert np.all(without > 5.0 * power), "the same without its friction"


def test_windows_cover_every_row_once(dry):
    for prepared in prepared_for_short_runs(dry, 0.3)[0]:
        first, last = prepared.windows.rows.T
        assert first[0] == 0
        assert last[-1] == prepared.recording.rows - 1
        np.testing.assert_array_equal(first[1:], last[:-1] + 1)
        assert np.all(first % prepared.whitener.block == 0)


def test_innovations_made_during_the_replay_are_those_of_the_residuals(dry):
    """Of whole runs and windows, with and without memory, and of laws that a sensor has."""
    laws = catalogue(dry.case)
    plain = Hypothesis()
    x = dry.start(plain)
    trials = [(plain, x), (plain, x + 0.3)]
    for key in ("gear-friction/bristles", "spring-hysteresis/two slips",
                "sensor-scale/factor@torque_Nm", "sensor-offset/constant@torque_Nm"):  # fmt: skip
        hypothesis = Hypothesis(laws=(laws[key],))
        trials.append((hypothesis, dry.start(hypothesis)))
    for recordings in (dry.fitted, prepared_for_short_runs(dry, 0.3)[0]):
        found = dry.innovations_of(trials, recordings)
        for prepared, e in zip(recordings, found, strict=True):
            for (hypothesis, at), own in zip(trials, e, strict=True):
                left = prepared.measured[None] - dry.predict(prepared, hypothesis, at[None])
                np.testing.assert_allclose(own, prepared.whitener(left)[0], rtol=1e-7, atol=1e-7)
                assert np.std(own) > 0.5


def test_a_replay_that_fails_has_no_innovations_from_there_and_leaves_the_others_theirs(
    dry,
):
    plain = Hypothesis()
    x = dry.start(plain)
    wild = x.copy()
    stiffness = next(n for n in dry.nominals if n.key.startswith("spring_stiffness"))
    wild[dry.nominals.index(stiffness)] = np.log(1e60) / stiffness.tolerance
    alone = dry.innovations(plain, x[None])
    found = dry.innovations(plain, np.array([x, wild, x]))
    for one, e in zip(alone, found, strict=True):
        assert not np.any(np.isfinite(e[1, 10:]))
        np.testing.assert_array_equal(e[0], one[0])
        np.testing.assert_array_equal(e[2], one[0])


def test_strong_cogging_that_throws_free_runs_out_of_step_is_found(tmp_path):
    problem = planted(tmp_path, MotorCogging(amplitude_Nm=0.06, cycles_per_rev=12.0))
    search = investigate(problem, depth=1)
    assert search.best.hypothesis.effects == ("motor-cogging",)
    _, laws = problem.values(search.best.hypothesis, search.best.x)
    assert laws[0]["cycles_per_rev"] == 12.0
    assert np.hypot(laws[0]["sin_Nm"], laws[0]["cos_Nm"]) == pytest.approx(0.06, rel=0.02)


def test_noise_drawn_for_a_replay_is_whitened_to_unit_power(dry):
    rng = np.random.default_rng(5)
    for prepared in dry.fitted:
        noise = coloured(prepared.whitener, rng)
        rows = np.repeat(noise, prepared.whitener.block, axis=0)
        white = prepared.whitener(rows[None])[0]
        assert np.mean(white**2) == pytest.approx(1.0, abs=0.06)
        lag = np.mean(white[1:] * white[:-1], axis=0)
        assert np.all(np.abs(lag) < 4.0 / np.sqrt(len(white)))


def test_a_replay_of_the_null_is_explained_by_its_parameters(dry):
    plain = Hypothesis()
    fit = Fitter(dry).fit(plain, dry.start(plain), iterations=2)
    replayed = dry.with_fitted(bootstrap_recordings(dry, fit, np.random.default_rng(0)))
    _, power, _ = Fitter(replayed).evaluate(plain, fit.x[None])
    np.testing.assert_allclose(power, 1.0, atol=0.1)


def test_chance_bound_holds_for_gumbel_maxima():
    rng = np.random.default_rng(2)
    bounds = [false_alarm_threshold(rng.gumbel(3.0, 2.0, 6)) for _ in range(400)]
    exact = 3.0 - 2.0 * np.log(-np.log(0.99))
    assert np.median(bounds) == pytest.approx(exact, rel=0.15)


def test_initial_rises_are_those_of_the_two_body_network():
    past = np.array([[0.1, 4.0]] * 200 + [[-1.0, 0.0]] + [[0.1, 1.0]] * 100)
    R, capacity, across, case, pause = 3.0, 8.0, 0.6, 60.0, 7.0

    def rates(current_squared):
        def f(_t, y):
            heat = R * current_squared * (1.0 + COPPER_per_K * y[0])
            flow = across * (y[0] - y[1])
            return [(heat - flow) / capacity, (flow - CASE_TO_AIR_W_per_K * y[1]) / case]

        return f

    y = [0.0, 0.0]
    for length, squared in ((20.0, 4.0), (pause, 0.0), (10.0, 1.0)):
        y = solve_ivp(rates(squared), (0.0, length), y, rtol=1e-9).y[:, -1]
    found = initial_rises(past, R, capacity, across, case, pause)
    np.testing.assert_allclose(found, y, rtol=2e-3)


def test_bristle_torque_is_that_of_dahl_integrated():
    """F(x) = F_c (1 - exp(-sigma x / F_c)) from rest, Dahl (1968); reversal likewise."""
    level, stiffness, h, speed = 2.0, 400.0, 1e-4, 0.05
    body = Body(1e9, 0.0, 0.0)  # so large that the speed is given
    friction = NO_FRICTION._replace(level=level, stiffness=stiffness)
    z, x = 0.0, 0.0
    for _ in range(2000):
        _, moved, z = bristle_step(body, friction, 0.0, z, speed, h)
        x += moved
    assert stiffness * z == pytest.approx(level * (1.0 - np.exp(-stiffness * x / level)))
    _, moved, back = bristle_step(body, friction, 0.0, z, -speed, 0.01)
    steady = level / stiffness
    exact = -steady + (z + steady) * np.exp(moved / steady)
    assert back == pytest.approx(exact)


def test_bristles_hold_a_body_that_is_pushed_below_their_level():
    level, stiffness, h = 2.0, 400.0, 2e-4
    body = Body(0.01, 0.5, 0.5 * level)
    friction = NO_FRICTION._replace(level=level, stiffness=stiffness)
    z, speed, x = 0.0, 0.0, 0.0
    for _ in range(40000):
        speed, moved, z = bristle_step(body, friction, 0.0, z, speed, h)
        x += moved
    assert abs(speed) < 1e-6
    assert stiffness * z == pytest.approx(0.5 * level, rel=1e-6)
    assert 0.0 < x < 2.0 * level / stiffness


@settings(deadline=None)
@given(
    onset=st.floats(0.02, 0.3),
    share=st.floats(0.01, 3.0),
    after=st.floats(1.0, 5.0),
    side=st.sampled_from([-1.0, 0.0, 1.0]),
    backward=st.floats(0.02, 0.3),
)
def test_rounded_knees_are_smooth_and_end_on_their_asymptotes(onset, share, after, side, backward):
    K, half = 60.0, min(0.5 * share * onset, 0.9 * onset)
    trial = TrialMachine(plant=np.zeros(1), fx=np.zeros(1), stiffness=K)
    where = RunConditions(
        index=0, file="", kind="locked", ratio=1.0, session_s=0.0, case_rise_K=0.0,
        time_s=np.zeros(1),
    )  # fmt: skip
    values = {
        "onset_rad": onset, "stiffness_after_over_before": after, "side": side,
        "round_rad": share * onset, "onset_backward_rad": backward,
    }  # fmt: skip
    laws_by_key()["spring-contact/rounded both ways"].write(values, trial, where)
    for corner in trial.spring[:-1, 0]:
        for f, scale in ((table_torque, K * onset), (table_tangent, K)):
            left, right = f(trial.spring, corner - 1e-9), f(trial.spring, corner + 1e-9)
            assert left == pytest.approx(right, abs=1e-5 * scale * after)
    far = onset + half + 0.1
    straight = K * far + (K * (after - 1.0) * (far - onset) if side >= 0.0 else 0.0)
    assert table_torque(trial.spring, far) == pytest.approx(straight)


def test_gravity_that_moved_is_the_difference_of_the_two_torques(dry):
    """m' g d sin(q + offset') - m g d sin(q + offset) as sine and cosine parts."""
    x = np.zeros(len(dry.nominals))
    np.testing.assert_allclose(gravity_moved(dry, x), 0.0, atol=1e-12)
    keys = [p.key for p in dry.nominals]
    x[keys.index("load_mass_kg")], x[keys.index("gravity_angle_offset_rad")] = 1.5, -2.0
    mass, angle = (
        dry.nominals[keys.index(key)].at(x[keys.index(key)])
        for key in ("load_mass_kg", "gravity_angle_offset_rad")
    )
    rig, q = dry.case.rig, np.linspace(-2.0, 2.0, 9)
    lever = 9.80665 * rig.load_distance_m
    exact = lever * (mass * np.sin(q + angle) - rig.load_mass_kg * np.sin(q))
    a, b = gravity_moved(dry, x)
    np.testing.assert_allclose(a * np.sin(q) + b * np.cos(q), exact, atol=1e-12)
