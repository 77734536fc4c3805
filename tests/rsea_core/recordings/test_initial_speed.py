"""A recording that begins in motion is replayed from the speed of its first row."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rsea_core.engines.fixed_step.replay import CHANNELS, Replay
from rsea_core.errors import InputError
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import Case
from rsea_core.recordings.finding import sentences
from rsea_core.recordings.initial_speed import first_speed, start_speeds
from rsea_core.recordings.quality_checks import data_warnings
from rsea_core.recordings.recording import Recording
from tests.cases.linear_axis import AXIS, DRAG, FORCE, MASS

ROW_s, ROWS = 1e-3, 3000


def coasting(t, speed, command):
    """Position of a mass with viscous drag under a constant force, closed form."""
    settled, decay = FORCE * command / DRAG, MASS / DRAG
    return settled * t + (speed - settled) * decay * (1.0 - np.exp(-t / decay))


def recorded(speed: float, *, rest: bool, command: float = 0.3) -> Recording:
    t = ROW_s * np.arange(ROWS)
    columns = {
        "time_s": t,
        "current_command_A": np.full(ROWS, command),
        "load_angle_rad": 1e-7 * np.round(coasting(t, speed, command) / 1e-7),
    }
    return Recording(
        file="a.csv",
        load=Load(kind="free"),
        columns=columns,
        sample_time_s=ROW_s,
        initial_rest=rest,
    )


def case(r: Recording) -> Case:
    return Case(name="c", folder=Path(), rig=AXIS, recordings=(r,))


def left(r: Recording) -> float:
    """Largest error of the nominal machine's free run [m]."""
    problem, plain = Problem(case(r)), Hypothesis()
    prepared = problem.prepared[0]
    y = problem.predict(prepared, plain, problem.start(plain)[None])[0]
    return float(np.max(np.abs(y - prepared.measured)))


@pytest.mark.parametrize("speed", [0.0, -0.3, 2.0])
def test_a_parabola_gives_its_speed_exactly(speed):
    t = ROW_s * np.arange(200)
    found = first_speed(0.7 + speed * t + 4.0 * t * t, ROW_s, 1e-9)
    assert found.speed == pytest.approx(speed, abs=1e-6)


def test_a_long_parabola_is_left_where_the_motion_bends():
    t = ROW_s * np.arange(300)
    angle = 0.05 * np.sin(2 * np.pi * 5.0 * t)  # turns twice within the longest parabola
    found = first_speed(angle, ROW_s, 1e-6)
    assert found.speed == pytest.approx(0.05 * 2 * np.pi * 5.0, rel=0.02)


def test_the_stated_deviation_is_that_of_repeated_readings():
    t, rng = ROW_s * np.arange(300), np.random.default_rng(2)
    found = [
        first_speed(0.4 * t + 1e-3 * rng.standard_normal(300), ROW_s, 1e-3) for _ in range(300)
    ]
    off = np.array([(f.speed - 0.4) / f.std for f in found])
    assert 0.7 < np.sqrt(np.mean(off**2)) < 1.5


def test_too_few_rows_are_refused():
    with pytest.raises(ValueError, match="4 rows"):
        first_speed(np.zeros(3), ROW_s, 1e-6)


def test_the_side_that_is_not_read_turns_with_the_other():
    motor, load = start_speeds(recorded(0.02, rest=False), 60.0, {"load_angle_rad": 1e-7})
    assert load.speed == pytest.approx(0.02, rel=0.01)
    assert motor.speed == pytest.approx(60.0 * load.speed)


def test_a_start_in_motion_is_replayed_from_its_speed():
    """A coasting mass goes on by speed times time constant: 9.5 mm at 20 mm/s."""
    assert left(recorded(0.02, rest=False)) < 1e-4
    assert left(recorded(0.02, rest=True)) == pytest.approx(0.02 * MASS / DRAG, rel=0.01)


def test_gear_spring_and_load_that_turn_together_keep_turning():
    """Without drag and drive nothing changes: 0.5 rad/s of the load, 30 rad/s of the motor."""
    rig = Rig(
        name="whole",
        gear_ratio=60.0,
        torque_constant_Nm_per_A=0.3,
        current_limit_A=6.0,
        motor_inertia_kgm2=3e-4,
        output_inertia_kgm2=2e-3,
        spring_stiffness_Nm_per_rad=65.0,
        load_inertia_kgm2=0.03,
    )
    t = ROW_s * np.arange(500)
    replay = Replay(
        time_s=t,
        command_name="current_command_A",
        command=0.0 * t,
        load=Load(kind="free"),
        initial_speeds_rad_per_s=(30.0, 0.5),
    )
    y = replay.run(ActuatorModel(rig))
    assert y[:, CHANNELS.index("load_angle_rad")] == pytest.approx(0.5 * t, abs=1e-9)
    assert y[:, CHANNELS.index("motor_angle_rad")] == pytest.approx(30.0 * t, abs=1e-7)


def test_a_start_speed_that_is_no_number_is_refused():
    with pytest.raises(InputError, match="initial speeds"):
        Replay(time_s=[0.0, 0.1], initial_speeds_rad_per_s=(np.nan, 0.0))


def test_a_start_at_rest_is_replayed_as_before():
    at_rest, free = (left(recorded(0.0, rest=rest)) for rest in (True, False))
    assert at_rest < 1e-5
    assert free < 1e-4


def test_a_start_in_motion_that_is_called_rest_is_reported():
    assert "initial_rest = false" in " ".join(
        sentences(data_warnings(case(recorded(0.02, rest=True))))
    )
    assert not data_warnings(case(recorded(0.02, rest=False)))
    assert not data_warnings(case(recorded(0.0, rest=True, command=3.0)))


def test_a_start_in_motion_does_not_stand_out_of_the_noise_of_the_filter():
    """Innovations of a start whose speed was estimated are as small as those after it."""
    problem, plain = Problem(case(recorded(0.02, rest=False))), Hypothesis()
    innovations = problem.innovations_of([(plain, problem.start(plain))])[0][0]
    first, rest = innovations[:20], innovations[20:]
    assert np.sqrt(np.mean(first**2)) < 3.0 * max(np.sqrt(np.mean(rest**2)), 1.0)


def test_a_drive_that_comes_on_at_the_first_row_is_not_called_moving():
    r = recorded(0.0, rest=True, command=9.0)
    coarse = replace(
        r, columns=r.columns | {"load_angle_rad": 1e-5 * np.round(r["load_angle_rad"] / 1e-5)}
    )
    assert "already moves" not in " ".join(sentences(data_warnings(case(coarse))))
