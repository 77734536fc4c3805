"""A delay of a sensor."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rsea_core.effects.base import parameter
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.sensor_base import SensorTerm, writes_reading
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, Unknown


def _late(v, signal, w):
    return np.interp(w.time_s - v["delay_s"], w.time_s, signal)


@dataclass(frozen=True, kw_only=True)
class SensorDelay(SensorTerm):
    """A reading of an earlier time; before the delay has passed it shows the start."""

    effect: ClassVar[str] = "sensor-delay"
    law: ClassVar[str] = "delay"
    headline: ClassVar[str] = "The sensor has a delay."
    figure_units: ClassVar[Mapping[str, str]] = {"delay_s": "s"}

    delay_s: float = parameter(
        unit="s",
        bounds=(0.0, 1.0),
        source="bus and filter; a fit",
        meaning="How long ago the truth was what the reading shows.",
    )

    def equation(self) -> str:
        return f"{self.column} read(t) = true(t - {self.delay_s:g} s)"

    @classmethod
    def candidates_at(cls, column: str, typical: TypicalMagnitudes) -> tuple[Law, ...]:
        """A delay."""
        s = typical.like_time
        longest, late = (s(2.0), ((s(0.1),),)) if typical.relative else (0.2, ())
        unknown = Unknown(name="delay_s", unit="s", low=0.0, high=longest, scale=s(0.001))
        return (
            cls.variant(
                column, law="dead time", unknowns=(unknown,),
                starts=((s(0.002),), (s(0.01),), *late), write=writes_reading(column, _late),
            ),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The delay."""
        return f"a {f.reading} that is read with a delay of {f('delay_s', 's')}"
