"""The values that a dimension of a sizing may take."""

import math
from dataclasses import dataclass

from dftfs.errors import DesignError

EXAMPLE = "for example turns = [1.0, 3.0, 0.02], or --set turns=1:3:0.02"
_MOST_STEPS = 100_000


@dataclass(frozen=True, kw_only=True)
class Grid:
    """Values that a dimension may take: from ``low`` in steps of ``increment`` up to ``high``."""

    name: str
    low: float
    high: float
    increment: float

    def __post_init__(self) -> None:
        numbers = (self.low, self.high, self.increment)
        if not (all(map(math.isfinite, numbers)) and self.high >= self.low > 0):
            raise DesignError(
                f"{self.name}: 0 < minimum <= maximum, not {self.low}, {self.high}; {EXAMPLE}"
            )
        if not self.increment > 0 or self.high - self.low > _MOST_STEPS * self.increment:
            raise DesignError(
                f"{self.name}: increment {self.increment:g} must be positive, and not a hundred"
                f" thousandth of the range {self.low:g} to {self.high:g}"
            )

    @property
    def steps(self) -> int:
        """Number of the last value, the first being 0."""
        return math.floor((self.high - self.low) / self.increment + 1e-9)

    def value(self, index: int) -> float:
        """Value by its number, without the round-off of many steps."""
        return round(self.low + index * self.increment, 9)

    def nearest(self, value: float) -> int:
        """Number of the nearest value inside the bounds."""
        return min(max(round((value - self.low) / self.increment), 0), self.steps)

    def holds(self, value: float) -> bool:
        """Whether a value is one of the grid's (errata S19 asks)."""
        off = abs(value - self.value(self.nearest(value)))
        return off <= 1e-6 * self.increment
