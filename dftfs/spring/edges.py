"""The three kinds of edge an outline is made of: arc, segment, offset of a centreline.

Each knows its points and unit tangents over a parameter in [0, 1], its length, and its exact
contribution to the enclosed area, so that CAD, mesh and closed forms all read one geometry.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dftfs.spring.centreline import Spiral
from dftfs.spring.spline_profile import SplineProfile

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)


def rotate(points: NDArray, angle_rad: float) -> NDArray:
    """Points (..., 2) turned about the origin."""
    cosine, sine = np.cos(angle_rad), np.sin(angle_rad)
    return points @ np.array([[cosine, sine], [-sine, cosine]])


@dataclass(frozen=True, kw_only=True)
class Arc:
    """Circular arc from one polar angle to another (about its own centre), in m and rad."""

    name: str
    centre_m: tuple[float, float]
    radius_m: float
    start_rad: float
    end_rad: float

    def _polar(self, t: ArrayLike) -> NDArray:
        return self.start_rad + (self.end_rad - self.start_rad) * np.asarray(t, dtype=float)

    def point(self, t: ArrayLike) -> NDArray:
        """Points at parameters in [0, 1], shape (..., 2), in m."""
        polar = self._polar(t)
        ring = np.stack([np.cos(polar), np.sin(polar)], axis=-1)
        return np.asarray(self.centre_m) + self.radius_m * ring

    def tangent(self, t: ArrayLike) -> NDArray:
        """Unit tangents in the direction of travel, shape (..., 2)."""
        polar = self._polar(t)
        sense = np.sign(self.end_rad - self.start_rad)
        return sense * np.stack([-np.sin(polar), np.cos(polar)], axis=-1)

    @property
    def length_m(self) -> float:
        """Arc length in m."""
        return abs(self.end_rad - self.start_rad) * self.radius_m

    @property
    def area_m2(self) -> float:
        """Half the line integral of x dy - y dx along the edge, in m^2."""
        sweep = self.end_rad - self.start_rad
        chord = self.point(1.0) - self.point(0.0)
        x0, y0 = self.centre_m
        return 0.5 * (self.radius_m**2 * sweep + x0 * chord[1] - y0 * chord[0])

    def reversed(self) -> "Arc":
        """The same arc travelled the other way."""
        return replace(self, start_rad=self.end_rad, end_rad=self.start_rad)

    def rotated(self, angle_rad: float, name: str) -> "Arc":
        """The arc turned about the origin, under another name."""
        centre = rotate(np.asarray(self.centre_m), angle_rad)
        return replace(
            self,
            name=name,
            centre_m=(float(centre[0]), float(centre[1])),
            start_rad=self.start_rad + angle_rad,
            end_rad=self.end_rad + angle_rad,
        )


@dataclass(frozen=True, kw_only=True)
class Segment:
    """Straight edge between two points, in m."""

    name: str
    start_m: tuple[float, float]
    end_m: tuple[float, float]

    def point(self, t: ArrayLike) -> NDArray:
        """Points at parameters in [0, 1], shape (..., 2), in m."""
        t = np.asarray(t, dtype=float)[..., None]
        return (1 - t) * np.asarray(self.start_m) + t * np.asarray(self.end_m)

    def tangent(self, t: ArrayLike) -> NDArray:
        """Unit tangents in the direction of travel, shape (..., 2)."""
        direction = np.subtract(self.end_m, self.start_m) / self.length_m
        return np.broadcast_to(direction, (*np.shape(t), 2)).copy()

    @property
    def length_m(self) -> float:
        """Length in m."""
        return float(np.hypot(*np.subtract(self.end_m, self.start_m)))

    @property
    def area_m2(self) -> float:
        """Half the line integral of x dy - y dx along the edge, in m^2."""
        (x0, y0), (x1, y1) = self.start_m, self.end_m
        return 0.5 * (x0 * y1 - x1 * y0)

    def reversed(self) -> "Segment":
        """The same segment travelled the other way."""
        return replace(self, start_m=self.end_m, end_m=self.start_m)

    def rotated(self, angle_rad: float, name: str) -> "Segment":
        """The segment turned about the origin, under another name."""
        ends = rotate(np.array([self.start_m, self.end_m]), angle_rad)
        return replace(self, name=name, start_m=tuple(ends[0]), end_m=tuple(ends[1]))


@dataclass(frozen=True, kw_only=True)
class Taper:
    """Thickness of a strip that changes along its centreline, constant towards both ends.

    From ``first_m`` up to the parameter ``start`` to ``last_m`` from ``end`` on, between them by
    the quintic 10 u^3 - 15 u^4 + 6 u^5: slope and curvature of the edges are continuous, and at
    the ends, where fillets touch them, they are parallel curves.
    """

    first_m: float
    last_m: float
    start: float
    end: float

    def _share(self, theta: ArrayLike) -> NDArray:
        return np.clip(
            (np.asarray(theta, dtype=float) - self.start) / (self.end - self.start), 0, 1
        )

    def thickness_m(self, theta: ArrayLike) -> NDArray:
        """Thickness at centreline parameters, in m."""
        u = self._share(theta)
        return self.first_m + (self.last_m - self.first_m) * u**3 * (10 + u * (6 * u - 15))

    def slope(self, theta: ArrayLike) -> NDArray:
        """Its derivative in the parameter, in m."""
        u = self._share(theta)
        rise = (self.last_m - self.first_m) / (self.end - self.start)
        return rise * 30 * (u * (1 - u)) ** 2


@dataclass(frozen=True, kw_only=True)
class OffsetEdge:
    """Curve beside a centreline at a signed normal distance (positive: away from the axis).

    A parallel curve; with a ``taper`` half the thickness away, on the side of ``offset_m``.
    """

    name: str
    centreline: Spiral
    offset_m: float
    start: float
    end: float
    taper: Taper | SplineProfile | None = None

    @property
    def breaks(self) -> tuple[float, ...]:
        """Centreline parameters at which a profile's third derivative jumps."""
        found = self.centreline.breaks
        return found + (self.taper.breaks if isinstance(self.taper, SplineProfile) else ())

    def offset(self, theta: ArrayLike) -> NDArray:
        """Signed normal distance at centreline parameters, in m."""
        if self.taper is None:
            return np.full(np.shape(theta), self.offset_m)
        return np.copysign(self.taper.thickness_m(theta) / 2, self.offset_m)

    def _rate(self, theta: ArrayLike) -> NDArray:
        """Derivative of the point in theta, shape (..., 2)."""
        line = self.centreline
        forward = (1 + self.offset(theta) * line.curvature(theta)) * line.speed(theta)
        rate = forward[..., None] * line.tangent(theta)
        if self.taper is not None:
            outward = np.copysign(1.0, self.offset_m) * self.taper.slope(theta) / 2
            rate = rate + outward[..., None] * line.normal(theta)
        return rate

    def parameter(self, t: ArrayLike) -> NDArray:
        """Centreline parameter at the edge's parameter in [0, 1]."""
        return self.start + (self.end - self.start) * np.asarray(t, dtype=float)

    def point(self, t: ArrayLike) -> NDArray:
        """Points at parameters in [0, 1], shape (..., 2), in m."""
        return self._at(self.parameter(t))

    def _at(self, theta: NDArray) -> NDArray:
        line = self.centreline
        return line.point(theta) + self.offset(theta)[..., None] * line.normal(theta)

    def tangent(self, t: ArrayLike) -> NDArray:
        """Unit tangents in the direction of travel, shape (..., 2)."""
        theta = self.parameter(t)
        if self.taper is None:
            return np.sign(self.end - self.start) * self.centreline.tangent(theta)
        rate = self._rate(theta)
        return np.sign(self.end - self.start) * rate / np.linalg.norm(rate, axis=-1)[..., None]

    def speed(self, theta: ArrayLike) -> NDArray:
        """Length of the curve per unit of theta; parallel: ``(1 + offset kappa) ds/dtheta``."""
        if self.taper is not None:
            return np.linalg.norm(self._rate(theta), axis=-1)
        line = self.centreline
        return (1 + self.offset_m * line.curvature(theta)) * line.speed(theta)

    def _quadrature(self) -> tuple[NDArray, NDArray]:
        panels = max(4, int(np.ceil(8 * abs(self.end - self.start))))
        bounds = np.linspace(self.start, self.end, panels + 1)
        low, high = sorted((self.start, self.end))
        if cuts := [b for b in self.breaks if low < b < high]:
            bounds = np.sort([*bounds, *cuts])
            bounds = bounds if self.end > self.start else bounds[::-1]
        half = np.diff(bounds) / 2
        theta = bounds[:-1, None] + half[:, None] * (1 + _NODES)
        return theta.ravel(), (half[:, None] * _WEIGHTS).ravel()

    @property
    def length_m(self) -> float:
        """Arc length in m."""
        theta, weight = self._quadrature()
        return float(abs(np.sum(weight * self.speed(theta))))

    @property
    def area_m2(self) -> float:
        """Half the line integral of x dy - y dx along the edge, in m^2."""
        theta, weight = self._quadrature()
        point, step = self._at(theta), self._rate(theta)
        return float(0.5 * np.sum(weight * (point[:, 0] * step[:, 1] - point[:, 1] * step[:, 0])))

    def reversed(self) -> "OffsetEdge":
        """The same edge travelled the other way."""
        return replace(self, start=self.end, end=self.start)

    def rotated(self, angle_rad: float, name: str) -> "OffsetEdge":
        """The edge turned about the origin, under another name."""
        return replace(self, name=name, centreline=self.centreline.rotated(angle_rad))


Edge = Arc | Segment | OffsetEdge
