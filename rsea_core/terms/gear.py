"""Friction of motor and gear; the laws are the kernel's, here are their parameters.

Coulomb and Stribeck friction act on the motor side, where the bearings turn fast; the worm's
friction acts at the mesh and grows with the torque that passes through it.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.errors import TermError
from rsea_core.terms.base import (
    NO_CONTEXT,
    Context,
    Gear,
    Port,
    SHORTEST_PRESLIDING_rad,
    Term,
    parameter,
    require_bounds,
)

ARMSTRONG = "Armstrong-Helouvry et al., Automatica 30 (1994) 1083"
SHIGLEY = "Shigley, Mechanical Engineering Design, worm gears; actuator specification 1.3"


@dataclass(frozen=True, kw_only=True)
class GearFriction(Term):
    """Coulomb and Stribeck friction of motor bearing and gear, different in both directions.

    While the motor turns at speed w, F = F_c (1 + rise exp(-(w/w_s)^2)) against the motion, with
    F_c = coulomb (1 + asymmetry) for positive and coulomb (1 - asymmetry) for negative motion.
    At rest it holds, exactly, up to F_c (1 + rise). With a presliding stretch it is elastic
    instead until it slides (a Jenkins element). Viscous, arctangent and constant parts make it
    the thesis' models (`thesis_friction`).

    Raises
    ------
    TermError
        If a parameter is outside its bounds.
    """

    effect: ClassVar[str] = "gear-friction"
    law: ClassVar[str] = "coulomb-stribeck"
    port: ClassVar[Port] = Port.GEAR

    coulomb_Nm: float = parameter(
        unit="Nm (motor side)",
        bounds=(0.0, 1.0),
        source="mean of both directions; a fit",
        meaning="Friction torque of motor and gear at speed, mean of both directions.",
    )
    asymmetry: float = parameter(
        0.0,
        unit="-",
        bounds=(-0.9, 0.9),
        source="0: the same in both directions",
        meaning="Share by which friction is larger forward and smaller backward than the mean.",
    )
    stribeck_rise: float = parameter(
        0.0,
        unit="-",
        bounds=(0.0, 3.0),
        source=f"0: no Stribeck peak; {ARMSTRONG}",
        meaning="Share by which friction at rest exceeds that at speed.",
    )
    stribeck_velocity_rad_per_s: float = parameter(
        5.0,
        unit="rad/s (motor side)",
        bounds=(0.05, 100.0),
        source=ARMSTRONG,
        meaning="Speed at which the rise has fallen to 1/e.",
    )
    stribeck_shape: float = parameter(
        2.0,
        unit="-",
        bounds=(1.0, 4.0),
        source="2: Gaussian; thesis eq. 3.1, delta; " + ARMSTRONG,
        meaning="Power of the speed in the exponent of the Stribeck curve.",
    )
    presliding_rad: float = parameter(
        0.0,
        unit="rad (motor side)",
        bounds=(0.0, 0.5),
        source="0: rigid until it slides; Dahl 1968, Jenkins element; a fit",
        meaning="Elastic turn of the motor over which friction builds up after a reversal; rigid"
        " where it is below 1e-6 rad at the wheel.",
    )
    viscous_Nms_per_rad: float = parameter(
        0.0,
        unit="Nms/rad (motor side)",
        bounds=(0.0, 0.1),
        source="0: the rig's viscous friction alone; thesis eq. 3.7, f_v",
        meaning="Viscous friction added to the rig's.",
    )
    viscous_skew_Nms_per_rad: float = parameter(
        0.0,
        unit="Nms/rad (motor side)",
        bounds=(-0.1, 0.1),
        source="0: the same in both directions; a fit",
        meaning="Added to the viscous friction of positive, taken from that of negative motion.",
    )
    arctan_Nm: float = parameter(
        0.0,
        unit="Nm (motor side)",
        bounds=(0.0, 1.0),
        source="0: none; thesis eq. 3.7, f_a",
        meaning="Factor of the friction that goes with the arctangent of the speed.",
    )
    arctan_velocity_rad_per_s: float = parameter(
        60.0,
        unit="rad/s (motor side)",
        bounds=(0.05, 2e4),
        source="thesis eq. 3.7, 1/f_b",
        meaning="Speed at which that friction has half of its largest value.",
    )
    offset_Nm: float = parameter(
        0.0,
        unit="Nm (motor side)",
        bounds=(-1.0, 1.0),
        source="0: none; thesis eq. 3.7, f_o: a sensor's zero rather than friction",
        meaning="Constant torque against positive motion, at rest too.",
    )

    def __post_init__(self):
        require_bounds(self)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Coulomb friction on the motor side."""
        return {"coulomb_Nm": self.coulomb_Nm}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The law at the gear output."""
        found = {}
        coulomb, out = gear.torque_to_output(self.coulomb_Nm), gear.torque_to_output
        if coulomb > 0.0:
            found = {
                "gear_coulomb_forward": coulomb * (1.0 + self.asymmetry),
                "gear_coulomb_backward": coulomb * (1.0 - self.asymmetry),
                "gear_stribeck_rise": self.stribeck_rise,
                "gear_stribeck_velocity": gear.motion_to_output(self.stribeck_velocity_rad_per_s),
            }
            if self.stribeck_shape != 2.0:
                found["gear_stribeck_shape"] = self.stribeck_shape
            if gear.motion_to_output(self.presliding_rad) >= SHORTEST_PRESLIDING_rad:
                found |= {
                    "gear_presliding": gear.motion_to_output(self.presliding_rad),
                    "memory": 1.0,
                }
            else:
                found["wheel_dry"] = 1.0
        if self.arctan_Nm > 0.0:
            found["gear_atan_level"] = out(self.arctan_Nm)
            found["gear_atan_velocity"] = gear.motion_to_output(self.arctan_velocity_rad_per_s)
        per_speed = gear.torque_to_output(1.0) / gear.motion_to_output(1.0)
        smooth = {
            "gear_offset": out(self.offset_Nm),
            "gear_viscous": per_speed * self.viscous_Nms_per_rad,
            "gear_viscous_skew": per_speed * self.viscous_skew_Nms_per_rad,
        }
        return found | {name: value for name, value in smooth.items() if value != 0.0}

    def rig_numbers(self, rig, gravity: float) -> Mapping[str, float]:
        """No numbers; a skew above all damping that turns with the motor would be an engine."""
        if self.viscous_skew_Nms_per_rad != 0.0:
            beside = rig.output_viscous_Nms_per_rad or 0.0
            if not rig.has("spring"):
                beside += rig.load_viscous_Nms_per_rad or 0.0
            damping = self.viscous_Nms_per_rad + (rig.motor_viscous_Nms_per_rad or 0.0)
            damping += beside / (rig.gear_ratio or 1.0) ** 2
            if abs(self.viscous_skew_Nms_per_rad) > damping * (1.0 + 1e-9):
                raise TermError(
                    f"{self.effect} on rig {rig.name!r}: viscous_skew_Nms_per_rad ="
                    f" {self.viscous_skew_Nms_per_rad:g} must be within the damping of"
                    f" {damping:g} Nms/rad beside it"
                )
        return {}

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """On a rigid body two dry joints cannot be told apart at rest."""
        return "needs a spring where the load is dry too" if rigid and dry > 1 else None

    def equation(self) -> str:
        """The law in one line."""
        rest = "; holds exactly at rest"
        if self.presliding_rad > 0.0:
            rest = f", reached after {self.presliding_rad:g} rad of elastic presliding"
        speed = f"|w_m/{self.stribeck_velocity_rad_per_s:g}|"
        smooth = ""
        if self.viscous_Nms_per_rad > 0.0:
            smooth += f" + N {self.viscous_Nms_per_rad:g} w_m"
        if self.viscous_skew_Nms_per_rad != 0.0:
            smooth += f" + N {self.viscous_skew_Nms_per_rad:g} |w_m|"
        if self.arctan_Nm > 0.0:
            smooth += f" + N {self.arctan_Nm:g} atan(w_m/{self.arctan_velocity_rad_per_s:g})"
        if self.offset_Nm != 0.0:
            smooth += f" + N {self.offset_Nm:g}"
        return (
            f"N F_c (1 + {self.stribeck_rise:g} exp(-{speed}^{self.stribeck_shape:g}))"
            f" against w_w, F_c = {self.coulomb_Nm * (1 + self.asymmetry):.4g} Nm forward,"
            f" {self.coulomb_Nm * (1 - self.asymmetry):.4g} Nm backward{rest}{smooth}"
        )


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

    Raises
    ------
    TermError
        If an efficiency is outside its bounds.
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

    def __post_init__(self):
        require_bounds(self)


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
