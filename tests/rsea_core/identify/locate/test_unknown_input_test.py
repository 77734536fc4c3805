"""An effect's name is withdrawn where an unknown input explains the data better."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rsea_core.effects.registry import GearBacklash
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.fitting.least_squares import Fit, Fitter
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.judgement.verdict import is_unobservable_slip
from rsea_core.identify.locate.unknown_input_test import (
    explained_better_by_other_port,
    unmodelled_input_detected,
)
from rsea_core.identify.result.conclusion import Conclusion
from rsea_core.identify.result.diagnosis_json import location_of
from rsea_core.identify.selection.criteria import NOISE_MSNI, QUICK
from tests.cases.planted import misread, parameters_of, planted


def with_law(problem: Problem, key: str, values: tuple[float, ...] = (), rounds: int = 0) -> Fit:
    """A fit of one law, begun at the owner's values."""
    law = catalogue(problem.case)[key]
    hypothesis = Hypothesis(laws=(law,))
    x = problem.start(hypothesis, [(*values, *law.starts[0][len(values) :])])
    return Fitter(problem, far=10.0).fit(hypothesis, x, iterations=rounds)


def test_a_machine_without_any_effect_leaves_no_signal(tmp_path):
    search = parameters_of(planted(tmp_path))
    assert not unmodelled_input_detected(search.problem, search.parameters)


@pytest.mark.parametrize(
    ("gains", "detected"),
    [
        ({"G": 536.0, "V": 409.0, "L": 318.0}, False),  # an unrepeatable bridge's shadow
        ({"G": 536.0, "L": 900.0}, True),
        ({"V": -3.0, "S": 301.0}, True),
        ({"G": 5000.0, "Y:motor_angle_rad": 900.0}, False),
    ],
)
def test_a_drift_of_the_drive_is_no_unmodelled_signal(monkeypatch, gains, detected):
    found = [SimpleNamespace(port=port, gain=gain) for port, gain in gains.items()]
    monkeypatch.setattr(
        "rsea_core.identify.locate.unknown_input_test.ranked_ports", lambda problem, fit: found
    )
    assert unmodelled_input_detected(None, None) is detected


def test_what_innovations_hardly_show_is_no_matter_of_values(tmp_path):
    search = parameters_of(
        misread(tmp_path, "torque_Nm", lambda t, c: 0.02 * np.sin(20.0 * t))  # its noise: 0.02
    )
    assert np.all(search.parameters.msni < NOISE_MSNI)
    conclusion = Conclusion(search)
    assert conclusion.verdict == "unexplained"
    assert location_of(conclusion)["subsystem"] == "sensor:torque_Nm"
    search.effort = QUICK
    assert Conclusion(search).verdict in ("no-mismatch", "parameters-only")


def test_lost_counts_are_not_an_error_of_the_gear(tmp_path):
    problem = misread(tmp_path, "motor_angle_rad", lambda t, c: 0.05 * np.floor(t / 0.4))
    search = parameters_of(problem)
    claimed = with_law(problem, "gear-transmission-error/worm", rounds=8)
    assert explained_better_by_other_port(problem, search.parameters, claimed)


def test_a_law_of_the_right_effect_stays_even_where_it_is_not_quite_right(tmp_path):
    problem = planted(tmp_path, GearBacklash(width_rad=0.02))
    search = parameters_of(problem)
    claimed = with_law(problem, "gear-backlash/play", (0.017,), rounds=1)
    assert not explained_better_by_other_port(problem, search.parameters, claimed)


@pytest.mark.parametrize(("stiffness", "yield_rad", "through"), [(12.0, 0.02, 0), (55.0, 0.13, 1)])
def test_a_hysteresis_that_holds_more_than_its_spring_is_a_clamp_that_slips(
    tmp_path, stiffness, yield_rad, through
):
    problem = planted(tmp_path)
    law = catalogue(problem.case)["spring-hysteresis/one slip"]
    hypothesis = Hypothesis(laws=(law,))
    x = problem.start(hypothesis, [(stiffness, yield_rad)])
    spring = next(
        j for j, p in enumerate(problem.nominals) if p.key == "spring_stiffness_Nm_per_rad"
    )
    p = problem.nominals[spring]
    x[spring] = -stiffness / (p.tolerance if p.additive else p.tolerance * p.value)
    fit = replace(parameters_of(problem).parameters, hypothesis=hypothesis, x=x)
    assert is_unobservable_slip(problem, fit) == bool(through)
