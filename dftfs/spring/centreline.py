"""Centreline of one arm: a plane spiral with analytic tangent, normal and curvature.

The thesis calls ``r = c sqrt(theta)`` a Fibonacci spiral; it is Fermat's, and the golden ratio
is only a scale (errata S4). The scale follows from the two radii and the number of turns.
Every other centreline enters the product by offering the members of `FermatSpiral`.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dftfs.errors import DesignError

_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(12)
_PANELS_PER_TURN = 24  # 12-point Gauss on these panels integrates the length to round-off


@dataclass(frozen=True, kw_only=True)
class FermatSpiral:
    """Fermat spiral ``r^2 = c^2 theta`` from one radius to another in a number of turns.

    Parameters
    ----------
    inner_radius_m, outer_radius_m : float
        Centreline radius where the arm leaves the hub and where it ends at the rim.
    turns : float
        Polar angle swept between the two, over 2 pi.
    rotation_rad : float
        Polar angle at which the curve passes ``inner_radius_m``.

    Raises
    ------
    DesignError
        If the radii are not positive and increasing, or the turns are not positive.

    Source
    ------
    Thesis section 2.1.3; scale corrected as ``c^2 = (R_o^2 - R_i^2) / (2 pi n)``.
    """

    inner_radius_m: float
    outer_radius_m: float
    turns: float
    rotation_rad: float = 0.0

    def __post_init__(self) -> None:
        if not 0 < self.inner_radius_m < self.outer_radius_m:
            raise DesignError(
                f"inner_radius_mm = {self.inner_radius_m * 1e3:.6g} must be positive and below"
                f" outer_radius_mm = {self.outer_radius_m * 1e3:.6g}"
            )
        if self.turns <= 0:
            raise DesignError(f"turns = {self.turns:.6g} must be positive")

    @cached_property
    def scale_m(self) -> float:
        """The factor c of ``r = c sqrt(theta)``, in m/sqrt(rad)."""
        area = self.outer_radius_m**2 - self.inner_radius_m**2
        return float(np.sqrt(area / (2 * np.pi * self.turns)))

    @property
    def start(self) -> float:
        """Parameter theta at the inner radius, in rad."""
        return (self.inner_radius_m / self.scale_m) ** 2

    @property
    def end(self) -> float:
        """Parameter theta at the outer radius, in rad."""
        return (self.outer_radius_m / self.scale_m) ** 2

    def radius(self, theta: ArrayLike) -> NDArray:
        """Distance of the centreline from the axis, in m, shape of ``theta``."""
        return self.scale_m * np.sqrt(np.asarray(theta, dtype=float))

    def parameter_at_radius(self, radius_m: float) -> float:
        """Parameter theta at which the centreline has this radius."""
        return (radius_m / self.scale_m) ** 2

    def _frame(self, theta: ArrayLike) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        theta = np.asarray(theta, dtype=float)
        polar = theta - self.start + self.rotation_rad
        radial = np.stack([np.cos(polar), np.sin(polar)], axis=-1)
        around = np.stack([-np.sin(polar), np.cos(polar)], axis=-1)
        radius = self.radius(theta)
        return radius, self.scale_m**2 / (2 * radius), radial, around

    def point(self, theta: ArrayLike) -> NDArray:
        """Points of the centreline, shape (..., 2), in m."""
        radius, _, radial, _ = self._frame(theta)
        return radius[..., None] * radial

    def speed(self, theta: ArrayLike) -> NDArray:
        """Arc length per unit of theta, in m/rad."""
        radius, slope, _, _ = self._frame(theta)
        return np.hypot(radius, slope)

    def tangent(self, theta: ArrayLike) -> NDArray:
        """Unit tangents towards the rim, shape (..., 2)."""
        radius, slope, radial, around = self._frame(theta)
        vector = slope[..., None] * radial + radius[..., None] * around
        return vector / np.hypot(radius, slope)[..., None]

    def normal(self, theta: ArrayLike) -> NDArray:
        """Unit normals pointing away from the axis, shape (..., 2)."""
        tangent = self.tangent(theta)
        return np.stack([tangent[..., 1], -tangent[..., 0]], axis=-1)

    def curvature(self, theta: ArrayLike) -> NDArray:
        """Curvature in 1/m, positive where the curve bends towards the axis.

        With ``r' = c^2/(2r)`` and ``r'' = -c^4/(4r^3)`` the polar formula
        ``(r^2 + 2 r'^2 - r r'') / (r^2 + r'^2)^1.5`` becomes the expression below.
        """
        radius, slope, _, _ = self._frame(theta)
        return (radius**2 + 3 * slope**2) / (radius**2 + slope**2) ** 1.5

    def length(self, theta_from: float, theta_to: float) -> float:
        """Arc length between two parameters, in m (signed, exact to round-off)."""
        panels = max(1, int(np.ceil(_PANELS_PER_TURN * abs(theta_to - theta_from) / (2 * np.pi))))
        bounds = np.linspace(theta_from, theta_to, panels + 1)
        half = np.diff(bounds) / 2
        nodes = bounds[:-1, None] + half[:, None] * (1 + _GAUSS_NODES)
        return float(np.sum(half * (self.speed(nodes) @ _GAUSS_WEIGHTS)))

    def parameter_at_length(self, theta_from: float, lengths_m: ArrayLike) -> NDArray:
        """Parameters at given arc lengths beyond ``theta_from`` (Newton on the exact length)."""
        lengths = np.atleast_1d(np.asarray(lengths_m, dtype=float))
        grid = np.linspace(theta_from, self.end + 1.0, 400)
        along = np.concatenate([[0.0], np.cumsum(np.diff(grid) * self.speed(grid[:-1]))])
        theta = np.interp(lengths, along, grid)
        for _ in range(20):
            error = np.array([self.length(theta_from, t) for t in theta]) - lengths
            theta = theta - error / self.speed(theta)
            if np.max(np.abs(error)) <= 1e-13 * self.outer_radius_m:
                break
        return theta

    def rotated(self, angle_rad: float) -> "FermatSpiral":
        """The same curve turned about the axis."""
        return FermatSpiral(
            inner_radius_m=self.inner_radius_m,
            outer_radius_m=self.outer_radius_m,
            turns=self.turns,
            rotation_rad=self.rotation_rad + angle_rad,
        )
