"""A quantity that varies smoothly along a centreline and is constant towards both ends.

A uniform cubic B-spline whose first and last three coefficients are equal: slope and curvature
vanish at both ends, and the curve stays between its smallest and its largest coefficient (C. de
Boor, A Practical Guide to Splines, 1978: partition of unity). The thickness and an offset of the
radius are such quantities.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dftfs.errors import DesignError

if TYPE_CHECKING:  # a third of a second, which no built-in design needs
    from scipy.interpolate import BSpline

MOST_VALUES = 24


@dataclass(frozen=True, kw_only=True)
class SplineProfile:
    """Values from ``start`` to ``end`` of a parameter: ``first``, the ``inner`` ones, ``last``."""

    first: float
    inner: tuple[float, ...]
    last: float
    start: float
    end: float

    @cached_property
    def _splines(self) -> "tuple[BSpline, BSpline, BSpline]":
        from scipy.interpolate import BSpline

        values = np.array([*[self.first] * 3, *self.inner, *[self.last] * 3])
        spans = len(values) - 3
        spline = BSpline(np.arange(-3, spans + 4) / spans, values, 3)
        return spline, spline.derivative(), spline.derivative(2)

    @property
    def breaks(self) -> tuple[float, ...]:
        """Parameters at which the third derivative jumps: the knots."""
        return tuple(np.linspace(self.start, self.end, len(self.inner) + 4).tolist())

    def _along(self, theta: ArrayLike, order: int) -> NDArray:
        span = self.end - self.start
        u = np.clip((np.asarray(theta, dtype=float) - self.start) / span, 0.0, 1.0)
        return self._splines[order](u) / span**order

    def value(self, theta: ArrayLike) -> NDArray:
        """Values at parameters, of their shape."""
        return self._along(theta, 0)

    def slope(self, theta: ArrayLike) -> NDArray:
        """First derivative in the parameter."""
        return self._along(theta, 1)

    def second(self, theta: ArrayLike) -> NDArray:
        """Second derivative in the parameter."""
        return self._along(theta, 2)

    def thickness_m(self, theta: ArrayLike) -> NDArray:
        """The values, where they are a thickness (as `dftfs.spring.edges.Taper`)."""
        return self.value(theta)


def checked_values(
    values: tuple[float, ...], name: str, low: float, high: float
) -> tuple[float, ...]:
    """The values of a profile as floats.

    Raises
    ------
    DesignError
        If there are too many, or one is not a number between the limits.
    """
    if len(values) > MOST_VALUES:
        raise DesignError(f"{name} has {len(values)} values; at most {MOST_VALUES} are taken")
    for number, value in enumerate(values, 1):
        if not low <= value <= high:
            raise DesignError(f"{name}: value {number} = {value:g} must be {low:g} to {high:g}")
    return tuple(float(value) for value in values)
