"""Zero-impedance torque: what is felt when the output is moved while no torque is asked for.

Two answers: the swing that the motor can follow at all, and the torque of a given controller.
Source: the experiment is Robinson's, Design and analysis of series elasticity in closed-loop
actuator force control (MIT, 2000).
"""

import math

import numpy as np

from rsea_core.control.laws.base import Controller
from rsea_core.control.tuning.figures_of_merit import swung
from rsea_core.errors import InputError
from rsea_core.machine.inputs import Load
from rsea_core.model.actuator_model import ActuatorModel


def largest_followed_swing_rad(model: ActuatorModel, frequency_Hz: float) -> float:
    """Largest amplitude of the load's swing that the motor can follow without torque.

    The wheel must then move as the load does: current and supply voltage that this takes stay
    within their limits. A gear without friction is assumed.

    Raises
    ------
    InputError
        If the frequency is not above 0.
    RigError
        If the rig lacks a value of its electric drive.
    """
    if not 0.0 < frequency_Hz < math.inf:
        raise InputError(f"frequency_Hz = {frequency_Hz} must be above 0")
    plant = model.plant("duty", Load(kind="locked"))
    s = 2j * np.pi * frequency_Hz
    current = (plant.inertia * s**2 + plant.damping * s) / plant.torque_per_ampere
    volts = (plant.resistance + plant.inductance * s) * current + plant.volts_per_speed * s
    return float(min(plant.current_limit / abs(current), plant.volts_per_command / abs(volts)))


def zero_impedance_torque_Nm(
    model: ActuatorModel,
    controller: Controller,
    *,
    load_amplitude_rad: float,
    frequency_Hz: float,
    periods: int = 6,
) -> float:
    """Peak-to-peak torque felt when the output is swung while the loop asks for none.

    Half of the periods are left to settle, the swing grows during the first.

    Raises
    ------
    InputError
        If amplitude or frequency are not above 0, or there are fewer than 4 periods.
    RseaError
        If model and controller do not go together.
    """
    if not (load_amplitude_rad > 0.0 and frequency_Hz > 0.0 and periods >= 4):
        raise InputError("load_amplitude_rad and frequency_Hz must be above 0, periods at least 4")
    result = swung(model, controller, load_amplitude_rad, frequency_Hz, periods)
    return float(np.ptp(result.torque_Nm[result.time_s >= 0.5 * result.time_s[-1]]))
