"""Dry friction in the load's joint that depends on the load's angle."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rsea_core.effects.base import Gear, Port, Term, parameter
from rsea_core.effects.curve import EffectCurve
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.hooks import hook, summed
from rsea_core.effects.load_base import HELD
from rsea_core.effects.load_friction import LOAD_DRY, LoadFriction
from rsea_core.effects.slots import slots
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, RunConditions, TrialMachine, Unknown, Values
from rsea_core.machine.rig import Rig

LEVEL, SINE, COSINE = slots("angle_friction", "angle_friction_sine", "angle_friction_cosine")


@hook("load_friction")
def angle_friction(fx, angle, speed, level):
    """A level that changes once in a turn of the joint, never below zero."""
    if fx[LEVEL] > 0.0:
        share = 1.0 + fx[SINE] * np.sin(angle) + fx[COSINE] * np.cos(angle)
        level += fx[LEVEL] * max(share, 0.0)
    return level


def _write(v: Values, d: TrialMachine, w: RunConditions) -> None:
    if w.kind not in HELD and v["coulomb_Nm"] > 0.0:
        d.put(LOAD_DRY, 1.0)
        for at, name in ((LEVEL, "coulomb_Nm"), (SINE, "sine_share"), (COSINE, "cosine_share")):
            d.put(at, v[name])


def _parameters(v: Values, rig: Rig) -> Values:
    """Amplitude and phase for a pair of waves."""
    a, b = v["sine_share"], v["cosine_share"]
    share, phase = float(np.hypot(a, b)), float(np.arctan2(b, a))
    return {"coulomb_Nm": v["coulomb_Nm"], "share": share, "phase_rad": phase}


@dataclass(frozen=True, kw_only=True)
class LoadFrictionAngle(Term):
    """Coulomb friction whose level changes once in a turn: a bent shaft, a tight spot, a seal.

    F = coulomb (1 + share sin(theta + phase)) against the motion, at least 0, with theta from
    where the load hangs; at rest it holds, exactly.

    Source
    ------
    Armstrong-Helouvry, Control of Machines with Friction (1991): friction of the position.
    """

    effect: ClassVar[str] = "load-friction-angle"
    law: ClassVar[str] = "once-a-turn"
    generalises: ClassVar[str] = LoadFriction.effect
    port: ClassVar[Port] = Port.LOAD
    headline: ClassVar[str] = "Dry friction in the load's joint depends on the load's angle."
    figure_units: ClassVar[Mapping[str, str]] = {"coulomb_Nm": "Nm", "share": "-"}
    curve: ClassVar = EffectCurve(
        title="Friction level of the load's joint", x_label="load angle (rad)",
        y_label="friction level (Nm)", over="load_angle", evaluate=lambda d, v, x: summed(
            "load_friction", d.fx, x + d.machine_numbers.gravity_offset, 0.0 * x),
    )  # fmt: skip

    coulomb_Nm: float = parameter(
        unit="Nm", bounds=(0.0, 1e9), source="a fit", meaning="Mean level of the friction."
    )
    share: float = parameter(
        unit="-", bounds=(0.0, 3.0), source="a fit", meaning="Change of the level over its mean."
    )
    phase_rad: float = parameter(
        0.0, unit="rad", bounds=(-7.0, 7.0), source="a fit", meaning="Its phase in hanging down."
    )

    other_joint: ClassVar[str] = LoadFriction.other_joint
    needs = LoadFriction.needs  # of two dry joints

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The level and both parts of its wave."""
        sine, cosine = self.share * np.cos(self.phase_rad), self.share * np.sin(self.phase_rad)
        return {"angle_friction": self.coulomb_Nm, "angle_friction_sine": sine,
                "angle_friction_cosine": cosine, "load_dry": 1.0}  # fmt: skip

    def equation(self) -> str:
        wave = f"1 + {self.share:g} sin(theta + {self.phase_rad:g})"
        return f"{self.coulomb_Nm:g} max({wave}, 0) against w_l; holds exactly at rest"

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """A level and the two parts of its wave."""
        t, pair = typical.load_torque_Nm, {"unit": "-", "low": -1.0, "high": 1.0, "scale": 0.05}
        level = Unknown(name="coulomb_Nm", unit="Nm", low=0.0, high=20 * t, scale=0.03 * t)
        wave = (Unknown(name=f"{part}_share", prior=0.7, **pair) for part in ("sine", "cosine"))
        starts = (0.1 * t, 0.5, 0.0), (0.1 * t, 0.0, 0.5)
        return (Law(effect=cls.effect, law="once a turn", subsystem="load", write=_write, kind=cls,
                    unknowns=(level, *wave), starts=starts, parameters=_parameters),)  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """Mean level and change."""
        change = f.percent(f.figures["share"])
        return f"dry friction in the load's joint, {f('coulomb_Nm', 'Nm')} ± {change} over a turn"
