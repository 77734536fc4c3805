"""What acts on the load's joint and link beyond the nominal viscous friction and gravity."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.terms.base import Gear, Port, Term, parameter, require_bounds

ARMSTRONG = "Armstrong-Helouvry et al., Automatica 30 (1994) 1083"


@dataclass(frozen=True, kw_only=True)
class LoadFriction(Term):
    """Coulomb and Stribeck friction of the load's joint.

    F = coulomb (1 + rise exp(-(w_l/w_s)^2)) against the motion; at rest it holds, exactly, up to
    coulomb (1 + rise).

    Raises
    ------
    TermError
        If a parameter is outside its bounds.
    """

    effect: ClassVar[str] = "load-friction"
    port: ClassVar[Port] = Port.LOAD

    coulomb_Nm: float = parameter(unit="Nm", bounds=(0.0, 50.0), source="a fit")
    stribeck_rise: float = parameter(
        0.0, unit="-", bounds=(0.0, 3.0), source=f"0: no Stribeck peak; {ARMSTRONG}"
    )
    stribeck_velocity_rad_per_s: float = parameter(
        0.1, unit="rad/s", bounds=(1e-3, 10.0), source=ARMSTRONG
    )

    def __post_init__(self):
        require_bounds(self)

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The law as compiled code reads it."""
        if self.coulomb_Nm == 0.0:
            return {}
        return {
            "load_dry": 1.0,
            "load_coulomb": self.coulomb_Nm,
            "load_stribeck_rise": self.stribeck_rise,
            "load_stribeck_velocity": self.stribeck_velocity_rad_per_s,
        }

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """On a rigid body two dry joints cannot be told apart at rest."""
        return "needs a spring where the gear is dry too" if rigid and dry > 1 else None

    def equation(self) -> str:
        """The law in one line."""
        return (
            f"{self.coulomb_Nm:g} (1 + {self.stribeck_rise:g}"
            f" exp(-(w_l/{self.stribeck_velocity_rad_per_s:g})^2)) against w_l; holds exactly at"
            " rest"
        )
