"""A sensor whose offset drifts."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import NO_CONTEXT, Context, parameter
from rsea_core.effects.sensor_base import SensorTerm


@dataclass(frozen=True, kw_only=True)
class SensorDrift(SensorTerm):
    """A reading that moves away from the truth at a constant rate, from the first row on."""

    effect: ClassVar[str] = "sensor-drift"
    law: ClassVar[str] = "linear"

    rate_per_s: float = parameter(
        unit="of its column per s",
        bounds=(-10.0, 10.0),
        source="warming of the electronics; a fit",
        meaning="How fast the reading moves away from the truth.",
    )

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """The rate."""
        return {"rate_per_s": self.rate_per_s}

    def equation(self) -> str:
        """The law in one line."""
        return f"{self.column} read = true + {self.rate_per_s:g} t"
