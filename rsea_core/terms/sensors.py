"""What a reading shows instead of the truth: the sensor's faults, not the machine's.

    reading(t) = scale true(t - delay) + table(t - delay) + offset + rate t + noise(t)

The terms of one column act together. They change what a controller reads and the readings of
a simulation (`sensing.readings`), never the motion itself in an open loop.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

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
OVER = ("value", "turn", "speed")
MOST_NODES = 400
LARGEST = 1e3  # error of a table, of its column


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


@dataclass(frozen=True, kw_only=True)
class SensorTable(SensorTerm):
    """A reading that errs by a table, straight between its nodes: what no formula has.

    Over its own value (an amplifier that clips or fades), over its place in the turn (an eccentric
    disc), or over its speed: then an entry is the share of the motion that is counted too much,
    below zero counts that are lost, and the error is what all rows so far have gathered.

    Attributes
    ----------
    over : str
        "value", "turn" or "speed".
    errors : (n,) array
        What the reading shows more than the truth, at n even nodes from `first` to `last`; over
        the turn at n even places from zero on. Outside its nodes an error over the value goes on
        straight, but an angle's stays as it is there, as every share over the speed does.

    Raises
    ------
    TermError
        If the column has no angle to turn or count, there are less than 2 or more than 400 nodes,
        or the nodes do not rise.
    """

    effect: ClassVar[str] = "sensor-table"
    law: ClassVar[str] = "straight"

    over: str
    first: float = parameter(
        0.0,
        unit="of its column, or per s",
        bounds=(-1e6, 1e6),
        source="the lowest that was recorded",
        meaning="Value or speed of the first node; a turn has its own.",
        free=False,
    )
    last: float = parameter(
        2.0 * math.pi,
        unit="of its column, or per s",
        bounds=(-1e6, 1e6),
        source="the highest that was recorded",
        meaning="Value or speed of the last node; a turn has its own.",
        free=False,
    )
    errors: ArrayLike

    def __post_init__(self):
        super().__post_init__()
        if self.over not in OVER:
            raise TermError(f"{self.effect}: over = {self.over!r} is not one of {', '.join(OVER)}")
        if self.over != "value" and not self.is_angle:
            raise TermError(f"{self.effect}: {self.column} is no angle to have a {self.over}")
        try:
            errors = np.array(self.errors, dtype=float)
        except (TypeError, ValueError):
            raise TermError(f"{self.effect}: errors must be numbers") from None
        if errors.ndim != 1 or not 2 <= errors.size <= MOST_NODES:
            raise TermError(f"{self.effect}: errors must be 2 to {MOST_NODES} numbers in a row")
        if not np.all(np.abs(errors) <= LARGEST):
            raise TermError(f"{self.effect}: errors must be within {LARGEST:g}")
        if not self.last > self.first:
            raise TermError(f"{self.effect}: last = {self.last} must be above first = {self.first}")
        errors.flags.writeable = False
        object.__setattr__(self, "errors", errors)

    @property
    def is_angle(self) -> bool:
        """Whether its column is an encoder's: it turns, counts, and saturates nowhere."""
        return self.column.endswith("angle_rad")

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """The largest entry."""
        return {"peak": float(np.abs(self.errors).max())}

    def equation(self) -> str:
        """The law in one line."""
        size = f"{np.size(self.errors)} nodes, at most {np.abs(self.errors).max():g}"
        span = f"from {self.first:g} to {self.last:g}"
        if self.over == "speed":
            return f"{self.column} read = true + sum of e(|speed|) times motion, {size} {span}"
        at = "true mod 2 pi" if self.over == "turn" else "true"
        return f"{self.column} read = true + e({at}), {size}" + (
            "" if self.over == "turn" else f" {span}"
        )
