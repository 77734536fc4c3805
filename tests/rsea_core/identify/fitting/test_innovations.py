"""Innovations of the true machine are noise, and a planted effect is screened first and fitted."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.effects.base import Context
from rsea_core.effects.known_variants import laws_by_key
from rsea_core.effects.registry import DriveDelay, GearFriction, LoadFriction
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.fitting.least_squares import Fitter
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.selection.screening import screen
from tests.cases.planted import RIG, planted


def test_innovations_of_the_true_machine_are_noise_of_unit_power(tmp_path):
    problem = planted(tmp_path)
    plain = Hypothesis()
    _, power, found = Fitter(problem).evaluate(plain, problem.start(plain)[None])
    assert np.all(power < 1.3)
    e = found[1][0, 50:, problem.prepared[1].channels.index("torque_Nm")]
    assert abs(np.corrcoef(e[1:], e[:-1])[0, 1]) < 0.1
    assert np.std(e) == pytest.approx(1.0, abs=0.1)


def test_wrong_parameters_are_found_and_nothing_is_left(tmp_path):
    true = replace(RIG, spring_stiffness_Nm_per_rad=60.0, motor_inertia_kgm2=3.5e-4)
    problem = planted(tmp_path, rig=true)
    plain = Hypothesis()
    fit = Fitter(problem, far=10.0).fit(plain, problem.start(plain), iterations=20)
    nominal, _ = problem.values(plain, fit.x)
    assert nominal["spring_stiffness_Nm_per_rad"] == pytest.approx(60.0, rel=0.005)
    assert nominal["motor_inertia_kgm2"] == pytest.approx(3.5e-4, rel=0.03)
    assert np.all(fit.msni < 1.3)


PLANTED = {
    "gear-friction": (GearFriction(coulomb_Nm=0.02), {"gear-friction"}),
    # a level that changes with the angle holds one that does not
    "load-friction": (LoadFriction(coulomb_Nm=0.04), {"load-friction", "load-friction-angle"}),
    # at one sample late a delay of the command and one of every sensor are the same thing
    "drive-delay": (DriveDelay(delay_s=0.006), {"drive-delay", "sensor-delay"}),
}


@pytest.mark.parametrize("effect", PLANTED)
def test_screening_puts_a_planted_effect_first(tmp_path, effect):
    term, expected = PLANTED[effect]
    problem = planted(tmp_path, term)
    fitter = Fitter(problem, far=10.0)
    plain = Hypothesis()
    fit = fitter.fit(plain, problem.start(plain), iterations=12)
    laws = [
        law
        for law in catalogue(problem.case).values()
        if law.effect not in ("motor-cogging", "load-flexibility", "sensor-drift")
    ]
    found = screen(fitter, plain, fit.x, laws, tempering=1.0 / max(1.0, fit.msni.mean()))
    assert found[0].law.effect in expected, [c.law.key for c in found[:4]]


def test_a_planted_coulomb_friction_is_fitted_to_its_value(tmp_path):
    problem = planted(tmp_path, GearFriction(coulomb_Nm=0.02))
    law = catalogue(problem.case)["gear-friction/coulomb"]
    hypothesis = Hypothesis(laws=(law,))
    fitter = Fitter(problem, far=10.0)
    fit = fitter.fit(hypothesis, problem.start(hypothesis, [(0.01,)]), iterations=10)
    _, (values,) = problem.values(hypothesis, fit.x)
    assert values["coulomb_Nm"] == pytest.approx(0.02, rel=0.03)
    assert np.all(fit.msni < 1.6)


def test_the_loop_of_one_slip_is_a_parallelogram():
    """Width 2 k y and energy 4 k y (A - y) for an element that yields at y within A."""
    law = laws_by_key()["spring-hysteresis/one slip"]
    found = law.figures({"stiffness_1_Nm_per_rad": 20.0, "yield_1_rad": 0.03}, RIG, Context())
    assert found["loop_width_Nm"] == pytest.approx(2 * 20.0 * 0.03, rel=1e-12)
    assert found["loop_energy_J"] == pytest.approx(4 * 20.0 * 0.03 * (0.15 - 0.03), rel=1e-12)
