"""Drag on the load that grows with the square of its speed."""

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
class LoadDrag(Term):
    """Drag of the link that grows with the square of its speed (air, a paddle).

    Raises
    ------
    TermError
        If a parameter is outside its bounds.
    """

    effect: ClassVar[str] = "load-drag"
    law: ClassVar[str] = "quadratic"
    port: ClassVar[Port] = Port.LOAD

    torque_at_5_rad_per_s_Nm: float = parameter(
        unit="Nm",
        bounds=(0.0, 50.0),
        source="quadratic drag of a bluff body; a fit",
        meaning="Drag torque of the link at 5 rad/s.",
    )

    def __post_init__(self):
        require_bounds(self)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Drag at 5 rad/s."""
        return {"torque_at_5_rad_per_s_Nm": self.torque_at_5_rad_per_s_Nm}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Torque over speed squared."""
        return {"load_drag": self.torque_at_5_rad_per_s_Nm / 25.0}

    def equation(self) -> str:
        """The law in one line."""
        return f"-{self.torque_at_5_rad_per_s_Nm / 25.0:.5g} w_l |w_l| on the load"
