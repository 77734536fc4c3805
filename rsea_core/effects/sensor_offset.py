"""A sensor with an offset."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import NO_CONTEXT, Context, parameter
from rsea_core.effects.sensor_base import SensorTerm


@dataclass(frozen=True, kw_only=True)
class SensorOffset(SensorTerm):
    """A reading that is off by a constant."""

    effect: ClassVar[str] = "sensor-offset"
    law: ClassVar[str] = "constant"

    offset: float = parameter(
        unit="of its column",
        bounds=(-1e3, 1e3),
        source="mounting, zero drift; a fit",
        meaning="What the reading shows more than the truth.",
    )

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """The offset."""
        return {"offset": self.offset}

    def equation(self) -> str:
        """The law in one line."""
        return f"{self.column} read = true + {self.offset:g}"
