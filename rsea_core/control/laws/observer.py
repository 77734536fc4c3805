"""Torque control with a disturbance observer: what a laboratory would take today.

An extended state observer follows the wheel's angle and finds the torque z that the model of
drive, inertia and damping leaves unexplained, dry friction first of all:

    J w' = N k_t (V u - k_e N w) / R - B w - f(theta_w - theta_l) + z

    a' = w + 3 q (theta_w - a),   w' = ... + 3 q^2 (theta_w - a),   z' = J q^3 (theta_w - a)

-z is added to the torque of a PID loop with feedforward. All three poles of the observer lie at
q: fast against what disturbs, slow against an encoder count. Because it takes what a
compensator would and needs no friction model, it is the honest rival of both.

Source: Gao, Scaling and bandwidth-parameterization based controller tuning, ACC 2003; Kong, Bae &
Tomizuka, IEEE/ASME Trans. Mechatronics 14 (2009) 105 for the series elastic actuator.
"""

import functools
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numba import cfunc

import rsea_core.control.laws.torque_loop as loop
import rsea_core.engines.event_driven.states as k
from rsea_core.errors import ControllerError
from rsea_core.machine.spring_table import table_torque
from rsea_core.numeric.source_version import SOURCE_VERSION

KP, KI, KD, Q, SHARE, ELECTRIC_DAMPING, Z_LIMIT, LATE = range(loop.N_SHARED, loop.N_SHARED + 8)
SPRING = loop.N_SHARED + 8
ANGLE, SPEED, EXTRA, ACTING, GIVEN = range(loop.N_SHARED_STATE, loop.N_SHARED_STATE + 5)


@dataclass(frozen=True, kw_only=True)
class DisturbanceObserverTorque(loop.TorqueLoop):
    """PID torque loop with feedforward and an extended state observer.

    Attributes
    ----------
    kp, ki, kd : float
        As `PidTorque`.
    observer_rad_per_s : float
        q; at most a fifth of the sampling rate in rad/s.
    rejection : float
        Share of the found torque that is taken out, 0 to 1.

    The others, and what is raised, are those of `torque_loop.TorqueLoop`.
    """

    kind: ClassVar[str] = "disturbance-observer"
    gains: ClassVar[tuple[str, ...]] = ("kp", "ki", "kd", "observer_rad_per_s", "rejection")
    n_states: ClassVar[int] = loop.N_SHARED_STATE + 5

    kp: float = 60.0
    ki: float = 10.0
    kd: float = 0.0
    observer_rad_per_s: float = 150.0
    rejection: float = 0.9

    def __post_init__(self):
        super().__post_init__()
        if self.rejection > 1.0:
            raise ControllerError(f"{self.kind}: rejection = {self.rejection} must be at most 1")
        if not 0.0 < self.observer_rad_per_s * self.sample_time_s <= 0.4 * np.pi:
            raise ControllerError(
                f"{self.kind}: observer_rad_per_s = {self.observer_rad_per_s:g} with a sample time"
                f" of {self.sample_time_s:g} s must be above 0 and at most"
                f" {0.4 * np.pi / self.sample_time_s:.4g}"
            )

    def own(self, machine: loop.LoopMachine):
        """Gains, the observer's pole, the motor's own braking and the torque at the limit."""
        plant, braking = machine.plant, 0.0
        if self.command_name in loop.ELECTRIC:
            braking = plant.torque_per_ampere * plant.volts_per_speed / plant.resistance
        # poles of the sampled observer at the same place as the continuous one's
        pole = np.exp(-self.observer_rad_per_s * self.sample_time_s)
        gains = [self.kp, self.ki, self.kd, pole, self.rejection]
        largest = machine.limit / machine.per_torque
        return _compiled(SOURCE_VERSION), [*gains, braking, largest, self.delay_samples]


@functools.cache
def _compiled(version: int):
    """The law as compiled code, made when first used."""

    def observer(p, s, y, command):
        if version < 0:
            return
        spring = p[SPRING:].reshape(-1, 6)
        first = s[loop.ACTED] == 0.0
        error = loop.sense(p, s, y, spring)
        wheel, load = s[loop.LAST_MOTOR] / p[loop.GEAR], s[loop.LAST_LOAD]
        if first:
            s[ANGLE] = wheel
        # predict over the last sample with the command that acted, then correct by the angle
        T = p[loop.T]
        torque = s[ACTING] / p[loop.PER_TORQUE]
        torque -= (p[loop.DAMPING] + p[ELECTRIC_DAMPING]) * s[SPEED]
        torque += s[EXTRA] - table_torque(spring, s[ANGLE] - load)
        acceleration = torque / p[loop.INERTIA]
        angle = s[ANGLE] + T * s[SPEED] + 0.5 * T * T * acceleration
        speed = s[SPEED] + T * acceleration
        miss = wheel - angle
        pole = p[Q]
        s[ANGLE] = angle + (1.0 - pole**3) * miss
        s[SPEED] = speed + 1.5 * (1.0 - pole) ** 2 * (1.0 + pole) / T * miss
        extra = s[EXTRA] + p[loop.INERTIA] * (1.0 - pole) ** 3 / T**2 * miss
        s[EXTRA] = min(max(extra, -p[Z_LIMIT]), p[Z_LIMIT])

        u, friction, compensated = loop.prepared(p, s, y, spring)
        # the observer finds the whole friction: what is compensated already is not its to take out
        u += friction - p[SHARE] * (s[EXTRA] + friction)
        u += p[KP] * error + p[KD] * s[loop.SLOPE_E]
        base = p[loop.PER_TORQUE] * u + p[loop.PER_SPEED] * compensated
        asked = loop.integrated(p, s, base, p[KI] * T * error)
        loop.give(p, command, asked)
        # with a sample of delay the command given last time acts until the next reading
        s[ACTING] = s[GIVEN] if p[LATE] != 0.0 else command[k.COMMAND]
        s[GIVEN] = command[k.COMMAND]

    return cfunc(k.CONTROLLER, cache=True, error_model="numpy")(observer)
