"""A flexible link: the load's inertia in two parts with a spring and a damper between them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.load_base import HELD
from rsea_core.effects.relevant_size import RelevantSize
from rsea_core.effects.slots import slots
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import PLANT, Law, RunConditions, TrialMachine, Unknown, Values
from rsea_core.machine.rig import Rig

LINK_STIFFNESS, LINK_INERTIA, LINK_DAMPING = slots("link_stiffness", "link_inertia", "link_damping")


LINK_Hz = (4.0, 6.0, 8.0, 10.0, 12.0, 14.0, 17.0, 20.0, 25.0, 32.0, 45.0)
SLOWER_Hz = (0.6, 1.0, 1.5, 2.0, 3.0)  # more of a machine that is no bench
# a tenth apart, as narrow as the valley in which a ring of some periods stays in step; one that
# falls between two of them at one share of the inertia is met at another
LINK_GRID = tuple(
    (float(f), share, 0.02)
    for share in (0.3, 0.45, 0.6, 0.7, 0.8) for f in np.geomspace(4.0, 100.0, 34)
)  # fmt: skip


def _write(v: Values, d: TrialMachine, w: RunConditions) -> None:
    """A link whose outer part is joined by a stiffness."""
    if w.kind in HELD:
        return
    inertia = v["tip_share"] * d.plant[PLANT["load_inertia"]]
    d.plant[PLANT["load_inertia"]] *= 1.0 - v["tip_share"]
    stiffness = inertia * (1.0 - v["tip_share"]) * (2.0 * np.pi * v["frequency_Hz"]) ** 2
    d.put(LINK_INERTIA, inertia)
    d.put(LINK_STIFFNESS, stiffness)
    d.put(LINK_DAMPING, 2.0 * v["damping_ratio"] * np.sqrt(stiffness * inertia))


def _parameters(v: Values, rig: Rig) -> Values:
    """Both parts against each other, joint free, have the frequency and the damping ratio."""
    rig.need("the flexible link found", "load_inertia_kgm2")
    share = v["tip_share"]
    outer = share * rig.load_inertia_kgm2
    stiffness = outer * (1.0 - share) * (2.0 * math.pi * v["frequency_Hz"]) ** 2
    return {
        "link_stiffness_Nm_per_rad": stiffness,
        "outer_fraction": share,
        "link_damping_Nms_per_rad": 2.0 * v["damping_ratio"] * math.sqrt(stiffness * outer),
    }


@dataclass(frozen=True, kw_only=True)
class LoadFlexibility(Term):
    """A flexible link: part of the load's inertia sits behind a spring and a damper.

    The joint side keeps the rest of the inertia, friction, contact and the whole gravity
    torque: the encoder and the weight belong to the joint's angle. What the outer part adds is
    its inertia alone.
    """

    effect: ClassVar[str] = "load-flexibility"
    law: ClassVar[str] = "one-mode"
    port: ClassVar[Port] = Port.LOAD
    headline: ClassVar[str] = "The link is flexible: it adds a resonance."
    figure_units: ClassVar[Mapping[str, str]] = {"free_link_frequency_Hz": "Hz"}
    relevant: ClassVar = RelevantSize(
        variant="*", part="load", size=lambda m: ((10.0, 0.4, 0.02), "a flexible link at 10 Hz")
    )

    link_stiffness_Nm_per_rad: float = parameter(
        unit="Nm/rad",
        bounds=(1e-12, 1e9),
        source="a beam's 3 E I / l; a fit",
        meaning="Stiffness between the joint side and the outer part of the link.",
    )
    outer_fraction: float = parameter(
        unit="-",
        bounds=(0.001, 0.99),
        source="from the mass's place along the link; a fit",
        meaning="Share of the load's inertia that sits beyond the flexibility.",
    )
    link_damping_Nms_per_rad: float = parameter(
        0.0,
        unit="Nms/rad",
        bounds=(0.0, 1e9),
        source="0: none; a fit",
        meaning="Damping between the joint side and the outer part of the link.",
    )

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Frequency of both parts against each other, joint free."""
        inertia = context.need(self.effect, "load_inertia_kgm2")
        reduced = inertia * self.outer_fraction * (1.0 - self.outer_fraction)
        frequency = math.sqrt(self.link_stiffness_Nm_per_rad / reduced) / (2.0 * math.pi)
        return {"free_link_frequency_Hz": frequency}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Stiffness, outer inertia, damping."""
        return {
            "link_stiffness": self.link_stiffness_Nm_per_rad,
            "link_damping": self.link_damping_Nms_per_rad,
            "internal_states": 1.0,
        }

    def rig_numbers(self, rig, gravity: float) -> Mapping[str, float]:
        """Inertia of the outer part."""
        rig.need("a flexible link", "load_inertia_kgm2")
        return {"link_inertia": self.outer_fraction * rig.load_inertia_kgm2}

    def on_plant(self, plant):
        """The machine with the joint side's inertia."""
        return plant._replace(load_inertia=(1.0 - self.outer_fraction) * plant.load_inertia)

    def equation(self) -> str:
        return (
            f"tau_link = {self.link_stiffness_Nm_per_rad:g} (theta_l - theta_o)"
            f" + {self.link_damping_Nms_per_rad:g} (w_l - w_o),"
            f"  {self.outer_fraction:g} J_l w_o' = tau_link,"
            f"  {1.0 - self.outer_fraction:g} J_l w_l' = ... - tau_link"
        )

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """Frequency, the outer part's share, damping."""
        unit = typical.like_time(1.0)
        low, tried = (0.3, (*SLOWER_Hz, *LINK_Hz)) if typical.relative else (1.5, LINK_Hz)
        unknowns = (
            Unknown(name="frequency_Hz", unit="Hz", low=low / unit, high=120.0 / unit, scale=0.03,
                    log=True),
            Unknown(name="tip_share", unit="-", low=0.002, high=0.95, scale=0.05),
            Unknown(name="damping_ratio", unit="-", low=1e-3, high=0.5, scale=0.2, log=True,
                    prior=1.0),
        )  # fmt: skip
        return (
            Law(effect=cls.effect, law="one mode", subsystem="load", write=_write,
                unknowns=unknowns, starts=tuple((f / unit, 0.4, 0.02) for f in tried),
                grid=LINK_GRID, swings=True, kind=cls, parameters=_parameters,
                figure_values={"free_link_frequency_Hz": "frequency_Hz"}),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The frequency."""
        frequency = f.figures["free_link_frequency_Hz"]
        return f"a flexible link, {frequency:.3g} Hz when free"
