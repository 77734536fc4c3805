"""A sensor with a scale error."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import NO_CONTEXT, Context, parameter
from rsea_core.effects.sensor_base import SensorTerm


@dataclass(frozen=True, kw_only=True)
class SensorScale(SensorTerm):
    """A reading in proportion to the truth, with another factor than 1."""

    effect: ClassVar[str] = "sensor-scale"
    law: ClassVar[str] = "factor"

    scale: float = parameter(
        unit="-",
        bounds=(0.1, 10.0),
        source="calibration; a fit",
        meaning="Reading over truth.",
    )

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """The factor."""
        return {"scale": self.scale}

    def equation(self) -> str:
        """The law in one line."""
        return f"{self.column} read = {self.scale:g} true"
