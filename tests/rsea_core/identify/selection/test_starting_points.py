"""Laws that fit at their right values alone are found from a grid of starts."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.fitting.least_squares import Fitter
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.selection.criteria import (
    FAR,
    LEAST_MSNI,
    Search,
    far_from_prior,
    reset_to_prior,
)
from rsea_core.identify.selection.refits import finish
from rsea_core.identify.selection.starting_points import align_on_grid, from_grids
from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig
from rsea_core.recordings.case import Case
from rsea_core.recordings.recording import Recording

RIG = Rig.preset("rsea-bench")
TIME_s = np.arange(2500) / 1000.0
DUTY = 0.1 * np.sign(np.sin(2.0 * np.pi * (0.6 + 0.5 * TIME_s) * TIME_s))
TRUTH = {
    "load-flexibility/one mode": (23.0, 0.55, 0.03),
    "gear-backlash/play, wheel": (0.019, RIG.output_inertia_kgm2, 0.02, 0.25),
}


def problem_of(key: str | None) -> Problem:
    """A pendulum on a bench that a law of the catalogue makes differ from its rig file."""
    still = np.zeros(TIME_s.size)
    columns = {"time_s": TIME_s, "duty": DUTY, "motor_angle_rad": still, "load_angle_rad": still}
    recording = Recording(
        file="made.csv", load=Load(kind="pendulum"), columns=columns, sample_time_s=1e-3
    )
    case = Case(name="made", folder=Path(), rig=RIG, recordings=(recording,))
    if key is None:
        return Problem(case, step_s=1e-3)
    blank = problem_of(None)
    hypothesis = Hypothesis(laws=(catalogue(case)[key],))
    x = blank.start(hypothesis, [TRUTH[key]])
    prepared = blank.fitted[0]
    read = blank.predict(prepared, hypothesis, x[None])[0]
    columns |= dict(zip(prepared.channels, read.T, strict=True))
    case = Case(
        name="made", folder=Path(), rig=RIG,
        recordings=(Recording(file="made.csv", load=Load(kind="pendulum"), columns=columns,
                              sample_time_s=1e-3),),
    )  # fmt: skip
    return Problem(case, step_s=1e-3)


def search_of(problem: Problem) -> Search:
    fitter = Fitter(problem, far=FAR)
    first = fitter.fit(Hypothesis(), problem.start(Hypothesis()), iterations=10)
    return Search(problem=problem, fitter=fitter, nominal_msni=first.msni, parameters=first)


@pytest.mark.parametrize("key", TRUTH)
def test_a_fit_from_the_grid_comes_to_the_machine_that_was_replayed(key):
    problem = problem_of(key)
    search = search_of(problem)
    law = catalogue(problem.case)[key]
    rough = from_grids(search, search.parameters, [law])
    assert 1 <= len(rough) <= search.effort.kept
    best = finish(search, max(rough, key=search.score))
    assert search.parameters.msni[0] > 3.0
    assert best.msni[0] < LEAST_MSNI  # below which a score knows no better
    if key.startswith("gear-backlash"):  # of a link one recording knows share and frequency as one
        values = problem.values(best.hypothesis, best.x)[1][0]
        assert values["width_rad"] == pytest.approx(TRUTH[key][0], rel=0.02)


def test_without_a_valley_nothing_begins():
    """Readings of a machine that is as its owner says: no start is worth a fit."""
    problem = problem_of(None)
    prepared = problem.fitted[0]
    read = problem.predict(prepared, Hypothesis(), problem.start(Hypothesis())[None])[0]
    prepared.measured[:] = read
    search = search_of(problem)
    assert from_grids(search, search.parameters, list(catalogue(problem.case).values())) == []


def test_a_backlash_that_is_nearly_right_steps_in():
    key = "gear-backlash/play, wheel"
    problem = problem_of(key)
    search, laws = search_of(problem), catalogue(problem.case)
    width, *_ = TRUTH[key]
    hypothesis = Hypothesis(laws=(laws["gear-backlash/play"],))
    x = problem.start(hypothesis, [(0.93 * width, *laws[key].starts[0][1:])])
    names = [n.key for n in problem.nominals]
    x[names.index("load_inertia_kgm2")] = 4.0
    near = search.fitter.fit(hypothesis, x, iterations=1)
    cost, power, _ = search.fitter.evaluate(hypothesis, x[None])
    near = replace(near, x=x, msni=power[0], cost=float(cost[0]), prior_cost=0.5 * float(x @ x))
    found = align_on_grid(search, near, laws, lambda reported: None)
    assert near.msni[0] > 5.0
    assert finish(search, near).msni[0] > 1.5, "where it is it ends in a hollow"
    found = finish(search, found)
    assert found.msni[0] < 1.0
    values = problem.values(found.hypothesis, found.x)[1][0]
    assert values["width_rad"] == pytest.approx(width, rel=0.02)
    assert not np.any(far_from_prior(problem, found))
    assert align_on_grid(search, found, laws, lambda reported: None) is found, (
        "nothing is left to gain"
    )


@pytest.mark.parametrize(("farthest", "sent"), [(2.9, []), (4.0, [1, 2])])
def test_constants_are_far_from_their_priors_where_the_farthest_is_beyond_chance(farthest, sent):
    """Of about a dozen normal deviates the farthest exceeds 3.3 once in a hundred."""
    problem = problem_of(None)
    fit = search_of(problem).parameters
    x = np.zeros_like(fit.x)
    x[:3] = 0.9, -1.2, farthest
    fit = replace(fit, x=x)
    gone = far_from_prior(problem, fit)
    assert np.flatnonzero(gone).tolist() == sent
    home = reset_to_prior(fit, gone)
    assert np.all(home[sent] == 0.0)
    assert home[0] == 0.9
