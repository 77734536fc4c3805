"""The cogging of a linear motor has a pitch that no rig file states: the travel shows it."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.effects.motor_cogging import MotorCogging, linear_motor_cogging
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.candidates.sentences import effect_text
from rsea_core.identify.candidates.typical_magnitudes import own_magnitudes
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.candidate_choice import promising
from rsea_core.identify.law_search.candidate_fits import fitted
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.law_search.order_analysis import along_motion
from rsea_core.identify.law_search.screening import Projection, screen
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.horizons import parameters
from rsea_core.identify.multistep.log_nuisances import nuisances
from tests.cases.one_axis import axis_case, axis_recording, axis_rig

LINEAR = replace(axis_rig(), axis="linear")


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """An axis of 0.02 kg (written as kg m2) that a motor of a pitch of 2 pi / 7.3 m drives."""
    cogging = MotorCogging(amplitude_Nm=0.05, cycles_per_rev=7.3, phase_rad=0.4)
    folder = tmp_path_factory.mktemp("linear")
    return axis_case(folder, axis_recording(cogging, seed=1), rig=LINEAR)


def test_only_a_linear_motor_without_a_gear_has_a_free_pitch(case):
    def laws_of(rig):
        return {law.law for law in catalogue(replace(case, rig=rig), relative=True).values()
                if law.effect == "motor-cogging"}  # fmt: skip

    assert laws_of(LINEAR) == {"free pitch", "free pitch, two waves"}
    assert "free pitch" not in laws_of(axis_rig())
    assert "free pitch" not in laws_of(replace(LINEAR, gear_ratio=300.0))  # a screw


def test_starts_are_half_a_wave_apart_in_the_travel(case):
    typical = own_magnitudes(case)
    wave_numbers = np.array([start[2] for start in linear_motor_cogging(typical)[0].starts])
    travel = 3.0 * typical.widest_angle_rad
    assert np.diff(wave_numbers) == pytest.approx(np.pi / travel, rel=1e-9)


def test_the_travel_is_that_of_the_widest_recording(case):
    """Of a stage with moves and a fast multisine, waves were sought that the moves pass 8 times."""
    (wide,) = case.recordings
    rows = 10 * np.arange(wide.rows) % wide.rows
    angle = 0.2 * wide["motor_angle_rad"][rows]
    fast = replace(wide, file="fast.csv", columns={**wide.columns, "motor_angle_rad": angle})
    both = own_magnitudes(replace(case, recordings=(wide, fast)))
    alone = own_magnitudes(case)
    assert both.angle_rad < 0.3 * alone.angle_rad
    assert both.cycle_of_travel == alone.cycle_of_travel


def test_the_second_wave_has_half_the_pitch_of_the_first(case):
    law = linear_motor_cogging(own_magnitudes(case))[1]
    values = dict(zip([p.name for p in law.unknowns], (0.3, 0.4, 7.0, 0.0, 0.1), strict=True))
    found = law.parameters(values, LINEAR)
    assert found["amplitude_Nm"] == pytest.approx(0.5)
    assert found["cycles_2_per_rev"] == 14.0
    assert found["amplitude_2_Nm"] == pytest.approx(0.1)


def test_the_pitch_is_found(case):
    problem = MultistepProblem(case)
    own, base, _ = parameters(problem, Hypothesis(laws=nuisances(case)), lambda text: None)
    law = catalogue(problem.case, relative=True)["motor-cogging/free pitch"]
    fit = fitted(own, base, along_motion(Projection(own, base), [law])[0])
    values = problem.values(fit.hypothesis, fit.x)[1][-1]
    assert values["cycles_per_rev"] == pytest.approx(7.3, rel=0.01)
    assert np.hypot(values["sin_Nm"], values["cos_Nm"]) == pytest.approx(0.05, rel=0.1)


def test_a_strong_wave_is_found_along_the_recorded_motion_and_not_by_the_simulated_one(tmp_path):
    """The simulated angle leaves the recorded one by waves within a window."""
    cogging = MotorCogging(amplitude_Nm=0.3, cycles_per_rev=20.0, phase_rad=0.4)
    strong = axis_case(tmp_path, axis_recording(cogging, seed=1), rig=LINEAR)
    own, base, horizon = parameters(
        MultistepProblem(strong), Hypothesis(laws=nuisances(strong)), lambda text: None
    )
    found = Found(problem=own.problem, base_estimator=own, base=base, estimator=own, best=base,
                  horizon=horizon)  # fmt: skip
    law = catalogue(strong, relative=True)["motor-cogging/free pitch"]
    by_engine = screen(own, base, [replace(law, follows=False)])[0]
    (candidate,) = [c for c in promising(found, [law], quick=True).candidates if c.law is law]
    assert candidate.held_out > 10.0 * by_engine.held_out
    sine, cosine, cycles = candidate.start
    assert cycles == pytest.approx(20.0, rel=0.02)
    assert np.hypot(sine, cosine) == pytest.approx(0.3, rel=0.2)


def test_the_sentence_states_the_pitch_in_millimetres():
    figures = {"amplitude_Nm": 3.0, "cycles_per_rev": 2.0 * np.pi / 0.03}
    text = effect_text("motor-cogging", "gear", figures, linear=True)
    assert "3 N" in text
    assert "every 30 mm" in text
