"""Friction of the gear that grows with the torque that it transmits."""

import math
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
)
from rsea_core.errors import TermError

# between Stribeck's square and the roots of AGMA 6022, exp(-0.11 v^0.45)
FALL = "falls exponentially with the speed, as a worm gear's friction (AGMA 6022); a fit"
SHIGLEY = "Shigley, Mechanical Engineering Design, worm gears; actuator specification 1.3"


class LoadDependent(Term):
    """What every law of friction that grows with the transmitted torque has in common."""

    effect: ClassVar[str] = "gear-load-friction"
    port: ClassVar[Port] = Port.GEAR

    @property
    def is_self_locking(self) -> bool:
        """Whether the load cannot move the motor."""
        return self.backdrive_efficiency <= 0.0

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Efficiencies in both directions of power flow; the second is below zero if it locks."""
        return {
            "drive_efficiency": self.drive_efficiency,
            "backdrive_efficiency": self.backdrive_efficiency,
        }

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Loss per torque in both directions of power flow."""
        drive, back = 1.0 / self.drive_efficiency - 1.0, 1.0 - self.backdrive_efficiency
        if drive == 0.0 and back == 0.0:
            return {}
        return {"wheel_dry": 1.0, "gear_drive_loss": drive, "gear_backdrive_loss": back}

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """On a rigid body two dry joints cannot be told apart at rest."""
        return "needs a spring where the load is dry too" if rigid and dry > 1 else None

    def equation(self) -> str:
        """The law in one line."""
        locks = "self-locking" if self.is_self_locking else "not self-locking"
        return (
            f"mu_w |tau_s| against w_w, mu_w = {1.0 / self.drive_efficiency - 1.0:.4g} driving"
            f" (efficiency {self.drive_efficiency:.4g}), {1.0 - self.backdrive_efficiency:.4g}"
            f" back-driven (efficiency {self.backdrive_efficiency:.4g}, {locks})"
        )


@dataclass(frozen=True, kw_only=True)
class GearEfficiency(LoadDependent):
    """Friction that grows with the transmitted torque, by its efficiencies.

    The output side feels (1/eta_f - 1) |tau_s| against its motion where the motor drives the
    load and (1 - eta_r) |tau_s| where the load drives the motor; eta_r at or below zero locks.
    With a bristle deflection bristles carry it, and all Coulomb friction of the gear
    (`engines.event_driven.bristles`); then it is larger by 1 + rise exp(-|w/w_s|) where the thread
    hardly slides.

    Raises
    ------
    TermError
        If a parameter is outside its bounds, or there is a rise without bristles.
    """

    law: ClassVar[str] = "efficiencies"

    drive_efficiency: float = parameter(
        unit="-",
        bounds=(0.05, 1.0),
        source=SHIGLEY,
        meaning="Output power over input power where the motor drives the load.",
    )
    backdrive_efficiency: float = parameter(
        unit="-",
        bounds=(-10.0, 1.0),
        source=SHIGLEY,
        meaning="Motor power over load power where the load drives; at or below 0 it locks.",
    )
    bristle_rad: float = parameter(
        0.0,
        unit="rad (motor side)",
        bounds=(0.0, 0.5),
        source=f"0: no bristles; {LUGRE}",
        meaning="Deflection at which the thread's bristles at rest give way; none where it is below"
        " 1e-6 rad at the wheel.",
    )
    stribeck_rise: float = parameter(
        0.0,
        unit="-",
        bounds=(0.0, 3.0),
        source=f"0: the same at every speed; {FALL}",
        meaning="Share by which friction of a thread at rest exceeds that at speed.",
    )
    stribeck_velocity_rad_per_s: float = parameter(
        10.0,
        unit="rad/s (motor side)",
        bounds=(0.05, 100.0),
        source=FALL,
        meaning="Speed at which the rise has fallen to 1/e.",
    )

    def __post_init__(self):
        require_bounds(self)
        if self.stribeck_rise > 0.0 and self.bristle_rad == 0.0:
            raise TermError(
                f"{self.effect}: stribeck_rise = {self.stribeck_rise:g} needs bristle_rad above 0"
            )

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Loss per torque in both directions of power flow, and the bristles that carry it."""
        found, width = super().numbers(gear), gear.motion_to_output(self.bristle_rad)
        if not found or width < SHORTEST_PRESLIDING_rad:
            return found
        found = dict(found) | {"gear_presliding": width, "gear_bristle": 2.0, "memory": 1.0}
        if self.stribeck_rise > 0.0:
            found |= {
                "gear_stribeck_rise": self.stribeck_rise,
                "gear_stribeck_velocity": gear.motion_to_output(self.stribeck_velocity_rad_per_s),
                "gear_stribeck_shape": 1.0,
            }
        return found

    def equation(self) -> str:
        """The law in one line."""
        law = super().equation()
        if self.stribeck_rise > 0.0:
            speed = f"|w_m/{self.stribeck_velocity_rad_per_s:g}|"
            law += f", times 1 + {self.stribeck_rise:g} exp(-{speed})"
        return law + (on_bristles(self.bristle_rad, 0.0) if self.bristle_rad > 0.0 else "")


@dataclass(frozen=True, kw_only=True)
class GearLoadFriction(LoadDependent):
    """Friction of a worm that grows with the torque it carries, and locks.

    With lead angle l and friction angle phi = atan(mu), the output side feels mu_w |tau_s|
    against its motion: mu_w = tan(l + phi)/tan(l) - 1 where the motor drives the load and
    1 - tan(l - phi)/tan(l) where the load drives the motor. With phi >= l the load cannot move
    the motor: the worm holds any torque.

    Raises
    ------
    TermError
        If a parameter is outside its bounds, or the worm could not be driven at all.
    """

    law: ClassVar[str] = "worm"

    lead_angle_rad: float = parameter(
        unit="rad",
        bounds=(0.01, 0.8),
        source=SHIGLEY,
        meaning="Angle of the worm thread against the plane of its turns.",
    )
    friction_coefficient: float = parameter(
        unit="-",
        bounds=(0.0, 0.5),
        source="0.06-0.08 steel on bronze, lubricated; " + SHIGLEY,
        meaning="Coefficient of friction between worm and wheel.",
    )

    def __post_init__(self):
        require_bounds(self)
        if self.lead_angle_rad + math.atan(self.friction_coefficient) >= 0.5 * math.pi:
            raise TermError(
                f"{self.effect}: lead_angle_rad = {self.lead_angle_rad} and friction_coefficient"
                f" = {self.friction_coefficient} leave no torque: lead and friction angle must"
                " stay below pi/2 together"
            )

    @property
    def drive_efficiency(self) -> float:
        """tan(l)/tan(l + phi), where the motor drives the load."""
        phi = math.atan(self.friction_coefficient)
        return math.tan(self.lead_angle_rad) / math.tan(self.lead_angle_rad + phi)

    @property
    def backdrive_efficiency(self) -> float:
        """tan(l - phi)/tan(l), where the load drives the motor; at or below zero it locks."""
        phi = math.atan(self.friction_coefficient)
        return math.tan(self.lead_angle_rad - phi) / math.tan(self.lead_angle_rad)
