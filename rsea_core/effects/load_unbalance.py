"""A mass on the load that the rig file does not state."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import (
    NO_CONTEXT,
    Context,
    Gear,
    Port,
    Term,
    parameter,
    require_bounds,
)


@dataclass(frozen=True, kw_only=True)
class LoadUnbalance(Term):
    """Gravity on an eccentric mass that the rig does not name; acts on every moving load.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.
    """

    effect: ClassVar[str] = "load-unbalance"
    law: ClassVar[str] = "eccentric-mass"
    port: ClassVar[Port] = Port.LOAD

    torque_amplitude_Nm: float = parameter(
        unit="Nm",
        bounds=(0.0, 50.0),
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

    def __post_init__(self):
        require_bounds(self)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Amplitude and angle."""
        return {"torque_amplitude_Nm": self.torque_amplitude_Nm, "angle_rad": self.angle_rad}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Amplitude and angle."""
        return {"unbalance_torque": self.torque_amplitude_Nm, "unbalance_angle": self.angle_rad}

    def equation(self) -> str:
        """The law in one line."""
        return f"-{self.torque_amplitude_Nm:g} sin(theta_l + {self.angle_rad:g}) on the load"
