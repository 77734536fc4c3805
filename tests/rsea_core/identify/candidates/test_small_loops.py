"""A Bouc-Wen spring dissipates energy far below its yield; a fit finds it (mass on a shaker)."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core.effects.spring_hysteresis import SpringBoucWen
from rsea_core.engines.fixed_step.replay import Replay
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.candidates.typical_magnitudes import own_magnitudes
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.law_search.candidate_fits import at_bound, fitted
from rsea_core.identify.law_search.screening import screen, screen_again
from rsea_core.identify.multistep.criteria import LEAST_GAIN
from rsea_core.identify.multistep.horizons import with_fine_steps
from rsea_core.identify.multistep.log_nuisances import nuisances
from rsea_core.identify.multistep.timing_choice import parameters_with_timing
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.recording import Recording
from tests.cases.one_axis import axis_case

ROW_s, N = 1.0 / 400.0, 1200
RIG = Rig(
    name="shaker", parts=("drive", "gear", "spring"), gear_ratio=1.0, motor_inertia_kgm2=2.0,
    motor_viscous_Nms_per_rad=10.0, spring_stiffness_Nm_per_rad=1e5,
    motor_encoder_counts_per_rev=200_000_000,
)  # fmt: skip
LOOP = SpringBoucWen(stiffness_Nm_per_rad=4e4, yield_rad=0.003, exponent=1.0, shape=0.5)


@pytest.mark.parametrize("shape", [0.5, 0.2, -0.4])
def test_the_loss_of_a_small_loop_grows_with_the_cube_of_its_amplitude(shape):
    """To first order in A / y, with n = 1: integral of z over the loop, 4/3 k (1 - |s|) A^3 / y."""
    term = replace(LOOP, shape=shape)
    k, y = term.stiffness_Nm_per_rad, term.yield_rad
    for share in (0.001, 0.002):
        _, area = term.loop(share * y)
        expected = 4.0 / 3.0 * k * (1.0 - abs(shape)) * share**3 * y**2
        assert area == pytest.approx(expected, rel=3.0 * share)  # the next order


def shaken(term, *, seed: int) -> Recording:
    """A mass on a spring with a locked end, under random forces; read by fine counts."""
    rng = np.random.default_rng(seed)
    time = ROW_s * np.arange(N)
    force = sum(
        5.0 * np.sin(2.0 * np.pi * f * time + rng.uniform(0.0, 6.0)) for f in range(5, 60, 5)
    )
    locked = Load(kind="locked")
    inputs = Inputs(time_s=time, motor_torque_Nm=force, load=locked)
    angle = Replay.of(inputs, step_s=ROW_s / 40.0).run(ActuatorModel(RIG, (term,)))[:, 0]
    count = 2.0 * np.pi / RIG.motor_encoder_counts_per_rev
    columns = {"time_s": time, "motor_torque_Nm": force,
               "motor_angle_rad": count * np.round(angle / count)}  # fmt: skip
    return Recording(file="shaken.csv", load=locked, columns=columns, sample_time_s=ROW_s)


@pytest.mark.parametrize(
    ("yield_rad", "stated", "tolerance"),
    [(0.003, 1e5, 0.1), (0.0012, 1e5, 0.1), (0.0012, 1.4e5, 0.05)],
    ids=["8 deflections", "3 deflections", "small-deflection stiffness stated"],
)
def test_a_loop_far_below_its_yield_is_fitted(tmp_path, yield_rad, stated, tolerance):
    """The small-deflection stiffness, 1e5 + 4e4 Nm/rad, is 7 tolerances above the elastic one."""
    spring = replace(LOOP, yield_rad=yield_rad)
    rig = replace(RIG, spring_stiffness_Nm_per_rad=stated,
                  tolerances=(("spring_stiffness_Nm_per_rad", tolerance),))  # fmt: skip
    case = axis_case(tmp_path, shaken(spring, seed=3), rig=rig)
    h = Hypothesis(laws=nuisances(case))
    estimator, base, _ = parameters_with_timing(case, h, lambda text: None)
    estimator, base = with_fine_steps(estimator, base, lambda text: None)
    law = next(w for w in catalogue(case, relative=True).values() if w.law == LOOP.law)
    assert yield_rad > 3.0 * own_magnitudes(case).deflection_rad
    candidate = screen_again(estimator, base, screen(estimator, base, [law], wrong_signs=True))[0]
    assert candidate.gain > LEAST_GAIN
    fit = fitted(estimator, base, candidate, iterations=20)
    found = estimator.problem.values(fit.hypothesis, fit.x)[1][-1]
    assert not at_bound(estimator.problem, fit, law)
    largest = np.max(np.abs(case.identification[0]["motor_angle_rad"]))
    of_fit, of_spring = (term.loop(largest)[1] for term in (SpringBoucWen(**found), spring))
    assert of_fit == pytest.approx(of_spring, rel=0.1)
