"""A wheel's place within its backlash follows from the torque, or predictions average over it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rsea_core.engines.fixed_step.body_steps as b
from rsea_core.effects.known_variants import laws_by_key
from rsea_core.effects.variant import RunConditions, TrialMachine
from rsea_core.engines.fixed_step.replay import Replay
from rsea_core.identify.fitting.problem import Hypothesis, Problem, predict_readings
from rsea_core.identify.result.corrected_model import FoundModel, rest_of
from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import Case, read_test
from rsea_core.recordings.recording import Recording

RIG = Rig.preset("rsea-bench")
K, WIDTH, WHEEL, DRAG = RIG.spring_stiffness_Nm_per_rad, 0.02, 2e-3, 0.03
VALUES = {
    "width_rad": WIDTH,
    "wheel_inertia_kgm2": WHEEL,
    "wheel_damping_Nms_per_rad": DRAG,
    "rebound": 0.0,
}
LAW = laws_by_key()["gear-backlash/play, wheel"]
TIME_s = np.arange(400) / 1000.0


def _recording(torque, motor=0.0):
    still = np.zeros(TIME_s.size)
    read = {"motor_angle_rad": still + motor, "load_angle_rad": still, "torque_Nm": still + torque}
    return Recording(
        file="r.csv", load=Load(kind="locked"), columns={"time_s": TIME_s, "duty": still} | read,
        sample_time_s=1e-3,
    )  # fmt: skip


def _problem(*recordings):
    return Problem(Case(name="made", folder=Path(), rig=RIG, recordings=recordings), step_s=2e-4)


def _replayed(recording):
    problem = _problem(recording)
    hypothesis = Hypothesis(laws=(LAW,))
    x = problem.start(hypothesis, [tuple(VALUES.values())])
    prepared = problem.prepared[0]
    return problem.predict(prepared, hypothesis, x[None])[0][
        :, prepared.channels.index("torque_Nm")
    ]


@pytest.mark.parametrize("torque", [0.4, -0.2])
def test_a_wheel_within_its_backlash_swings_on_the_spring_from_where_the_torque_puts_it(torque):
    """J q'' + c q' + K q = 0 from rest, in closed form."""
    decay = 0.5 * DRAG / WHEEL
    turn = np.sqrt(K / WHEEL - decay**2)
    swing = np.exp(-decay * TIME_s) * (np.cos(turn * TIME_s) + decay / turn * np.sin(turn * TIME_s))
    assert _replayed(_recording(torque)) == pytest.approx(torque * swing, abs=0.02 * abs(torque))


def test_no_torque_puts_a_wheel_beyond_its_backlash():
    most = 0.5 * WIDTH * K
    assert _replayed(_recording(3.0 * most))[0] == pytest.approx(most)


def test_a_spring_deflected_beyond_the_backlash_holds_the_wheel_at_the_flank():
    turned = 0.1  # at the wheel
    torque = _replayed(_recording(-5.0, motor=turned * RIG.gear_ratio))
    assert torque[0] == pytest.approx(K * (turned - 0.5 * WIDTH))


def test_first_torques_say_how_far_from_slack_a_wheel_rests():
    far = 0.006
    places = far * (2.0 * np.arange(40) + 1.0 - 40) / 40
    problem = _problem(*(_recording(K * place) for place in places), _recording(9.0, motor=9.0))
    laws = ((LAW, VALUES),)
    assert rest_of(problem, laws, K) == pytest.approx(far, rel=0.01)
    assert rest_of(problem, (), K) == 0.0
    assert rest_of(_problem(_recording(2.0)), laws, K) == 0.5 * WIDTH
    assert rest_of(_problem(_recording(0.0)), laws, K) == 0.0


def test_a_prediction_is_the_mean_over_the_places_of_the_wheel(tmp_path):
    duty = 0.1 * np.sin(40.0 * TIME_s)
    table = np.column_stack([TIME_s, duty])
    np.savetxt(tmp_path / "input.csv", table, delimiter=",", header="time_s,duty", comments="")
    (tmp_path / "test.toml").write_text('[[recording]]\nfile = "input.csv"\nload = "pendulum"\n')
    (test,) = read_test(tmp_path, RIG)
    slack = FoundModel(rig=RIG, contact={}, laws=((LAW, VALUES),))
    path = tmp_path / "model.toml"
    path.write_text(replace(slack, rest_rad=0.008).to_toml())
    model = FoundModel.from_toml(path)
    assert model.rest_rad == 0.008
    replay = Replay.of(test.inputs)
    base = replay.numbers(ActuatorModel(RIG))
    where = RunConditions(index=-1, file="", kind="pendulum", ratio=RIG.gear_ratio, session_s=0.0,
                          case_rise_K=0.0, time_s=TIME_s)  # fmt: skip
    trial = TrialMachine(plant=base.plant.copy(), fx=base.fx.copy(), stiffness=K)
    LAW.write(VALUES, trial, where)
    many = [
        replace(trial, start_deflection_rad=deflection)
        for deflection in np.linspace(-0.008, 0.008, 401)
    ]
    runs = predict_readings(replay, many, ("torque_Nm",), where)[:, :, 0]
    found = model.predict(test)["torque_Nm"]
    spread = np.std(runs, axis=0)
    assert spread[0] == pytest.approx(0.008 * K / np.sqrt(3.0), rel=0.01)
    assert np.sqrt(np.mean((found - runs.mean(axis=0)) ** 2)) < 0.1 * np.sqrt(np.mean(spread**2))
    alone = slack.predict(test)["torque_Nm"]
    assert np.array_equal(alone, predict_readings(replay, [trial], ("torque_Nm",), where)[0, :, 0])
    assert np.ptp(found - alone) > 0.02


@pytest.mark.parametrize("rebound", [0.0, 0.4, 0.9])
def test_flanks_part_with_a_share_of_the_speed_at_which_they_met(rebound):
    """Newton's law of impact: momentum stays, the speed of approach turns round."""
    front, behind, h, half = 3.0, 1.0, 1e-3, 4e-4  # wide enough not to meet the other flank
    speed, moved, _, speed_behind, moved_behind = b.backlash_step(
        b.Body(front, 0.0, 0.0), b.Body(behind, 0.0, 0.0), b.NO_FRICTION, b.NO_FRICTION, 0.0,
        b.Flanks(half, rebound), (1.0, 0.0, 0.0), h,
    )  # fmt: skip
    assert front * speed + behind * speed_behind == pytest.approx(front * 1.0)
    assert speed - speed_behind == pytest.approx(-rebound, abs=1e-12)
    assert moved - moved_behind == pytest.approx(half - rebound * (h - half), abs=1e-12)
    assert front * moved + behind * moved_behind == pytest.approx(front * h)
