"""A final refinement never costs more, and a held load's encoder makes no torque."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.identify.fitting.least_squares import Fit, Fitter
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.locate.unknown_input import ranked_ports
from rsea_core.identify.selection.final_refinement import final_refinement
from rsea_core.machine.inputs import Load
from rsea_core.recordings.case import Case
from tests.cases.bench_recordings import (
    LOCKED,
    PENDULUM,
    SLOW,
    TIME,
    multisine,
    search_of,
)
from tests.cases.planted import RIG, recording

KEYS = ("spring_stiffness_Nm_per_rad", "load_inertia_kgm2", "motor_inertia_kgm2")


def weighed(tmp_path) -> Problem:
    """No torque is read: only the known weight, a hundredth of the spring, scales all torques."""
    made = []
    for seed, load in ((1, "pendulum"), (2, "pendulum")):
        r = recording((), load, f"{load}{seed}.csv", seed, RIG)
        columns = {k: v for k, v in r.columns.items() if k != "torque_Nm"}
        made.append(replace(r, columns=columns))
    rig = replace(RIG, anchors=("load_mass_kg",))
    return Problem(Case(name="weighed", folder=tmp_path, rig=rig, recordings=tuple(made)))


def test_a_refined_fit_costs_no_more_and_stays_within_bounds(tmp_path):
    problem = weighed(tmp_path)
    fitter, plain = Fitter(problem, far=10.0), Hypothesis()
    x = problem.start(plain)
    keys = [p.key for p in problem.nominals]
    scaled = [*KEYS, "torque_constant_Nm_per_A"]
    for key in scaled:  # along the valley: all torques 8 % too large
        x[keys.index(key)] += 0.08 / problem.nominals[keys.index(key)].tolerance
    rough = fitter.fit(plain, x, iterations=3)
    fine = final_refinement(fitter, rough)
    assert fine.cost <= rough.cost
    values, start = problem.values(plain, fine.x)[0], problem.values(plain, rough.x)[0]
    for key in KEYS:
        true = getattr(RIG, key)
        assert abs(values[key] / true - 1.0) < abs(start[key] / true - 1.0) + 1e-3
    again = final_refinement(fitter, fine)
    assert again.cost == pytest.approx(fine.cost, abs=1.0)


def test_a_final_refinement_leaves_a_fit_alone_that_cannot_gain(tmp_path):
    problem = weighed(tmp_path)
    fitter, plain = Fitter(problem, far=10.0), Hypothesis()
    fit = final_refinement(fitter, fitter.fit(plain, problem.start(plain), iterations=12))
    assert isinstance(fit, Fit)
    np.testing.assert_allclose(final_refinement(fitter, fit).x, fit.x, atol=0.1)


def test_the_count_of_a_held_load_is_no_torque_in_the_spring(tmp_path):
    search = search_of(
        (LOCKED, SLOW), (PENDULUM, multisine(TIME)), sensors=("torque_Nm", "current_A"),
        folder=tmp_path,
    )  # fmt: skip
    first = search.problem.fitted[0].recording
    assert first.load == Load(kind="locked")
    assert first.first("load_angle_rad") != 0.0  # the encoder counts from within a count
    assert max(e.gain for e in ranked_ports(search.problem, search.parameters)) < 30.0
