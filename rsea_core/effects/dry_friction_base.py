"""What the dry friction of joints has in common: parameters of the same meaning, their checks."""

from typing import ClassVar

from rsea_core.effects.base import Term, parameter
from rsea_core.errors import TermError

ARMSTRONG = "Armstrong-Helouvry et al., Automatica 30 (1994) 1083"
LUGRE = "Canudas de Wit et al., IEEE Trans. Automatic Control 40 (1995) 419; a fit"
MOTOR = " (motor side)"


def stribeck_rise(source: str = f"0: no Stribeck peak; {ARMSTRONG}", of: str = "friction"):
    """Parameter: share by which friction at rest exceeds that at speed."""
    return parameter(
        0.0,
        unit="-",
        bounds=(0.0, 3.0),
        source=source,
        meaning=f"Share by which {of} at rest exceeds that at speed.",
    )


def stribeck_velocity(
    default: float, bounds: tuple[float, float], side: str = "", source: str = ARMSTRONG
):
    """Parameter: speed at which the rise has fallen to 1/e."""
    return parameter(
        default,
        unit=f"rad/s{side}",
        bounds=bounds,
        source=source,
        meaning="Speed at which the rise has fallen to 1/e.",
    )


def presliding(most_rad: float, joint: str, at: str = "", side: str = ""):
    """Parameter: elastic deflection before friction slides (a Jenkins element)."""
    return parameter(
        0.0,
        unit=f"rad{side}",
        bounds=(0.0, most_rad),
        source="0: rigid until it slides; Dahl 1968, Jenkins element; a fit",
        meaning=f"Elastic turn of the {joint} over which friction builds up after a reversal; rigid"
        f" where it is below 1e-6 rad{at}.",
    )


def bristle(most_rad: float, whose: str = "bristles", at: str = "", side: str = ""):
    """Parameter: deflection at which bristles give way (LuGre)."""
    return parameter(
        0.0,
        unit=f"rad{side}",
        bounds=(0.0, most_rad),
        source=f"0: no bristles; {LUGRE}",
        meaning=f"Deflection at which {whose} at rest give way; none where it is below"
        f" 1e-6 rad{at}.",
    )


def bristle_damping(most: float, meaning: str, side: str = ""):
    """Parameter: micro-damping of bristles (LuGre's sigma_1)."""
    return parameter(
        0.0,
        unit=f"Nms/rad{side}",
        bounds=(0.0, most),
        source=f"0: undamped; {LUGRE}",
        meaning=meaning,
    )


class DryFriction(Term):
    """Friction of a joint that holds at rest: rigidly, by an elastic stretch, or on bristles.

    Raises
    ------
    TermError
        If a parameter is outside its bounds, or friction is both a stop's and on bristles.
    """

    known_form: ClassVar[str] = "presliding"
    other_joint: ClassVar[str]  # the one that a rigid body moves together with this one

    def __post_init__(self):
        super().__post_init__()
        if self.presliding_rad > 0.0 and self.bristle_rad > 0.0:
            raise TermError(
                f"{self.effect}: presliding_rad = {self.presliding_rad:g} and bristle_rad ="
                f" {self.bristle_rad:g} are laws of one thing: keep one"
            )

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """On a rigid body two dry joints cannot be told apart at rest."""
        return (
            f"needs a spring where the {self.other_joint} is dry too" if rigid and dry > 1 else None
        )

    def at_rest(self) -> str:
        """How an equation says what friction does at rest."""
        if self.presliding_rad > 0.0:
            return f", reached after {self.presliding_rad:g} rad of elastic presliding"
        if self.bristle_rad > 0.0:
            return on_bristles(self.bristle_rad, self.bristle_damping_Nms_per_rad)
        return "; holds exactly at rest"


def on_bristles(deflection_rad: float, damping_Nms_per_rad: float) -> str:
    """How an equation says that friction is reached on bristles."""
    damped = f", damped by {damping_Nms_per_rad:g} Nms/rad" if damping_Nms_per_rad > 0.0 else ""
    return f", reached on bristles that give way at {deflection_rad:g} rad{damped}"
