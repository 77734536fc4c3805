"""A sensor with a scale error."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import parameter
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.sensor_base import SensorTerm, draw_error, writes_reading
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, Unknown


@dataclass(frozen=True, kw_only=True)
class SensorScale(SensorTerm):
    """A reading in proportion to the truth, with another factor than 1."""

    effect: ClassVar[str] = "sensor-scale"
    law: ClassVar[str] = "factor"
    headline: ClassVar[str] = "The sensor has a scale error."
    figure_units: ClassVar[Mapping[str, str]] = {"scale": "-"}

    scale: float = parameter(
        unit="-",
        bounds=(0.1, 10.0),
        source="calibration; a fit",
        meaning="Reading over truth.",
    )

    def equation(self) -> str:
        return f"{self.column} read = {self.scale:g} true"

    @classmethod
    def candidates_at(cls, column: str, typical: TypicalMagnitudes) -> tuple[Law, ...]:
        """A factor."""
        unknown = Unknown(name="scale", unit="-", low=0.05, high=20.0, scale=0.01, log=True)
        return (
            cls.variant(
                column, law="factor", unknowns=(unknown,), starts=((1.02,),),
                write=writes_reading(column, lambda v, signal, w: signal * v["scale"]),
            ),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """How far off."""
        off = f.figures["scale"] - 1.0
        side = "small" if off < 0.0 else "large"
        return f"a {f.reading} that reads {f.percent(abs(off))} too {side}"

    @staticmethod
    def curve_at(column: str):
        """The error over the true value."""
        return draw_error(column, lambda d, v, x: (v.get("scale", 1.0) - 1.0) * x)
