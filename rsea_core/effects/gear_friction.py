"""Friction of motor and gear; the laws are the kernel's, here are their parameters.

Coulomb and Stribeck friction act on the motor side, where the bearings turn fast; the worm's
friction acts at the mesh and grows with the torque that passes through it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

import rsea_core.machine.plant as mp
from rsea_core.effects.base import Gear, Port, SHORTEST_PRESLIDING_rad, parameter
from rsea_core.effects.curve import EffectCurve
from rsea_core.effects.dry_friction_base import (
    ARMSTRONG,
    MOTOR,
    DryFriction,
    bristle,
    bristle_damping,
    presliding,
    stribeck_rise,
    stribeck_velocity,
)
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.hooks import hook
from rsea_core.effects.relevant_size import RelevantSize, sized
from rsea_core.effects.slots import slots
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import PLANT, Law, RunConditions, TrialMachine, Unknown, Values
from rsea_core.errors import TermError
from rsea_core.machine.rig import Rig

(
    WHEEL_DRY,
    GEAR_FORWARD,
    GEAR_BACKWARD,
    GEAR_RISE,
    GEAR_STRIBECK,
    STRIBECK_SHAPE,
    GEAR_PRESLIDING,
    ATAN_LEVEL,
    ATAN_VELOCITY,
    GEAR_OFFSET,
    GEAR_VISCOUS,
    VISCOUS_SKEW,
    GEAR_BRISTLE,
    GEAR_BRISTLE_DAMPING,
) = slots(
    "wheel_dry",
    "gear_coulomb_forward",
    "gear_coulomb_backward",
    "gear_stribeck_rise",
    "gear_stribeck_velocity",
    "gear_stribeck_shape",
    "gear_presliding",
    "gear_atan_level",
    "gear_atan_velocity",
    "gear_offset",
    "gear_viscous",
    "gear_viscous_skew",
    "gear_bristle",
    "gear_bristle_damping",
)


@hook("output_torque")
def offset_torque(fx, wheel, speed, torque):
    """The offset of the thesis' NLFM."""
    return torque - fx[GEAR_OFFSET]


@njit(error_model="numpy", inline="always")
def gear_slip(fx, speed):
    """Factor of the gear's friction level that slides at a speed (Stribeck)."""
    if fx[GEAR_RISE] == 0.0:
        return 1.0
    share = np.abs(speed / fx[GEAR_STRIBECK])
    fallen = share * share
    if fx[STRIBECK_SHAPE] > 0.0:  # zero: the usual 2
        fallen = share ** fx[STRIBECK_SHAPE]
    return 1.0 + fx[GEAR_RISE] * np.exp(-fallen)


@njit(error_model="numpy", inline="always")
def gear_coulomb(fx, direction, speed):
    """Coulomb and Stribeck level [Nm] of motor and gear that slide this way."""
    level = fx[GEAR_FORWARD] if direction > 0 else fx[GEAR_BACKWARD]
    return level * gear_slip(fx, speed)


@njit(error_model="numpy", inline="always")
def gear_smooth_friction(fx, speed):
    """Viscous and arctangent friction of the thesis' NLFM [Nm], with the sign of the speed."""
    friction = fx[GEAR_VISCOUS] * speed + fx[VISCOUS_SKEW] * abs(speed)
    if fx[ATAN_LEVEL] != 0.0:
        friction += fx[ATAN_LEVEL] * np.arctan(speed / fx[ATAN_VELOCITY])
    return friction


MOTOR_kgm2 = 1e-4  # of a motor of which the rig's file says nothing


def _write(v: Values, d: TrialMachine, w: RunConditions) -> None:
    """Coulomb, Stribeck, presliding and asymmetric friction of motor and gear."""
    level = v["coulomb_Nm"] * w.ratio
    skew = v.get("asymmetry", 0.0)
    if level > 0.0:
        d.put(WHEEL_DRY, 1.0)
        d.put(GEAR_FORWARD, level * (1.0 + skew))
        d.put(GEAR_BACKWARD, level * (1.0 - skew))
    if "viscous_asymmetry" in v:
        damping = d.plant[PLANT["damping"]]
        if d.plant[PLANT["structure"]] == mp.RIGID_FREE:
            damping += d.plant[PLANT["load_damping"]]
        d.put(VISCOUS_SKEW, v["viscous_asymmetry"] * damping)
    if level == 0.0:
        return
    if "stribeck_rise" in v:
        d.put(GEAR_RISE, v["stribeck_rise"])
        d.put(GEAR_STRIBECK, v["stribeck_velocity_rad_per_s"] / w.ratio)
    if "presliding_rad" in v:
        d.put(GEAR_PRESLIDING, v["presliding_rad"] / w.ratio)
    if "bristle_rad" in v:
        d.put(GEAR_PRESLIDING, v["bristle_rad"] / w.ratio)
        d.put(GEAR_BRISTLE, 1.0)
        d.put(GEAR_BRISTLE_DAMPING, v.get("bristle_damping_Nms_per_rad", 0.0) * w.ratio**2)


def _motor_side_damping(rig: Rig) -> float:
    """Viscous friction of all that turns rigidly with the motor [Nms/rad]."""
    output = rig.output_viscous_Nms_per_rad or 0.0
    if rig.has("load") and not rig.has("spring"):
        output += rig.load_viscous_Nms_per_rad or 0.0
    return (rig.motor_viscous_Nms_per_rad or 0.0) + output / (rig.gear_ratio or 1.0) ** 2


def _parameters(v: Values, rig: Rig) -> Values:
    """What of the viscous friction has a side is a share of the rig's."""
    given = dict(v)
    if (share := given.pop("viscous_asymmetry", None)) is not None:
        given["viscous_skew_Nms_per_rad"] = share * _motor_side_damping(rig)
    return given


@njit(cache=True, error_model="numpy")
def _friction(fx, speeds):
    """Dry and smooth friction (n,) of motor and gear at wheel speeds, without viscous damping."""
    found = np.empty(speeds.size)
    for j, w in enumerate(speeds):
        dry = np.sign(w) * gear_coulomb(fx, 1 if w > 0 else -1, w) if w != 0.0 else 0.0
        found[j] = dry + gear_smooth_friction(fx, w)
    return found


def _drawn(d: TrialMachine, v: Values, x: NDArray) -> NDArray:
    return _friction(d.fx, x) + d.machine_numbers.damping * x + d.fx[GEAR_OFFSET]


@dataclass(frozen=True, kw_only=True)
class GearFriction(DryFriction):
    """Coulomb and Stribeck friction of motor bearing and gear, different in both directions.

    While the motor turns at speed w, F = F_c (1 + rise exp(-(w/w_s)^2)) against the motion, with
    F_c = coulomb (1 + asymmetry) for positive and coulomb (1 - asymmetry) for negative motion.
    At rest it holds, exactly, up to F_c (1 + rise). With a presliding stretch it is elastic
    instead until it slides (a Jenkins element), or on bristles, damped as they bend (LuGre,
    `engines.event_driven.bristles`). Viscous, arctangent and constant parts make it
    the thesis' models (`thesis_friction`).
    """

    effect: ClassVar[str] = "gear-friction"
    law: ClassVar[str] = "coulomb-stribeck"
    port: ClassVar[Port] = Port.GEAR
    other_joint: ClassVar[str] = "load"
    headline: ClassVar[str] = "Dry friction in the gear: it opposes all motion and holds at rest."
    figure_units: ClassVar[Mapping[str, str]] = {"coulomb_Nm": "Nm"}
    curve: ClassVar = EffectCurve(
        title="Friction of motor and gear", x_label="wheel speed (rad/s)",
        y_label="friction at the wheel (Nm)", over="wheel_speed", evaluate=_drawn,
    )  # fmt: skip
    relevant: ClassVar = RelevantSize(
        variant="coulomb", part="gear",
        size=lambda m: sized(0.05 * m.motor_torque_Nm, "gear friction of {:.2g} Nm at the motor"),
    )  # fmt: skip

    coulomb_Nm: float = parameter(
        unit="Nm (motor side)",
        bounds=(0.0, 1e9),
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
    stribeck_rise: float = stribeck_rise()
    stribeck_velocity_rad_per_s: float = stribeck_velocity(5.0, (0.05, 100.0), MOTOR)
    stribeck_shape: float = parameter(
        2.0,
        unit="-",
        bounds=(1.0, 4.0),
        source="2: Gaussian; thesis eq. 3.1, delta; " + ARMSTRONG,
        meaning="Power of the speed in the exponent of the Stribeck curve.",
    )
    presliding_rad: float = presliding(0.5, "motor", " at the wheel", MOTOR)
    bristle_rad: float = bristle(0.5, at=" at the wheel", side=MOTOR)
    bristle_damping_Nms_per_rad: float = bristle_damping(
        10.0, "Damping of the bristles while the motion bends them, a loaded thread's too.", MOTOR
    )
    viscous_Nms_per_rad: float = parameter(
        0.0,
        unit="Nms/rad (motor side)",
        bounds=(0.0, 1e9),
        source="0: the rig's viscous friction alone; thesis eq. 3.7, f_v",
        meaning="Viscous friction added to the rig's.",
    )
    viscous_skew_Nms_per_rad: float = parameter(
        0.0,
        unit="Nms/rad (motor side)",
        bounds=(-1e9, 1e9),
        source="0: the same in both directions; a fit",
        meaning="Added to the viscous friction of positive, taken from that of negative motion.",
    )
    arctan_Nm: float = parameter(
        0.0,
        unit="Nm (motor side)",
        bounds=(0.0, 1e9),
        source="0: none; thesis eq. 3.7, f_a",
        meaning="Factor of the friction that goes with the arctangent of the speed.",
    )
    arctan_velocity_rad_per_s: float = parameter(
        60.0,
        unit="rad/s (motor side)",
        bounds=(1e-12, 1e9),
        source="thesis eq. 3.7, 1/f_b",
        meaning="Speed at which that friction has half of its largest value.",
    )
    offset_Nm: float = parameter(
        0.0,
        unit="Nm (motor side)",
        bounds=(-1e9, 1e9),
        source="0: none; thesis eq. 3.7, f_o: a sensor's zero rather than friction",
        meaning="Constant torque against positive motion, at rest too.",
    )

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The law at the gear output."""
        found = {}
        coulomb, out = gear.torque_to_output(self.coulomb_Nm), gear.torque_to_output
        if coulomb > 0.0:
            found = {
                "gear_coulomb_forward": coulomb * (1.0 + self.asymmetry),
                "gear_coulomb_backward": coulomb * (1.0 - self.asymmetry),
            }
            if self.stribeck_rise > 0.0:
                velocity = gear.motion_to_output(self.stribeck_velocity_rad_per_s)
                found["gear_stribeck_rise"] = self.stribeck_rise
                found["gear_stribeck_velocity"] = velocity
            if self.stribeck_rise > 0.0 and self.stribeck_shape != 2.0:
                found["gear_stribeck_shape"] = self.stribeck_shape
            width = gear.motion_to_output(max(self.presliding_rad, self.bristle_rad))
            if width >= SHORTEST_PRESLIDING_rad:
                found |= {"gear_presliding": width, "internal_states": 1.0}
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
            damping = self.viscous_Nms_per_rad + _motor_side_damping(rig)
            if abs(self.viscous_skew_Nms_per_rad) > damping * (1.0 + 1e-9):
                raise TermError(
                    f"{self.effect} on rig {rig.name!r}: viscous_skew_Nms_per_rad ="
                    f" {self.viscous_skew_Nms_per_rad:g} must be within the other viscous"
                    f" friction of {damping:g} Nms/rad"
                )
        return {}

    def equation(self) -> str:
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
            f" {self.coulomb_Nm * (1 - self.asymmetry):.4g} Nm backward{self.at_rest()}{smooth}"
        )

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """Coulomb's level alone, and with all that is known to go with it."""
        v, a = typical.like_motor_speed, typical.like_motor_angle
        t = typical.motor_torque_Nm
        level = Unknown(name="coulomb_Nm", unit="Nm", low=0.0, high=20 * t, scale=0.05 * t)
        levels = [share * t for share in (0.02, 0.08, 0.25)]
        rise = Unknown(name="stribeck_rise", unit="-", low=0.0, high=3.0, scale=0.1, prior=1.0)
        speed = Unknown(name="stribeck_velocity_rad_per_s", unit="rad/s", low=v(0.05),
                        high=v(100.0), scale=0.2, log=True, prior=1.2)  # fmt: skip
        pre = Unknown(name="presliding_rad", unit="rad", low=a(1e-4), high=a(0.5), scale=0.2,
                      log=True, prior=1.5)  # fmt: skip
        inertia = typical.rig.motor_inertia_kgm2 if typical.rig is not None else None
        inertia = inertia or typical.like_inertia(MOTOR_kgm2)
        # half critical damping, as in LuGre's
        damped = float(np.sqrt(inertia * levels[1] / a(0.02)))
        micro = Unknown(name="bristle_damping_Nms_per_rad", unit="Nms/rad", low=0.0,
                        high=100 * damped, scale=0.2 * damped)  # fmt: skip
        skew = Unknown(name="asymmetry", unit="-", low=-0.9, high=0.9, scale=0.05, prior=0.3)
        lean = replace(skew, name="viscous_asymmetry")  # of the viscous friction
        start, common = levels[1], {"effect": cls.effect, "subsystem": "gear", "write": _write,
                                    "kind": cls, "parameters": _parameters}  # fmt: skip
        return (
            Law(law="coulomb", unknowns=(level,), starts=tuple((v,) for v in levels),
                richer=("asymmetric", "stops", "bristles"), **common),
            Law(law="presliding", unknowns=(level, pre), starts=((start, a(0.02)),), **common,
                richer=("stops", "bristles", "asymmetric presliding")),
            Law(law="asymmetric presliding", unknowns=(level, skew, pre),
                starts=((start, 0.0, a(0.02)),),
                richer=("stops", "bristles", "direction-dependent presliding"), **common),
            Law(law="stribeck", unknowns=(level, rise, speed), starts=((start, 0.3, v(2.0)),),
                richer=("stops", "bristles"), **common),
            Law(law="stribeck presliding", unknowns=(level, rise, speed, pre),
                starts=((start, 0.2, v(2.0), a(0.02)),), richer=("stops", "bristles"), **common),
            Law(law="asymmetric", unknowns=(level, skew), starts=((start, 0.0),),
                richer=("stops", "bristles", "direction-dependent", "asymmetric presliding"),
                **common),
            Law(law="direction-dependent", unknowns=(level, skew, lean),
                starts=((start, 0.0, 0.0),), richer=("direction-dependent presliding",),
                **common),
            Law(law="direction-dependent presliding", unknowns=(level, skew, lean, pre),
                starts=((start, 0.0, 0.0, a(0.02)),), **common),
            Law(law="stops", unknowns=(level, rise, speed, pre, skew),
                starts=((start, 0.2, v(2.0), a(0.02), 0.0),), **common),
            Law(law="bristles",
                unknowns=(level, rise, speed, replace(pre, name="bristle_rad"), skew, micro),
                starts=((start, 0.2, v(2.0), a(0.02), 0.0, damped),), **common),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The level."""
        return f"dry friction in the gear, {f('coulomb_Nm', 'Nm')} at the motor"
