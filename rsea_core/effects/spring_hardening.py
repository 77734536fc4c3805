"""A spring whose stiffness grows with its deflection."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from rsea_core.effects.base import Port, Term, parameter
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.relevant_size import RelevantSize
from rsea_core.effects.spring_base import draw_spring
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, RunConditions, TrialMachine, Unknown, Values
from rsea_core.errors import TermError
from rsea_core.machine.spring_table import C1, C2, SpringTable, read_only

HARDENING_AT_rad = 0.15  # where the contract compares tangents
UP_TO_rad = 0.3  # the cubic goes


def extent_rad(ratio: float, up_to: float) -> float:
    """Deflection up to which the law is a cubic: a softening spring keeps a quarter."""
    if ratio >= 1.0:
        return up_to
    return min(HARDENING_AT_rad * np.sqrt(0.75 / (1.0 - ratio)), up_to)


def _write(v: Values, d: TrialMachine, w: RunConditions) -> None:
    """K (d + c d^3) up to 0.3 rad, or where a softening spring has a quarter left."""
    K, ratio = d.stiffness, v["stiffness_ratio_at_0p15rad"]
    extent = extent_rad(ratio, v.get("up_to_rad", UP_TO_rad))
    cubic = K * (ratio - 1.0) / (3.0 * 0.15**2)
    torque, tangent = K * extent + cubic * extent**3, K + 3.0 * cubic * extent**2
    curvature = 3.0 * cubic * extent
    d.spring = np.array(
        [
            (-extent, -extent, -torque, tangent, 0.0, 0.0),
            (0.0, -extent, -torque, tangent, -curvature, cubic),
            (extent, 0.0, 0.0, K, 0.0, cubic),
            (np.inf, extent, torque, tangent, 0.0, 0.0),
        ]
    )


@dataclass(frozen=True, kw_only=True)
class SpringHardening(Term):
    """A stiffness that grows (or falls) with the square of the deflection: K d + k_3 d^3.

    k_3 = K (r - 1)/(3 0.15^2) for the ratio r of the tangents at 0.15 rad and at zero. Beyond
    `up_to_rad`, or where a softening spring has a quarter of its stiffness left, it goes on
    straight.

    Raises
    ------
    TermError
        If a parameter is outside its bounds, or the spring is given by a curve already.
    """

    effect: ClassVar[str] = "spring-hardening"
    law: ClassVar[str] = "cubic"
    in_spring_table: ClassVar[bool] = True
    port: ClassVar[Port] = Port.SPRING
    headline: ClassVar[str] = "The spring's stiffness changes smoothly with its deflection."
    figure_units: ClassVar[Mapping[str, str]] = {"stiffness_ratio_at_0p15rad": "-"}
    curve: ClassVar = draw_spring()
    relevant: ClassVar = RelevantSize(
        variant="cubic", part="spring", size=lambda m: ((1.3,), "30 % of hardening at 0.15 rad")
    )

    stiffness_ratio_at_0p15rad: float = parameter(
        unit="-",
        bounds=(-1e9, 1e9),
        source="tangent there over tangent at zero; a fit",
        meaning="Tangent stiffness at 0.15 rad over that at zero deflection.",
    )

    up_to_rad: float = parameter(
        unit="rad",
        bounds=(1e-9, 1e9),
        source="the largest deflection of the recordings; the bench's 0.3 rad",
        meaning="Deflection up to which the law is a cubic; beyond it the law is a straight line.",
        default=UP_TO_rad,
    )

    @property
    def extent_rad(self) -> float:
        """Deflection up to which the law is a cubic."""
        return extent_rad(self.stiffness_ratio_at_0p15rad, self.up_to_rad)

    def on_spring(self, table: SpringTable) -> SpringTable:
        """The law over a linear spring."""
        if np.any(table.regions[:, C2:] != 0.0) or np.unique(table.regions[:, C1]).size > 1:
            raise TermError("spring-hardening: the spring is given by a curve already")
        K, extent = table.regions[0, C1], self.extent_rad
        cubic = K * (self.stiffness_ratio_at_0p15rad - 1.0) / (3.0 * HARDENING_AT_rad**2)
        torque, tangent = K * extent + cubic * extent**3, K + 3.0 * cubic * extent**2
        curvature = 3.0 * cubic * extent
        regions = np.array(
            [
                (-extent, -extent, -torque, tangent, 0.0, 0.0),
                (0.0, -extent, -torque, tangent, -curvature, cubic),
                (extent, 0.0, 0.0, K, 0.0, cubic),
                (np.inf, extent, torque, tangent, 0.0, 0.0),
            ]
        )
        return table._replace(regions=read_only(regions))

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """It bends the spring's law."""
        return "needs a spring between wheel and load" if rigid else None

    def equation(self) -> str:
        return (
            f"f(d) = K_s (d + {(self.stiffness_ratio_at_0p15rad - 1) / 0.0675:.5g} d^3) up to"
            f" {self.extent_rad:.4g} rad, linear beyond"
        )

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """A ratio of tangents."""
        common = {"effect": cls.effect, "law": "cubic", "subsystem": "spring", "write": _write,
                  "kind": cls}  # fmt: skip
        ratio = Unknown(name="stiffness_ratio_at_0p15rad", unit="-", low=0.3, high=10.0, scale=0.05)
        if not typical.relative:
            return (Law(unknowns=(ratio,), starts=((1.1,), (1.5,), (0.85,)), **common),)
        # a ratio at 0.15 rad of a spring that deflects by as much more or less
        size = (HARDENING_AT_rad / (2.0 * typical.deflection_rad)) ** 2
        ratio = replace(ratio, low=-1e9, high=1e9, scale=0.05 * size)
        up_to = 5.0 * typical.deflection_rad
        held = Unknown(name="up_to_rad", unit="rad", low=up_to, high=up_to, scale=0.0)
        starts = tuple((1.0 + share * size, up_to) for share in (0.1, 0.5, -0.15))
        return (Law(unknowns=(ratio, held), starts=starts, **common),)

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The ratio."""
        ratio = f.figures["stiffness_ratio_at_0p15rad"]
        direction = "softer" if ratio < 1.0 else "stiffer"
        at = f.of(HARDENING_AT_rad, "rad")
        return f"a spring that is {direction} at {at}, {ratio:.3g} times as stiff as at 0"
