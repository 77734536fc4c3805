"""PID torque control: the thesis' PD, PID, PID-FF and PID-FFC, and PID-FFC with compensation.

    u_own = K_p e + K_i int e + K_d de/dt        [Nm at the joint]

added to what `torque_loop` prepares. The thesis compares PID-FFC with a fuzzy controller and
with a fuzzy controller with friction compensation; the fourth of the square, PID-FFC with the
same compensation, is `friction_compensation = 1` here.
"""

import functools
from dataclasses import dataclass
from typing import ClassVar

from numba import cfunc

import rsea_core.control.laws.torque_loop as loop
import rsea_core.engines.event_driven.states as k
from rsea_core.numeric.source_version import SOURCE_VERSION

KP, KI, KD = range(loop.N_SHARED, loop.N_SHARED + 3)
SPRING = loop.N_SHARED + 3


@dataclass(frozen=True, kw_only=True)
class PidTorque(loop.TorqueLoop):
    """PI or PID torque loop with feedforward and friction compensation.

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

    The others, and what is raised, are those of `torque_loop.TorqueLoop`.
    """

    kind: ClassVar[str] = "pid-torque"
    gains: ClassVar[tuple[str, ...]] = ("kp", "ki", "kd")

    kp: float = 60.0
    ki: float = 10.0
    kd: float = 0.0

    def own(self, machine: loop.LoopMachine):
        """The three gains."""
        return _compiled(SOURCE_VERSION), [self.kp, self.ki, self.kd]


@functools.cache
def _compiled(version: int):
    """The law as compiled code, made when first used."""

    def pid(p, s, y, command):
        if version < 0:
            return
        spring = p[SPRING:].reshape(-1, 6)
        error = loop.sense(p, s, y, spring)
        torque, friction, compensated = loop.prepared(p, s, y, spring)
        torque += friction + p[KP] * error + p[KD] * s[loop.SLOPE_E]
        base = p[loop.PER_TORQUE] * torque + p[loop.PER_SPEED] * compensated
        loop.give(p, command, loop.integrated(p, s, base, p[KI] * p[loop.T] * error))

    return cfunc(k.CONTROLLER, cache=True, error_model="numpy")(pid)
