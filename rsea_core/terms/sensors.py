"""What a reading shows instead of the truth: the sensor's faults, not the machine's.

    reading(t) = scale true(t - delay) + offset + rate t + noise(t)

The terms of one column act together. They change what a controller reads and the readings of
a simulation (`sensing.readings`), never the motion itself in an open loop.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.errors import TermError
from rsea_core.terms.base import (
    NO_CONTEXT,
    Context,
    Port,
    Term,
    parameter,
    require_bounds,
)

COLUMNS = (
    "motor_angle_rad",
    "load_angle_rad",
    "spring_deflection_rad",
    "motor_velocity_rad_per_s",
    "load_velocity_rad_per_s",
    "current_A",
    "torque_Nm",
    "temperature_C",
)


@dataclass(frozen=True, kw_only=True)
class SensorTerm(Term):
    """Base of the sensors' terms: the column of a recording that one acts on."""

    port: ClassVar[Port] = Port.SENSOR

    column: str

    def __post_init__(self):
        if self.column not in COLUMNS:
            raise TermError(
                f"{self.effect}: column {self.column!r} is not one of {', '.join(COLUMNS)}"
            )
        require_bounds(self)

    @property
    def subsystem(self) -> str:
        """sensor:<column>"""
        return f"sensor:{self.column}"

    @property
    def key(self) -> str:
        """Effect and column: several sensors may have the same fault."""
        return f"{self.effect}:{self.column}"


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
        """The law in one line."""
        return f"{self.column} read = true + white noise, std {self.standard_deviation:g}"
