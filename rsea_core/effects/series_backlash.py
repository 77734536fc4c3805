"""Play in series with the spring, without a mass between the two: a dead zone of its law."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import Gear, Port, Term, parameter
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.gear_backlash import LARGE_WIDTHS, WIDTHS, GearBacklash
from rsea_core.effects.spring_base import draw_spring
from rsea_core.effects.spring_curve import NEVER_rad
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, RunConditions, TrialMachine, Unknown, Values
from rsea_core.machine.spring_table import SpringTable, with_dead_zone


def _write(v: Values, d: TrialMachine, w: RunConditions) -> None:
    d.series_backlash_rad = v["width_rad"]


@dataclass(frozen=True, kw_only=True)
class SeriesBacklash(Term):
    """Lost motion in the path of the torque where no body of its own moves in the gap.

    A key, a coupling or a spline beside the spring, or a gear whose wheel is light: the spring
    carries f(d - w/2) above w/2, f(d + w/2) below -w/2, and nothing between. `GearBacklash` has
    the wheel's inertia and impacts; this is its limit without them.

    Source
    ------
    Nordin & Gutman, Controlling mechanical systems with backlash: a survey, Automatica 38
    (2002) 1633, section 2.1: the dead-zone model.
    """

    effect: ClassVar[str] = GearBacklash.effect
    law: ClassVar[str] = "dead-zone"
    port: ClassVar[Port] = Port.GEAR
    in_spring_table: ClassVar[bool] = True
    headline: ClassVar[str] = GearBacklash.headline
    figure_units: ClassVar[Mapping[str, str]] = {"width_rad": "rad"}
    curve: ClassVar = draw_spring()

    width_rad: float = parameter(
        unit="rad (of deflection)",
        bounds=(0.0, 7.0),
        source="a fit",
        meaning="How far the load can be turned without a torque.",
    )

    def on_spring(self, table: SpringTable) -> SpringTable:
        """The law with the gap in it."""
        if self.width_rad == 0.0:
            return table
        return table._replace(regions=with_dead_zone(table.regions, self.width_rad))

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Where the law bends."""
        half = 0.5 * self.width_rad
        if half == 0.0:
            return {}
        bends = (-NEVER_rad, -half, half, NEVER_rad)
        return {f"knee_{i}": at for i, at in enumerate(bends, start=1)} | {"internal_states": 1.0}

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """It lies in series with the spring."""
        return "needs a spring, with which it is in series" if rigid else None

    def equation(self) -> str:
        half = 0.5 * self.width_rad
        return f"tau_s = f(d - {half:g} sgn d) where |d| > {half:g} rad, 0 within"

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """A width."""
        deflection = typical.deflection_rad
        width = Unknown(name="width_rad", unit="rad", low=0.0, high=4.0 * deflection,
                        scale=0.02 * deflection)  # fmt: skip
        if not typical.relative:
            return ()
        return (
            Law(effect=cls.effect, law="play in series", subsystem="gear", write=_write, kind=cls,
                unknowns=(width,), starts=tuple((s * deflection,) for s in WIDTHS + LARGE_WIDTHS),
                richer=("play",)),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The width."""
        return f"backlash in the gear or its couplings, {f('width_rad', 'rad')} at the output"
