"""PID torque control of a series elastic joint with feedforward (the thesis' PID-FFC).

    u = tau_ref + J a_w + B w_w + K_p e + K_i int e + K_d de/dt         [Nm at the joint]
    w_w = tau_ref' / K(tau_ref) + w_l,    a_w = tau_ref'' / K(tau_ref) + a_l
    e = tau_ref - f(theta_m / N - theta_l),    both angles from encoders
    duty = u R / (N k_t V) + k_e N w_b / V

w_w, a_w is the motion that the wheel must make for the spring to follow the reference while
the load moves. K is the spring's tangent at the reference; that it changes along the reference
is neglected in a_w. w_b is the speed whose back-EMF is compensated: the wanted one
("reference", which leaves the motor's own back-EMF damping in the loop), the measured one
("measured", which takes it out) or none.

Source: the thesis' equations 4.3-4.5 with the spring's stiffness restored (4.3 must be
multiplied by K_s). Derivative filter and conditional anti-windup: Astrom & Hagglund, Advanced
PID Control (2006), section 3.
"""

import functools
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numba import cfunc

import rsea_core.kernel as k
from rsea_core.compiled import SOURCE_VERSION
from rsea_core.control.base import CompiledController, Controller, require_sampling
from rsea_core.errors import ControllerError
from rsea_core.inputs import COMMANDS, Load
from rsea_core.model import ActuatorModel
from rsea_core.terms.table import (
    table_deflection,
    table_tangent,
    table_torque,
)

BACK_EMF = ("none", "reference", "measured")
LOAD_MOTION = ("none", "velocity", "acceleration")

# parameters
KP, KI, KD, D_KEEP, T, GEAR, INERTIA, DAMPING = range(8)
FEEDFORWARD, FOLLOW_LOAD, LOAD_KEEP = 8, 9, 10
PER_TORQUE, PER_SPEED, EMF, LIMIT, IDEAL = range(11, 16)
N_SCALARS = 16  # then the regions of the spring's table
# state
ACTED, INTEGRAL, LAST_E, SLOPE_E, LAST_LOAD, LOAD_W, LOAD_A, LAST_MOTOR, MOTOR_W = range(9)
N_STATE = 9


@dataclass(frozen=True, kw_only=True)
class PidTorque(Controller):
    """PI or PID torque loop with feedforward; the law is in the module's docstring.

    The default gains are for the rig preset "rsea-bench" at 1 kHz with one sample of delay. With
    a locked output they leave a gain margin of 18.6 dB (26.7 Hz) and a phase margin of 59.1
    degrees (crossover 6.4 Hz), by `loop_margins`. A load that swings freely while its motion is
    compensated has next to no damping left, so the loop is then stable with hardly any margin.

    Attributes
    ----------
    kp : float
        Nm per Nm of torque error.
    ki : float
        1/s.
    kd : float
        s.
    sample_time_s : float
    derivative_filter_s : float
        Time constant of the first-order filter on de/dt.
    feedforward : bool
        tau_ref and the wheel's motion; without it u is the PID alone.
    load_feedforward : "none", "velocity" or "acceleration"
        How much of the measured load motion enters the wheel's motion. The acceleration of an
        encoder angle is coarse, and the lag of its filter takes damping from a swinging load.
    load_filter_s : float
        Time constant of the filters that make speed and acceleration of encoder angles.
    back_emf : "reference", "measured" or "none"
    delay_samples : int
    ideal_sensors : bool
        True: angles and speeds without quantisation and differencing.
    command_name : str
        What the drive takes: "duty" or another command of the rig.

    Raises
    ------
    ControllerError
        If a gain or filter is negative or not finite, the sample time is not positive, or a
        choice is unknown.
    """

    reference_name: ClassVar[str] = "reference_torque_Nm"

    kp: float = 60.0
    ki: float = 10.0
    kd: float = 0.0
    sample_time_s: float = 1e-3
    derivative_filter_s: float = 1e-3
    feedforward: bool = True
    load_feedforward: str = "velocity"
    load_filter_s: float = 0.02
    back_emf: str = "reference"
    delay_samples: int = 1
    ideal_sensors: bool = False
    command_name: str = "duty"

    def __post_init__(self):
        require_sampling(self)
        for name in ("kp", "ki", "kd", "derivative_filter_s", "load_filter_s"):
            if not 0.0 <= getattr(self, name) < np.inf:
                raise ControllerError(
                    f"pid-torque: {name} = {getattr(self, name)} must be finite and not negative"
                )
        for name, known in (
            ("back_emf", BACK_EMF),
            ("load_feedforward", LOAD_MOTION),
            ("command_name", COMMANDS),
        ):
            if getattr(self, name) not in known:
                raise ControllerError(
                    f"pid-torque: {name} = {getattr(self, name)!r} must be one of"
                    f" {', '.join(known)}"
                )

    def compile(self, model: ActuatorModel, load: Load) -> CompiledController:
        """The loop for one machine: its inertia, damping, spring and drive are in the law.

        Raises
        ------
        ControllerError
            If wheel and load are rigidly joined, so that there is no torque to measure.
        RigError
            If the rig lacks a value that the law needs.
        """
        plant = model.plant(self.command_name, load)
        if plant.structure not in (k.ELASTIC_FREE, k.ELASTIC_HELD):
            raise ControllerError(
                f"pid-torque: rig {model.rig.name!r} with the load {load.kind!r} has no spring"
                " between wheel and load whose deflection would measure the torque"
            )
        spring = model.spring_table(load)
        per_torque, per_speed, limit = _command_scale(plant, self.command_name, model)
        scalars = np.zeros(N_SCALARS)
        scalars[[KP, KI, KD, T]] = self.kp, self.ki, self.kd, self.sample_time_s
        scalars[D_KEEP] = _kept(self.derivative_filter_s, self.sample_time_s)
        scalars[[GEAR, INERTIA, DAMPING]] = plant.gear_ratio, plant.inertia, plant.damping
        scalars[FEEDFORWARD] = self.feedforward
        scalars[FOLLOW_LOAD] = LOAD_MOTION.index(self.load_feedforward)
        scalars[LOAD_KEEP] = _kept(self.load_filter_s, self.sample_time_s)
        scalars[[PER_TORQUE, PER_SPEED]] = per_torque, per_speed
        scalars[EMF] = BACK_EMF.index(self.back_emf)
        scalars[[LIMIT, IDEAL]] = limit, self.ideal_sensors
        return CompiledController(
            function=_compiled(SOURCE_VERSION),
            parameters=np.concatenate((scalars, spring.regions.ravel())),
            state=np.zeros(N_STATE),
            command_name=self.command_name,
            command_limit=limit,
        )


@functools.cache
def _compiled(version: int):
    """The law as compiled code, made when first used."""

    def pid(p, s, y, command):
        if version < 0:
            return
        spring = p[N_SCALARS:].reshape(-1, 6)
        ideal = p[IDEAL] != 0.0
        motor = y[k.TRUE_MOTOR_ANGLE] if ideal else y[k.READ_MOTOR_ANGLE]
        load = y[k.TRUE_LOAD_ANGLE] if ideal else y[k.READ_LOAD_ANGLE]
        target = y[k.REFERENCE]
        error = target - table_torque(spring, motor / p[GEAR] - load)
        if s[ACTED] == 0.0:
            s[ACTED], s[LAST_E], s[LAST_LOAD], s[LAST_MOTOR] = 1.0, error, load, motor
        keep_e, keep_l = p[D_KEEP], p[LOAD_KEEP]
        s[SLOPE_E] = keep_e * s[SLOPE_E] + (1.0 - keep_e) * (error - s[LAST_E]) / p[T]
        speed = keep_l * s[LOAD_W] + (1.0 - keep_l) * (load - s[LAST_LOAD]) / p[T]
        s[LOAD_A] = keep_l * s[LOAD_A] + (1.0 - keep_l) * (speed - s[LOAD_W]) / p[T]
        s[LOAD_W] = speed
        s[MOTOR_W] = keep_e * s[MOTOR_W] + (1.0 - keep_e) * (motor - s[LAST_MOTOR]) / p[T]
        s[LAST_E], s[LAST_LOAD], s[LAST_MOTOR] = error, load, motor
        if ideal:
            s[LOAD_W], s[MOTOR_W] = y[k.TRUE_LOAD_VELOCITY], y[k.TRUE_MOTOR_VELOCITY]

        stiffness = table_tangent(spring, table_deflection(spring, target))
        wanted_w = y[k.REFERENCE_RATE] / stiffness
        wanted_a = y[k.REFERENCE_ACCELERATION] / stiffness
        if p[FOLLOW_LOAD] >= 1.0:
            wanted_w += s[LOAD_W]
        if p[FOLLOW_LOAD] == 2.0:
            wanted_a += s[LOAD_A]
        u = p[KP] * error + p[KD] * s[SLOPE_E]
        if p[FEEDFORWARD] != 0.0:
            u += target + p[INERTIA] * wanted_a + p[DAMPING] * wanted_w
        compensated = 0.0
        if p[EMF] == 1.0:
            compensated = wanted_w
        elif p[EMF] == 2.0:
            compensated = s[MOTOR_W] / p[GEAR]
        base = p[PER_TORQUE] * u + p[PER_SPEED] * compensated
        # conditional integration: not further into saturation
        integral = s[INTEGRAL] + p[KI] * p[T] * error
        asked = base + p[PER_TORQUE] * integral
        if abs(asked) > p[LIMIT] and asked * error > 0.0:
            integral = s[INTEGRAL]
            asked = base + p[PER_TORQUE] * integral
        s[INTEGRAL] = integral
        command[k.COMMAND] = min(max(asked, -p[LIMIT]), p[LIMIT])
        command[k.UNSATURATED] = asked

    return cfunc(k.CONTROLLER, cache=True, error_model="numpy")(pid)


def _kept(time_constant_s: float, sample_time_s: float) -> float:
    """Share of its last value that a backward-Euler first-order filter keeps."""
    return time_constant_s / (time_constant_s + sample_time_s)


def _command_scale(
    plant: k.Plant, command_name: str, model: ActuatorModel
) -> tuple[float, float, float]:
    """Command per joint torque and per wheel speed, and the command's limit."""
    rig, n_kt = model.rig, plant.torque_per_ampere
    if command_name in ("duty", "voltage_V"):
        volts = plant.volts_per_command
        limit = 1.0
        if command_name == "voltage_V":
            rig.need("a voltage that is limited", "supply_voltage_V")
            limit = rig.supply_voltage_V
        return plant.resistance / (n_kt * volts), plant.volts_per_speed / volts, limit
    if command_name == "current_command_A":
        return 1.0 / n_kt, 0.0, plant.current_limit
    return (
        1.0 / plant.torque_per_motor_torque,
        0.0,
        plant.current_limit * (n_kt / plant.torque_per_motor_torque),
    )
