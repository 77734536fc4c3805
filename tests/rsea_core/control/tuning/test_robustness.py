"""Robustness figures scale as they must and repeat over random machines and disturbances."""

from dataclasses import replace

import numpy as np
import pytest

from rsea_core import ActuatorModel, Load, Reference, Rig
from rsea_core.control import LqgTorque, PidTorque
from rsea_core.control.tuning.robustness import Disturbance, robustness
from rsea_core.control.tuning.tune import Task, run_all
from rsea_core.effects import GearFriction, LoadDisturbance
from rsea_core.errors import InputError
from rsea_core.model.perturbed import perturbed_models

RIG = replace(Rig.preset("rsea-bench"), current_limit_A=None, motor_encoder_counts_per_rev=None,
              load_encoder_counts_per_rev=None)  # fmt: skip
LOCKED = Load(kind="locked")
WALL = Load(
    kind="contact",
    contact_stiffness_Nm_per_rad=200.0,
    contact_angle_rad=-0.5,
    contact_damping_Nms_per_rad=1.0,
)
PULSE = Disturbance(peak_Nm=1.0, start_s=0.3, end_s=0.6)


def task(load, *, noise=0.0, terms=(), **changes):
    reference = Reference(kind="sine", amplitude_Nm=2.0, frequency_Hz=2.0)
    return Task(
        model=ActuatorModel(RIG, terms), loads=(load,), reference=reference, duration_s=1.0,
        from_s=0.1, noise=(noise, 0.0, 0.0), **changes,
    )  # fmt: skip


def test_deviation_of_a_linear_loop_is_in_proportion_to_the_external_torque():
    """The load stays in its wall, so that machine and loop are linear."""
    law = PidTorque(kp=5.0, ki=2.0, ideal_sensors=True, command_name="voltage_V")
    twice = replace(PULSE, peak_Nm=2.0)
    found = robustness(task(WALL), law, machines=0, seed=0, disturbances=(PULSE, twice)).disturbed
    assert [d.name for d in found] == ["pulse 1 Nm", "pulse 2 Nm"]
    assert found[0].peak_deviation > 0.01
    assert found[1].peak_deviation == pytest.approx(2.0 * found[0].peak_deviation, rel=0.02)
    assert found[0].recovery_s is not None
    assert found[1].recovery_s == pytest.approx(found[0].recovery_s, abs=0.05)


def test_a_ramp_disturbs_less_than_a_pulse_of_its_peak():
    law = PidTorque(kp=5.0, ki=2.0)
    both = (PULSE, replace(PULSE, rise_s=0.3))
    pulse, ramp = robustness(task(WALL), law, machines=0, seed=0, disturbances=both).disturbed
    assert (pulse.name, ramp.name) == ("pulse 1 Nm", "ramp 1 Nm")
    assert ramp.peak_deviation < pulse.peak_deviation


def test_a_held_output_takes_no_external_torque():
    found = robustness(task(LOCKED), PidTorque(), machines=0, seed=0, disturbances=(PULSE,))
    assert found.disturbed == ()


def test_a_disturbance_takes_the_place_of_the_machines_own():
    own = LoadDisturbance(start_s=0.0, end_s=0.1, peak_Nm=9.0)
    model = PULSE.on(ActuatorModel(RIG, (own,)))
    assert [t.peak_Nm for t in model.terms] == [1.0]


def test_random_machines_repeat_and_each_has_noise_of_its_own():
    noisy = task(LOCKED, noise=0.02)
    found = robustness(noisy, LqgTorque(), machines=4, seed=3)
    again = robustness(noisy, LqgTorque(), machines=4, seed=3)
    np.testing.assert_array_equal(found.monte_carlo_rmse, again.monte_carlo_rmse)
    still = robustness(task(LOCKED), LqgTorque(), machines=4, seed=3)
    assert (found.monte_carlo_rmse > still.monte_carlo_rmse).all()
    same = run_all(noisy, [LqgTorque()] * 3, LOCKED).metric("rmse")
    assert np.unique(same).size == 3
    assert len({m.rig.motor_inertia_kgm2 for m in perturbed_models(noisy.model, 4, 3)}) == 4


def test_a_wrong_compensator_is_judged_on_its_worse_side_under_the_same_noise():
    dry = task(LOCKED, noise=0.02, terms=(GearFriction(coulomb_Nm=0.02),))
    law = PidTorque(kp=20.0, friction_compensation=1.0)
    found = robustness(dry, law, machines=0, seed=0)
    sides = [
        run_all(dry, [replace(law, friction_compensation=c)] * 5, LOCKED).metric("rmse").mean()
        for c in (0.7, 1.3)
    ]
    assert found.wrong_compensator_rmse == max(sides)
    expected = 100.0 * (max(sides) / found.noisy_rmse - 1.0)
    assert found.degradation_percent == pytest.approx(expected)
    plain = robustness(dry, PidTorque(kp=20.0), machines=0, seed=0)
    assert plain.degradation_percent is None


@pytest.mark.parametrize(
    ("changes", "text"), [({"end_s": 0.2}, "must come after"), ({"rise_s": 0.5}, "rise_s = 0.5")]
)
def test_an_impossible_disturbance_is_refused_in_a_line(changes, text):
    with pytest.raises(InputError, match=text):
        replace(PULSE, **changes)
