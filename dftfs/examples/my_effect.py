"""A template of an effect of one's own: a cable that drags along with the load.

    dftfs simulate|diagnose|predict ... --effects my_effect.py

Copy it, rename the class, the effect and its number, and write the law. Everything else follows
from this file: simulation, fit, screening, sentence, detectability, model.toml. Units are SI and
radians; see docs/adding-an-effect.md for the ports.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rsea_core.effects import Free, Port, Term, hook, parameter, slots

DRAG, SPEED = slots("cable_drag", "cable_speed")  # places of this effect's numbers


@hook("load_torque")
def cable_torque(fx, angle, speed, torque):
    """A drag that saturates: -level tanh(speed / speed scale), added to the load's torque."""
    if fx[DRAG] != 0.0:
        torque -= fx[DRAG] * np.tanh(speed / fx[SPEED])
    return torque


@dataclass(frozen=True, kw_only=True)
class CableDrag(Term):
    """A cable bundle that the load pulls through a guide."""

    effect: ClassVar[str] = "x-cable-drag"
    law: ClassVar[str] = "saturating"
    port: ClassVar[Port] = Port.LOAD
    headline: ClassVar[str] = "A cable drags on the load."

    level_Nm: float = parameter(
        unit="Nm",
        bounds=(0.0, 50.0),
        source="a fit",
        meaning="Largest drag of the cable.",
        fit=Free(of="load_torque_Nm", starts=(0.05, 0.3), step=0.03, high=20.0),
    )
    speed_rad_per_s: float = parameter(
        0.5,
        unit="rad/s",
        bounds=(1e-3, 100.0),
        source="a fit",
        meaning="Speed at which three quarters of it act.",
        fit=Free(starts=(0.5,), step=0.2, low=0.05, high=20.0, log=True, prior=1.0),
    )

    def numbers(self, gear) -> Mapping[str, float]:
        """What the law reads, by the names of `slots`."""
        return {"cable_drag": self.level_Nm, "cable_speed": self.speed_rad_per_s}

    def equation(self) -> str:
        """The law in one line."""
        return f"-{self.level_Nm:g} tanh(w_l / {self.speed_rad_per_s:g}) on the load"
