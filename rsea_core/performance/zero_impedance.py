"""Zero-impedance torque: what is felt when the output is moved while no torque is asked for.

Two answers: the swing that the motor can follow at all, and the torque of a given controller.
Source: the experiment is Robinson's, Design and analysis of series elasticity in closed-loop
actuator force control (MIT, 2000).
"""

import math

import numpy as np

from rsea_core.control.closed_loop import rows_per_sample
from rsea_core.control.laws.base import Controller
from rsea_core.errors import InputError
from rsea_core.machine.inputs import Load
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.simulation.simulate import run_sampled


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
    load = Load(kind="imposed")
    compiled = controller.compile(model, load)
    per_sample, row = rows_per_sample(controller.sample_time_s, None)
    time = np.arange(round(periods / frequency_Hz / row) + 1) * row
    growing = np.clip(time * frequency_Hz, 0.0, 1.0)
    swing = load_amplitude_rad * np.sin(2.0 * np.pi * frequency_Hz * time)
    result = run_sampled(
        model,
        command_name=compiled.command_name,
        load=load,
        time_s=time,
        controller=compiled.function,
        parameters=compiled.parameters,
        state=compiled.state,
        reference=np.zeros((time.size, 3)),
        reference_name=controller.reference_name,
        load_angle_rad=swing * growing**2 * (3.0 - 2.0 * growing),
        rows_per_sample=per_sample,
        delay_samples=controller.delay_samples,
        command_limit=compiled.command_limit,
    )
    return float(np.ptp(result.torque_Nm[time >= 0.5 * time[-1]]))
