"""A sensor whose error is a table over its value, turn or speed."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from rsea_core.effects.base import NO_CONTEXT, Context, parameter
from rsea_core.effects.sensor_base import LARGEST, SensorTerm
from rsea_core.errors import TermError

OVER = ("value", "turn", "speed")


MOST_NODES = 400


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
        size = f"{np.size(self.errors)} nodes, at most {np.abs(self.errors).max():g}"
        span = f"from {self.first:g} to {self.last:g}"
        if self.over == "speed":
            return f"{self.column} read = true + sum of e(|speed|) times motion, {size} {span}"
        at = "true mod 2 pi" if self.over == "turn" else "true"
        return f"{self.column} read = true + e({at}), {size}" + (
            "" if self.over == "turn" else f" {span}"
        )
