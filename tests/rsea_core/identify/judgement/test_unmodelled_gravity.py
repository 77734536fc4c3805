"""An unbalance that the rig file does not name is read off the fitted gravity."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.effects.registry import LoadUnbalance
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.fitting.least_squares import Fitter
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.judgement.covariance import Spread, covariance
from rsea_core.identify.judgement.criteria import CLEAR_MSNI
from rsea_core.identify.judgement.unmodelled_gravity import unmodelled_gravity
from rsea_core.recordings.case import Case
from tests.cases.planted import RIG, recording


@pytest.mark.parametrize("anchors", [(), ("load_mass_kg",)])
@pytest.mark.parametrize("offset", [0.0, 0.06])
def test_a_turned_gravity_is_an_unbalance_also_where_the_mass_was_weighed(
    tmp_path, anchors, offset
):
    turned = replace(RIG, gravity_angle_offset_rad=offset)
    rig = replace(RIG, anchors=anchors)
    made = tuple(
        recording((), load, f"{load}.csv", seed, turned)
        for seed, load in ((1, "locked"), (2, "pendulum"))
    )
    problem = Problem(Case(name="turned", folder=tmp_path, rig=rig, recordings=made), step_s=1e-3)
    assert ("load_mass_kg" in {n.key for n in problem.nominals}) is not bool(anchors)
    fitter, plain = Fitter(problem, far=10.0), Hypothesis()
    fit = fitter.fit(plain, problem.start(plain), iterations=12)
    found = unmodelled_gravity(fitter, fit, covariance(fitter, fit)[0])
    if offset == 0.0:
        assert found is None
        return
    weight = 9.80665 * RIG.load_mass_kg * RIG.load_distance_m
    amplitude = found["parameters"]["torque_amplitude_Nm"]
    expected = 2.0 * weight * np.sin(0.5 * offset)
    assert abs(amplitude["value"] - expected) < 2.0 * amplitude["std"]
    assert found["confidence"] > 0.8
    rough = replace(fit, msni=np.array([1.0, 2.0 * CLEAR_MSNI]))
    assert unmodelled_gravity(fitter, rough, covariance(fitter, fit)[0]) is None


@pytest.mark.parametrize("angle", [-0.9, 2.2])
def test_a_weighed_mass_does_not_turn_an_unbalance_square_to_the_load(tmp_path, angle):
    """With the mass held gravity only turns, by what lies square to the load; the rest shows too.

    The lever is known to a percent, and what it is off by is in the stated error.
    """
    rig = replace(RIG, anchors=("load_mass_kg",))
    hung = (LoadUnbalance(torque_amplitude_Nm=0.08, angle_rad=angle),)
    longer = replace(RIG, load_distance_m=1.008 * RIG.load_distance_m)
    made = tuple(
        recording(hung if load == "pendulum" else (), load, f"{load}.csv", seed, longer)
        for seed, load in ((1, "locked"), (2, "pendulum"))
    )
    problem = Problem(Case(name="hung", folder=tmp_path, rig=rig, recordings=made), step_s=1e-3)
    fitter, plain = Fitter(problem, far=10.0), Hypothesis()
    fit = fitter.fit(plain, problem.start(plain), iterations=12)
    fit = replace(fit, msni=np.minimum(fit.msni, CLEAR_MSNI))  # this session is all pendulum
    found = unmodelled_gravity(fitter, fit, covariance(fitter, fit)[0])["parameters"]
    for name, expected in (("torque_amplitude_Nm", 0.08), ("angle_rad", angle)):
        assert abs(found[name]["value"] - expected) < 2.0 * found[name]["std"]
    assert found["angle_rad"]["std"] < 0.3 * abs(abs(angle) - 0.5 * np.pi)


def test_jointly_with_laws_an_unbalance_must_exceed_the_tolerances(tmp_path):
    rig = replace(RIG, anchors=("load_mass_kg",))
    term = LoadUnbalance(torque_amplitude_Nm=0.15, angle_rad=0.7)
    made = tuple(
        recording((term,), load, f"{load}.csv", seed, RIG)
        for seed, load in ((1, "locked"), (2, "pendulum"))
    )
    problem = Problem(Case(name="leaning", folder=tmp_path, rig=rig, recordings=made), step_s=1e-3)
    fitter, plain = Fitter(problem, far=10.0), Hypothesis()
    fit = fitter.fit(plain, problem.start(plain), iterations=12)
    laws = catalogue(problem.case)
    jointly = replace(fit, hypothesis=Hypothesis(laws=(laws["load-drag/quadratic"],)))
    x = np.append(fit.x, 0.0)
    x[[n.key for n in problem.nominals].index("gravity_angle_offset_rad")] = 0.025 / 0.015
    jointly = replace(jointly, x=x)
    assert unmodelled_gravity(fitter, jointly, Spread(sources=(1e-4 * np.eye(x.size),))) is None


@pytest.mark.parametrize("together", [False, True])
def test_a_mass_that_moved_with_motor_and_spring_is_no_unbalance(tmp_path, together):
    made = (recording((), "pendulum", "pendulum.csv", 2, RIG),)
    problem = Problem(Case(name="scaled", folder=tmp_path, rig=RIG, recordings=made), step_s=1e-3)
    fitter, plain = Fitter(problem, far=10.0), Hypothesis()
    x = problem.start(plain)
    shared = ("torque_constant_Nm_per_A", "motor_inertia_kgm2", "spring_stiffness_Nm_per_rad")
    for j, nominal in enumerate(problem.nominals):
        if nominal.key == "load_mass_kg" or (together and nominal.key in shared):
            x[j] = np.log(1.2) / nominal.tolerance
    fit = replace(fitter.fit(plain, x, iterations=1), x=x)
    found = unmodelled_gravity(fitter, fit, Spread(sources=(0.01 * np.eye(x.size),)))
    assert (found is None) is together
    if found is not None:
        weight = 9.80665 * RIG.load_mass_kg * RIG.load_distance_m
        assert found["parameters"]["torque_amplitude_Nm"]["value"] == pytest.approx(0.2 * weight)
