"""Claim: batches are run by the exact engine where it can, and are those of single runs."""

from dataclasses import replace

import numba
import numpy as np
import pytest

from rsea_core import ActuatorModel, Load, Reference, Rig, run_batch, simulate_closed_loop
from rsea_core.control import PidTorque
from rsea_core.control.tuning.tune import Task, run_all, tune
from rsea_core.effects import GearFriction, LoadFriction, SensorOffset, SpringHardening
from rsea_core.errors import InputError, SimulationError

RIG = replace(Rig.preset("rsea-bench"), current_limit_A=2.0)
CONTACT = Load(
    kind="contact",
    contact_stiffness_Nm_per_rad=30.0,
    contact_angle_rad=0.02,
    contact_damping_Nms_per_rad=0.3,
)
DRY = (GearFriction(coulomb_Nm=0.04), LoadFriction(coulomb_Nm=0.05))
CONTROLLERS = [PidTorque(kp=kp, ki=20.0) for kp in (2.0, 5.0, 10.0, 20.0)]
NOISE = (1e-3, 1e-4, 0.01)


def task(*terms, **more):
    return Task(
        model=ActuatorModel(RIG, terms),
        loads=(CONTACT,),
        reference=Reference(kind="sine", amplitude_Nm=2.0, frequency_Hz=1.5),
        duration_s=1.0,
        **more,
    )


@pytest.mark.parametrize("terms", [DRY, (*DRY, SensorOffset(column="motor_angle_rad", offset=0.2))])
def test_a_batch_is_its_single_runs(terms):
    given = task(*terms)
    found = run_all(given, CONTROLLERS, CONTACT, with_rows=True)
    assert (found.engine, found.engine_reason) == ("piecewise-linear", None)
    for j, controller in enumerate(CONTROLLERS):
        alone = simulate_closed_loop(
            given.model, controller, given.reference, CONTACT, duration_s=1.0, refuse_unstable=False
        )
        assert np.array_equal(found.rows[j, :, 2], alone.torque_Nm)
        assert np.array_equal(found.rows[j, :, 0], alone.motor_angle_rad)
        error = alone.reference - alone.torque_Nm
        assert found.metric("rmse")[j] == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-12)
        assert found.metric("current_peak_A")[j] == np.abs(alone.current_A).max()


def test_a_batch_is_the_same_to_the_bit_on_one_and_two_threads():
    given = task(*DRY, noise=NOISE)
    ran, before = [], numba.get_num_threads()
    for threads in (1, min(2, numba.config.NUMBA_NUM_THREADS)):
        numba.set_num_threads(threads)
        ran.append(run_all(given, CONTROLLERS * 3, CONTACT).metrics)
    numba.set_num_threads(before)
    assert np.array_equal(*ran, equal_nan=True)


def by_engine(given, engine):
    """Metrics of the controllers by one engine, with the same draws of noise."""
    made = [c.compile(given.model, CONTACT) for c in CONTROLLERS]
    time = np.arange(1001) * 1e-3
    return run_batch(
        given.model,
        made[0].function,
        np.array([c.parameters for c in made]),
        np.array([c.state for c in made]),
        time_s=time,
        reference=given.reference.sample(time),
        command_name=made[0].command_name,
        load=CONTACT,
        command_limit=made[0].command_limit,
        noise=given.noise,
        engine=engine,
    )


@pytest.mark.parametrize("noise", [(0.0, 0.0, 0.0), NOISE])
def test_both_engines_judge_alike(noise):
    """The fixed steps' own error is of second order: a few per thousand in these loops."""
    given = task(*DRY, noise=noise)
    exact, fixed = by_engine(given, None), by_engine(given, "fixed-step")
    assert (exact.engine, fixed.engine) == ("piecewise-linear", "fixed-step")
    assert fixed.engine_reason == "it was asked for"
    for name in ("rmse", "mean_absolute_error", "command_rms", "current_rms_A"):
        np.testing.assert_allclose(exact.metric(name), fixed.metric(name), rtol=5e-3)


def test_what_the_exact_engine_cannot_run_fixed_steps_do_and_say_why():
    curved = task(SpringHardening(stiffness_ratio_at_0p15rad=1.5))
    found = run_all(curved, CONTROLLERS, CONTACT)
    assert (found.engine, found.engine_reason) == (
        "fixed-step", "its spring is no chain of straight lines",
    )  # fmt: skip
    with pytest.raises(SimulationError, match="straight lines"):
        by_engine(curved, "piecewise-linear")
    with pytest.raises(InputError, match="engine = 'exact'"):
        by_engine(curved, "exact")


def test_a_tuning_says_which_engine_it_ran_on():
    found = tune(task(*DRY), PidTorque(), {"kp": (1.0, 20.0)}, population=4, generations=2)
    assert found.engine == "piecewise-linear"
