"""A worm friction that falls with speed holds its level and is found by a fit."""

from dataclasses import replace

import numpy as np
import pytest

import rsea_core.effects.layout as e
from rsea_core.effects.known_variants import laws_by_key
from rsea_core.effects.variant import RunConditions, TrialMachine
from rsea_core.engines.fixed_step.step_torques import gear_levels, gear_slip
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.fitting.least_squares import Fitter
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.selection.criteria import Search
from rsea_core.identify.selection.false_alarm_rate import coloured
from rsea_core.identify.selection.refits import ROOM_FOR_LAWS, with_richer_laws
from tests.cases.planted import planted

TRUE = (0.93, 0.92, 0.03, 0.4, 12.0)  # efficiencies, bristles, rise and speed of the fading
RATIO = 60.0
QUIET = 0.9  # of the noise that the sensors are said to have, as true sensors often are


def test_a_thread_that_fades_slides_with_the_level_of_its_speed():
    values = dict(
        zip(
            ("drive_efficiency", "backdrive_efficiency", "bristle_rad", "stribeck_rise",
             "stribeck_velocity_rad_per_s"), TRUE, strict=True,
        )
    )  # fmt: skip
    where = RunConditions(
        index=0, file="", kind="locked", ratio=RATIO, session_s=0.0, case_rise_K=0.0,
        time_s=np.zeros(1),
    )  # fmt: skip
    trial = TrialMachine(plant=np.zeros(40), fx=np.zeros(e.N_EFFECTS), stiffness=60.0)
    laws_by_key()["gear-load-friction/efficiencies, fading"].write(values, trial, where)
    torque = 5.0
    for speed in (0.02, 0.2, 0.5):  # of the wheel
        slip = gear_slip(trial.fx, speed)
        assert slip == pytest.approx(1.0 + 0.4 * np.exp(-speed * RATIO / 12.0))
        forward = gear_levels(trial.fx, slip, torque, speed, 1e-3).level
        backward = gear_levels(trial.fx, slip, torque, -speed, -1e-3).level
        assert forward == pytest.approx(slip * (1.0 / 0.93 - 1.0) * torque)
        assert backward == pytest.approx(slip * (1.0 - 0.92) * torque)


def read_from(problem: Problem, hypothesis: Hypothesis, x, seed: int) -> Problem:
    """The problem on noisy readings of a hypothesis."""
    rng = np.random.default_rng(seed)
    recordings = []
    for prepared in problem.fitted:
        expected = problem.predict(prepared, hypothesis, x[None])[0]
        noise = np.repeat(coloured(prepared.whitener, rng), prepared.whitener.block, axis=0)
        recordings.append(replace(prepared, measured=expected[: len(noise)] + QUIET * noise))
    return problem.with_fitted(recordings)


def test_efficiencies_are_right_where_constants_would_hide_that_friction_fades(tmp_path):
    problem = planted(tmp_path)
    laws = catalogue(problem.case)
    plain, fading = (
        Hypothesis(laws=(laws[f"gear-load-friction/efficiencies, {name}"],))
        for name in ("bristles", "fading")
    )
    problem = read_from(problem, fading, problem.start(fading, (TRUE,)), seed=3)
    fitter = Fitter(problem, far=10.0)
    fit = fitter.fit(plain, problem.start(plain, (TRUE[:3],)), iterations=15)
    assert np.all(fit.msni < ROOM_FOR_LAWS), "nothing is left to look for"
    search = Search(problem=problem, fitter=fitter, nominal_msni=fit.msni, parameters=fit)
    rich = with_richer_laws(search, fit, laws, set(), lambda _: None)
    assert rich.hypothesis == fading
    simple, found = (problem.values(f.hypothesis, f.x)[1][0] for f in (fit, rich))
    for name, true in zip(("drive_efficiency", "backdrive_efficiency"), TRUE, strict=False):
        assert found[name] == pytest.approx(true, abs=0.008)
        assert abs(simple[name] - true) > 0.008
