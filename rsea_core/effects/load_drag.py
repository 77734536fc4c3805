"""Drag on the load that grows with the square of its speed, or with another power of it."""

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
from rsea_core.machine.rig import Rig

DRAG, BEYOND_SQUARE = slots("load_drag", "load_drag_beyond_square")
SPEED_rad_per_s = 5.0  # at which the contract compares drags


@njit(error_model="numpy", inline="always")
def drag_damping(fx, speed):
    """Torque of the drag over the speed [Nms/rad]."""
    size = abs(speed)
    damping = fx[DRAG] * size
    if fx[BEYOND_SQUARE] != 0.0 and size > 0.0:
        damping *= (size / SPEED_rad_per_s) ** fx[BEYOND_SQUARE]
    return damping


@njit(error_model="numpy", inline="always")
def drag_torque(fx, speed):
    """Against the speed [Nm]."""
    return drag_damping(fx, speed) * speed


@njit(cache=True, error_model="numpy")
def _drag_torques(fx, speeds):
    """Torques (n,) of the drag."""
    return np.array([drag_torque(fx, speed) for speed in speeds])


def _write(v: Values, d: TrialMachine, w: RunConditions) -> None:
    if w.kind not in HELD:
        d.put(DRAG, v["torque_at_5_rad_per_s_Nm"] / SPEED_rad_per_s**2)


def _parameters(v: Values, rig: Rig | None) -> Values:
    """Of a power law whose torque is that at a speed which the recordings reach."""
    at_5 = v["torque_Nm"] * (SPEED_rad_per_s / v["speed_rad_per_s"]) ** v["exponent"]
    return {"torque_at_5_rad_per_s_Nm": at_5, "exponent": v["exponent"]}


def _write_power(v: Values, d: TrialMachine, w: RunConditions) -> None:
    found = _parameters(v, None)
    _write(found, d, w)
    if w.kind not in HELD:
        d.put(BEYOND_SQUARE, found["exponent"] - 2.0)


def _drawn(d: TrialMachine, v: Values, x: NDArray) -> NDArray:
    return _drag_torques(d.fx, x) + d.machine_numbers.load_damping * x


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
        return {"load_drag": self.torque_at_5_rad_per_s_Nm / SPEED_rad_per_s**2}

    def equation(self) -> str:
        return f"-{self.torque_at_5_rad_per_s_Nm / 25.0:.5g} w_l |w_l| on the load"

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """A torque at a speed."""
        t, least = typical.load_torque_Nm, 0.0 if typical.relative else 0.3
        v = max(typical.speed_rad_per_s, least)
        at_5 = t * SPEED_rad_per_s**2 / v**2
        torque = Unknown(name="torque_at_5_rad_per_s_Nm", unit="Nm", low=0.0, high=100 * at_5,
                         scale=0.05 * at_5)  # fmt: skip
        return (
            Law(effect=cls.effect, law=cls.law, subsystem="load", write=_write, kind=cls,
                richer=(PowerDrag.law,), unknowns=(torque,),
                starts=((0.05 * at_5,), (0.3 * at_5,))),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The torque at a speed."""
        return (
            "drag on the load that grows with the square of its speed,"
            f" {f('torque_at_5_rad_per_s_Nm', 'Nm')} at {f.of(5.0, 'rad')}/s"
        )


@dataclass(frozen=True, kw_only=True)
class PowerDrag(LoadDrag):
    """Drag of the link that grows with a power of its speed.

    Source
    ------
    White, Fluid Mechanics, ch. 7: in proportion to the speed in creeping flow, to its power 1.5
    along a laminar boundary layer, to its square in separated flow. The power is a fit.
    """

    law: ClassVar[str] = "power"
    headline: ClassVar[str] = "Drag on the load grows with a power of its speed."
    figure_units: ClassVar[Mapping[str, str]] = {**LoadDrag.figure_units, "exponent": "-"}
    relevant: ClassVar = None

    exponent: float = parameter(
        unit="-", bounds=(1.0, 5.0), source="2: a bluff body; a fit",
        meaning="Power of the speed with which the drag grows.",
    )  # fmt: skip

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Torque over speed squared at 5 rad/s, and the power beyond the square."""
        return super().numbers(gear) | {"load_drag_beyond_square": self.exponent - 2.0}

    def equation(self) -> str:
        return (
            f"-{self.torque_at_5_rad_per_s_Nm:.5g} Nm |w_l / ({SPEED_rad_per_s:g} rad/s)|^"
            f"{self.exponent:.4g} sgn(w_l) on the load"
        )

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """A torque at the speed that the load reaches, and a power."""
        t, speed = typical.load_torque_Nm, typical.speed_rad_per_s
        if not typical.relative:  # the bench's speeds span too little to tell a power
            return ()
        unknowns = (
            Unknown(name="torque_Nm", unit="Nm", low=0.0, high=100.0 * t, scale=0.05 * t),
            Unknown(name="exponent", unit="-", low=1.2, high=4.5, scale=0.1),
            Unknown(name="speed_rad_per_s", unit="rad/s", low=speed, high=speed, scale=0.0),
        )
        return (
            Law(effect=cls.effect, law=cls.law, subsystem="load", kind=cls, write=_write_power,
                parameters=_parameters, unknowns=unknowns,
                starts=((0.05 * t, 2.0, speed), (0.3 * t, 2.0, speed))),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The torque at a speed, and the power."""
        return (
            f"drag on the load that grows with the power {f.figures['exponent']:.2g} of its speed,"
            f" {f('torque_at_5_rad_per_s_Nm', 'Nm')} at {f.of(5.0, 'rad')}/s"
        )
