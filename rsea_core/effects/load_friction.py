"""Dry friction in the load's joint."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import (
    LUGRE,
    NO_CONTEXT,
    Context,
    Gear,
    Port,
    SHORTEST_PRESLIDING_rad,
    Term,
    on_bristles,
    parameter,
    require_bounds,
    require_one_presliding,
)

ARMSTRONG = "Armstrong-Helouvry et al., Automatica 30 (1994) 1083"


@dataclass(frozen=True, kw_only=True)
class LoadFriction(Term):
    """Coulomb and Stribeck friction of the load's joint.

    F = coulomb (1 + rise exp(-(w_l/w_s)^2)) against the motion; at rest it holds, exactly, up to
    coulomb (1 + rise), or, with a presliding stretch, is elastic until it slides, or on
    bristles, damped as they bend (LuGre, `engines.event_driven.bristles`). Bearing load adds
    lever |N|, N = hypot(m d w^2 + m g cos, m g sin), without elasticity.

    Raises
    ------
    TermError
        If a parameter is outside its bounds, or friction is both a stop's and on bristles.
    """

    effect: ClassVar[str] = "load-friction"
    law: ClassVar[str] = "coulomb-stribeck"
    port: ClassVar[Port] = Port.LOAD

    coulomb_Nm: float = parameter(
        unit="Nm",
        bounds=(0.0, 50.0),
        source="a fit",
        meaning="Friction torque of the load joint at speed.",
    )
    stribeck_rise: float = parameter(
        0.0,
        unit="-",
        bounds=(0.0, 3.0),
        source=f"0: no Stribeck peak; {ARMSTRONG}",
        meaning="Share by which friction at rest exceeds that at speed.",
    )
    stribeck_velocity_rad_per_s: float = parameter(
        0.1,
        unit="rad/s",
        bounds=(5e-3, 10.0),
        source=ARMSTRONG,
        meaning="Speed at which the rise has fallen to 1/e.",
    )
    presliding_rad: float = parameter(
        0.0,
        unit="rad",
        bounds=(0.0, 0.05),
        source="0: rigid until it slides; Dahl 1968, Jenkins element; a fit",
        meaning="Elastic turn of the joint over which friction builds up after a reversal; rigid"
        " where it is below 1e-6 rad.",
    )
    bristle_rad: float = parameter(
        0.0,
        unit="rad",
        bounds=(0.0, 0.05),
        source=f"0: no bristles; {LUGRE}",
        meaning="Deflection at which bristles at rest give way; none where it is below 1e-6 rad.",
    )
    bristle_damping_Nms_per_rad: float = parameter(
        0.0,
        unit="Nms/rad",
        bounds=(0.0, 500.0),
        source=f"0: undamped; {LUGRE}",
        meaning="Damping of the bristles while the motion bends them.",
    )
    normal_lever_m: float = parameter(
        0.0,
        unit="m",
        bounds=(0.0, 0.1),
        source="friction coefficient times bearing radius; thesis eq. 3.6, corrected",
        meaning="Friction torque per bearing load of weight and centrifugal force.",
    )

    def __post_init__(self):
        require_bounds(self)
        require_one_presliding(self)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Coulomb friction."""
        return {"coulomb_Nm": self.coulomb_Nm}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The law as compiled code reads it."""
        found = {}
        if self.coulomb_Nm > 0.0:
            found = {
                "load_coulomb": self.coulomb_Nm,
                "load_stribeck_rise": self.stribeck_rise,
                "load_stribeck_velocity": self.stribeck_velocity_rad_per_s,
            }
            width = max(self.presliding_rad, self.bristle_rad)
            if width >= SHORTEST_PRESLIDING_rad:
                found |= {"load_presliding": width, "memory": 1.0}
                if self.bristle_rad > 0.0:
                    damping = self.bristle_damping_Nms_per_rad
                    found |= {"load_bristle": 1.0, "load_bristle_damping": damping}
            else:
                found["load_dry"] = 1.0
        if self.normal_lever_m > 0.0:
            found |= {"load_normal_friction": self.normal_lever_m, "load_dry": 1.0}
        return found

    def rig_numbers(self, rig, gravity: float) -> Mapping[str, float]:
        """Weight and mass moment of the link that the bearing carries."""
        if self.normal_lever_m == 0.0:
            return {}
        rig.need("the bearing's load", "load_mass_kg", "load_distance_m")
        return {
            "load_weight": rig.load_mass_kg * gravity,
            "load_mass_lever": rig.load_mass_kg * rig.load_distance_m,
        }

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """On a rigid body two dry joints cannot be told apart at rest."""
        return "needs a spring where the gear is dry too" if rigid and dry > 1 else None

    def equation(self) -> str:
        """The law in one line."""
        rest = "; holds exactly at rest"
        if self.presliding_rad > 0.0:
            rest = f", reached after {self.presliding_rad:g} rad of elastic presliding"
        elif self.bristle_rad > 0.0:
            rest = on_bristles(self.bristle_rad, self.bristle_damping_Nms_per_rad)
        normal = ""
        if self.normal_lever_m > 0.0:
            normal = f"; {self.normal_lever_m:g} |N| more, N = bearing load, holds exactly"
        return (
            f"{self.coulomb_Nm:g} (1 + {self.stribeck_rise:g}"
            f" exp(-(w_l/{self.stribeck_velocity_rad_per_s:g})^2)) against w_l{rest}{normal}"
        )
