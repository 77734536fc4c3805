"""A sensor that reads late."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import NO_CONTEXT, Context, parameter
from rsea_core.effects.sensor_base import SensorTerm


@dataclass(frozen=True, kw_only=True)
class SensorDelay(SensorTerm):
    """A reading of an earlier time; before the delay has passed it shows the start."""

    effect: ClassVar[str] = "sensor-delay"
    law: ClassVar[str] = "delay"

    delay_s: float = parameter(
        unit="s",
        bounds=(0.0, 1.0),
        source="bus and filter; a fit",
        meaning="How long ago the truth was what the reading shows.",
    )

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """The delay."""
        return {"delay_s": self.delay_s}

    def equation(self) -> str:
        """The law in one line."""
        return f"{self.column} read(t) = true(t - {self.delay_s:g} s)"
