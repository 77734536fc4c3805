"""Friction of the gear that grows with the torque that it transmits."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rsea_core.effects.base import Gear, Port, SHORTEST_PRESLIDING_rad, Term, parameter
from rsea_core.effects.curve import EffectCurve
from rsea_core.effects.dry_friction_base import (
    MOTOR,
    bristle,
    on_bristles,
    stribeck_rise,
    stribeck_velocity,
)
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.gear_friction import (
    GEAR_BACKWARD,
    GEAR_BRISTLE,
    GEAR_FORWARD,
    GEAR_PRESLIDING,
    GEAR_RISE,
    GEAR_STRIBECK,
    STRIBECK_SHAPE,
    WHEEL_DRY,
    GearFriction,
    gear_coulomb,
)
from rsea_core.effects.relevant_size import RelevantSize
from rsea_core.effects.slots import slots
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, RunConditions, TrialMachine, Unknown, Values
from rsea_core.errors import TermError

GEAR_DRIVE_LOSS, GEAR_BACKDRIVE_LOSS = slots("gear_drive_loss", "gear_backdrive_loss")


@njit(error_model="numpy", inline="always")
def gear_friction(fx, direction, speed, torque, torque_sign):
    """Magnitude of the set-valued friction [Nm] at the wheel that slides (or is about to) so.

    `torque_sign` is the sign of the spring torque: friction is driven where it opposes the
    motion, back-driven where it helps it. With presliding the Coulomb part is elastic at first
    (`internal_states.gear_presliding`) and only what the load causes stays set-valued.
    """
    level = gear_coulomb(fx, direction, speed) if fx[GEAR_PRESLIDING] == 0.0 else 0.0
    loss = fx[GEAR_DRIVE_LOSS] if direction * torque_sign > 0 else fx[GEAR_BACKDRIVE_LOSS]
    return level + loss * torque_sign * torque


@njit(error_model="numpy", inline="always")
def rigid_share(fx, motion_sign, torque_sign):
    """Factor on load and load inertia that a worm without spring adds to what moves the wheel.

    Its friction is in proportion to the torque tau = J_l w' - tau_load that it transmits, so that
    (J + E J_l) w' = tau_wheel + E tau_load with E = 1 + loss where it drives, 1 - loss where it is
    back-driven.
    """
    if motion_sign * torque_sign > 0.0:
        return 1.0 + fx[GEAR_DRIVE_LOSS]
    return 1.0 - fx[GEAR_BACKDRIVE_LOSS]


# between Stribeck's square and the roots of AGMA 6022, exp(-0.11 v^0.45)
FALL = "falls exponentially with the speed, as a worm gear's friction (AGMA 6022); a fit"
SHIGLEY = "Shigley, Mechanical Engineering Design, worm gears; actuator specification 1.3"


def _write(v: Values, d: TrialMachine, w: RunConditions) -> None:
    """Friction in proportion to the transmitted torque, by its efficiencies.

    With `stribeck_rise` it is larger by that share where the thread hardly slides, and falls
    exponentially with the speed: between Stribeck's square and the roots of worm gears' standards
    (AGMA 6022: exp(-0.11 v^0.45)).
    """
    drive, back = 1.0 / v["drive_efficiency"] - 1.0, 1.0 - v["backdrive_efficiency"]
    if drive == 0.0 and back == 0.0:
        return
    d.put(WHEEL_DRY, 1.0)
    d.put(GEAR_DRIVE_LOSS, drive)
    d.put(GEAR_BACKDRIVE_LOSS, back)
    if "bristle_rad" in v:
        d.put(GEAR_PRESLIDING, v["bristle_rad"] / w.ratio)
        d.put(GEAR_BRISTLE, 2.0)
    if "stribeck_rise" in v:
        d.put(GEAR_RISE, v["stribeck_rise"])
        d.put(GEAR_STRIBECK, v["stribeck_velocity_rad_per_s"] / w.ratio)
        d.put(STRIBECK_SHAPE, 1.0)


PRESLIDING = ("presliding_rad", "bristle_rad")
STRIBECK = ("stribeck_rise", "stribeck_velocity_rad_per_s")


def distinguished(laws: Sequence[tuple[Law, Values]]) -> list[tuple[Law, Values]]:
    """The laws of a gear's dry friction and of its load's, each with what it has the last word in.

    Both have bristles and a Stribeck curve, of which a fit takes those that are written last: the
    thread's bristles, where they are, carry Coulomb friction too.
    """
    found = [(law, dict(values)) for law, values in laws]
    gear = [law for law, _ in found if law.effect in (GearFriction.effect, LoadDependent.effect)]
    own = {law.effect: values for law, values in found}
    dry, thread = own.get(GearFriction.effect), own.get(LoadDependent.effect)
    if dry is None or thread is None or len(gear) > 2 or "bristle_rad" not in thread:
        return found
    efficiencies = thread["drive_efficiency"], thread["backdrive_efficiency"]
    if dry["coulomb_Nm"] == 0.0 or efficiencies == (1.0, 1.0):  # no friction writes nothing
        return found
    faded, thread_last = "stribeck_rise" in thread, gear[-1].effect == LoadDependent.effect
    if "stribeck_rise" in dry and not (faded and thread_last):
        if faded:  # the thread's power of the speed stays
            dry["stribeck_shape"] = 1.0
        _drop(thread, STRIBECK)
    else:
        _drop(dry, STRIBECK)
    if thread_last:
        _drop(dry, PRESLIDING)
    elif "bristle_rad" in dry:
        _drop(thread, PRESLIDING)
    elif "presliding_rad" in dry:
        thread["bristle_rad"] = dry.pop("presliding_rad")
    return found


def _drop(values: dict[str, float], names: Sequence[str]) -> None:
    for name in names:
        values.pop(name, None)


@njit(cache=True, error_model="numpy")
def _carried_friction(fx, torques):
    """Friction (n,) of a gear that turns forward under torques."""
    return np.array([gear_friction(fx, 1, 1.0, t, 1.0 if t > 0 else -1.0) for t in torques])


def _drawn(d: TrialMachine, v: Values, x: NDArray) -> NDArray:
    fx = d.fx.copy()
    fx[[GEAR_FORWARD, GEAR_BACKWARD]] = 0.0
    return _carried_friction(fx, x)


class LoadDependent(Term):
    """What every law of friction that grows with the transmitted torque has in common."""

    effect: ClassVar[str] = "gear-load-friction"
    port: ClassVar[Port] = Port.GEAR
    headline: ClassVar[str] = "The gear's friction grows with the torque that it transmits."
    figure_units: ClassVar[Mapping[str, str]] = {
        "drive_efficiency": "-",
        "backdrive_efficiency": "-",
    }
    curve: ClassVar = EffectCurve(
        title="Friction of the gear under load, turning forward", x_label="torque carried (Nm)",
        y_label="friction at the wheel (Nm)", over="torque", evaluate=_drawn,
    )  # fmt: skip

    @property
    def is_self_locking(self) -> bool:
        """Whether the load cannot move the motor."""
        return self.backdrive_efficiency <= 0.0

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
        locks = "self-locking" if self.is_self_locking else "not self-locking"
        return (
            f"mu_w |tau_s| against w_w, mu_w = {1.0 / self.drive_efficiency - 1.0:.4g} driving"
            f" (efficiency {self.drive_efficiency:.4g}), {1.0 - self.backdrive_efficiency:.4g}"
            f" back-driven (efficiency {self.backdrive_efficiency:.4g}, {locks})"
        )

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """Efficiencies in both directions."""
        back = f.figures["backdrive_efficiency"]
        driven = f"{f.percent(back)} backdriving" if back > 0.0 else "self-locking in backdriving"
        drive = f.percent(f.figures["drive_efficiency"])
        return (
            f"friction in the gear that grows with its load: efficiency {drive} driving, {driven}"
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
    relevant: ClassVar = RelevantSize(
        variant="efficiencies", part="gear",
        size=lambda m: ((0.9, 0.9), "a gear of 90 % efficiency"),
    )  # fmt: skip

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
    bristle_rad: float = bristle(0.5, "the thread's bristles", " at the wheel", MOTOR)
    stribeck_rise: float = stribeck_rise(
        f"0: the same at every speed; {FALL}", "friction of a thread"
    )
    stribeck_velocity_rad_per_s: float = stribeck_velocity(10.0, (0.05, 100.0), MOTOR, FALL)

    def __post_init__(self):
        super().__post_init__()
        if self.stribeck_rise > 0.0 and self.bristle_rad == 0.0:
            raise TermError(
                f"{self.effect}: stribeck_rise = {self.stribeck_rise:g} needs bristle_rad above 0"
            )

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Loss per torque in both directions of power flow, and the bristles that carry it."""
        found, width = super().numbers(gear), gear.motion_to_output(self.bristle_rad)
        if not found or width < SHORTEST_PRESLIDING_rad:
            return found
        found = dict(found) | {
            "gear_presliding": width,
            "gear_bristle": 2.0,
            "internal_states": 1.0,
        }
        if self.stribeck_rise > 0.0:
            found |= {
                "gear_stribeck_rise": self.stribeck_rise,
                "gear_stribeck_velocity": gear.motion_to_output(self.stribeck_velocity_rad_per_s),
                "gear_stribeck_shape": 1.0,
            }
        return found

    def equation(self) -> str:
        law = super().equation()
        if self.stribeck_rise > 0.0:
            speed = f"|w_m/{self.stribeck_velocity_rad_per_s:g}|"
            law += f", times 1 + {self.stribeck_rise:g} exp(-{speed})"
        return law + (on_bristles(self.bristle_rad, 0.0) if self.bristle_rad > 0.0 else "")

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """Efficiencies, without and with bristles, and a friction that falls with the speed."""
        v, a = typical.like_motor_speed, typical.like_motor_angle
        share = {"unit": "-", "scale": 0.03}
        efficiencies = (
            Unknown(name="drive_efficiency", low=0.05, high=1.0, **share),
            Unknown(name="backdrive_efficiency", low=-3.0, high=1.0, **share),
        )
        rise = Unknown(name="stribeck_rise", unit="-", low=0.0, high=3.0, scale=0.1, prior=1.0)
        speed = Unknown(name="stribeck_velocity_rad_per_s", unit="rad/s", low=v(0.05),
                        high=v(100.0), scale=0.2, log=True, prior=1.2)  # fmt: skip
        bristle = Unknown(name="bristle_rad", unit="rad", low=a(1e-4), high=a(0.5), scale=0.2,
                          log=True, prior=1.5)  # fmt: skip
        common = {"effect": cls.effect, "subsystem": "gear", "write": _write, "kind": cls}
        return (
            Law(law="efficiencies", unknowns=efficiencies,
                starts=((0.97, 0.97), (0.85, 0.8), (0.6, 0.3)),
                richer=("efficiencies, bristles",), **common),
            Law(law="efficiencies, bristles", unknowns=(*efficiencies, bristle),
                starts=((0.85, 0.8, a(0.02)),), always=("efficiencies, fading",), **common),
            Law(law="efficiencies, fading", unknowns=(*efficiencies, bristle, rise, speed),
                starts=((0.85, 0.8, a(0.02), 0.1, v(10.0)),), **common),
        )  # fmt: skip


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
        super().__post_init__()
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
