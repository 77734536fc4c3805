"""The errors and weights of Gauss-Newton give the cost of the task and its gradient."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from rsea_core import ActuatorModel, Load, Reference, Rig
from rsea_core.control import HybridImpedance, PidTorque
from rsea_core.control.tuning.tune import Task
from rsea_core.control.tuning.tune_task import costs_of, squares_of
from rsea_core.errors import InputError
from rsea_core.simulation.reference import AngleReference

# no counts and no current limit: the cost is a smooth function of the gains
RIG = replace(Rig.preset("rsea-bench"), current_limit_A=None, motor_encoder_counts_per_rev=None,
              load_encoder_counts_per_rev=None)  # fmt: skip
TORQUE = Reference(kind="sine", amplitude_Nm=1.0, frequency_Hz=2.0)
ANGLE = AngleReference(kind="sine", amplitude_rad=radians(10.0), frequency_Hz=1.0)
GROUND = Load(kind="contact", contact_stiffness_Nm_per_rad=25.0, contact_angle_rad=0.0,
              contact_damping_Nms_per_rad=0.1)  # fmt: skip
STEP = 1e-3  # of the gain


def task(cost, reference=TORQUE, load=None, **changes):
    return Task(model=ActuatorModel(RIG, ()), loads=(load or Load(kind="locked"),),
                reference=reference, duration_s=0.5, from_s=0.1, cost=cost, **changes)  # fmt: skip


def torque_law(kp):
    return PidTorque(kp=kp, ki=2.0, ideal_sensors=True, command_name="voltage_V")


def impedance_law(kp):
    return HybridImpedance(kp=kp, force_N=5.0)


def check(asked, law, gain):
    controllers = [law(gain * (1.0 + s)) for s in (0.0, STEP, -STEP)]
    exact = costs_of(asked, controllers)
    costs, errors, weights = squares_of(asked, controllers)
    np.testing.assert_allclose(costs, exact, rtol=0.01)
    gradient = np.sum(weights[0] * errors[0] * (errors[1] - errors[2]))
    assert gradient == pytest.approx(costs[1] - costs[2], rel=0.02)


@pytest.mark.parametrize("cost", ["rmse", "ise", "iae", "itae"])
@pytest.mark.parametrize("effort", [0.0, 0.1])
def test_costs_and_gradient_are_those_of_the_tuned_cost(cost, effort):
    """Within 1 %: the two differ by one row of 400 at the ends of the judged time."""
    check(task(cost, effort_weight=effort), torque_law, 5.0)


def test_costs_and_gradient_of_angle_and_force_are_those_of_the_tuned_cost():
    check(task("angle-force", ANGLE, GROUND, force_N=5.0), impedance_law, 2.175)


def test_angle_and_force_are_not_judged_on_a_torque_reference():
    with pytest.raises(InputError, match="needs a reference in rad"):
        task("angle-force")
