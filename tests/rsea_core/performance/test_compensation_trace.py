"""The parts of a command are those that the law added up."""

import numpy as np
import pytest

from rsea_core import ActuatorModel, Load, Rig
from rsea_core.control.closed_loop import simulate_closed_loop
from rsea_core.control.laws.impedance import HybridImpedance
from rsea_core.control.laws.pid import PidTorque
from rsea_core.effects import GearFriction
from rsea_core.errors import ControllerError
from rsea_core.performance.compensation_trace import PARTS, compensation_trace
from rsea_core.simulation.reference import Reference

RIG = Rig.preset("rsea-bench")
MODEL = ActuatorModel(RIG, (GearFriction(coulomb_Nm=0.02),))
SINE = Reference(kind="sine", amplitude_Nm=3.0, frequency_Hz=2.0)


@pytest.mark.parametrize("ideal", [False, True])
def test_what_the_parts_leave_is_the_gains_times_the_error(ideal):
    law = PidTorque(
        kp=3.0, ki=0.0, friction_compensation=1.0, friction_smoothing_rad_per_s=0.05,
        back_emf="reference", ideal_sensors=ideal,
    )  # fmt: skip
    run = simulate_closed_loop(MODEL, law, SINE, Load(kind="locked"), duration_s=0.4)
    found = compensation_trace(law, run, SINE)
    n = found.time_s.size
    readings = (run.motor_angle_rad, run.load_angle_rad) if ideal else (
        run.encoder_motor_angle_rad, run.encoder_load_angle_rad)  # fmt: skip
    motor, load = (angle[:n] for angle in readings)
    torque = RIG.spring_stiffness_Nm_per_rad * (motor / RIG.gear_ratio - load)
    wanted = SINE.sample(found.time_s)
    feedback = law.kp * (wanted[:, 0] - torque)
    np.testing.assert_allclose(found.parts["feedback"], feedback, atol=1e-9)
    speed = wanted[:, 1] / RIG.spring_stiffness_Nm_per_rad
    friction = RIG.gear_ratio * 0.02 * np.tanh(speed / 0.05)  # at the joint
    np.testing.assert_allclose(found.parts["friction"], friction, atol=1e-12)
    assert list(found.parts) == list(PARTS)
    assert found.rms_Nm(0.1)["reference"] == pytest.approx(3.0 / np.sqrt(2.0), rel=0.1)


def test_a_law_without_such_parts_is_refused():
    law = PidTorque()
    run = simulate_closed_loop(MODEL, law, SINE, Load(kind="locked"), duration_s=0.05)
    with pytest.raises(ControllerError, match="impedance has no parts"):
        compensation_trace(HybridImpedance(), run, SINE)
