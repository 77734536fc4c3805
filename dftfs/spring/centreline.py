"""Centrelines of one arm: plane spirals with analytic tangent, normal and curvature.

The thesis calls ``r = c sqrt(theta)`` a Fibonacci spiral; it is Fermat's, and the golden ratio
is only a scale (errata S4). The scale follows from the two radii and the number of turns.
Archimedes' spiral (constant pitch) and the logarithmic one (constant angle, the golden spiral
among them) stand beside it. A spiral gives its radius and two derivatives of it over the polar
angle; the frame, the arc length and all that reads them (outline, CAD, mesh, rod) is common.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dftfs.errors import DesignError
from dftfs.spring.spline_profile import SplineProfile

_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(12)
_PANELS_PER_TURN = 24  # 12-point Gauss on these panels integrates the length to round-off
_GOLDEN_PER_TURN = 4 * np.log((1 + np.sqrt(5)) / 2)  # log radius: the golden ratio a quarter turn
_GOLDEN_TOLERANCE = 2e-3  # of the turns: what a person types
_INWARDS_FOLDS = 3.0  # e-folds of radius that a logarithmic spiral is continued inside its start


@dataclass(frozen=True, kw_only=True)
class Spiral(ABC):
    """A spiral from one radius to another in a number of turns.

    Its parameter is the polar angle less a constant; it is positive at the inner radius, and the
    curve continues inwards from there towards 0.

    Parameters
    ----------
    inner_radius_m, outer_radius_m : float
        Centreline radius where the arm leaves the hub and where it ends at the rim.
    turns : float
        Polar angle swept between the two, over 2 pi.
    rotation_rad : float
        Polar angle at which the curve passes ``inner_radius_m``.
    offset_m : tuple of float
        Added to the radius at equal steps between both ends, where it is zero
        (`dftfs.spring.spline_profile`); empty for the plain spiral.

    Raises
    ------
    DesignError
        If the radii are not positive and increasing, or the turns are not positive.
    """

    inner_radius_m: float
    outer_radius_m: float
    turns: float
    rotation_rad: float = 0.0
    offset_m: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not 0 < self.inner_radius_m < self.outer_radius_m:
            raise DesignError(
                f"inner_radius_mm = {self.inner_radius_m * 1e3:.6g} must be positive and below"
                f" outer_radius_mm = {self.outer_radius_m * 1e3:.6g}"
            )
        if self.turns <= 0:
            raise DesignError(f"turns = {self.turns:.6g} must be positive")

    @property
    @abstractmethod
    def start(self) -> float:
        """Parameter theta at the inner radius, in rad."""

    @property
    def end(self) -> float:
        """Parameter theta at the outer radius, in rad."""
        return self.parameter_at_radius(self.outer_radius_m)

    @abstractmethod
    def parameter_at_radius(self, radius_m: float) -> float:
        """Parameter theta at which the centreline has this radius."""

    @abstractmethod
    def _profile(self, theta: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """Radius and its first and second derivative over theta, in m, m/rad, m/rad^2."""

    @cached_property
    def _offset(self) -> SplineProfile:
        ends = {"start": self.start, "end": self.end}
        return SplineProfile(first=0.0, inner=self.offset_m, last=0.0, **ends)

    @property
    def breaks(self) -> tuple[float, ...]:
        """Parameters at which the offset's third derivative jumps; none of a plain spiral."""
        return self._offset.breaks if self.offset_m else ()

    def _polar(self, theta: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """As `_profile`, the offset included."""
        plain = self._profile(theta)
        if not self.offset_m:
            return plain
        added = self._offset.value(theta), self._offset.slope(theta), self._offset.second(theta)
        return plain[0] + added[0], plain[1] + added[1], plain[2] + added[2]

    def radius(self, theta: ArrayLike) -> NDArray:
        """Distance of the centreline from the axis, in m, shape of ``theta``."""
        return self._polar(np.asarray(theta, dtype=float))[0]

    def _frame(self, theta: ArrayLike) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        theta = np.asarray(theta, dtype=float)
        polar = theta - self.start + self.rotation_rad
        cosine, sine = np.cos(polar), np.sin(polar)
        radial, around = _pairs(cosine, sine), _pairs(-sine, cosine)
        radius, slope, _ = self._polar(theta)
        return radius, slope, radial, around

    def point(self, theta: ArrayLike) -> NDArray:
        """Points of the centreline, shape (..., 2), in m."""
        radius, _, radial, _ = self._frame(theta)
        return radius[..., None] * radial

    def speed(self, theta: ArrayLike) -> NDArray:
        """Arc length per unit of theta, in m/rad."""
        radius, slope, _ = self._polar(np.asarray(theta, dtype=float))
        return np.hypot(radius, slope)

    def tangent(self, theta: ArrayLike) -> NDArray:
        """Unit tangents towards the rim, shape (..., 2)."""
        radius, slope, radial, around = self._frame(theta)
        vector = slope[..., None] * radial + radius[..., None] * around
        return vector / np.hypot(radius, slope)[..., None]

    def normal(self, theta: ArrayLike) -> NDArray:
        """Unit normals pointing away from the axis, shape (..., 2)."""
        tangent = self.tangent(theta)
        return _pairs(tangent[..., 1], -tangent[..., 0])

    def offset_point(self, theta: ArrayLike, offset_m: float) -> NDArray:
        """Points at a signed distance along the normal, shape (..., 2), in m."""
        radius, slope, radial, around = self._frame(theta)
        tangent = slope[..., None] * radial + radius[..., None] * around
        tangent = tangent / np.hypot(radius, slope)[..., None]
        return radius[..., None] * radial + offset_m * _pairs(tangent[..., 1], -tangent[..., 0])

    def curvature(self, theta: ArrayLike) -> NDArray:
        """Curvature in 1/m, positive where the curve bends towards the axis (polar formula)."""
        radius, slope, second = self._polar(np.asarray(theta, dtype=float))
        return (radius**2 + 2 * slope**2 - radius * second) / (radius**2 + slope**2) ** 1.5

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

    def rotated(self, angle_rad: float) -> Self:
        """The same curve turned about the axis."""
        return replace(self, rotation_rad=self.rotation_rad + angle_rad)


def _pairs(x: NDArray, y: NDArray) -> NDArray:
    """Two arrays as the last axis of one: np.stack, at a fifth of its time for single numbers."""
    both = np.empty((*np.shape(x), 2))
    both[..., 0], both[..., 1] = x, y
    return both


@dataclass(frozen=True, kw_only=True)
class FermatSpiral(Spiral):
    """``r^2 = c^2 theta``: equal areas between coils, so the gap narrows outwards.

    Source
    ------
    Thesis section 2.1.3; scale corrected as ``c^2 = (R_o^2 - R_i^2) / (2 pi n)``.
    """

    @cached_property
    def scale_m(self) -> float:
        """The factor c of ``r = c sqrt(theta)``, in m/sqrt(rad)."""
        area = self.outer_radius_m**2 - self.inner_radius_m**2
        return float(np.sqrt(area / (2 * np.pi * self.turns)))

    @property
    def start(self) -> float:
        """Parameter theta at the inner radius, in rad."""
        return (self.inner_radius_m / self.scale_m) ** 2

    def parameter_at_radius(self, radius_m: float) -> float:
        """Parameter theta at which the centreline has this radius."""
        return (radius_m / self.scale_m) ** 2

    def _profile(self, theta: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        radius = self.scale_m * np.sqrt(theta)
        slope = self.scale_m**2 / (2 * radius)
        return radius, slope, -(slope**2) / radius


@dataclass(frozen=True, kw_only=True)
class ArchimedeanSpiral(Spiral):
    """``r = b theta``: a constant pitch, so all gaps between coils are (nearly) the same."""

    @cached_property
    def pitch_m(self) -> float:
        """The factor b, in m/rad."""
        return (self.outer_radius_m - self.inner_radius_m) / (2 * np.pi * self.turns)

    @property
    def start(self) -> float:
        """Parameter theta at the inner radius, in rad."""
        return self.inner_radius_m / self.pitch_m

    def parameter_at_radius(self, radius_m: float) -> float:
        """Parameter theta at which the centreline has this radius."""
        return radius_m / self.pitch_m

    def _profile(self, theta: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        return self.pitch_m * theta, np.full_like(theta, self.pitch_m), np.zeros_like(theta)


@dataclass(frozen=True, kw_only=True)
class LogarithmicSpiral(Spiral):
    """``r = a exp(k theta)``: a constant angle to the radius, so gaps widen outwards."""

    @cached_property
    def growth_per_rad(self) -> float:
        """The k of the exponent."""
        return float(np.log(self.outer_radius_m / self.inner_radius_m) / (2 * np.pi * self.turns))

    @property
    def start(self) -> float:
        """Parameter theta at the inner radius, in rad."""
        return _INWARDS_FOLDS / self.growth_per_rad

    def parameter_at_radius(self, radius_m: float) -> float:
        """Parameter theta at which the centreline has this radius."""
        return self.start + float(np.log(radius_m / self.inner_radius_m)) / self.growth_per_rad

    def _profile(self, theta: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        k = self.growth_per_rad
        radius = self.inner_radius_m * np.exp(k * (theta - self.start))
        return radius, k * radius, k**2 * radius


@dataclass(frozen=True, kw_only=True)
class GoldenSpiral(LogarithmicSpiral):
    """The logarithmic spiral that grows by the golden ratio every quarter turn.

    Its two radii leave no choice of the turns.

    Raises
    ------
    DesignError
        If the turns are not the ones; the message names them.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        only = float(np.log(self.outer_radius_m / self.inner_radius_m) / _GOLDEN_PER_TURN)
        if abs(self.turns / only - 1) > _GOLDEN_TOLERANCE:
            raise DesignError(
                f"turns = {self.turns:.6g}: a golden spiral between these radii has {only:.4g}"
                " turns; centreline = logarithmic takes any number"
            )


CENTRELINES: dict[str, type[Spiral]] = {
    "fermat": FermatSpiral,
    "fibonacci": FermatSpiral,  # as the thesis calls it (errata S4)
    "archimedean": ArchimedeanSpiral,
    "logarithmic": LogarithmicSpiral,
    "golden": GoldenSpiral,
}
