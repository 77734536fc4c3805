"""What a reading shows instead of the truth: the sensor's faults, not the machine's.

    reading(t) = scale true(t - delay) + table(t - delay) + offset + rate t + noise(t)

The terms of one column act together. They change what a controller reads and the readings of
a simulation (`sensing.readings`), never the motion itself in an open loop.
"""

from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import Port, Term, require_bounds
from rsea_core.errors import TermError

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
