"""A sensor with noise."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import NO_CONTEXT, Context, parameter
from rsea_core.effects.sensor_base import SensorTerm
from rsea_core.errors import TermError


@dataclass(frozen=True, kw_only=True)
class SensorNoise(SensorTerm):
    """White Gaussian noise on every sample of a reading; one seed is one noise, always."""

    effect: ClassVar[str] = "sensor-noise"
    law: ClassVar[str] = "white"

    standard_deviation: float = parameter(
        unit="of its column",
        bounds=(0.0, 100.0),
        source="data sheet; a still machine's readings",
        meaning="Standard deviation of the noise on a sample.",
    )
    seed: float = parameter(
        0.0,
        unit="-",
        bounds=(0.0, 2.0**32),
        source="a whole number, chosen",
        meaning="Names the noise: the same seed gives the same one.",
        free=False,
    )

    def __post_init__(self):
        super().__post_init__()
        if self.seed != math.floor(self.seed):
            raise TermError(f"{self.effect}: seed = {self.seed} must be a whole number")

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """The standard deviation."""
        return {"standard_deviation": self.standard_deviation}

    def equation(self) -> str:
        return f"{self.column} read = true + white noise, std {self.standard_deviation:g}"
