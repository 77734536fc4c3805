"""Readings that cannot come from one machine are named, and missing physics is not."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rsea_core.engines.fixed_step.replay import CHANNELS, Replay
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import Case
from rsea_core.recordings.consistency_checks import inconsistencies, zeros_and_jumps
from rsea_core.recordings.finding import Kind, sentences
from rsea_core.recordings.initial_speed import initial_motion
from rsea_core.recordings.quality_checks import data_errors, data_warnings
from rsea_core.recordings.recording import Recording
from rsea_core.recordings.sample_faults import jumps, longest_constant_run

RIG = replace(Rig.preset("rsea-bench"), torque_sensor_noise_Nm=0.02, current_sensor_noise_A=0.005)
ROWS, ROW_s = 4000, 0.001


def recorded(kind: str = "pendulum", **changes) -> Recording:
    """A sine of the duty on the nominal machine, with noisy sensors; changed columns on top."""
    t = ROW_s * np.arange(ROWS)
    duty = 0.25 * np.sin(2.0 * np.pi * 0.5 * t)
    replay = Replay.of(Inputs(time_s=t, duty=duty, load=Load(kind=kind)))
    run = replay.run_many([replay.numbers(ActuatorModel(RIG))])[0]
    rng = np.random.default_rng(5)
    read = {name: run[:, CHANNELS.index(name)].copy() for name in CHANNELS}
    columns = {
        "time_s": t,
        "duty": duty,
        "motor_angle_rad": read["motor_angle_rad"],
        "load_angle_rad": read["load_angle_rad"],
        "current_A": read["current_A"] + 0.005 * rng.standard_normal(ROWS),
        "torque_Nm": read["torque_Nm"] + 0.02 * rng.standard_normal(ROWS),
    }
    for name, change in changes.items():
        columns[name] = change(columns[name])
    return Recording(file="a.csv", load=Load(kind=kind), columns=columns, sample_time_s=ROW_s)


def dies(values: np.ndarray) -> np.ndarray:
    values = values.copy()
    values[ROWS // 2 :] = values[ROWS // 2]
    return values


def at(row: int, by: float):
    return lambda values: values + by * (np.arange(ROWS) == row)


@pytest.mark.parametrize("kind", ["pendulum", "locked"])
def test_a_machine_as_its_rig_file_says_does_not_contradict_itself(kind):
    r = recorded(kind)
    assert [*inconsistencies(RIG, r), *zeros_and_jumps(RIG, r)] == []


@pytest.mark.parametrize("kind", ["pendulum", "locked"])
def test_physics_that_is_missing_is_no_inconsistency(kind):
    weak = replace(
        RIG,
        spring_stiffness_Nm_per_rad=1.5 * RIG.spring_stiffness_Nm_per_rad,
        terminal_resistance_ohm=0.7 * RIG.terminal_resistance_ohm,
    )
    r = recorded(kind, torque_Nm=lambda v: v + 0.3 * np.sign(np.gradient(v)))
    assert [*inconsistencies(weak, r), *zeros_and_jumps(weak, r)] == []


WRONG = {
    "load sign": ("pendulum", {"load_angle_rad": np.negative}, "load_angle_rad runs against"),
    "motor sign": ("locked", {"motor_angle_rad": np.negative}, "torque_Nm runs against"),
    "torque sign": ("locked", {"torque_Nm": np.negative}, "torque_Nm runs against"),
    "current sign": ("locked", {"current_A": np.negative}, "current_A runs against"),
    "command sign": ("locked", {"duty": np.negative}, "wrong sign"),
    "degrees": ("pendulum", {"load_angle_rad": np.rad2deg}, "is 5[678].*degrees in one"),
    "turns": ("pendulum", {"motor_angle_rad": lambda v: v / (2 * np.pi)}, "turns in one"),
    "milliamperes": ("locked", {"current_A": lambda v: 1e3 * v}, "current_A is .* thousandth"),
    "counts": (
        "pendulum",
        {"load_angle_rad": lambda v: v * RIG.load_encoder_counts_per_rev / (2 * np.pi)},
        "encoder counts in one",
    ),
    "kiloamperes": ("locked", {"current_A": lambda v: 1e-3 * v}, "current_A is .* thousandth"),
    "percent": ("pendulum", {"duty": lambda v: 1e-2 * v}, "hundredth|times the speed"),
    "thousandths": (
        "pendulum",
        {"motor_angle_rad": lambda v: 1e-3 * v},
        "is 99.* times .* thousandth",
    ),
    "dead torque": ("locked", {"torque_Nm": lambda v: 0.0 * v}, "torque_Nm never moves"),
    "dying torque": ("locked", {"torque_Nm": dies}, "torque_Nm stands still from 2 to"),
    "dying motor": ("locked", {"motor_angle_rad": dies}, "motor_angle_rad stands still from 2 "),
    "dying current": ("locked", {"current_A": dies}, "current_A stands still from 2 to"),
    "dead load": ("pendulum", {"load_angle_rad": lambda v: 0.0 * v}, "load_angle_rad never moves"),
    "held load": (
        "pendulum",
        {"load_angle_rad": lambda v: 8e-4 * (np.arange(v.size) == 3)},  # a count, once
        'load_angle_rad stands still.*needs load = "locked"',
    ),
    "wrap": (
        "pendulum",
        {"motor_angle_rad": lambda v: (v + np.pi) % (2 * np.pi) - np.pi},
        "motor_angle_rad jumps by 6.2.*wraps",
    ),
    "spike": ("pendulum", {"torque_Nm": at(1000, 30.0)}, "torque_Nm: spike of .* at 1 s"),
}


@pytest.mark.parametrize("what", WRONG)
def test_a_wrong_sign_unit_or_sensor_is_reported_with_its_column(what):
    kind, changes, message = WRONG[what]
    r = recorded(kind, **changes)
    found = [*inconsistencies(RIG, r), *zeros_and_jumps(RIG, r)]
    assert {f.file for f in found} == {"a.csv"}
    assert any(re.search(message, f.sentence()) for f in found), found
    case = Case(name="c", folder=Path(), rig=RIG, recordings=(r,))
    assert set(found) <= set(data_warnings(case))
    assert set(found) <= set(data_errors(case))


def released(*, step_rad: float = 0.0, rows: int = 1) -> Recording:
    """An oscillation of 27 rows a cycle from rest, which soon decays; a step within some rows."""
    t = ROW_s * np.arange(ROWS)
    count, decay, rate = 1e-4, 12.0, 2.0 * np.pi * 37.0
    cycles = np.cos(rate * t) + decay / rate * np.sin(rate * t)
    angle = 0.1 * np.exp(-decay * t) * cycles + step_rad * np.clip(
        (t - 3.0) / (rows * ROW_s), 0.0, 1.0
    )
    return Recording(
        file="a.csv", load=Load(kind="pendulum"), sample_time_s=ROW_s,
        columns={"time_s": t, "duty": 0.0 * t, "load_angle_rad": count * np.round(angle / count)},
    )  # fmt: skip


def test_a_fast_oscillation_that_decays_neither_jumps_nor_begins_in_motion():
    r = released()
    assert jumps(r, "load_angle_rad", 1e-4 / np.sqrt(12.0)) == []
    assert initial_motion(r, "load_angle_rad", 1e-4 / np.sqrt(12.0)) is None


@pytest.mark.parametrize("rows", [1, 2])
def test_a_step_after_the_oscillation_has_decayed_is_a_jump(rows):
    r = released(step_rad=0.04, rows=rows)
    (found,) = jumps(r, "load_angle_rad", 1e-4 / np.sqrt(12.0))
    assert f"jumps by {0.04 / rows:g} rad at 3.001 s" in found.text


@pytest.mark.parametrize("factor", [60.0, 10.0])
def test_a_clock_that_the_winding_contradicts_is_reported(factor):
    r = recorded()
    slow = replace(
        r, columns={**r.columns, "time_s": factor * r.time_s}, sample_time_s=factor * ROW_s
    )
    (found,) = inconsistencies(RIG, slow)
    share = float(re.search(r"shows (\S+) times the speed", found.text).group(1))
    assert share == pytest.approx(factor, rel=0.1)


def test_a_wrap_is_the_cause_and_what_follows_from_it_is_not_reported():
    wrapped = recorded(motor_angle_rad=lambda v: v % (2.0 * np.pi))
    found = inconsistencies(RIG, wrapped)
    assert {(f.kind, f.column) for f in found} == {(Kind.WRAP, "motor_angle_rad")}
    assert zeros_and_jumps(RIG, wrapped) == []


def test_units_come_before_what_follows_from_them():
    held = replace(recorded("locked", load_angle_rad=at(500, 1.0)), file="held.csv")
    free = replace(recorded(load_angle_rad=lambda v: 1e3 * v), file="free.csv")
    case = Case(name="c", folder=Path(), rig=RIG, recordings=(held, free))
    first, *rest = data_errors(case)
    assert (first.kind, first.file, first.column) == (Kind.UNIT, "free.csv", "load_angle_rad")
    spike = (Kind.SPIKE, "held.csv", "load_angle_rad")
    assert spike in [(f.kind, f.file, f.column) for f in rest]


@pytest.mark.parametrize("name", ["motor_angle_rad", "load_angle_rad"])
def test_an_angle_that_is_cut_off_is_reported_and_one_that_turns_back_is_not(name):
    r = recorded()
    top = 0.6 * float(np.max(r[name]))
    case = Case(name="c", folder=Path(), rig=RIG, recordings=(r,))
    assert Kind.CLIPPED not in {f.kind for f in data_warnings(case)}
    cut = replace(r, columns={**r.columns, name: np.minimum(r[name], top)})
    case = replace(case, recordings=(cut,))
    first = data_errors(case)[0]
    assert (first.kind, first.column) == (Kind.CLIPPED, name)
    assert f"{name} is clipped at {top:.5g}" in first.text


def test_a_logged_velocity_shows_that_an_angle_is_dead_or_of_another_unit():
    r = recorded("free")
    speed = np.gradient(r["load_angle_rad"], ROW_s)
    right = replace(r, columns={**r.columns, "load_velocity_rad_per_s": speed})
    assert inconsistencies(RIG, right) == []
    held = {**r.columns, "load_angle_rad": np.zeros(ROWS), "load_velocity_rad_per_s": speed}
    found = sentences(inconsistencies(RIG, replace(r, columns=held)))
    assert any("load_velocity_rad_per_s moves although" in text for text in found)


def test_the_windings_current_is_compared_by_whatever_column_shows_the_motors_speed():
    r = recorded("free")
    ratio = RIG.gear_ratio
    speed = {"motor_velocity_rad_per_s": np.gradient(r["motor_angle_rad"], ROW_s)}
    others = ({"load_angle_rad": r["load_angle_rad"]},
              {"load_velocity_rad_per_s": speed["motor_velocity_rad_per_s"] / ratio})  # fmt: skip
    kept = {name: r[name] for name in ("time_s", "duty", "current_A")}
    for read in (speed, *others):
        assert inconsistencies(RIG, replace(r, columns=kept | read)) == []
        wrong = kept | read | {"current_A": -r["current_A"]}
        found = sentences(inconsistencies(RIG, replace(r, columns=wrong)))
        assert any("current_A runs against" in text for text in found)
    # nothing shows how fast it turns: a back-EMF of unknown size proves nothing
    unseen = replace(r, columns=kept | {"current_A": 0.1 * r["current_A"]})
    assert inconsistencies(RIG, unseen) == []


@pytest.mark.parametrize(
    ("measured", "phrase"),
    [
        (lambda i: i, None),
        (lambda i: np.clip(i, -0.1, 0.1), None),  # a limit that the rig file does not know
        (lambda i: 1.2 * i + 0.3, None),
        (lambda i: -i, "current_A runs against current_command_A"),
        (lambda i: 1000.0 * i, "current_A is 1000 times current_command_A"),
        (lambda i: 0.001 * i, "current_A is 0.001 times current_command_A"),
        (lambda i: 0.0 * i, "current_A never moves although current_command_A does"),
    ],
)
def test_a_current_is_compared_with_the_one_that_was_commanded(measured, phrase):
    r = recorded("free")
    command = np.sin(np.pi * r.time_s)
    columns = {"time_s": r.time_s, "current_command_A": command, "current_A": measured(command),
               "motor_angle_rad": r["motor_angle_rad"]}  # fmt: skip
    rig = replace(RIG, current_sensor_noise_A=1e-6)
    texts = sentences(inconsistencies(rig, replace(r, columns=columns)))
    assert not texts if phrase is None else any(phrase in text for text in texts)
    open_bridge = columns | {"drive_enabled": 0.0 * command}
    disabled = sentences(inconsistencies(rig, replace(r, columns=open_bridge)))
    assert not any("current_command_A" in text for text in disabled)


def test_a_motor_that_starts_without_a_command_was_driven():
    rest = np.maximum(np.arange(ROWS) - 100, 0)
    r = recorded(duty=lambda v: 0.0 * v, motor_angle_rad=lambda v: v[rest])
    still = replace(r, columns={**r.columns, "motor_angle_rad": np.zeros(ROWS)})
    case = Case(name="c", folder=Path(), rig=RIG, recordings=(r,))
    assert any("the motor of a.csv starts from rest" in f.text for f in data_errors(case))
    at_rest = data_errors(replace(case, recordings=(still,)))
    assert Kind.NO_COMMAND not in {f.kind for f in at_rest}


def test_a_copied_recording_and_a_command_that_was_not_logged_are_reported():
    first = recorded(duty=lambda v: 0.0 * v)
    second = replace(first, file="b.csv", role="validation")
    case = Case(name="c", folder=Path(), rig=RIG, recordings=(first, second))
    reported = " ".join(sentences(data_warnings(case)))
    assert "b.csv has the same readings as a.csv" in reported
    assert "duty is 0 in all 2 recordings" in reported


def test_the_longest_run_of_one_value():
    assert longest_constant_run(np.array([1.0, 1.0, 2.0, 2.0, 2.0, 3.0])) == (2, 5)
    assert longest_constant_run(np.array([4.0, 4.0])) == (0, 2)
