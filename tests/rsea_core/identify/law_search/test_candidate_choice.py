"""What is worth a fit: each effect once, if it stands out, and what one screening hides."""

from dataclasses import replace

import pytest

from rsea_core.effects.gear_friction import GearFriction
from rsea_core.effects.load_friction import LoadFriction
from rsea_core.effects.sensor_delay import SensorDelay
from rsea_core.effects.sensor_noise import SensorNoise
from rsea_core.effects.sensor_offset import SensorOffset
from rsea_core.effects.sensor_scale import SensorScale
from rsea_core.identify.candidates.catalogue import catalogue, of_one_body
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.candidate_choice import promising, standing_out
from rsea_core.identify.law_search.candidate_fits import (
    absent,
    continued_parent,
    fitted,
    gain_of,
    settled,
)
from rsea_core.identify.law_search.found import Found
from rsea_core.identify.law_search.screening import Candidate
from rsea_core.identify.law_search.search import laws_of
from rsea_core.identify.multistep.experiment import DELAY_STEP_ROWS, MultistepProblem
from rsea_core.identify.multistep.horizons import parameters
from rsea_core.identify.multistep.log_nuisances import nuisances
from tests.cases.one_axis import axis_case, axis_recording, axis_rig, pendulum_case


def silent(_):
    """No progress."""


@pytest.fixture(scope="module")
def dry_friction(tmp_path_factory):
    """An axis with dry friction, its parameters fitted, and the laws of its catalogue."""
    recording = axis_recording(LoadFriction(coulomb_Nm=0.05), seed=3)
    case = axis_case(tmp_path_factory.mktemp("axis"), recording, rig=axis_rig())
    problem = MultistepProblem(case)
    estimator, base, horizon = parameters(problem, Hypothesis(laws=nuisances(case)), silent)
    found = Found(problem=problem, base_estimator=estimator, base=base, estimator=estimator,
                  best=base, horizon=horizon)  # fmt: skip
    laws = [law for law in catalogue(case, relative=True).values()
            if law.effect != SensorNoise.effect and not law.follows]  # fmt: skip
    return found, laws


def candidate(law, held_out: float, deviation: float = 1.0) -> Candidate:
    return Candidate(law=law, start=law.starts[0], gain=held_out, held_out=held_out,
                     deviation=deviation, size=1.0)  # fmt: skip


def test_each_effect_stands_out_once_and_what_scatters_does_not(dry_friction):
    _, laws = dry_friction
    friction = [law for law in laws if law.effect == LoadFriction.effect][:2]
    other = next(law for law in laws if law.effect != LoadFriction.effect)
    screened = [candidate(friction[0], 100.0), candidate(friction[1], 90.0)]
    screened.append(candidate(other, 50.0, deviation=40.0))
    assert [c.law.effect for c in standing_out(screened, 1.0)] == [LoadFriction.effect]


def test_friction_stands_out_once_the_parameters_are_fitted(dry_friction):
    choice = promising(*dry_friction, quick=True)
    # a direct drive's gear and load are one body
    assert choice.candidates[0].law.effect in of_one_body(dry_friction[0].problem.case.rig)


def test_laws_that_only_another_screening_shows_are_finished_and_begin_where_they_were_seen(
    dry_friction,
):
    choice = promising(*dry_friction, quick=False)
    shown = {c.law.key for c in standing_out(choice.screened, dry_friction[0].estimator.tempering)}
    assert not choice.apart & shown
    assert choice.apart <= {c.law.key for c in choice.candidates}


def test_a_reading_is_tried_with_the_delay_that_the_fit_gives_the_command(dry_friction):
    found, laws = dry_friction
    at = found.problem.names(found.base.hypothesis).index("drive-delay.delay_s")
    row = found.problem.fitted[0].recording.sample_time_s
    delays = {}
    for rows in (0.0, 1.5):
        x = found.base.x.copy()
        x[at] = rows / DELAY_STEP_ROWS
        fit = replace(found.base, x=x)
        choice = promising(replace(found, base=fit, best=fit), laws, quick=False)
        delays[rows] = [c for c in choice.candidates
                        if c.law.kind is SensorDelay and c.start_values is not None]  # fmt: skip
    assert not any(c.start_values[at] == 0.0 and c.start[0] == 0.0 for c in delays[0.0])
    tried = next(c for c in delays[1.5] if c.start[0] == pytest.approx(1.5 * row))
    assert tried.start_values[at] == 0.0


def test_laws_predict_longer_where_their_horizon_is_the_longer_one(dry_friction):
    found, _ = dry_friction
    for with_laws, without, longer in ((None, 4.0, True), (4.0, 1.0, True), (4.0, 4.0, False),
                                       (None, None, False), (1.0, None, False)):  # fmt: skip
        own = replace(found, horizon=with_laws, base_horizon=without)
        assert own.predicts_longer is longer


def friction_fit(dry_friction):
    found, laws = dry_friction
    law = next(w for w in laws if w.key == "load-friction/coulomb")
    c = candidate(law, 100.0)
    own, fit = settled(found.estimator, fitted(found.estimator, found.best, c), once=True)
    return found, c, own, fit


def test_a_law_with_no_size_moves_no_prediction(dry_friction):
    _, c, own, fit = friction_fit(dry_friction)
    assert not absent(c, own, fit)
    x = fit.x.copy()
    x[-1] = 0.0
    assert absent(c, own, own.fit(fit.hypothesis, x, iterations=0))


def test_a_fit_that_was_stopped_is_continued_and_one_that_converged_is_not(dry_friction):
    found, c, own, fit = friction_fit(dry_friction)
    x = found.best.x.copy()
    x[0] += 3.0  # three tolerances off
    stopped = found.estimator.fit(found.best.hypothesis, x, iterations=0)
    further = continued_parent(stopped, (c, own, fit))
    assert gain_of(further[0], stopped, further[1]) > 4.0
    converged = settled(found.estimator, found.best, once=True)
    again = continued_parent(converged[1], (c, own, fit))
    assert again is None or gain_of(again[0], converged[1], again[1]) < 4.0


def test_one_angle_alone_shows_no_offset_no_factor_and_no_reading_that_is_late(dry_friction):
    """They would be an angle of gravity and a torque constant; which one is late needs two."""
    found, _ = dry_friction
    tracks = found.base_estimator.tracks
    assert all(t.experiment.channels == ("motor_angle_rad",) for t in tracks)
    effects = {law.effect for law in laws_of(found)}
    assert SensorOffset.effect not in effects
    assert SensorDelay.effect not in effects
    assert SensorScale.effect not in effects
    assert LoadFriction.effect in effects or GearFriction.effect in effects


def test_one_angle_of_a_machine_without_a_motor_shows_a_factor(tmp_path):
    """Gravity's period is known, and no torque constant is free."""
    case = pendulum_case(tmp_path, seed=4)
    h = Hypothesis(laws=nuisances(case))
    own, base, horizon = parameters(MultistepProblem(case), h, lambda _: None)
    found = Found(problem=own.problem, base_estimator=own, base=base, estimator=own, best=base,
                  horizon=horizon)  # fmt: skip
    assert SensorScale.effect in {law.effect for law in laws_of(found)}
