"""The study of a drifting force finds it, and its sliding mass agrees with closed forms."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks import emps_structures as study
from benchmarks.real_recordings_drift import Wandering, halves_held_out, wandering
from rsea_core.engines.fixed_step.replay import CHANNELS
from rsea_core.identify.fitting.cross_validation import windowed
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.machine.inputs import Load
from rsea_core.recordings.case import Case
from rsea_core.recordings.recording import Recording
from tests.cases.linear_axis import AXIS, DRAG, FORCE, MASS

ROW_s, ROWS = 2e-3, 4001
FORCES = (0.3, 0.1, -0.1, -0.4)  # of the quarters [N]


def record() -> Recording:
    """An axis whose force is off by `FORCES`, which its command column does not say."""
    t = ROW_s * np.arange(ROWS)
    volts = 0.5 * np.sin(2.0 * np.pi * 0.5 * t)
    r = Recording(
        file="a.csv",
        load=Load(kind="free"),
        columns={"time_s": t, "current_command_A": volts, "load_angle_rad": 0.0 * t},
        sample_time_s=ROW_s,
    )
    off = np.array(FORCES)[np.minimum(np.arange(ROWS) * 4 // ROWS, 3)]
    pushed = Recording(
        file="a.csv",
        load=Load(kind="free"),
        columns=r.columns | {"current_command_A": volts + off / FORCE},
        sample_time_s=ROW_s,
    )
    prepared = Problem(Case(name="c", folder=Path(), rig=AXIS, recordings=(pushed,))).prepared[0]
    y = prepared.replay.run_many([prepared.base])[0, :, CHANNELS.index("load_angle_rad")]
    return Recording(
        file="a.csv",
        load=Load(kind="free"),
        columns=r.columns | {"load_angle_rad": 1e-7 * np.round(y / 1e-7)},
        sample_time_s=ROW_s,
    )


@pytest.fixture(scope="module")
def problem():
    whole = Problem(Case(name="c", folder=Path(), rig=AXIS, recordings=(record(),)))
    return windowed(whole, 0.5)


def test_the_force_of_each_quarter_is_found(problem):
    plain = Hypothesis()
    found = wandering(problem, problem.cuts["a.csv"], plain, problem.start(plain))
    assert found.forces == pytest.approx(FORCES, abs=0.02)


def test_a_free_run_answers_a_constant_force_as_mass_and_drag_do(problem):
    plain = Hypothesis()
    found = wandering(problem, problem.cuts["a.csv"], plain, problem.start(plain))
    t, decay = ROW_s * np.arange(ROWS), MASS / DRAG
    answer = (t - decay * (1.0 - np.exp(-t / decay))) / DRAG
    assert found.per_force == pytest.approx(np.sqrt(np.mean(answer**2)), rel=1e-3)


def test_a_half_is_missed_by_the_answer_to_its_constant_forces(problem):
    """No value of the machine makes up for a constant force: the run drifts by the answer to it."""
    plain = Hypothesis()
    found = halves_held_out(problem, plain, problem.start(plain))
    kept, expected = np.exp(-ROW_s * DRAG / MASS), []
    for forces in (FORCES[2:], FORCES[:2]):  # the second half is held out first
        place, speed, far_from_prior = 0.0, 0.0, []
        for force in np.repeat(forces, ROWS // 4):
            settled = force / DRAG
            place += settled * ROW_s + (speed - settled) * (1.0 - kept) * MASS / DRAG
            speed = settled + (speed - settled) * kept
            far_from_prior.append(place)
        expected.append(np.sqrt(np.mean(np.square(far_from_prior))))
    assert found == pytest.approx(expected, rel=0.2)
    assert np.all(problem.used["a.csv"])


def test_the_chance_of_a_small_error_is_that_of_a_normal_force():
    w = Wandering(forces=np.array([-1.0, 1.0]) / np.sqrt(2.0), per_force=2.0)
    assert w.rms == pytest.approx(2.0)
    assert w.chance(w.rms) == pytest.approx(0.6827, abs=1e-4)
    assert w.chance(w.median) == pytest.approx(0.5, abs=1e-4)


def test_a_sliding_mass_stops_where_drag_and_dry_friction_stop_it():
    """x = m/b (v - F/b ln(1 + b v / F)), and there it stays."""
    p, speed, dry = study.nominal(), 0.12, 20.0
    p[study.FORWARD], p[study.VISCOUS_F], p[study.MASS] = dry, DRAG, MASS
    y = study.run(p, np.zeros(1001), 0.0, speed, 0, 1000)
    stops = MASS / DRAG * (speed - dry / DRAG * np.log(1.0 + DRAG * speed / dry))
    assert y[-1] == pytest.approx(stops, rel=1e-4)
    assert y[-1] == y[-100]


def test_preload_over_the_travel_does_the_same_work_in_both_directions():
    """A friction with its sign takes the same work forth and back; a force of the place none."""
    p = np.zeros(study.VALUES)
    x = np.linspace(0.0, study.TRAVEL_m, 2001)
    for first, work in ((study.PRELOAD, 2.0), (study.PLACE, 0.0)):
        p[:] = 0.0
        p[first : first + study.ORDERS] = 0.7, -0.4, 0.2, 1.0
        forth, back = (
            np.array([study.friction(p, place, direction * 0.05, 0.5, direction) for place in x])
            for direction in (1.0, -1.0)
        )
        forwards = np.sum(0.5 * (forth[1:] + forth[:-1]) * np.diff(x))
        round_trip = forwards - np.sum(0.5 * (back[1:] + back[:-1]) * np.diff(x))
        assert round_trip == pytest.approx(work * forwards, abs=1e-12)
