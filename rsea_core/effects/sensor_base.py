"""What a reading shows instead of the truth: the sensor's faults, not the machine's.

    reading(t) = scale true(t - delay) + table(t - delay) + offset + rate t + noise(t)

The terms of one column act together. They change what a controller reads and the readings of
a simulation (`sensing.readings`), never the motion itself in an open loop.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import Port, Term
from rsea_core.effects.curve import EffectCurve
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, RunConditions, TrialMachine, Write
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


# whose faults a diagnosis looks for
FITTED = ("motor_angle_rad", "load_angle_rad", "current_A", "torque_Nm", "spring_deflection_rad")
LARGEST = 1e3  # error of a table, of its column


def writes_reading(column: str, change) -> Write:
    """What changes a reading: function of (values, signal (n,), where), the reading (n,)."""

    def write(v: Mapping[str, float], d: TrialMachine, w: RunConditions) -> None:
        d.reads.append((column, lambda signal: change(v, signal, w)))
        if "offset" in v and column == "load_angle_rad":
            d.start_load_rad -= v["offset"]
        if "scale" in v and column == "load_angle_rad":
            d.start_load_scale /= v["scale"]
        if "scale" in v and column == "motor_angle_rad":
            d.start_motor_scale /= v["scale"]

    return write


def span_of(typical: TypicalMagnitudes, column: str) -> tuple[float, float]:
    """Spread of a reading and duration of the longest recording [s]."""
    spread, longest = typical.spans.get(column, (1.0, 1.0))
    return max(spread, 1e-9), longest


def draw_error(column: str, evaluate, *, over_time: bool = False) -> EffectCurve:
    """A reading's error over what is true, or over time."""
    unit = column.rsplit("_", 1)[-1]
    return EffectCurve(
        title=f"Error of the reading {column}",
        x_label="time (s)" if over_time else f"true value ({unit})", y_label=f"error ({unit})",
        over="time" if over_time else column, evaluate=evaluate,
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class SensorTerm(Term):
    """Base of the sensors' terms: the column of a recording that one acts on."""

    port: ClassVar[Port] = Port.SENSOR

    column: str

    @classmethod
    def variant(cls, column: str, **more) -> Law:
        """A variant of this fault at one column."""
        return Law(effect=cls.effect, subsystem=f"sensor:{column}", sensor=column, kind=cls, **more)

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> list[Law]:
        """The variants of every column that was recorded."""
        return [
            law
            for column in FITTED
            if column in typical.columns
            for law in cls.candidates_at(column, typical)
        ]

    @classmethod
    def candidates_at(cls, column: str, typical: TypicalMagnitudes) -> tuple[Law, ...]:
        """The variants of one column."""
        return ()

    def __post_init__(self):
        if self.column not in COLUMNS:
            raise TermError(
                f"{self.effect}: column {self.column!r} is not one of {', '.join(COLUMNS)}"
            )
        super().__post_init__()

    @property
    def subsystem(self) -> str:
        """sensor:<column>"""
        return f"sensor:{self.column}"

    @property
    def key(self) -> str:
        """Effect and column: several sensors may have the same fault."""
        return f"{self.effect}:{self.column}"
