"""A spring whose stiffness grows with its deflection."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.base import Port, Term, parameter
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.relevant_size import RelevantSize
from rsea_core.effects.spring_base import draw_spring
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, RunConditions, TrialMachine, Unknown, Values
from rsea_core.errors import TermError
from rsea_core.machine.spring_table import C1, C2, SpringTable, read_only

HARDENING_AT_rad = 0.15  # where the contract compares tangents
UP_TO_rad = 0.3  # the polynomial goes
LEAST_TANGENT = 0.25  # over that at zero, at which a softening spring goes on straight


def extent_rad(ratio: float, up_to: float, share: float = 0.0) -> float:
    """Deflection up to which the law is a polynomial: a softening spring keeps a quarter."""
    growth = ratio - 1.0
    found = np.roots([(1.0 - share) * growth, share * growth, 1.0 - LEAST_TANGENT])
    ends = [u.real for u in found if u.real > 0.0 and abs(u.imag) < 1e-9 * abs(u)]
    return min(HARDENING_AT_rad * min(ends, default=np.inf), up_to)


def regions_of(stiffness: float, ratio: float, up_to: float, share: float) -> NDArray:
    """Regions (4, 6) of the spring's table: straight, polynomial either way, straight."""
    extent = extent_rad(ratio, up_to, share)
    growth = stiffness * (ratio - 1.0)
    square = share * growth / (2.0 * HARDENING_AT_rad)
    cubic = (1.0 - share) * growth / (3.0 * HARDENING_AT_rad**2)
    torque = stiffness * extent + square * extent**2 + cubic * extent**3
    tangent = stiffness + 2.0 * square * extent + 3.0 * cubic * extent**2
    curvature = square + 3.0 * cubic * extent
    return np.array(
        [
            (-extent, -extent, -torque, tangent, 0.0, 0.0),
            (0.0, -extent, -torque, tangent, -curvature, cubic),
            (extent, 0.0, 0.0, stiffness, square, cubic),
            (np.inf, extent, torque, tangent, 0.0, 0.0),
        ]
    )


def _write(v: Values, d: TrialMachine, w: RunConditions) -> None:
    """The law over the stiffness of the machine."""
    up_to, share = v.get("up_to_rad", UP_TO_rad), v.get("quadratic_share", 0.0)
    d.spring = regions_of(d.stiffness, v["stiffness_ratio_at_0p15rad"], up_to, share)


@dataclass(frozen=True, kw_only=True)
class SpringHardening(Term):
    """A stiffness that grows (or falls) with the deflection: K d + k_2 |d| d + k_3 d^3.

    k_2 = K s (r - 1)/(2 0.15) and k_3 = K (1 - s) (r - 1)/(3 0.15^2) for the ratio r of the
    tangents at 0.15 rad and at zero, and a share s: 0 is Duffing's cubic spring, 1 a
    quadratic spring, as in joints of variable stiffness (Migliore, Brown & DeWeerth, ICRA 2005).
    Beyond `up_to_rad`, or where a softening spring has a quarter of its stiffness left, the law is
    a straight line.

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
        meaning="Deflection up to which the law is a polynomial; beyond it a straight line.",
        default=UP_TO_rad,
    )

    quadratic_share: float = parameter(
        0.0,
        unit="-",
        bounds=(-1e3, 1e3),
        source="0: grows with the square; 1: in proportion to the deflection; a fit",
        meaning="Share of the tangent's growth up to 0.15 rad that is proportional to deflection.",
    )

    @property
    def extent_rad(self) -> float:
        """Deflection up to which the law is a polynomial."""
        return extent_rad(self.stiffness_ratio_at_0p15rad, self.up_to_rad, self.quadratic_share)

    def on_spring(self, table: SpringTable) -> SpringTable:
        """The law over a linear spring."""
        if np.any(table.regions[:, C2:] != 0.0) or np.unique(table.regions[:, C1]).size > 1:
            raise TermError("spring-hardening: the spring is given by a curve already")
        regions = regions_of(
            table.regions[0, C1], self.stiffness_ratio_at_0p15rad, self.up_to_rad,
            self.quadratic_share,
        )  # fmt: skip
        return table._replace(regions=read_only(regions))

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """It bends the spring's law."""
        return "needs a spring between wheel and load" if rigid else None

    def equation(self) -> str:
        growth, share = self.stiffness_ratio_at_0p15rad - 1.0, self.quadratic_share
        square = f" + {share * growth / 0.3:.5g} |d| d" if share else ""
        return (
            f"f(d) = K_s (d{square} + {(1.0 - share) * growth / 0.0675:.5g} d^3) up to"
            f" {self.extent_rad:.4g} rad, linear beyond"
        )

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """A ratio of tangents, which grow with the deflection, its square, or both."""
        common = {"effect": cls.effect, "subsystem": "spring", "write": _write, "kind": cls}
        ratio = Unknown(name="stiffness_ratio_at_0p15rad", unit="-", low=0.3, high=10.0, scale=0.05)
        if not typical.relative:
            starts = ((1.1,), (1.5,), (0.85,))
            return (Law(law="cubic", unknowns=(ratio,), starts=starts, **common),)
        # a ratio at 0.15 rad of a spring that deflects by as much more or less
        size = (HARDENING_AT_rad / (2.0 * typical.deflection_rad)) ** 2
        ratio = replace(ratio, low=-1e9, high=1e9, scale=0.05 * size)
        up_to = 5.0 * typical.deflection_rad
        held = Unknown(name="up_to_rad", unit="rad", low=up_to, high=up_to, scale=0.0)
        share = Unknown(name="quadratic_share", unit="-", low=-20.0, high=20.0, scale=0.1)
        all_of_it = replace(share, low=1.0, high=1.0, scale=0.0)
        both = "quadratic and cubic"
        starts = [1.0 + part * size for part in (0.1, 0.5, -0.15)]
        return (
            Law(law="cubic", unknowns=(ratio, held), richer=(both,),
                starts=tuple((r, up_to) for r in starts), **common),
            Law(law="quadratic", unknowns=(ratio, held, all_of_it), richer=(both,),
                starts=tuple((r, up_to, 1.0) for r in starts), **common),
            Law(law=both, unknowns=(ratio, held, share), follows=True,
                starts=tuple((r, up_to, 0.5) for r in starts), **common),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The ratio."""
        ratio = f.figures["stiffness_ratio_at_0p15rad"]
        direction = "softer" if ratio < 1.0 else "stiffer"
        at = f.of(HARDENING_AT_rad, "rad")
        return f"a spring that is {direction} at {at}, {ratio:.3g} times as stiff as at 0"
