"""A mass on the load that the rig file does not state."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rsea_core.effects.base import Gear, Port, Term, parameter
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.hooks import hook
from rsea_core.effects.load_base import HELD, draw_over_angle
from rsea_core.effects.slots import slots
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, RunConditions, TrialMachine, Unknown, Values
from rsea_core.machine.rig import Rig

UNBALANCE, UNBALANCE_ANGLE = slots("unbalance_torque", "unbalance_angle")


@hook("load_torque")
def unbalance_torque(fx, angle, speed, torque):
    """Gravity on the mass."""
    if fx[UNBALANCE] != 0.0:
        torque -= fx[UNBALANCE] * np.sin(angle + fx[UNBALANCE_ANGLE])
    return torque


def unbalance(torque_Nm: float) -> Law:
    """A gravity torque that the rig does not name, by its sine and cosine parts."""
    pair = {"unit": "Nm", "low": -100 * torque_Nm, "high": 100 * torque_Nm,
            "scale": 0.02 * torque_Nm}  # fmt: skip
    return Law(
        effect="load-unbalance", law="eccentric mass", subsystem="load", write=_write,
        unknowns=(Unknown(name="sin_Nm", **pair), Unknown(name="cos_Nm", **pair)),
        starts=((0.05 * torque_Nm, 0.0),), kind=LoadUnbalance, parameters=_parameters,
    )  # fmt: skip


def _write(v: Values, d: TrialMachine, w: RunConditions) -> None:
    if w.kind in HELD:
        return
    a, b = v["sin_Nm"], v["cos_Nm"]
    d.put(UNBALANCE, float(np.hypot(a, b)))
    d.put(UNBALANCE_ANGLE, float(np.arctan2(b, a)))


def _parameters(v: Values, rig: Rig) -> Values:
    a, b = v["sin_Nm"], v["cos_Nm"]
    return {"torque_amplitude_Nm": float(np.hypot(a, b)), "angle_rad": float(np.arctan2(b, a))}


@dataclass(frozen=True, kw_only=True)
class LoadUnbalance(Term):
    """Gravity on an eccentric mass that the rig does not name; acts on every moving load."""

    effect: ClassVar[str] = "load-unbalance"
    law: ClassVar[str] = "eccentric-mass"
    port: ClassVar[Port] = Port.LOAD
    headline: ClassVar[str] = "The load's gravity torque differs from that of the rig file."
    figure_units: ClassVar[Mapping[str, str]] = {"torque_amplitude_Nm": "Nm", "angle_rad": "rad"}
    curve: ClassVar = draw_over_angle()

    torque_amplitude_Nm: float = parameter(
        unit="Nm",
        bounds=(0.0, 1e9),
        source="m g d of the eccentric mass; a fit",
        meaning="Largest gravity torque of the mass that the rig does not name.",
    )
    angle_rad: float = parameter(
        0.0,
        unit="rad",
        bounds=(-7.0, 7.0),
        source="0: it hangs where the link hangs",
        meaning="Load angle, negative, at which that mass hangs.",
    )

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Amplitude and angle."""
        return {"unbalance_torque": self.torque_amplitude_Nm, "unbalance_angle": self.angle_rad}

    def equation(self) -> str:
        return f"-{self.torque_amplitude_Nm:g} sin(theta_l + {self.angle_rad:g}) on the load"

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """Two parts, where a load hangs; in windows also where one turns that should not."""
        turns = typical.rig is None or typical.rig.axis != "linear"
        hangs = {"pendulum", "contact"} | ({"free"} if typical.relative and turns else set())
        if not hangs & set(typical.loads):
            return ()
        return (unbalance(typical.load_torque_Nm),)

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The size."""
        size = f("torque_amplitude_Nm", "Nm")
        return f"an unbalance of the load that the rig file does not state, {size}"
