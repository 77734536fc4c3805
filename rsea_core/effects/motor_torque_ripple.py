"""Ripple of the torque constant over the motor angle."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numba import njit

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter
from rsea_core.effects.slots import slots

RIPPLE, RIPPLE_CYCLES, RIPPLE_PHASE = slots(
    "ripple_fraction", "ripple_cycles_at_output", "ripple_phase"
)


@njit(error_model="numpy", inline="always")
def ripple_factor(fx, wheel):
    """Factor on k_t and k_e alike, over the motor's angle."""
    return 1.0 + fx[RIPPLE] * np.sin(fx[RIPPLE_CYCLES] * wheel + fx[RIPPLE_PHASE])


@dataclass(frozen=True, kw_only=True)
class TorqueRipple(Term):
    """Torque constant that is periodic in the motor's angle, one harmonic.

    The factor 1 + r sin(n theta_m + phase) stands before the torque constant and before the
    back-EMF constant alike, as the shape of a winding's back-EMF gives it: it makes no energy.
    """

    effect: ClassVar[str] = "motor-cogging"
    law: ClassVar[str] = "ripple"
    port: ClassVar[Port] = Port.GEAR

    ripple_fraction: float = parameter(
        unit="-",
        bounds=(0.0, 0.5),
        source="2-10 % of trapezoidal commutation; a fit",
        meaning="Amplitude of the torque constant's variation over its mean.",
    )
    cycles_per_rev: float = parameter(
        unit="-",
        bounds=(1.0, 400.0),
        source="six times the pole pairs",
        meaning="Periods of the variation in a turn of the motor.",
        free=False,
    )
    phase_rad: float = parameter(
        0.0,
        unit="rad",
        bounds=(-7.0, 7.0),
        source="a fit",
        meaning="Phase of the variation at motor angle zero.",
    )

    @property
    def key(self) -> str:
        """It may stand beside a cogging torque."""
        return f"{self.effect}:{self.law}"

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Fraction and cycles in a turn of the motor."""
        return {"ripple_fraction": self.ripple_fraction, "cycles_per_rev": self.cycles_per_rev}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Fraction, cycles per radian of the output."""
        return {
            "ripple_fraction": self.ripple_fraction,
            "ripple_cycles_at_output": self.cycles_per_rev / gear.motion_to_output(1.0),
            "ripple_phase": self.phase_rad,
        }

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """A torque that is known needs no torque constant."""
        electric = command_name in ("duty", "voltage_V", "current_command_A")
        return None if electric else "needs a drive by duty, voltage or current"

    def equation(self) -> str:
        return (
            f"k_t and k_e times 1 + {self.ripple_fraction:g}"
            f" sin({self.cycles_per_rev:g} theta_m + {self.phase_rad:g})"
        )
