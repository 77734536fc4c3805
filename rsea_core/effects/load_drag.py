"""Drag on the load that grows with the square of its speed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rsea_core.effects.base import Gear, Port, Term, parameter
from rsea_core.effects.curve import EffectCurve
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.load_base import HELD
from rsea_core.effects.relevant_size import RelevantSize, sized
from rsea_core.effects.slots import slots
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, RunConditions, TrialMachine, Unknown, Values

DRAG = slots("load_drag")


@njit(error_model="numpy", inline="always")
def drag_torque(fx, speed):
    """Against the speed [Nm]."""
    return fx[DRAG] * speed * abs(speed)


def _write(v: Values, d: TrialMachine, w: RunConditions) -> None:
    if w.kind not in HELD:
        d.put(DRAG, v["torque_at_5_rad_per_s_Nm"] / 25.0)


def _drawn(d: TrialMachine, v: Values, x: NDArray) -> NDArray:
    return d.fx[DRAG] * x * np.abs(x) + d.machine_numbers.load_damping * x


@dataclass(frozen=True, kw_only=True)
class LoadDrag(Term):
    """Drag of the link that grows with the square of its speed (air, a paddle)."""

    effect: ClassVar[str] = "load-drag"
    law: ClassVar[str] = "quadratic"
    port: ClassVar[Port] = Port.LOAD
    headline: ClassVar[str] = "Drag on the load grows with the square of its speed."
    figure_units: ClassVar[Mapping[str, str]] = {"torque_at_5_rad_per_s_Nm": "Nm"}
    curve: ClassVar = EffectCurve(
        title="Drag of the load", x_label="load speed (rad/s)", y_label="drag (Nm)",
        over="load_speed", evaluate=_drawn,
    )  # fmt: skip
    relevant: ClassVar = RelevantSize(
        variant="quadratic", part="load",
        size=lambda m: sized(m.load_torque_Nm, "drag of {:.2g} Nm at 5 rad/s"),
    )  # fmt: skip

    torque_at_5_rad_per_s_Nm: float = parameter(
        unit="Nm",
        bounds=(0.0, 1e9),
        source="quadratic drag of a bluff body; a fit",
        meaning="Drag torque of the link at 5 rad/s.",
    )

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Torque over speed squared."""
        return {"load_drag": self.torque_at_5_rad_per_s_Nm / 25.0}

    def equation(self) -> str:
        return f"-{self.torque_at_5_rad_per_s_Nm / 25.0:.5g} w_l |w_l| on the load"

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """A torque at a speed."""
        t, least = typical.load_torque_Nm, 0.0 if typical.relative else 0.3
        v = max(typical.speed_rad_per_s, least)
        return (
            Law(effect=cls.effect, law="quadratic", subsystem="load", write=_write, kind=cls,
                unknowns=(Unknown(name="torque_at_5_rad_per_s_Nm", unit="Nm", low=0.0,
                                  high=100 * t * 25 / v**2, scale=0.05 * t * 25 / v**2),),
                starts=((0.05 * t * 25 / v**2,), (0.3 * t * 25 / v**2,))),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The torque at a speed."""
        return (
            "drag on the load that grows with the square of its speed,"
            f" {f('torque_at_5_rad_per_s_Nm', 'Nm')} at {f.of(5.0, 'rad')}/s"
        )
