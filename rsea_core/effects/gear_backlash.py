"""Backlash between the gear's flanks."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter, require_bounds
from rsea_core.errors import TermError


@dataclass(frozen=True, kw_only=True)
class GearBacklash(Term):
    """Play between worm and wheel: motor side and wheel are two bodies.

    The wheel with the spring's hub (J_o, B_o of the rig) is in mesh with one flank or free in
    the gap. A flank only pushes; where it would have to pull, it lets go. Closing the gap is
    an impact: both keep their momentum, less what a worm's friction takes of it, and part with the
    share `rebound` of the speed at which they met. The motor's friction stays on the motor side.

    Raises
    ------
    TermError
        If a parameter is outside its bounds.

    Source
    ------
    Nordin & Gutman, Controlling mechanical systems with backlash: a survey, Automatica 38
    (2002) 1633; rigid contact: Pfeiffer & Glocker, Multibody Dynamics with Unilateral Contacts.
    """

    effect: ClassVar[str] = "gear-backlash"
    law: ClassVar[str] = "rigid-flanks"
    port: ClassVar[Port] = Port.GEAR

    width_rad: float = parameter(
        unit="rad (at the wheel)",
        bounds=(0.0, 0.2),
        source="0.1-0.5 mm over the wheel's radius; a fit",
        meaning="How far the wheel can be turned while the motor is held.",
    )
    wheel_inertia_kgm2: float = parameter(
        0.0,
        unit="kgm2",
        bounds=(0.0, 1e3),
        source="0: J_o of the rig, with B_o; a diagnosis: what its fit took",
        free=False,
        meaning="Share of the machine's inertia that moves with the wheel, behind the play.",
    )
    wheel_damping_Nms_per_rad: float = parameter(
        0.0,
        unit="Nms/rad",
        bounds=(0.0, 1e3),
        source="with wheel_inertia_kgm2 only: a diagnosis, what its fit took",
        free=False,
        meaning="Share of the viscous friction that acts on the wheel behind the play.",
    )
    rebound: float = parameter(
        0.0,
        unit="-",
        bounds=(0.0, 0.95),
        source="0: none; some 0.3 of steel and bronze in grease; a fit",
        meaning="Speed at which the flanks part after an impact over that at which they met.",
    )

    def __post_init__(self):
        require_bounds(self)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """The whole gap at the wheel."""
        return {"width_rad": self.width_rad}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The whole gap and the impact."""
        if self.width_rad == 0.0:
            return {}
        found = {"backlash_width": self.width_rad, "memory": 1.0}
        return found | ({"backlash_rebound": self.rebound} if self.rebound > 0.0 else {})

    def rig_numbers(self, rig, gravity: float) -> Mapping[str, float]:
        """What is behind the play."""
        if self.width_rad == 0.0:
            return {}
        if self.wheel_inertia_kgm2 > 0.0:
            return self._given_wheel(rig)
        rig.need("the wheel behind the play", "motor_inertia_kgm2", "output_inertia_kgm2")
        for key in ("motor_inertia_kgm2", "output_inertia_kgm2"):
            if not getattr(rig, key) > 0.0:
                raise TermError(
                    f"{self.effect} on rig {rig.name!r}: {key} = {getattr(rig, key):g} must be"
                    " above 0, play lies between two bodies"
                )
        return {
            "backlash_wheel_inertia": rig.output_inertia_kgm2,
            "backlash_wheel_damping": rig.output_viscous_Nms_per_rad or 0.0,
        }

    def _given_wheel(self, rig) -> Mapping[str, float]:
        motor = (rig.gear_ratio or 1.0) ** 2 * (rig.motor_inertia_kgm2 or 0.0)
        whole = motor + (rig.output_inertia_kgm2 or 0.0)
        if not self.wheel_inertia_kgm2 < whole:
            raise TermError(
                f"{self.effect} on rig {rig.name!r}: wheel_inertia_kgm2 ="
                f" {self.wheel_inertia_kgm2:g} must be below the {whole:g} of motor and wheel"
            )
        return {
            "backlash_wheel_inertia": self.wheel_inertia_kgm2,
            "backlash_wheel_damping": self.wheel_damping_Nms_per_rad,
        }

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """The wheel behind the play sits with the spring."""
        return "needs a spring, with which the wheel behind the play moves" if rigid else None

    def equation(self) -> str:
        """The law in one line."""
        return (
            f"|theta_m/N - theta_w| <= {0.5 * self.width_rad:g}: J_o w_w' = c - B_o w_w - tau_s,"
            " flank torque c on the motor side too, c pushes only, impact"
            + (f" with rebound {self.rebound:g}" if self.rebound > 0.0 else " without rebound")
        )
