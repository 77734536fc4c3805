"""A rational transfer function as plain arrays: enough for a formula, a plot or another library.

Coefficients stand from the highest power of s down, as numpy and python-control have them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rsea_core.errors import InputError
from rsea_core.numeric.arrays import read_only


@dataclass(frozen=True, kw_only=True, eq=False)
class TransferFunction:
    """numerator(s) / denominator(s), from `input_unit` to `output_unit`.

    Leading zeros and common factors of s are taken out, so that a gain at rest is seen where
    there is one.

    Attributes
    ----------
    numerator, denominator : (n,), (m,) arrays
        From the highest power of s down.
    input_unit, output_unit : str

    Raises
    ------
    InputError
        If a coefficient is not finite or the denominator is zero.
    """

    numerator: ArrayLike
    denominator: ArrayLike
    input_unit: str
    output_unit: str

    def __post_init__(self):
        above = np.atleast_1d(np.array(self.numerator, dtype=float))
        below = np.atleast_1d(np.array(self.denominator, dtype=float))
        if not (np.all(np.isfinite(above)) and np.all(np.isfinite(below))):
            raise InputError("a transfer function needs finite coefficients")
        if not np.any(below):
            raise InputError("a transfer function needs a denominator that is not zero")
        above, below = np.trim_zeros(above, "f"), np.trim_zeros(below, "f")
        if above.size == 0:
            above, below = np.zeros(1), np.ones(1)
        while above.size > 1 and below.size > 1 and above[-1] == below[-1] == 0.0:
            above, below = above[:-1], below[:-1]
        object.__setattr__(self, "numerator", read_only(above))
        object.__setattr__(self, "denominator", read_only(below))

    def response(self, frequency_Hz: ArrayLike) -> NDArray:
        """Complex gain at given frequencies, in output units per input unit."""
        s = 2j * np.pi * np.asarray(frequency_Hz, dtype=float)
        return np.polyval(self.numerator, s) / np.polyval(self.denominator, s)

    def dc_gain(self) -> float:
        """Gain at rest; inf where it has an integrator."""
        if self.denominator[-1] == 0.0:
            return float(np.inf) if self.numerator[-1] != 0.0 else 0.0
        return float(self.numerator[-1] / self.denominator[-1])

    def poles(self) -> NDArray:
        """Roots of the denominator [rad/s]."""
        return np.roots(self.denominator)

    def zeros(self) -> NDArray:
        """Roots of the numerator [rad/s]."""
        return np.roots(self.numerator)
