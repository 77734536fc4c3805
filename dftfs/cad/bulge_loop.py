"""A closed loop of circular arcs and straight lines, written as vertices and bulges.

The bulge of a piece is the tangent of a quarter of its swept angle, positive anticlockwise: what
a DXF polyline stores. Writing, re-reading and measuring a profile all use this one form. Every
formula here stays accurate as a piece becomes straight (bulge to 0).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dftfs.errors import DesignError

_SEARCH_POINTS = 20000  # a loop's samples, from which the search of the nearest piece starts
_NEIGHBOURS = 4  # at a joint the samples of both pieces coincide
_STRAIGHT = 1e-3  # half-angle below which a segment's area is summed as a series


def bulge_from_chord(tangent: NDArray, chord: NDArray) -> NDArray:
    """Bulge of the arc that leaves along ``tangent`` and spans ``chord``, both (..., 2)."""
    cross = tangent[..., 0] * chord[..., 1] - tangent[..., 1] * chord[..., 0]
    return np.tan(np.arctan2(cross, np.sum(tangent * chord, axis=-1)) / 2)


@dataclass(frozen=True, kw_only=True)
class ArcPieces:
    """Arcs as start point, unit start tangent, signed curvature and length; lines have curvature 0.

    start_m, end_m, tangent : (n, 2); curvature_per_m, length_m : (n,).
    """

    start_m: NDArray
    end_m: NDArray
    tangent: NDArray
    curvature_per_m: NDArray
    length_m: NDArray

    @classmethod
    def from_bulges(cls, start_m: NDArray, end_m: NDArray, bulges: NDArray) -> "ArcPieces":
        """Pieces from their ends (n, 2) and bulges (n,)."""
        chord = end_m - start_m
        span = np.linalg.norm(chord, axis=1)
        half = 2 * np.arctan(bulges)
        cosine, sine = np.cos(half), np.sin(half)
        unit = chord / span[:, None]
        tangent = np.stack(
            [cosine * unit[:, 0] + sine * unit[:, 1], cosine * unit[:, 1] - sine * unit[:, 0]],
            axis=-1,
        )
        return cls(
            start_m=start_m,
            end_m=end_m,
            tangent=tangent,
            curvature_per_m=2 * sine / span,
            length_m=span / np.sinc(half / np.pi),
        )

    def at(self, piece: NDArray, fraction: NDArray) -> NDArray:
        """Points (..., 2) in m at fractions (...) of the pieces of those indices (...)."""
        along = self.length_m[piece] * fraction
        half = along * self.curvature_per_m[piece] / 2
        chord = along * np.sinc(half / np.pi)
        ahead, aside = chord * np.cos(half), chord * np.sin(half)
        x, y = np.moveaxis(self.tangent[piece], -1, 0)
        step = np.stack([ahead * x - aside * y, ahead * y + aside * x], axis=-1)
        return self.start_m[piece] + step

    def sampled(self, spacing_m: float) -> tuple[NDArray, NDArray]:
        """Points (m, 2) no further apart than that, both ends of every piece among them, and
        the piece (m,) of each."""
        counts = np.ceil(self.length_m / spacing_m).astype(int) + 1
        piece = np.repeat(np.arange(len(counts)), counts)
        within = np.arange(len(piece)) - np.repeat(np.cumsum(counts) - counts, counts)
        return self.at(piece, within / (counts[piece] - 1)), piece

    def distance(self, points: NDArray, piece: NDArray) -> NDArray:
        """Distance (m) of points (..., 2) from the pieces of those indices (...)."""
        gap = points - self.start_m[piece]
        tangent, k = self.tangent[piece], self.curvature_per_m[piece]
        ahead = np.sum(gap * tangent, axis=-1)
        aside = tangent[..., 0] * gap[..., 1] - tangent[..., 1] * gap[..., 0]
        q = k * np.sum(gap**2, axis=-1) - 2 * aside
        radial = np.abs(q) / (1 + np.sqrt(np.maximum(1 + k * q, 0.0)))
        flat = np.where(k == 0, 1.0, k)
        along = np.where(k == 0, ahead, np.arctan2(k * ahead, 1 - k * aside) / flat)
        to_end = np.linalg.norm(points - self.end_m[piece], axis=-1)
        inside = (along >= 0) & (along <= self.length_m[piece])
        return np.where(inside, radial, np.minimum(np.linalg.norm(gap, axis=-1), to_end))


@dataclass(frozen=True, kw_only=True)
class BulgeLoop:
    """A closed loop: vertices (n, 2) in m and the bulge (n,) of the piece that leaves each.

    Raises
    ------
    DesignError
        If the loop has fewer than two vertices, values that are not finite, or two equal
        neighbouring vertices.
    """

    name: str
    vertices_m: NDArray
    bulges: NDArray

    def __post_init__(self) -> None:
        vertices = np.array(self.vertices_m, dtype=float)
        bulges = np.array(self.bulges, dtype=float)
        if vertices.ndim != 2 or vertices.shape[1:] != (2,) or bulges.shape != vertices.shape[:1]:
            raise DesignError(
                f"loop {self.name}: {vertices.shape} vertices and {bulges.shape} bulges must be"
                " (n, 2) and (n,)"
            )
        if len(vertices) < 2 or not (np.isfinite(vertices).all() and np.isfinite(bulges).all()):
            raise DesignError(f"loop {self.name} needs two or more vertices, all of them finite")
        chords = np.linalg.norm(np.roll(vertices, -1, axis=0) - vertices, axis=1)
        if chords.min() == 0:
            raise DesignError(f"loop {self.name}: vertex {chords.argmin()} is repeated")
        vertices.flags.writeable = bulges.flags.writeable = False
        object.__setattr__(self, "vertices_m", vertices)
        object.__setattr__(self, "bulges", bulges)

    @classmethod
    def circle(cls, name: str, centre_m: NDArray, radius_m: float) -> "BulgeLoop":
        """A full anticlockwise circle as four quarter arcs."""
        angle = np.arange(4) * np.pi / 2
        ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        return cls(
            name=name,
            vertices_m=np.asarray(centre_m, dtype=float) + radius_m * ring,
            bulges=np.full(4, np.tan(np.pi / 8)),
        )

    @cached_property
    def pieces(self) -> ArcPieces:
        """The loop's arcs and lines in order."""
        end = np.roll(self.vertices_m, -1, axis=0)
        return ArcPieces.from_bulges(self.vertices_m, end, self.bulges)

    @property
    def length_m(self) -> float:
        """Length of the loop in m."""
        return float(np.sum(self.pieces.length_m))

    @property
    def area_m2(self) -> float:
        """Enclosed area in m^2, positive anticlockwise: the polygon's plus the arcs' segments."""
        x, y = self.vertices_m.T
        polygon = 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
        half = 2 * np.arctan(self.bulges)
        chord = self.pieces.end_m - self.vertices_m
        safe = np.where(np.abs(half) < _STRAIGHT, 1.0, half)
        exact = (2 * safe - np.sin(2 * safe)) / np.sin(safe) ** 2
        series = 4 * half / 3 * (1 + 2 * half**2 / 15)
        factor = np.where(np.abs(half) < _STRAIGHT, series, exact)
        return float(polygon + np.sum(np.sum(chord**2, axis=1) * factor) / 8)

    @cached_property
    def _search(self) -> tuple[cKDTree, NDArray]:
        points, owner = self.pieces.sampled(self.length_m / _SEARCH_POINTS)
        return cKDTree(points), owner

    def distance(self, points: NDArray) -> NDArray:
        """Distance (m) of points (m, 2) from the loop, shape (m,).

        Exact for points near the loop; never below the true distance.
        """
        tree, owner = self._search
        _, index = tree.query(points, k=_NEIGHBOURS)
        return self.pieces.distance(points[:, None], owner[index]).min(axis=1)
