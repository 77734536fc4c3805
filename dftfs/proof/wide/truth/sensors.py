"""What the sensors and the logger make of an exact motion."""

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from dftfs.proof.wide.truth.body import Body
from dftfs.proof.wide.truth.simulate import at_rows


@dataclass(frozen=True, kw_only=True)
class Sensor:
    """One column's sensor; the faults' defaults are a healthy one.

    ``count``: width of a count, 0 for an analogue sensor; ``noise``: standard deviation;
    ``colour``: correlation from row to row; ``clock``: share by which its clock is fast;
    ``filter_s``: time constant of the drive's own filter of a speed.
    """

    count: float = 0.0
    noise: float = 0.0
    colour: float = 0.0
    clock: float = 0.0
    filter_s: float = 0.0
    offset: float = 0.0
    scale: float = 1.0
    delay_s: float = 0.0
    rate_per_s: float = 0.0
    ripple: float = 0.0
    ripple_cycles: float = 0.0

    @property
    def floor(self) -> float:
        """Standard deviation of a healthy reading."""
        return float(np.hypot(self.noise, self.count / np.sqrt(12.0)))

    def exact(
        self, made: np.ndarray, step: float, rows_s: np.ndarray, body: Body, column: str
    ) -> np.ndarray:
        """The reading before noise and counts, at the rows. (rows,)"""
        times = rows_s * (1.0 + self.clock) - self.delay_s
        if self.filter_s > 0.0:
            side = 1 if column.startswith("motor") else 3
            ratio = body.gear_ratio if side == 1 else 1.0
            keep = np.exp(-step / self.filter_s)
            values = lfilter([1.0 - keep], [1.0, -keep], ratio * made[:, side])
            values = np.interp(times, step * np.arange(made.shape[0]), values)
        else:
            values = at_rows(made, step, times, body.gear_ratio)[column]
        values = values + self.ripple * np.sin(self.ripple_cycles * values)
        return self.scale * values + self.offset + self.rate_per_s * rows_s

    def logged(self, exact: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """The reading with noise, coloured, and counts. (rows,)"""
        noise = rng.normal(size=exact.size)
        if self.colour > 0.0:
            keep = np.sqrt(1.0 - self.colour**2)
            noise = lfilter([keep], [1.0, -self.colour], noise)
        values = exact + self.noise * noise
        if self.count > 0.0:
            values = self.count * np.floor(values / self.count + 0.5)
        return values
