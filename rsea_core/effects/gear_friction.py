"""Friction of motor and gear; the laws are the kernel's, here are their parameters.

Coulomb and Stribeck friction act on the motor side, where the bearings turn fast; the worm's
friction acts at the mesh and grows with the torque that passes through it.
"""

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
from rsea_core.errors import TermError

ARMSTRONG = "Armstrong-Helouvry et al., Automatica 30 (1994) 1083"


@dataclass(frozen=True, kw_only=True)
class GearFriction(Term):
    """Coulomb and Stribeck friction of motor bearing and gear, different in both directions.

    While the motor turns at speed w, F = F_c (1 + rise exp(-(w/w_s)^2)) against the motion, with
    F_c = coulomb (1 + asymmetry) for positive and coulomb (1 - asymmetry) for negative motion.
    At rest it holds, exactly, up to F_c (1 + rise). With a presliding stretch it is elastic
    instead until it slides (a Jenkins element), or on bristles, damped as they bend (LuGre,
    `engines.event_driven.bristles`). Viscous, arctangent and constant parts make it
    the thesis' models (`thesis_friction`).

    Raises
    ------
    TermError
        If a parameter is outside its bounds, or friction is both a stop's and on bristles.
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
    bristle_rad: float = parameter(
        0.0,
        unit="rad (motor side)",
        bounds=(0.0, 0.5),
        source=f"0: no bristles; {LUGRE}",
        meaning="Deflection at which bristles at rest give way; none where it is below 1e-6 rad at"
        " the wheel.",
    )
    bristle_damping_Nms_per_rad: float = parameter(
        0.0,
        unit="Nms/rad (motor side)",
        bounds=(0.0, 10.0),
        source=f"0: undamped; {LUGRE}",
        meaning="Damping of the bristles while the motion bends them, a loaded thread's too.",
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
        require_one_presliding(self)

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
            width = gear.motion_to_output(max(self.presliding_rad, self.bristle_rad))
            if width >= SHORTEST_PRESLIDING_rad:
                found |= {"gear_presliding": width, "memory": 1.0}
                if self.bristle_rad > 0.0:
                    found["gear_bristle"] = 1.0
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
            "gear_bristle_damping": per_speed * self.bristle_damping_Nms_per_rad,
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
        elif self.bristle_rad > 0.0:
            rest = on_bristles(self.bristle_rad, self.bristle_damping_Nms_per_rad)
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
