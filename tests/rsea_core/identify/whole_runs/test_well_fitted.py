"""Fits of whole recordings: minima a cycle away are left, and rows of unknown commands not used."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rsea_core.effects.drive_delay import DriveDelay
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.multistep.log_nuisances import nuisances
from rsea_core.identify.multistep.timing_choice import parameters_with_timing
from rsea_core.identify.whole_runs.sensor_noise import (
    converged,
    in_sensor_noise,
    misfit,
    refitted_from_rig,
    well_fitted,
)
from tests.cases.one_axis import ROW_s, axis_case, axis_recording, axis_rig, pendulum_case

FACTOR = 1.2


def fitted_whole(case):
    """An estimator of whole recordings in the sensors' noise, and its fit of parameters alone."""
    h = Hypothesis(laws=nuisances(case))
    estimator, base, _ = parameters_with_timing(case, h, lambda text: None)
    own = in_sensor_noise(estimator)
    return own, own.fit(h, base.x, iterations=12)


@pytest.fixture(scope="module")
def swinging(tmp_path_factory):
    """A bare pendulum that swings for twenty seconds, in the noise of its encoder."""
    return fitted_whole(pendulum_case(tmp_path_factory.mktemp("pendulum"), seed=1))


def test_a_fit_whose_swing_is_cycles_early_finds_the_right_one(swinging):
    own, best = swinging
    x = best.x.copy()
    x[[p.key for p in own.problem.nominals].index("load_inertia_kgm2")] += 30.0  # its upper bound
    early = own.fit(best.hypothesis, x, iterations=0)  # whether steps leave it depends on round-off
    found = well_fitted(own, early)
    left = [misfit(own, f.hypothesis, f.x) for f in (best, early, found)]
    assert left[0] < 1.2
    assert left[1] > 10.0
    assert left[2] < 1.2


def test_rows_in_which_unknown_commands_act_do_not_count(tmp_path):
    late_rows = 12
    whole = axis_recording(seed=1, delay_rows=late_rows)
    first = 300  # the recording begins in motion, and the commands before it are not in it
    columns = {name: values[first:] for name, values in whole.columns.items()}
    columns["time_s"] = columns["time_s"] - columns["time_s"][0]
    moving = replace(whole, columns=columns, initial_rest=False)
    case = axis_case(tmp_path, moving, rig=axis_rig())
    h = Hypothesis(laws=nuisances(case))
    estimator, base, _ = parameters_with_timing(case, h, lambda text: None)
    values = estimator.problem.values(h, base.x)[1]
    delay = next(v["delay_s"] for w, v in zip(h.laws, values, strict=True) if w.kind is DriveDelay)
    assert delay == pytest.approx(late_rows * ROW_s, abs=ROW_s)
    all_rows, known = in_sensor_noise(estimator), in_sensor_noise(estimator, base)
    assert all_rows.tracks[0].lead == 0
    assert known.tracks[0].lead == pytest.approx(late_rows, abs=1)
    e = known.innovations([(h, base.x)])[0][0]
    assert np.all(e[: known.tracks[0].lead] == 0.0)
    soon = in_sensor_noise(estimator, replace(base, x=0.02 * base.x))  # within a row
    assert soon.tracks[0].lead == 2
    assert np.all(np.isfinite(soon.innovations([(h, base.x)])[0]))
    left = [misfit(own, h, own.fit(h, base.x, iterations=12).x) for own in (all_rows, known)]
    assert left[1] < 1.5
    assert left[0] > 3.0 * left[1]


@pytest.fixture(scope="module")
def turning(tmp_path_factory):
    """An axis whose torques no reading states, in the noise of its encoder."""
    folder = tmp_path_factory.mktemp("axis")
    return fitted_whole(axis_case(folder, axis_recording(seed=2), rig=axis_rig()))


def test_a_fit_along_the_common_factor_of_all_torques_returns_to_the_rig_file(turning):
    own, best = turning
    x = best.x.copy()
    for j, p in enumerate(own.problem.nominals):  # all have the dimension of a torque
        more = (FACTOR * p.at(x[j]) - p.value) / p.tolerance if p.additive else None
        x[j] = x[j] + np.log(FACTOR) / p.tolerance if more is None else more
    far = own.fit(best.hypothesis, x, iterations=0)
    likeliest = best.negative_log_likelihood
    assert far.negative_log_likelihood == pytest.approx(likeliest, abs=1.0)  # readings do not tell
    found = refitted_from_rig(own, far)
    assert found.cost < far.cost
    assert np.max(np.abs(found.x[: len(own.problem.nominals)])) < 1.0


@pytest.mark.parametrize(("cost", "kept"), [(9.0, False), (10.0, True), (11.0, True)])
def test_a_fit_from_the_rig_file_replaces_another_only_if_it_is_likelier(cost, kept):
    h = Hypothesis()
    given = SimpleNamespace(hypothesis=h, x=np.array([3.0, -2.0]), cost=10.0)
    other = SimpleNamespace(hypothesis=h, x=np.zeros(2), cost=cost)
    begun = []

    def fit(h, x, *, iterations, fine):
        begun.append(x)
        return other

    own = SimpleNamespace(problem=SimpleNamespace(nominals=(None,)), fit=fit)
    assert refitted_from_rig(own, given) is (given if kept else other)
    assert list(begun[0]) == [0.0, -2.0]  # the rig file's value, and the law's


class Stopping:
    """Fits that stop short of their minimum: each lowers the cost by the next of some falls."""

    def __init__(self, *falls: float):
        self.costs = list(1000.0 - np.cumsum([0.0, *falls]))
        self.fits = 0

    def fit(self, h, x, *, iterations, fine):
        self.fits += 1
        cost = self.costs[min(self.fits - 1, len(self.costs) - 1)]
        return SimpleNamespace(hypothesis=h, x=x, cost=cost)


@pytest.mark.parametrize(("falls", "fits"), [((0.0,), 2), ((100.0, 0.0), 3), ((50.0,) * 9, 4)])
def test_a_fit_is_started_again_as_long_as_that_lowers_its_cost(falls, fits):
    own = Stopping(*falls)
    assert converged(own, None, np.zeros(1)).cost == own.costs[own.fits - 1]
    assert own.fits == fits
