"""The linear machine around a state: matrices, poles, the step that the integrator takes.

    x' = A x + b u,   x = (current, wheel angle, wheel speed, load angle, load speed)

A state that a machine does not have (the current of a winding without inductance, the motion
of a held load) has a row of zeros.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import rsea_core.effects.layout as e
import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
from rsea_core.engines.event_driven.time_scales import rates_per_s
from rsea_core.errors import InputError
from rsea_core.machine.inputs import Load
from rsea_core.machine.spring_table import C1, SpringTable, spring_tangent_Nm_per_rad
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.numeric.arrays import read_only
from rsea_core.numeric.brief_repr import BriefRepr

STATE_NAMES = (
    "current_A",
    "wheel_angle_rad",
    "wheel_velocity_rad_per_s",
    "load_angle_rad",
    "load_velocity_rad_per_s",
)
STEP_PER_FASTEST = 0.5  # step times fastest mode: torque and energy are then good to 1e-9
LARGEST_STEP_PER_FASTEST = 2.0  # beyond it accuracy is gone, and soon stability
STEP_PER_SWING = 0.15  # of gravity's own time constant: a sine bends within a radian, not a period
FASTEST_SENSIBLE_per_s = 1e6


@dataclass(frozen=True, kw_only=True, repr=False)
class LinearModel(BriefRepr):
    """A linear machine; row k of A and element k of b belong to STATE_NAMES[k].

    Attributes
    ----------
    A : (5, 5) array
    b : (5,) array
        Per unit of the command (duty, V, A or Nm at the motor).
    torque_row : (5,) array
        tau_s = torque_row x, where wheel and load are joined by the spring.
    left_out : tuple of str
        Effects of the model that are not in these matrices: dry friction, drive limits, loads
        and whatever else is no smooth law of the spring.
    """

    A: NDArray
    b: NDArray
    torque_row: NDArray
    left_out: tuple[str, ...] = ()

    def poles(self) -> NDArray:
        """Eigenvalues of A [rad/s], those of absent states (zero) included."""
        return np.linalg.eigvals(self.A)


def linearise(
    model: ActuatorModel,
    *,
    command_name: str | None = "duty",
    load: Load,
    deflection_rad: float = 0.0,
    load_angle_rad: float = 0.0,
    in_contact: bool = False,
) -> LinearModel:
    """The machine around a deflection and a load angle, off its current limit.

    Raises
    ------
    RigError
        If the rig lacks a value that this drive and load need.
    """
    plant = model.plant(command_name, load)
    tangent = float(spring_tangent_Nm_per_rad(model.spring_table(load), deflection_rad))
    gravity = plant.gravity * np.cos(load_angle_rad + plant.gravity_offset)
    linear = linear_plant(plant, tangent=tangent, gravity_stiffness=gravity, in_contact=in_contact)
    left_out = tuple(term.effect for term in model.terms if not term.in_spring_table)
    return replace(linear, left_out=left_out)


def linear_plant(
    plant: mp.Plant, *, tangent: float, gravity_stiffness: float, in_contact: bool
) -> LinearModel:
    """The linear machine of a plant for given stiffnesses [Nm/rad]."""
    A, b = np.zeros((k.N_STATES, k.N_STATES)), np.zeros(k.N_STATES)
    A[k.TW, k.WW] = A[k.TL, k.WL] = 1.0
    torque = np.zeros(k.N_STATES)  # drive torque less friction, per state
    torque[k.WW] = -plant.damping
    torque_per_command = _drive_into(plant, A, b, torque)
    load = np.zeros(k.N_STATES)
    load[k.TL] = -gravity_stiffness
    load[k.WL] = -plant.load_damping
    if in_contact:
        load[k.TL] -= plant.contact_stiffness
        load[k.WL] -= plant.contact_damping
    spring = np.zeros(k.N_STATES)
    spring[k.TW], spring[k.TL] = tangent, -tangent
    if plant.structure in (mp.ELASTIC_FREE, mp.ELASTIC_HELD):
        A[k.WW] = (torque - spring) / plant.inertia
        b[k.WW] = torque_per_command / plant.inertia
    if plant.structure == mp.ELASTIC_FREE:
        A[k.WL] = (load + spring) / plant.load_inertia
    if plant.structure == mp.RIGID_FREE:
        A[k.WW] = A[k.WL] = (torque + load) / (plant.inertia + plant.load_inertia)
        b[k.WW] = b[k.WL] = torque_per_command / (plant.inertia + plant.load_inertia)
        spring[:] = 0.0
    if plant.structure in (mp.ELASTIC_HELD, mp.RIGID_HELD):
        A[k.TL, k.WL] = 0.0
    return LinearModel(A=read_only(A), b=read_only(b), torque_row=read_only(spring))


def _drive_into(plant: mp.Plant, A: NDArray, b: NDArray, torque: NDArray) -> float:
    """Enter the drive; returns the torque that follows the command without delay."""
    if plant.drive == mp.MOTOR_TORQUE:
        return plant.torque_per_motor_torque
    if plant.drive == mp.CURRENT:
        return plant.torque_per_ampere
    if plant.drive == mp.POSITION:
        torque[k.TW] -= plant.volts_per_command
        torque[k.WW] -= plant.volts_per_speed
        return plant.volts_per_command
    if plant.drive == mp.NO_DRIVE:
        return 0.0
    if plant.inductance > 0.0:
        A[k.IM, k.IM] = -plant.resistance / plant.inductance
        A[k.IM, k.WW] = -plant.volts_per_speed / plant.inductance
        b[k.IM] = plant.volts_per_command / plant.inductance
        torque[k.IM] = plant.torque_per_ampere
        return 0.0
    torque[k.WW] -= plant.torque_per_ampere * plant.volts_per_speed / plant.resistance
    return plant.torque_per_ampere * plant.volts_per_command / plant.resistance


def fastest_mode_per_s(plant: mp.Plant, spring: SpringTable) -> float:
    """Largest pole magnitude [rad/s] over the spring's tangents, in and out of contact."""
    tangents = {float(spring.regions[:, C1].min()), float(spring.regions[:, C1].max())}
    contacts = (False, True) if np.isfinite(plant.contact_angle) else (False,)
    fastest = 0.0
    for tangent in tangents:
        for contact in contacts:
            linear = linear_plant(
                plant, tangent=tangent, gravity_stiffness=plant.gravity, in_contact=contact
            )
            fastest = max(fastest, float(np.abs(linear.poles()).max()))
    return fastest


def fastest_per_s(plant: mp.Plant, spring: SpringTable, fx: NDArray) -> float:
    """The fastest of the linear modes and of the terms' own nonlinearities [1/s]."""
    plant = plant._replace(load_inertia=plant.load_inertia * e.least_inertia_factor.py_func(fx))
    no_load = plant.volts_per_command / plant.volts_per_speed if plant.volts_per_speed > 0 else 0.0
    of_terms = rates_per_s(
        fx,
        inertia=plant.inertia + (plant.load_inertia if plant.structure == mp.RIGID_FREE else 0.0),
        load_inertia=plant.load_inertia,
        wheel_speed=no_load,
        gear_ratio=plant.gear_ratio,
        contact_stiffness=plant.contact_stiffness,
        spring_stiffness=float(spring.regions[:, C1].max()),
        supply_V=plant.volts_per_command,
        inductance=plant.inductance,
    )
    return max(fastest_mode_per_s(plant, spring), of_terms)


def step_length_s(plant: mp.Plant, fastest: float, step_s: float | None) -> float:
    """The integration step: the asked one, or what the `fastest` rate [1/s] allows.

    Parameters
    ----------
    fastest : float
        `fastest_per_s` of the machine.

    Raises
    ------
    InputError
        If the asked step is too long for the fastest mode, or that mode is so fast that only
        a smaller model makes sense.
    """
    if fastest > FASTEST_SENSIBLE_per_s:
        raise InputError(
            f"the fastest mode, {fastest:.3g} rad/s, is above {FASTEST_SENSIBLE_per_s:.0g} rad/s:"
            " leave a negligible terminal_inductance_H out, or check inertias and stiffnesses"
        )
    if step_s is None:
        moving = plant.load_inertia + (plant.inertia if plant.structure == mp.RIGID_FREE else 0.0)
        swing = np.sqrt(plant.gravity / moving) if plant.gravity > 0.0 else 0.0
        limits = ((STEP_PER_FASTEST, fastest), (STEP_PER_SWING, swing))
        return min((share / mode for share, mode in limits if mode > 0.0), default=np.inf)
    if not step_s > 0.0:
        raise InputError(f"step_s = {step_s} must be above 0")
    if step_s * fastest > LARGEST_STEP_PER_FASTEST:
        raise InputError(
            f"step_s = {step_s:g} s is too long for the fastest mode of {fastest:.4g} rad/s: at"
            f" most {LARGEST_STEP_PER_FASTEST / fastest:.3g} s"
        )
    return step_s
