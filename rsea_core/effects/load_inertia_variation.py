"""An inertia of the load that varies with its angle, such as that of a crank or a linkage."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rsea_core.effects.base import Gear, Port, Term, parameter
from rsea_core.effects.curve import EffectCurve
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.slots import slots
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, Unknown, writes_numbers

INERTIA_COSINE, INERTIA_SINE, INERTIA_CYCLES = slots(
    "inertia_cosine", "inertia_sine", "inertia_cycles"
)
LARGEST_PART = 0.67  # of the mean inertia: both parts together leave 5 % of it
PART_SCALE = 0.01  # step of a fit, of the mean inertia


@njit(error_model="numpy", inline="always")
def inertia_factor(fx, angle):
    """Inertia at a load angle [rad] over its mean, and the derivative of that [1/rad]."""
    if fx[INERTIA_COSINE] == 0.0 and fx[INERTIA_SINE] == 0.0:
        return 1.0, 0.0
    turned = fx[INERTIA_CYCLES] * angle
    cosine, sine = np.cos(turned), np.sin(turned)
    factor = 1.0 + fx[INERTIA_COSINE] * cosine + fx[INERTIA_SINE] * sine
    slope = fx[INERTIA_CYCLES] * (fx[INERTIA_SINE] * cosine - fx[INERTIA_COSINE] * sine)
    return factor, slope


@njit(error_model="numpy", inline="always")
def least_inertia_factor(fx):
    """The smallest inertia over its mean."""
    return 1.0 - np.hypot(fx[INERTIA_COSINE], fx[INERTIA_SINE])


def array_inertia_factor(fx: NDArray, angle: NDArray) -> NDArray:
    """Inertia over its mean for an array of load angles [rad]."""
    return inertia_factor.py_func(fx, angle)[0] + np.zeros_like(angle)


@dataclass(frozen=True, kw_only=True)
class LoadInertiaVariation(Term):
    """An inertia J (1 + a cos(n theta) + b sin(n theta)) of the load.

    The motion takes the torque J(theta) alpha + J'(theta) omega^2 / 2 (Lagrange's equation of the
    kinetic energy J(theta) omega^2 / 2). It is not an effect of the contract: a diagnosis that
    finds it reports `unexplained` with this formula.

    Source
    ------
    Norton, Design of Machinery (2012), section 11.4.
    """

    effect: ClassVar[str] = "load-inertia-variation"
    law: ClassVar[str] = "harmonic"
    port: ClassVar[Port] = Port.LOAD
    headline: ClassVar[str] = "The inertia of the load varies with its angle."
    figure_units: ClassVar[Mapping[str, str]] = {"cosine_share": "-", "sine_share": "-"}
    curve: ClassVar = EffectCurve(
        title="Inertia of the load over its mean", x_label="load angle (rad)",
        y_label="inertia over its mean", over="load_angle",
        evaluate=lambda d, v, x: array_inertia_factor(d.fx, x),
    )  # fmt: skip

    cosine_share: float = parameter(
        0.0, unit="-", bounds=(-LARGEST_PART, LARGEST_PART), source="a fit",
        meaning="Amplitude of the cosine of the angle, over the mean inertia.",
    )  # fmt: skip
    sine_share: float = parameter(
        0.0, unit="-", bounds=(-LARGEST_PART, LARGEST_PART), source="a fit",
        meaning="Amplitude of the sine of the angle, over the mean inertia.",
    )  # fmt: skip
    cycles_per_rev: float = parameter(
        1.0, unit="-", bounds=(1.0, 100.0), source="1: a crank; 2: a rod; a fit", free=False,
        meaning="Periods of the inertia in a turn of the load.",
    )  # fmt: skip

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Both parts and the number of periods."""
        return {"inertia_cosine": self.cosine_share, "inertia_sine": self.sine_share,
                "inertia_cycles": self.cycles_per_rev}  # fmt: skip

    def equation(self) -> str:
        angle = "theta" if self.cycles_per_rev == 1.0 else f"{self.cycles_per_rev:g} theta"
        wave = f"{self.cosine_share:.4g} cos({angle}) + {self.sine_share:.4g} sin({angle})"
        return f"J_l(theta) = J_l (1 + {wave}), the load feels J_l' omega^2 / 2 too"

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """None: it is tried where no effect of the contract is found (`unnamed`)."""
        return ()

    @classmethod
    def unnamed(cls, cycles: int) -> Law:
        """Both parts as free values, with a given number of periods in a turn of the load."""
        parts = tuple(
            Unknown(
                name=f"{part}_share",
                unit="-",
                low=-LARGEST_PART,
                high=LARGEST_PART,
                scale=PART_SCALE,
            )
            for part in ("cosine", "sine")
        )
        fixed = Unknown(name="cycles_per_rev", unit="-", low=cycles, high=cycles, scale=0.0)
        return Law(
            effect=cls.effect, law=cls.law, subsystem="load", kind=cls,
            write=writes_numbers(cls), unknowns=(*parts, fixed),
            starts=((0.0, 0.0, float(cycles)),),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The amplitude."""
        share = float(np.hypot(f.figures["cosine_share"], f.figures["sine_share"]))
        return f"an inertia of the load that varies by ± {f.percent(share)} with its angle"
