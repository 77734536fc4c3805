"""A sensor with an offset."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import parameter
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.sensor_base import SensorTerm, draw_error, span_of, writes_reading
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, Unknown


@dataclass(frozen=True, kw_only=True)
class SensorOffset(SensorTerm):
    """A reading that is off by a constant."""

    effect: ClassVar[str] = "sensor-offset"
    law: ClassVar[str] = "constant"
    headline: ClassVar[str] = "The sensor has an offset."
    figure_units: ClassVar[Mapping[str, str]] = {"offset": ""}

    offset: float = parameter(
        unit="of its column",
        bounds=(-1e3, 1e3),
        source="mounting, zero drift; a fit",
        meaning="What the reading shows more than the truth.",
    )

    def equation(self) -> str:
        return f"{self.column} read = true + {self.offset:g}"

    @classmethod
    def candidates_at(cls, column: str, typical: TypicalMagnitudes) -> tuple[Law, ...]:
        """An offset; a motor encoder's is where the angles count from."""
        if column == "motor_angle_rad":
            return ()
        spread, _ = span_of(typical, column)
        unknown = Unknown(name="offset", unit=column.rsplit("_", 1)[-1], low=-20 * spread,
                          high=20 * spread, scale=0.005 * spread)  # fmt: skip
        return (
            cls.variant(
                column, law="constant", unknowns=(unknown,), starts=((0.005 * spread,),),
                write=writes_reading(column, lambda v, signal, w: signal + v["offset"]),
            ),
        )  # fmt: skip

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """How far off."""
        off = f.figures["offset"]
        side = "small" if off < 0.0 else "large"
        return f"a {f.reading} that reads {f.of(abs(off), f.unit)} too {side}"

    @staticmethod
    def curve_at(column: str):
        """The offset over the true value."""
        return draw_error(column, lambda d, v, x: v.get("offset", 0.0) + 0.0 * x)
