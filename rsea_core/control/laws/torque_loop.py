"""What every torque loop of this package shares: signals, feedforward, friction, command.

    e   = tau_ref - f(theta_m / N - theta_l)                   both angles from encoders
    w_w = tau_ref' / K(tau_ref) + w_l,   a_w = tau_ref'' / K(tau_ref) + a_l
    u   = tau_ref + J a_w + B w_w + c tau_f(w_w, tau_ref) + (the controller's own law)   [Nm]
    duty = u R / (N k_t V) + k_e N w_b / V

w_w, a_w is the motion that the wheel must make for the spring to follow the reference while the
load moves. K is the spring's tangent at the reference; that it changes along the reference is
neglected in a_w. w_b is the speed whose back-EMF is compensated: the wanted one ("reference",
which leaves the motor's own back-EMF damping in the loop), the measured one ("measured", which
takes it out) or none. J and B are the rig's own. tau_f is the gear friction that the model's
terms know (Coulomb, Stribeck, load-dependent, viscous, the thesis' equation 3.8), at the wanted
speed, because the measured one chatters at rest; its sign is smoothed over
`friction_smoothing_rad_per_s`. c is `friction_compensation`: 1 takes the model's word, 0 leaves
it out.

Source: the thesis' equations 4.3-4.5 with the spring's stiffness restored (4.3 must be
multiplied by K_s) and 3.15. Derivative filter and conditional anti-windup: Astrom & Hagglund,
Advanced PID Control (2006), section 3.
"""

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

import rsea_core.effects.layout as fx
import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
from rsea_core.control.laws.base import (
    CompiledController,
    Controller,
    plant_with_spring,
    require_choices,
    require_sampling,
    require_values,
)
from rsea_core.machine.inputs import COMMANDS, Load
from rsea_core.machine.spring_table import table_deflection, table_tangent, table_torque
from rsea_core.model.actuator_model import ActuatorModel

BACK_EMF = ("none", "reference", "measured")
LOAD_MOTION = ("none", "velocity", "acceleration")
ELECTRIC = ("duty", "voltage_V")

# parameters
T, D_KEEP, LOAD_KEEP, GEAR, INERTIA, DAMPING, FEEDFORWARD, FOLLOW_LOAD = range(8)
PER_TORQUE, PER_SPEED, EMF, LIMIT, IDEAL = range(8, 13)
COMPENSATION, SMOOTHING, FORWARD, BACKWARD, RISE, STRIBECK = range(13, 19)
DRIVE_LOSS, BACKDRIVE_LOSS, ATAN_LEVEL, ATAN_VELOCITY, OFFSET, VISCOUS = range(19, 25)
N_SHARED = 25  # then a law's own, then the regions of the spring's table
# state
ACTED, INTEGRAL, LAST_E, SLOPE_E, LAST_LOAD, LOAD_W, LOAD_A, LAST_MOTOR, MOTOR_W = range(9)
N_SHARED_STATE = 9
FRICTION_NUMBERS = {
    FORWARD: fx.GEAR_FORWARD,
    BACKWARD: fx.GEAR_BACKWARD,
    RISE: fx.GEAR_RISE,
    STRIBECK: fx.GEAR_STRIBECK,
    DRIVE_LOSS: fx.GEAR_DRIVE_LOSS,
    BACKDRIVE_LOSS: fx.GEAR_BACKDRIVE_LOSS,
    ATAN_LEVEL: fx.ATAN_LEVEL,
    ATAN_VELOCITY: fx.ATAN_VELOCITY,
    OFFSET: fx.GEAR_OFFSET,
    VISCOUS: fx.GEAR_VISCOUS,
}


class LoopMachine(NamedTuple):
    """What a law may read of the machine that it is compiled for."""

    model: ActuatorModel
    load: Load
    plant: mp.Plant
    limit: float  # of the command
    per_torque: float  # command per joint torque


@dataclass(frozen=True, kw_only=True)
class TorqueLoop(Controller):
    """Base of the torque controllers; the shared law is in the module's docstring.

    Attributes
    ----------
    sample_time_s : float
    derivative_filter_s : float
        Time constant of the first-order filter on de/dt and on the motor's speed.
    feedforward : bool
        tau_ref and the wheel's motion; without it u is the controller's own law alone.
    load_feedforward : "none", "velocity" or "acceleration"
        How much of the measured load motion enters the wheel's motion. The acceleration of an
        encoder angle is coarse, and the lag of its filter takes damping from a swinging load.
    load_filter_s : float
        Time constant of the filters that make speed and acceleration of encoder angles.
    back_emf : "reference", "measured" or "none"
    friction_compensation : float
        Share of the model's gear friction that is compensated; above 1 it pushes by itself.
    friction_smoothing_rad_per_s : float
        Wanted wheel speed at which tanh(w / smoothing) takes the place of the sign.
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

    kind: ClassVar[str]
    gains: ClassVar[tuple[str, ...]] = ()  # of the law itself: finite and not negative
    n_states: ClassVar[int] = N_SHARED_STATE
    reference_name: ClassVar[str] = "reference_torque_Nm"

    sample_time_s: float = 1e-3
    derivative_filter_s: float = 1e-3
    feedforward: bool = True
    load_feedforward: str = "velocity"
    load_filter_s: float = 0.02
    back_emf: str = "reference"
    friction_compensation: float = 0.0
    friction_smoothing_rad_per_s: float = 0.02
    delay_samples: int = 1
    ideal_sensors: bool = False
    command_name: str = "duty"

    def __post_init__(self):
        require_sampling(self)
        shared = ("derivative_filter_s", "load_filter_s", "friction_compensation")
        require_values(self, (*self.gains, *shared), "finite and not negative")
        require_values(self, ["friction_smoothing_rad_per_s"], "finite and above 0")
        require_choices(
            self, back_emf=BACK_EMF, load_feedforward=LOAD_MOTION, command_name=COMMANDS
        )

    @abstractmethod
    def own(self, machine: LoopMachine) -> tuple[Any, ArrayLike]:
        """The law's compiled function and its own parameters, for one machine."""

    def compile(self, model: ActuatorModel, load: Load) -> CompiledController:
        """The loop for one machine: its inertia, damping, spring and drive are in the law.

        Raises
        ------
        ControllerError
            If wheel and load are rigidly joined, so that there is no torque to measure.
        RigError
            If the rig lacks a value that the law needs.
        """
        plant = plant_with_spring(self, model, self.command_name, load)
        per_torque, per_speed, limit = command_scale(plant, self.command_name, model)
        p = np.zeros(N_SHARED)
        p[T], p[D_KEEP] = self.sample_time_s, kept(self.derivative_filter_s, self.sample_time_s)
        p[LOAD_KEEP] = kept(self.load_filter_s, self.sample_time_s)
        p[[GEAR, INERTIA, DAMPING]] = plant.gear_ratio, plant.inertia, plant.damping
        p[FEEDFORWARD] = self.feedforward
        p[FOLLOW_LOAD] = LOAD_MOTION.index(self.load_feedforward)
        p[[PER_TORQUE, PER_SPEED]] = per_torque, per_speed
        p[EMF] = BACK_EMF.index(self.back_emf)
        p[[LIMIT, IDEAL]] = limit, self.ideal_sensors
        p[COMPENSATION] = self.friction_compensation
        p[SMOOTHING] = self.friction_smoothing_rad_per_s
        if self.friction_compensation > 0.0:
            known = model.effects(self.command_name, load)
            for mine, theirs in FRICTION_NUMBERS.items():
                p[mine] = known[theirs]
        function, own = self.own(LoopMachine(model, load, plant, limit, per_torque))
        return CompiledController(
            function=function,
            parameters=np.concatenate((p, own, model.spring_table(load).regions.ravel())),
            state=np.zeros(self.n_states),
            command_name=self.command_name,
            command_limit=limit,
        )


@njit(error_model="numpy", inline="always")
def sense(p, s, y, spring):
    """Torque error [Nm] from the readings; filters speeds and the error's slope in the state."""
    ideal = p[IDEAL] != 0.0
    motor = y[k.TRUE_MOTOR_ANGLE] if ideal else y[k.READ_MOTOR_ANGLE]
    load = y[k.TRUE_LOAD_ANGLE] if ideal else y[k.READ_LOAD_ANGLE]
    error = y[k.REFERENCE] - table_torque(spring, motor / p[GEAR] - load)
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
    return error


@njit(error_model="numpy", inline="always")
def friction_estimate(p, speed, torque):
    """Gear friction [Nm] that the model expects at this wheel speed and spring torque."""
    level = p[FORWARD] if speed > 0.0 else p[BACKWARD]
    if p[RISE] > 0.0:
        level *= 1.0 + p[RISE] * np.exp(-((speed / p[STRIBECK]) ** 2))
    loss = p[DRIVE_LOSS] if speed * torque > 0.0 else p[BACKDRIVE_LOSS]
    friction = (level + loss * abs(torque)) * np.tanh(speed / p[SMOOTHING])
    if p[ATAN_LEVEL] != 0.0:
        friction += p[ATAN_LEVEL] * np.arctan(speed / p[ATAN_VELOCITY])
    return friction + p[VISCOUS] * speed + p[OFFSET]


@njit(error_model="numpy", inline="always")
def prepared(p, s, y, spring):
    """Feedforward [Nm], friction compensation [Nm], the speed whose back-EMF is compensated."""
    target = y[k.REFERENCE]
    stiffness = table_tangent(spring, table_deflection(spring, target))
    wanted_w = y[k.REFERENCE_RATE] / stiffness
    wanted_a = y[k.REFERENCE_ACCELERATION] / stiffness
    if p[FOLLOW_LOAD] >= 1.0:
        wanted_w += s[LOAD_W]
    if p[FOLLOW_LOAD] == 2.0:
        wanted_a += s[LOAD_A]
    torque = 0.0
    if p[FEEDFORWARD] != 0.0:
        torque += target + p[INERTIA] * wanted_a + p[DAMPING] * wanted_w
    friction = 0.0
    if p[COMPENSATION] != 0.0:
        friction = p[COMPENSATION] * friction_estimate(p, wanted_w, target)
    compensated = 0.0
    if p[EMF] == 1.0:
        compensated = wanted_w
    elif p[EMF] == 2.0:
        compensated = s[MOTOR_W] / p[GEAR]
    return torque, friction, compensated


@njit(error_model="numpy", inline="always")
def integrated(p, s, base, rate):
    """The command with its integral, which does not go further into saturation.

    `base` is the command without the integral, `rate` what the integral [Nm] gains a sample.
    """
    integral = s[INTEGRAL] + rate
    asked = base + p[PER_TORQUE] * integral
    if abs(asked) > p[LIMIT] and asked * rate > 0.0:
        integral = s[INTEGRAL]
        asked = base + p[PER_TORQUE] * integral
    s[INTEGRAL] = integral
    return asked


@njit(error_model="numpy", inline="always")
def give(p, command, asked):
    """Write a command within its limit."""
    command[k.COMMAND] = min(max(asked, -p[LIMIT]), p[LIMIT])
    command[k.UNSATURATED] = asked


def kept(time_constant_s: float, sample_time_s: float) -> float:
    """Share of its last value that a backward-Euler first-order filter keeps."""
    return time_constant_s / (time_constant_s + sample_time_s)


def command_scale(
    plant: mp.Plant, command_name: str, model: ActuatorModel
) -> tuple[float, float, float]:
    """Command per joint torque and per wheel speed, and the command's limit.

    Raises
    ------
    RigError
        If a voltage is commanded and the rig has no supply voltage to limit it.
    """
    rig, n_kt = model.rig, plant.torque_per_ampere
    if command_name in ELECTRIC:
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
