"""A gravity torque that the rig file does not name, read off the gravity that was fitted."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.case import Case
from rsea_core.identify.fit import Fitter
from rsea_core.identify.problem import Hypothesis, Problem
from rsea_core.identify.unbalance import unbalance_of
from rsea_core.identify.uncertainty import covariance
from rsea_core.identify.verdict import CLEAR
from tests.verification.test_core_innovations import RIG, recording


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
    found = unbalance_of(problem, fit, covariance(fitter, fit)[0])
    if offset == 0.0:
        assert found is None
        return
    weight = 9.80665 * RIG.load_mass_kg * RIG.load_distance_m
    told = found["parameters"]["torque_amplitude_Nm"]
    expected = 2.0 * weight * np.sin(0.5 * offset)
    assert abs(told["value"] - expected) < 2.0 * told["std"]
    assert found["confidence"] > 0.8
    rough = replace(fit, power=np.array([1.0, 2.0 * CLEAR]))
    assert unbalance_of(problem, rough, covariance(fitter, fit)[0]) is None
