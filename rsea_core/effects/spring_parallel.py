"""A spring between the load and the frame."""

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
class SpringParallel(Term):
    """A second spring between the load and the ground.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.
    """

    effect: ClassVar[str] = "spring-parallel"
    law: ClassVar[str] = "linear"
    port: ClassVar[Port] = Port.LOAD

    stiffness_Nm_per_rad: float = parameter(
        unit="Nm/rad",
        bounds=(0.0, 1000.0),
        source="cables, a balancing spring; a fit",
        meaning="Stiffness of the second spring between load and ground.",
    )
    rest_angle_rad: float = parameter(
        0.0,
        unit="rad",
        bounds=(-7.0, 7.0),
        source="0: it rests where the load does",
        meaning="Load angle at which the second spring is unloaded.",
    )

    def __post_init__(self):
        require_bounds(self)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Its stiffness."""
        return {"stiffness_Nm_per_rad": self.stiffness_Nm_per_rad}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Stiffness and rest angle."""
        return {
            "parallel_stiffness": self.stiffness_Nm_per_rad,
            "parallel_rest_angle": self.rest_angle_rad,
        }

    def equation(self) -> str:
        """The law in one line."""
        return f"-{self.stiffness_Nm_per_rad:g} (theta_l - {self.rest_angle_rad:g}) on the load"
