"""The three kinds of edge an outline is made of: arc, segment, offset of a centreline.

Each knows its points and unit tangents over a parameter in [0, 1], its length, and its exact
contribution to the enclosed area, so that CAD, mesh and closed forms all read one geometry.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from dftfs.spring.centreline import Spiral

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
class OffsetEdge:
    """Parallel curve of a centreline at a signed normal distance (positive: away from the axis)."""

    name: str
    centreline: Spiral
    offset_m: float
    start: float
    end: float

    def parameter(self, t: ArrayLike) -> NDArray:
        """Centreline parameter at the edge's parameter in [0, 1]."""
        return self.start + (self.end - self.start) * np.asarray(t, dtype=float)

    def point(self, t: ArrayLike) -> NDArray:
        """Points at parameters in [0, 1], shape (..., 2), in m."""
        theta = self.parameter(t)
        return self.centreline.point(theta) + self.offset_m * self.centreline.normal(theta)

    def tangent(self, t: ArrayLike) -> NDArray:
        """Unit tangents in the direction of travel, shape (..., 2)."""
        return np.sign(self.end - self.start) * self.centreline.tangent(self.parameter(t))

    def speed(self, theta: ArrayLike) -> NDArray:
        """Length of the parallel curve per unit of theta: ``(1 + offset kappa) ds/dtheta``."""
        line = self.centreline
        return (1 + self.offset_m * line.curvature(theta)) * line.speed(theta)

    def _quadrature(self) -> tuple[NDArray, NDArray]:
        panels = max(4, int(np.ceil(8 * abs(self.end - self.start))))
        bounds = np.linspace(self.start, self.end, panels + 1)
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
        line = self.centreline
        point = line.point(theta) + self.offset_m * line.normal(theta)
        step = self.speed(theta)[:, None] * line.tangent(theta)
        return float(0.5 * np.sum(weight * (point[:, 0] * step[:, 1] - point[:, 1] * step[:, 0])))

    def reversed(self) -> "OffsetEdge":
        """The same edge travelled the other way."""
        return replace(self, start=self.end, end=self.start)

    def rotated(self, angle_rad: float, name: str) -> "OffsetEdge":
        """The edge turned about the origin, under another name."""
        return replace(self, name=name, centreline=self.centreline.rotated(angle_rad))


Edge = Arc | Segment | OffsetEdge
