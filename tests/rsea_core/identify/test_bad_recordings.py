"""Recordings that no replay can match end in one line, odd machines in a verdict."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rsea_core.errors import RecordingError, RigError
from rsea_core.identify.diagnose import diagnose
from rsea_core.identify.fitting.periodic_regressors import periodic_columns, torque_columns
from rsea_core.identify.fitting.problem import Hypothesis, Problem, require_replays
from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig
from rsea_core.recordings.case import Case
from rsea_core.recordings.recording import Recording

RIG = Rig.preset("rsea-bench")


def problem(rows: int, *names: str, rig: Rig = RIG, kind: str = "locked") -> Problem:
    t = 0.001 * np.arange(rows)
    columns = {"time_s": t, "duty": 0.1 * np.sin(6.0 * t)}
    columns |= {name: 0.01 * np.sin(6.0 * t) for name in names}
    r = Recording(file="a.csv", load=Load(kind=kind), columns=columns, sample_time_s=0.001)
    return Problem(Case(name="c", folder=Path(), rig=rig, recordings=(r,)))


@pytest.mark.parametrize("rows", [3, 10, 19])
def test_a_recording_shorter_than_the_whitener_is_refused_in_one_line(rows):
    with pytest.raises(RecordingError, match=rf"a\.csv: too short: {rows} rows in 0\.0") as caught:
        problem(rows, "motor_angle_rad")
    assert "\n" not in str(caught.value)


def test_logged_velocities_alone_are_refused_with_what_is_needed():
    with pytest.raises(RecordingError, match=r"a\.csv: no column that a replay predicts.*angle"):
        problem(400, "motor_velocity_rad_per_s", "load_velocity_rad_per_s")


def test_a_torque_on_a_wheel_that_is_held_moves_nothing():
    parts = ("drive", "gear", "load")
    rigid = Rig.from_tables(
        {
            "rig": {
                "name": "r", "parts": list(parts), "supply_voltage_V": 48.0, "gear_ratio": 60.0,
                "terminal_resistance_ohm": 3.8, "torque_constant_Nm_per_A": 0.3,
                "back_emf_constant_Vs_per_rad": 0.3, "motor_inertia_kgm2": 3.2e-4,
                "load_inertia_kgm2": 0.03,
            }
        },
        where="test",
    )  # fmt: skip
    held = problem(400, "motor_angle_rad", "current_A", rig=rigid)
    (prepared,) = held.prepared
    found = torque_columns(
        prepared, 0.0, periodic_columns(prepared.recording["motor_angle_rad"], [1]), "G"
    )
    assert found.shape == (
        2,
        *held.innovations(Hypothesis(), held.start(Hypothesis())[None])[0].shape[1:],
    )
    assert np.all(found == 0.0)


def test_damping_that_the_rig_file_leaves_out_is_unknown_and_free():
    unknown = Rig(**(vars(RIG) | {"load_viscous_Nms_per_rad": None}))
    none = Rig(**(vars(RIG) | {"load_viscous_Nms_per_rad": 0.0}))
    freed = {}
    for name, rig in (("unknown", unknown), ("none", none)):
        case = problem(400, "motor_angle_rad", rig=rig, kind="pendulum")
        freed[name] = {n.key: n for n in case.nominals}["load_viscous_Nms_per_rad"]
    assert all(n.value == 0.0 and n.additive for n in freed.values())
    assert freed["unknown"].tolerance > freed["none"].tolerance > 0.0


def test_recordings_that_last_twenty_rows_tell_nothing_whatever_fits_them():
    rows = 20
    t = 0.001 * np.arange(rows)
    columns = {"time_s": t, "duty": np.zeros(rows), "motor_angle_rad": 4.0 * t}
    columns |= {"load_angle_rad": np.zeros(rows), "torque_Nm": 3.0 + 90.0 * t}
    r = Recording(file="a.csv", columns=columns, sample_time_s=0.001)
    case = Case(name="c", folder=Path(), rig=RIG, recordings=(r,))
    document = diagnose(case, quick=True).document
    assert document["verdict"] == "insufficient-data"
    assert "too short for any conclusion: the longest, a.csv, has 20 rows" in document["summary"]
    assert all(e["confidence"] < 0.5 for e in document["effects"])


def test_a_spring_out_by_a_thousand_is_replayed_in_steps_that_it_bears():
    stiff = Rig(**(vars(RIG) | {"spring_stiffness_Nm_per_rad": 6.58e4}))
    t = 0.002 * np.arange(1500)
    columns = {"time_s": t, "duty": 0.2 * np.sign(np.sin(9.0 * t))}
    columns |= {"motor_angle_rad": np.sin(9.0 * t), "load_angle_rad": np.zeros(1500)}
    r = Recording(file="a.csv", columns=columns, sample_time_s=0.002)
    case = Case(name="c", folder=Path(), rig=stiff, recordings=(r,))
    built = Problem(case, step_s=0.002)
    (found,) = built.innovations(Hypothesis(), built.start(Hypothesis())[None])
    assert np.all(np.isfinite(found))


def test_a_machine_that_leaves_the_range_of_numbers_is_refused_in_one_line():
    built = problem(400, "motor_angle_rad")
    require_replays(built, np.array([3.0]))
    with pytest.raises(RecordingError, match=r"a\.csv, leaves the range of numbers") as caught:
        require_replays(built, np.array([np.nan]))
    assert "\n" not in str(caught.value)


def test_what_a_recording_asks_of_the_rig_names_the_recording():
    with pytest.raises(RigError, match=r"a\.csv: rig .* needs load_distance_m in \[rig\]"):
        problem(400, "motor_angle_rad", rig=replace(RIG, load_distance_m=None), kind="pendulum")
