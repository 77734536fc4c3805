"""Intervals of a fit by windows: within the priors, true values in them, wider beside errors."""

import numpy as np
import pytest

from rsea_core.effects.load_friction import LoadFriction
from rsea_core.effects.spring_parallel import SpringParallel
from rsea_core.identify.law_search.candidate_fits import fitted
from rsea_core.identify.law_search.screening import screen
from rsea_core.identify.law_search.search import laws_of
from rsea_core.identify.window_fit import fit_of, spread_of
from tests.cases.one_axis import axis_recording
from tests.cases.whole_runs import searched_axis

SPRING, FRICTION = SpringParallel(stiffness_Nm_per_rad=0.01), LoadFriction(coulomb_Nm=0.02)
STIFFNESS = "spring-parallel.stiffness_Nm_per_rad"


def spread_with(folder, key, name, *recordings):
    """Intervals of parameters and a law, fitted to whole recordings of an axis."""
    found, own, plain = searched_axis(folder, *recordings)
    law = next(law for law in laws_of(found) if law.key == key)
    fit = fitted(own, plain, screen(own, plain, [law])[0])
    names = own.problem.names(fit.hypothesis)
    return own, fit, names.index(name), spread_of(own, fit_of(own, fit))


def spread_with_spring(folder, *recordings):
    return spread_with(folder, "spring-parallel/linear", STIFFNESS, *recordings)


def test_one_recording_gives_finite_intervals_within_the_priors(tmp_path):
    own, fit, _, spread = spread_with_spring(tmp_path, axis_recording(SPRING, seed=1))
    _, weight = own.problem.prior(fit.hypothesis)
    stated = weight > 0.0
    assert np.all(np.isfinite(spread.std))
    assert np.all(spread.std[stated] <= (1.0 + 1e-9) / weight[stated])


def test_a_law_that_is_missing_widens_intervals_that_priors_do_not_bound(tmp_path):
    stds = []
    for name, terms in (("alone", (SPRING,)), ("beside", (SPRING, FRICTION))):
        folder = tmp_path / name
        folder.mkdir()
        recordings = [axis_recording(*terms, seed=seed) for seed in (1, 2)]
        own, fit, _, spread = spread_with_spring(folder, *recordings)
        stds.append(spread.std[own.problem.names(fit.hypothesis).index("drive-delay.delay_s")])
    assert stds[1] > 2.0 * stds[0]  # the stiffness is known as well as the torque constant


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_interval_of_a_complete_law_holds_the_true_value(tmp_path, seed):
    own, fit, at, spread = spread_with_spring(tmp_path, axis_recording(SPRING, seed=seed))
    value = own.problem.values(fit.hypothesis, fit.x)[1][-1]["stiffness_Nm_per_rad"]
    scale = fit.hypothesis.laws[-1].unknowns[0].scale
    assert abs(value - SPRING.stiffness_Nm_per_rad) < 3.0 * spread.std[at] * scale


def test_a_common_scale_of_torques_that_no_reading_states_is_as_uncertain_as_its_priors(tmp_path):
    """Torque constant, inertias, damping and friction may all be larger by the same factor."""
    friction = LoadFriction(coulomb_Nm=0.06)
    recordings = [axis_recording(friction, seed=seed) for seed in (1, 2)]
    own, fit, at, spread = spread_with(
        tmp_path, "load-friction/coulomb", "load-friction.coulomb_Nm", *recordings
    )
    of = {n.key: n for n in own.problem.nominals}
    motor, load = of["motor_inertia_kgm2"], of["load_inertia_kgm2"]
    total = motor.value + load.value
    of_inertia = np.hypot(motor.tolerance * motor.value, load.tolerance * load.value) / total
    stds = (of["torque_constant_Nm_per_A"].tolerance, of_inertia)
    of_scale = 1.0 / np.sqrt(sum(1.0 / s**2 for s in stds))
    assert spread.std[at] / fit.x[at] == pytest.approx(of_scale, rel=0.1)
