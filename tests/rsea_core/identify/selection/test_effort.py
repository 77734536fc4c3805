"""Work that a diagnosis saves changes no answer."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rsea_core.effects.load_disturbance import disturbance
from rsea_core.effects.registry import GearFriction
from rsea_core.engines.fixed_step.replay import Replay
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.fitting.decimation import decimate
from rsea_core.identify.fitting.least_squares import Fitter, broyden_update
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.locate.pulse_detection import CELL_s, disturbances
from rsea_core.identify.selection import starting_points as search_starts
from rsea_core.identify.selection.criteria import CLOSE, FULL, QUICK, TEMPERATURE, Search
from rsea_core.identify.selection.refits import finish, with_richer_laws
from rsea_core.machine.inputs import Inputs
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import Case
from rsea_core.recordings.recording import Recording
from tests.cases.planted import RIG, planted

MODEL = ActuatorModel(RIG)


def fine(rows: int = 4001, **more) -> Recording:
    """A simulated recording at 1 kHz whose duty changes every row."""
    t = 0.001 * np.arange(rows)
    duty = 0.08 * np.sin(2 * np.pi * 1.1 * t) + 0.02 * np.sin(2 * np.pi * 40.0 * t)
    out = Replay.of(Inputs(time_s=t, duty=duty)).run(MODEL)
    columns = {"time_s": t, "duty": duty, "motor_angle_rad": out[:, 0], "load_angle_rad": out[:, 1]}
    return Recording(file="fine.csv", columns=columns | more, sample_time_s=0.001)


def case_of(recording: Recording) -> Case:
    return Case(name="fine", folder=".", rig=RIG, recordings=(recording,))


def test_a_decimated_recording_drives_the_machine_as_the_whole_one_does():
    (thin,) = decimate(case_of(fine()), 0.002).recordings
    assert thin.rows == 2000
    assert thin.sample_time_s == pytest.approx(0.002)
    again = Replay.of(thin.inputs(), step_s=1e-3).run(MODEL)
    for column, name in ((0, "motor_angle_rad"), (1, "load_angle_rad")):
        error = again[:, column] - thin[name]
        assert np.std(error) < 2e-3 * np.std(thin[name])
        assert np.abs(error).max() > 0.0


@pytest.mark.parametrize("row_s", [0.002, 0.004])
def test_a_decimated_current_is_that_of_the_mean_command(row_s):
    """The winding follows the last row's duty more than the mean of all (tau = L/R = 1.1 ms)."""
    t = 0.001 * np.arange(4001)
    duty = 0.08 * np.sin(2 * np.pi * (1.1 + 0.8 * t) * t)
    true = Replay.of(Inputs(time_s=t, duty=duty)).run(MODEL)[:, 3]
    (thin,) = decimate(case_of(fine(duty=duty, current_A=true)), row_s).recordings
    again = Replay.of(thin.inputs(), step_s=1e-3).run(MODEL)[:, 3]
    every = round(row_s / 0.001)
    picked = true[: again.size * every : every]
    moves = slice(20, None)  # after the start
    off, before = (thin["current_A"] - again)[moves], (picked - again)[moves]
    assert np.std(off) < 0.25 * np.std(before), "what is left is the back-EMF's own ripple"


@pytest.mark.parametrize(("opened", "rows"), [(2000, 1000), (1999, 4001)])
def test_events_that_fall_on_kept_rows_stay_events_and_others_leave_all_rows(opened, rows):
    enabled = (np.arange(4001) < opened).astype(float)
    (found,) = decimate(case_of(fine(drive_enabled=enabled)), 0.0041).recordings
    assert found.rows == rows
    assert set(np.unique(found["drive_enabled"])) == {0.0, 1.0}
    assert not found["drive_enabled"].flags.writeable or rows == 4001


@pytest.mark.parametrize(("rows", "row_s"), [(4001, 0.0015), (4001, 0.001), (700, 0.002)])
def test_rows_that_are_long_enough_and_short_recordings_stay(rows, row_s):
    case = case_of(fine(rows))
    assert decimate(case, row_s).recordings[0] is case.recordings[0]


@pytest.mark.parametrize(("at", "rows"), [(2000, 2000), (2001, 4001)])
def test_a_command_that_jumps_between_kept_rows_is_left_whole(at, rows):
    duty = np.where(np.arange(4001) < at, -0.05, 0.05)
    (found,) = decimate(case_of(fine(duty=duty)), 0.002).recordings
    assert found.rows == rows


def test_differences_that_serve_again_end_at_the_same_fit_with_fewer_replays(tmp_path):
    problem = planted(tmp_path, GearFriction(coulomb_Nm=0.02))
    hypothesis = Hypothesis(laws=(catalogue(problem.case)["gear-friction/coulomb"],))
    fits, replays = [], []
    for reuses in (0, 2):
        fitter = Fitter(problem, far=10.0, reuses=reuses)
        fits.append(fitter.fit(hypothesis, problem.start(hypothesis), iterations=12))
        replays.append(fitter.replays)
    assert fits[1].cost == pytest.approx(fits[0].cost, rel=0.01)
    _, (law,) = problem.values(hypothesis, fits[1].x)
    assert law["coulomb_Nm"] == pytest.approx(0.02, rel=0.05)
    assert replays[1] < replays[0]


def test_mended_differences_fit_the_step_and_keep_what_lies_across_it():
    rng = np.random.default_rng(3)
    J, moved = rng.standard_normal((4, 6)), rng.standard_normal(4)
    across = rng.standard_normal(4)
    across -= moved * (across @ moved) / (moved @ moved)
    came, here = rng.standard_normal((2, 3)), rng.standard_normal((2, 3))
    (mended,) = columns = [J.copy()]
    broyden_update(columns, moved, [came], [here])
    np.testing.assert_allclose(moved @ mended, (here - came).ravel(), rtol=1e-12)
    np.testing.assert_allclose(across @ mended, across @ J, rtol=1e-9, atol=1e-12)


class _Improving:
    """A fitter whose fits gain less and less."""

    def __init__(self, gains):
        self.gains, self.calls = list(gains), 0

    def fit(self, hypothesis, x, **_):
        self.calls += 1
        return fit_of(x[0] + self.gains.pop(0))


def fit_of(score: float):
    return SimpleNamespace(hypothesis=None, x=np.array([score]), msni=np.ones(1))


@pytest.mark.parametrize(
    ("gains", "effort", "leader", "calls"),
    [
        ((50.0, 20.0), FULL, 0.0, 2),
        ((50.0, 20.0), QUICK, 0.0, 1),
        ((0.5, 20.0), FULL, 0.0, 1),
        ((50.0, 20.0), FULL, 51.0 + CLOSE, 1),
    ],
)
def test_a_fit_continues_while_it_gains_and_can_reach_the_threshold(gains, effort, leader, calls):
    fitter = _Improving(gains)
    search = SimpleNamespace(fitter=fitter, effort=effort, score=lambda fit: float(fit.x[0]))
    finish(search, fit_of(0.0), leader)
    assert fitter.calls == calls


def test_an_external_torque_pulse_is_proposed_when_it_acted(tmp_path):
    problem = planted(tmp_path)
    plain = Hypothesis()
    fitter = Fitter(problem)
    fit = fitter.fit(plain, problem.start(plain), iterations=3)
    prepared = next(b for b in problem.fitted if b.where.kind == "pendulum")
    pulse = disturbance("pendulum.csv", prepared.where.index, (1.5, 0.4, 0.3), 0.5, 4.0)
    pushed = Hypothesis(laws=(pulse,))
    x = np.concatenate([fit.x, problem.start(Hypothesis(laws=(pulse,)))[fit.x.size :]])
    moved = problem.predict(prepared, pushed, x[None]) - problem.predict(
        prepared, plain, fit.x[None]
    )
    prepared.measured[:] += moved[0]
    first = disturbances(fitter, fit, 0.5)[0]
    values = dict(
        zip((parameter.name for parameter in first.unknowns), first.starts[0], strict=True)
    )
    assert first.only == "pendulum.csv"
    assert values["start_s"] == pytest.approx(1.5, abs=1.5 * CELL_s)
    assert values["width_s"] == pytest.approx(0.4, abs=2.0 * CELL_s)
    assert values["peak_Nm"] == pytest.approx(0.3, rel=0.3)


class _Staying:
    """A fitter whose fits stay where they begin; it notes what they were fitted to."""

    def __init__(self):
        self.prepared = []

    def fit(self, hypothesis, x, *, recordings=None, **_):
        self.prepared.append(recordings)
        return SimpleNamespace(hypothesis=hypothesis, x=x, msni=np.array(x), cost=-x[0])


def test_short_runs_that_met_are_followed_once_and_those_out_of_reach_not_at_all(monkeypatch):
    a, b = SimpleNamespace(key="a"), SimpleNamespace(key="b")
    begins = [(a, [1.0]), (a, [1.01]), (b, [1.5]), (b, [9.0]), (b, [np.nan])]
    monkeypatch.setattr(search_starts, "screen", lambda *_, **__: [])
    monkeypatch.setattr(search_starts, "begun", lambda *_: begins)
    fitter, reported = _Staying(), []
    search = SimpleNamespace(
        fitter=fitter,
        short="short",
        longer="longer",
        likelihood=lambda power: float(-500.0 * np.log(power[0])) if power[0] > 0 else -np.inf,
    )
    found = search_starts.from_short_runs(
        search, fitter.fit(a, [2.0]), [], reported.append, tried=3
    )
    assert [fit.msni[0] for fit in found] == [1.01, 1.5], "of two that met the better one"
    assert fitter.prepared.count("longer") == 2
    assert sum("not followed" in line for line in reported) == 2


def test_a_richer_law_that_was_tried_from_a_better_fit_is_not_tried_again(tmp_path):
    problem = planted(tmp_path)
    laws = catalogue(problem.case)
    hypothesis = Hypothesis(laws=(laws["gear-friction/coulomb"],))
    fit = SimpleNamespace(hypothesis=hypothesis, x=problem.start(hypothesis), msni=np.full(2, 9.0))
    richer = [f"gear-friction/{name}" for name in hypothesis.laws[0].richer]
    fitter = _Staying()
    search = SimpleNamespace(
        fitter=fitter, problem=problem, fits={}, score=lambda _: 0.0, effort=FULL,
        keep=lambda rich: search.fits.setdefault(rich.hypothesis.key, rich),
    )  # fmt: skip
    reported: list[str] = []
    assert with_richer_laws(search, fit, laws, set(richer), reported.append) is fit
    assert not fitter.prepared
    done = set(richer[1:])
    with_richer_laws(search, fit, laws, done, reported.append)
    assert fitter.prepared
    assert done == set(richer)


def test_what_a_rival_needs_more_of_priors_is_not_tempered(tmp_path):
    problem = planted(tmp_path)
    fitter, plain = Fitter(problem, far=10.0), Hypothesis()
    best = fitter.fit(plain, problem.start(plain), iterations=2)
    search = Search(problem=problem, fitter=fitter, nominal_msni=best.msni, parameters=best)
    dearer = replace(best, prior_cost=best.prior_cost + 3.0)
    assert search.score(best) - search.score(dearer) == pytest.approx(3.0)
    assert search.behind(best, dearer) == pytest.approx(3.0 * TEMPERATURE)
    cheaper = replace(best, prior_cost=best.prior_cost - 3.0)
    assert search.behind(best, cheaper) == pytest.approx(-3.0)
    worse = replace(best, msni=1.1 * np.maximum(best.msni, 0.9))
    gap = search.score(best) - search.score(worse)
    assert search.behind(best, worse) == pytest.approx(gap)
