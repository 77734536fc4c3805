"""A sensor whose offset drifts."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import parameter
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.sensor_base import SensorTerm, draw_error, span_of, writes_reading
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, Unknown


def _drift(v, signal, w):
    return signal + v["rate_per_s"] * (w.time_s - w.time_s[0] + v.get("session", 0.0) * w.session_s)


@dataclass(frozen=True, kw_only=True)
class SensorDrift(SensorTerm):
    """A reading that moves away from the truth at a constant rate, from the first row on."""

    effect: ClassVar[str] = "sensor-drift"
    law: ClassVar[str] = "linear"
    headline: ClassVar[str] = "The sensor drifts."
    figure_units: ClassVar[Mapping[str, str]] = {"rate_per_s": "/s"}

    rate_per_s: float = parameter(
        unit="of its column per s",
        bounds=(-10.0, 10.0),
        source="warming of the electronics; a fit",
        meaning="How fast the reading moves away from the truth.",
    )

    def equation(self) -> str:
        return f"{self.column} read = true + {self.rate_per_s:g} t"

    @classmethod
    def candidates_at(cls, column: str, typical: TypicalMagnitudes) -> tuple[Law, ...]:
        """A rate, anew in each recording or over the session."""
        spread, longest = span_of(typical, column)
        rate = Unknown(name="rate_per_s", unit="1/s", low=-20 * spread / longest,
                       high=20 * spread / longest, scale=0.005 * spread / longest)  # fmt: skip
        return tuple(
            cls.variant(
                column, law=name, starts=((0.005 * spread / longest, run),),
                unknowns=(rate, Unknown(name="session", unit="-", low=run, high=run, scale=0.0)),
                write=writes_reading(column, _drift),
                parameters=lambda v, rig: {"rate_per_s": v["rate_per_s"]},
            )
            for name, run in (("in each recording", 0.0), ("over the session", 1.0))
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The rate."""
        rate = f.of(f.figures["rate_per_s"], f.unit)
        return f"a {f.reading} whose zero drifts by {rate} a second"

    @staticmethod
    def curve_at(column: str):
        """The error over time."""
        return draw_error(column, lambda d, v, x: v.get("rate_per_s", 0.0) * x, over_time=True)
