"""Coils that touch: the spring's stiffness rises from an onset on."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.relevant_size import RelevantSize
from rsea_core.effects.spring_base import draw_spring
from rsea_core.effects.spring_curve import NEVER_rad
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, RunConditions, TrialMachine, Unknown, Values
from rsea_core.errors import TermError
from rsea_core.machine.rig import Rig
from rsea_core.machine.spring_table import (
    ANCHOR,
    C0,
    C2,
    UPPER,
    SpringTable,
    spring_tangent_Nm_per_rad,
    sum_of_regions,
)

FAR_rad = 7.0  # largest onset of a knee: a turn and more, no knee at all


ROUNDEST = 1.8  # onsets: width of a knee, at most; a wider one would reach back to zero


def _write(v: Values, d: TrialMachine, w: RunConditions) -> None:
    """Coils touch past an onset: the stiffness is larger beyond, on one or both sides.

    With `round_rad` it grows over that width about the onset, where the asymptotes meet; with
    `onset_backward_rad` unwinding has an onset of its own.
    """
    K, side = d.stiffness, v.get("side", 0.0)
    more = K * (v["stiffness_after_over_before"] - 1.0)
    width = v.get("round_rad", 0.0)
    forward, backward = v["onset_rad"], v.get("onset_backward_rad", v["onset_rad"])
    low, high = [], []
    if side <= 0.0:
        half = min(0.5 * width, 0.9 * backward)
        a, b = backward - half, backward + half
        end = -K * b - more * half
        low.append((-b, -b, end, K + more, 0.0, 0.0))
        if half > 0.0:
            low.append((-a, -a, -K * a, K, -0.25 * more / half, 0.0))
    if side >= 0.0:
        half = min(0.5 * width, 0.9 * forward)
        a, b = forward - half, forward + half
        if half > 0.0:
            high.append((b, a, K * a, K, 0.25 * more / half, 0.0))
        high.append((np.inf, b, K * b + more * half, K + more, 0.0, 0.0))
    first = high[0][1] if high else np.inf
    d.spring = np.array([*low, (first, 0.0, 0.0, K, 0.0, 0.0), *high])


def _parameters(v: Values, rig: Rig) -> Values:
    """A knee on one side: the other lies where no spring goes."""
    onset, side = v["onset_rad"], v.get("side", 0.0)
    backward = v.get("onset_backward_rad", onset)
    given = {"onset_rad": onset, "stiffness_ratio": v["stiffness_after_over_before"]}
    if "onset_backward_rad" in v:
        given["negative_onset_rad"] = backward
    if side > 0.0:
        given["negative_onset_rad"] = backward = FAR_rad
    elif side < 0.0:
        onset = FAR_rad
        given |= {"onset_rad": FAR_rad, "negative_onset_rad": backward}
    if "round_rad" in v:
        given["knee_width_rad"] = min(v["round_rad"], ROUNDEST * min(onset, backward))
    return given


@dataclass(frozen=True, kw_only=True)
class SpringContact(Term):
    """Coils that touch: past an onset the spring is stiffer, by a knee in each direction.

    Beyond the onset (r - 1) times the tangent there is added to the stiffness, on whatever law
    the spring has. With a width the tangent grows linearly over it, centred on the onset;
    without, it jumps. The simulation cuts its steps at the knees.

    Raises
    ------
    TermError
        If a parameter is outside its bounds, or a knee reaches back to zero deflection.
    """

    effect: ClassVar[str] = "spring-contact"
    law: ClassVar[str] = "knees"
    port: ClassVar[Port] = Port.SPRING
    in_spring_table: ClassVar[bool] = True
    headline: ClassVar[str] = "The spring's coils touch: its stiffness grows past a deflection."
    figure_units: ClassVar[Mapping[str, str]] = {"onset_rad": "rad", "onset_Nm": "Nm"}
    curve: ClassVar = draw_spring()
    relevant: ClassVar = RelevantSize(
        variant="knee both ways", part="spring",
        size=lambda m: ((0.1, 1.5, 0.0), "coils that touch past 0.1 rad"),
    )  # fmt: skip

    onset_rad: float = parameter(
        unit="rad",
        bounds=(1e-3, FAR_rad),
        source="the clearance of the coils; a fit",
        meaning="Positive deflection at which coils touch.",
    )
    stiffness_ratio: float = parameter(
        unit="-",
        bounds=(1.0, 100.0),
        source="a fit",
        meaning="Tangent just past the onset over tangent just before it.",
    )
    negative_onset_rad: float = parameter(
        0.0,
        unit="rad",
        bounds=(0.0, FAR_rad),
        source="0: the same as the positive one",
        meaning="Negative deflection, without its sign, at which coils touch.",
    )
    knee_width_rad: float = parameter(
        0.0,
        unit="rad",
        bounds=(0.0, 1e9),
        source="0: a sharp knee; coils that close one after the other",
        meaning="Deflection over which the tangent grows to its new value.",
    )

    def __post_init__(self):
        super().__post_init__()
        if not 0.5 * self.knee_width_rad < min(self.onsets_rad):
            raise TermError(
                f"spring-contact: knee_width_rad = {self.knee_width_rad:g} reaches from the onset"
                f" of {min(self.onsets_rad):g} rad back to zero: at most twice the onset"
            )

    @property
    def onsets_rad(self) -> tuple[float, float]:
        """Onset in negative (without its sign) and positive direction."""
        return self.negative_onset_rad or self.onset_rad, self.onset_rad

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Where the first coils touch, half a knee's width before its onset; the torque there."""
        onset = min(self.onsets_rad) - 0.5 * self.knee_width_rad
        stiffness = context.need(self.effect, "spring_stiffness_Nm_per_rad")
        return {"onset_rad": onset, "onset_Nm": stiffness * onset}

    def on_spring(self, table: SpringTable) -> SpringTable:
        """The law with both knees in it."""
        low, high = self.onsets_rad
        for onset in (-low, high):
            tangent = float(spring_tangent_Nm_per_rad(table, onset))
            extra = (self.stiffness_ratio - 1.0) * tangent
            knee = _knee(abs(onset), extra, self.knee_width_rad)
            if onset < 0.0:
                knee = _mirrored(knee)
            table = table._replace(regions=sum_of_regions(table.regions, knee))
        return table

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Where the law bends."""
        (low, high), half = self.onsets_rad, 0.5 * self.knee_width_rad
        bends = (-low - half, -low + half, high - half, high + half)
        if half == 0.0:
            bends = (-NEVER_rad, -low, high, NEVER_rad)
        return {f"knee_{i}": at for i, at in enumerate(bends, start=1)} | {"internal_states": 1.0}

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """It stiffens the spring."""
        return "needs a spring between wheel and load" if rigid else None

    def equation(self) -> str:
        low, high = self.onsets_rad
        return (
            f"tangent of f times {self.stiffness_ratio:g} where d < {-low:g} rad or"
            f" d > {high:g} rad, knees {self.knee_width_rad:g} rad wide"
        )

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """A knee, sharp or rounded, one way, both ways alike, or both ways by themselves."""
        d = typical.deflection_rad
        onset = Unknown(
            name="onset_rad", unit="rad", low=0.05 * d, high=6.0 * d, scale=0.03, log=True
        )
        after = Unknown(name="stiffness_after_over_before", unit="-", low=1.0, high=30.0, scale=0.1,
                        log=True)  # fmt: skip
        back = replace(onset, name="onset_backward_rad")
        rounded = Unknown(name="round_rad", unit="rad", low=1e-3 * d, high=3.0 * d, scale=0.2,
                          log=True, prior=1.5)  # fmt: skip
        sides = (("both ways", 0.0), ("forward", 1.0), ("backward", -1.0))

        def at(side: float) -> Unknown:
            return Unknown(name="side", unit="-", low=side, high=side, scale=0.0)

        common = {"effect": cls.effect, "subsystem": "spring", "write": _write, "kind": cls,
                  "parameters": _parameters}  # fmt: skip
        return (
            *(Law(law=f"knee {name}", unknowns=(onset, after, at(side)),
                  starts=tuple((f * d, 2.0, side) for f in (0.7, 1.2, 1.7)),
                  richer=(f"rounded {name}",) + (("two knees", "two rounded") if not side else ()),
                  **common)
              for name, side in sides),
            *(Law(law=f"rounded {name}", unknowns=(onset, after, at(side), rounded),
                  starts=((1.2 * d, 2.0, side, 0.3 * d),), **common)
              for name, side in sides),
            Law(law="two knees", unknowns=(onset, after, back), starts=((d, 2.0, d),), **common),
            Law(law="two rounded", unknowns=(onset, after, back, rounded),
                starts=((d, 2.0, d, 0.3 * d),), **common),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The first touch."""
        return (
            f"coils of the spring that touch from {f('onset_rad', 'rad')} on, {f('onset_Nm', 'Nm')}"
        )


def _knee(onset: float, extra: float, width: float) -> NDArray:
    """Regions of a law that is zero below a positive onset and has a slope beyond it."""
    start, end = onset - 0.5 * width, onset + 0.5 * width
    zero = (start, start, 0.0, 0.0, 0.0, 0.0)
    if width == 0.0:
        return np.array([zero, (np.inf, onset, 0.0, extra, 0.0, 0.0)])
    curved = (end, start, 0.0, 0.0, 0.5 * extra / width, 0.0)
    return np.array([zero, curved, (np.inf, end, 0.5 * extra * width, extra, 0.0, 0.0)])


def _mirrored(regions: NDArray) -> NDArray:
    """Regions of -f(-d)."""
    found = regions[::-1].copy()
    found[:, UPPER] = np.append(-regions[-2::-1, UPPER], np.inf)
    found[:, ANCHOR] *= -1.0
    found[:, [C0, C2]] *= -1.0
    return found
