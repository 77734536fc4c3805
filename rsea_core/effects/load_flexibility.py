"""A flexible link: the load's inertia in two parts with a spring and a damper between them."""

import math
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
class LoadFlexibility(Term):
    """A flexible link: part of the load's inertia sits behind a spring and a damper.

    The joint side keeps the rest of the inertia, friction, contact and the whole gravity
    torque: the encoder and the weight belong to the joint's angle. What the outer part adds is
    its inertia alone.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.
    """

    effect: ClassVar[str] = "load-flexibility"
    law: ClassVar[str] = "one-mode"
    port: ClassVar[Port] = Port.LOAD

    link_stiffness_Nm_per_rad: float = parameter(
        unit="Nm/rad",
        bounds=(1.0, 1e5),
        source="a beam's 3 E I / l; a fit",
        meaning="Stiffness between the joint side and the outer part of the link.",
    )
    outer_fraction: float = parameter(
        unit="-",
        bounds=(0.01, 0.99),
        source="from the mass's place along the link; a fit",
        meaning="Share of the load's inertia that sits beyond the flexibility.",
    )
    link_damping_Nms_per_rad: float = parameter(
        0.0,
        unit="Nms/rad",
        bounds=(0.0, 100.0),
        source="0: none; a fit",
        meaning="Damping between the joint side and the outer part of the link.",
    )

    def __post_init__(self):
        require_bounds(self)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Frequency of both parts against each other, joint free."""
        inertia = context.need(self.effect, "load_inertia_kgm2")
        reduced = inertia * self.outer_fraction * (1.0 - self.outer_fraction)
        frequency = math.sqrt(self.link_stiffness_Nm_per_rad / reduced) / (2.0 * math.pi)
        return {"free_link_frequency_Hz": frequency}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Stiffness, outer inertia, damping."""
        return {
            "link_stiffness": self.link_stiffness_Nm_per_rad,
            "link_damping": self.link_damping_Nms_per_rad,
            "memory": 1.0,
        }

    def rig_numbers(self, rig, gravity: float) -> Mapping[str, float]:
        """Inertia of the outer part."""
        rig.need("a flexible link", "load_inertia_kgm2")
        return {"link_inertia": self.outer_fraction * rig.load_inertia_kgm2}

    def on_plant(self, plant):
        """The machine with the joint side's inertia."""
        return plant._replace(load_inertia=(1.0 - self.outer_fraction) * plant.load_inertia)

    def equation(self) -> str:
        """The law in one line."""
        return (
            f"tau_link = {self.link_stiffness_Nm_per_rad:g} (theta_l - theta_o)"
            f" + {self.link_damping_Nms_per_rad:g} (w_l - w_o),"
            f"  {self.outer_fraction:g} J_l w_o' = tau_link,"
            f"  {1.0 - self.outer_fraction:g} J_l w_l' = ... - tau_link"
        )
