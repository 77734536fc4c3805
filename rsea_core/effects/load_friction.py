"""Dry friction in the load's joint."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rsea_core.effects.base import Gear, Port, SHORTEST_PRESLIDING_rad, parameter
from rsea_core.effects.curve import EffectCurve
from rsea_core.effects.dry_friction_base import (
    DryFriction,
    bristle,
    bristle_damping,
    presliding,
    stribeck_rise,
    stribeck_velocity,
)
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.hooks import hook
from rsea_core.effects.load_base import HELD
from rsea_core.effects.relevant_size import RelevantSize, sized
from rsea_core.effects.slots import slots
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, RunConditions, TrialMachine, Unknown, Values

(
    LOAD_DRY,
    LOAD_COULOMB,
    LOAD_RISE,
    LOAD_STRIBECK,
    LOAD_PRESLIDING,
    LOAD_BRISTLE,
    LOAD_BRISTLE_DAMPING,
    NORMAL_FRICTION,
    WEIGHT,
    MASS_LEVER,
) = slots(
    "load_dry",
    "load_coulomb",
    "load_stribeck_rise",
    "load_stribeck_velocity",
    "load_presliding",
    "load_bristle",
    "load_bristle_damping",
    "load_normal_friction",
    "load_weight",
    "load_mass_lever",
)


@hook("load_friction")
def bearing_friction(fx, hanging, speed, level):
    """The bearing carries weight and centrifugal force.

    |N| = hypot(m d w^2 + m g cos, m g sin) (eq. 3.6 with its sign set right).
    """
    if fx[NORMAL_FRICTION] > 0.0:
        along = fx[MASS_LEVER] * speed * speed + fx[WEIGHT] * np.cos(hanging)
        level += fx[NORMAL_FRICTION] * np.hypot(along, fx[WEIGHT] * np.sin(hanging))
    return level


@njit(error_model="numpy", inline="always")
def load_coulomb(fx, speed):
    """Coulomb and Stribeck level [Nm] of the load's joint."""
    level = fx[LOAD_COULOMB]
    if fx[LOAD_RISE] > 0.0:
        level *= 1.0 + fx[LOAD_RISE] * np.exp(-((speed / fx[LOAD_STRIBECK]) ** 2))
    return level


LIGHT_kgm2 = 0.01  # of a load of which the rig's file says nothing


def _write(v: Values, d: TrialMachine, w: RunConditions) -> None:
    """Dry friction of the load's joint."""
    if v["coulomb_Nm"] == 0.0 or w.kind in HELD:
        return
    d.put(LOAD_DRY, 1.0)
    d.put(LOAD_COULOMB, v["coulomb_Nm"])
    if "stribeck_rise" in v:
        d.put(LOAD_RISE, v["stribeck_rise"])
        d.put(LOAD_STRIBECK, v["stribeck_velocity_rad_per_s"])
    if "presliding_rad" in v:
        d.put(LOAD_PRESLIDING, v["presliding_rad"])
    if "bristle_rad" in v:
        d.put(LOAD_PRESLIDING, v["bristle_rad"])
        d.put(LOAD_BRISTLE, 1.0)
        d.put(LOAD_BRISTLE_DAMPING, v.get("bristle_damping_Nms_per_rad", 0.0))


@njit(cache=True, error_model="numpy")
def _friction(fx, speeds):
    """Dry friction (n,) of the load's joint."""
    return np.array([np.sign(w) * load_coulomb(fx, w) for w in speeds])


def _drawn(d: TrialMachine, v: Values, x: NDArray) -> NDArray:
    return _friction(d.fx, x) + d.machine_numbers.load_damping * x


@dataclass(frozen=True, kw_only=True)
class LoadFriction(DryFriction):
    """Coulomb and Stribeck friction of the load's joint.

    F = coulomb (1 + rise exp(-(w_l/w_s)^2)) against the motion; at rest it holds, exactly, up to
    coulomb (1 + rise), or, with a presliding stretch, is elastic until it slides, or on
    bristles, damped as they bend (LuGre, `engines.event_driven.bristles`). Bearing load adds
    lever |N|, N = hypot(m d w^2 + m g cos, m g sin), without elasticity.
    """

    effect: ClassVar[str] = "load-friction"
    law: ClassVar[str] = "coulomb-stribeck"
    port: ClassVar[Port] = Port.LOAD
    other_joint: ClassVar[str] = "gear"
    headline: ClassVar[str] = "Dry friction in the load's joint."
    figure_units: ClassVar[Mapping[str, str]] = {"coulomb_Nm": "Nm"}
    curve: ClassVar = EffectCurve(
        title="Friction of the load's joint", x_label="load speed (rad/s)",
        y_label="friction (Nm)", over="load_speed", evaluate=_drawn,
    )  # fmt: skip
    relevant: ClassVar = RelevantSize(
        variant="coulomb", part="load",
        size=lambda m: sized(0.05 * m.load_torque_Nm, "joint friction of {:.2g} Nm"),
    )  # fmt: skip

    coulomb_Nm: float = parameter(
        unit="Nm",
        bounds=(0.0, 1e9),
        source="a fit",
        meaning="Friction torque of the load joint at speed.",
    )
    stribeck_rise: float = stribeck_rise()
    stribeck_velocity_rad_per_s: float = stribeck_velocity(0.1, (5e-3, 10.0))
    presliding_rad: float = presliding(0.05, "joint")
    bristle_rad: float = bristle(0.05)
    bristle_damping_Nms_per_rad: float = bristle_damping(
        500.0, "Damping of the bristles while the motion bends them."
    )
    normal_lever_m: float = parameter(
        0.0,
        unit="m",
        bounds=(0.0, 0.1),
        source="friction coefficient times bearing radius; thesis eq. 3.6, corrected",
        meaning="Friction torque per bearing load of weight and centrifugal force.",
    )

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
                found |= {"load_presliding": width, "internal_states": 1.0}
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

    def equation(self) -> str:
        normal = ""
        if self.normal_lever_m > 0.0:
            normal = f"; {self.normal_lever_m:g} |N| more, N = bearing load, holds exactly"
        return (
            f"{self.coulomb_Nm:g} (1 + {self.stribeck_rise:g}"
            f" exp(-(w_l/{self.stribeck_velocity_rad_per_s:g})^2)) against w_l"
            f"{self.at_rest()}{normal}"
        )

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """Coulomb's level alone, with Stribeck's rise, presliding, bristles."""
        v, a, second = typical.like_speed, typical.like_angle, typical.like_time(1.0)
        t, rig = typical.load_torque_Nm, typical.rig
        level = Unknown(name="coulomb_Nm", unit="Nm", low=0.0, high=20 * t, scale=0.03 * t)
        rise = Unknown(name="stribeck_rise", unit="-", low=0.0, high=3.0, scale=0.1, prior=1.0)
        speed = Unknown(name="stribeck_velocity_rad_per_s", unit="rad/s", low=v(5e-3), high=v(10.0),
                        scale=0.2, log=True, prior=1.2)  # fmt: skip
        pre = Unknown(name="presliding_rad", unit="rad", low=a(1e-5), high=a(0.05), scale=0.2,
                      log=True, prior=1.5)  # fmt: skip
        micro = Unknown(name="bristle_damping_Nms_per_rad", unit="Nms/rad", low=0.0,
                        high=20 * t * second, scale=0.02 * t * second)  # fmt: skip
        inertia = rig.load_inertia_kgm2 if rig is not None else None
        inertia = inertia or typical.like_inertia(LIGHT_kgm2)
        # half of what keeps bristles from ringing
        held = float(np.sqrt(0.1 * t / a(1e-3) * inertia))
        common = {"effect": cls.effect, "subsystem": "load", "write": _write, "kind": cls}
        return (
            Law(law="coulomb", unknowns=(level,), starts=tuple((f * t,) for f in (0.02, 0.1, 0.4)),
                richer=("stops", "bristles"), **common),
            Law(law="stribeck", unknowns=(level, rise, speed), starts=((0.1 * t, 0.3, v(0.05)),),
                richer=("stops", "bristles"), **common),
            Law(law="presliding", unknowns=(level, pre), starts=((0.1 * t, a(1e-3)),),
                richer=("stops", "bristles"), **common),
            Law(law="stops", unknowns=(level, rise, speed, pre),
                starts=((0.1 * t, 0.2, v(0.05), a(1e-3)),), **common),
            Law(law="bristles",
                unknowns=(level, rise, speed, replace(pre, name="bristle_rad"), micro),
                starts=tuple((0.1 * t, 0.2, v(w), a(1e-3), d)
                             for w in (0.05, 0.15) for d in (0.1 * t * second, held)), **common),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The level."""
        return f"dry friction in the load's joint, {f('coulomb_Nm', 'Nm')}"
