"""The outline's loops within a tolerance: as arcs, or as straight chords; and how far they err.

Chords touch the exact curve at their ends and are spaced so that each has the same sagitta.
Spiral offsets become biarcs; circles, fillets and segments are already arcs and lines.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dftfs.cad.biarc import fit_biarcs
from dftfs.cad.bulge_loop import BulgeLoop
from dftfs.errors import DesignError
from dftfs.spring.edges import Arc, Edge, OffsetEdge
from dftfs.spring.outline import SpringOutline

_FIT_SHARE = 0.98  # of the tolerance: what the fit may use; the rest covers its finite sampling
_MAX_SWEEP = 0.75 * np.pi  # of one arc: bulges near 1 and above are badly read by some machines
_TOLERANCES_M = (1e-8, 1e-3)  # finer than any machine; coarser than any fillet
_SAMPLE_SPACING_M = 5e-5
_FEWEST_SAMPLES = 64
_CHORD_GRID = 2000
_FRACTIONS = np.linspace(0.0, 1.0, 11)


def outline_loops(
    outline: SpringOutline,
) -> tuple[tuple[str, tuple[Edge, ...]], ...]:
    """The closed loops to cut, as (name, exact edges): outer circle, bore, coil gaps."""
    gaps = [(f"gap:{k}", loop) for k, loop in enumerate(outline.coil_gaps)]
    return (("outer", (outline.rim_outer,)), ("bore", (outline.bore,)), *gaps)


def arc_loop(name: str, edges: Sequence[Edge], tolerance_m: float) -> BulgeLoop:
    """A closed loop of arcs and lines, tangent-continuous where the edges are.

    Raises
    ------
    DesignError
        If the tolerance is not between 0.01 um and 1 mm.
    """
    check_tolerance(tolerance_m)
    parts = [_as_arcs(edge, tolerance_m) for edge in edges]
    vertices, bulges = zip(*parts, strict=True)
    return BulgeLoop(name=name, vertices_m=np.concatenate(vertices), bulges=np.concatenate(bulges))


def chord_loop(name: str, edges: Sequence[Edge], tolerance_m: float) -> BulgeLoop:
    """A closed loop of straight chords whose vertices lie on the exact edges.

    Raises
    ------
    DesignError
        If the tolerance is not between 0.01 um and 1 mm.
    """
    check_tolerance(tolerance_m)
    vertices = np.concatenate([_chord_starts(edge, tolerance_m) for edge in edges])
    return BulgeLoop(name=name, vertices_m=vertices, bulges=np.zeros(len(vertices)))


def deviation(loop: BulgeLoop, edges: Sequence[Edge]) -> float:
    """Largest distance (m) between a loop and the exact edges, the worse of both directions.

    Exact points are measured to the loop's pieces every 0.05 mm, and eleven points of every
    piece to the exact edges, each by projection.
    """
    exact = _ExactLoop(edges)
    fitted = loop.pieces.at(np.arange(len(loop.bulges))[:, None], _FRACTIONS).reshape(-1, 2)
    return float(max(loop.distance(exact.points).max(), exact.distance(fitted).max()))


def check_tolerance(tolerance_m: float) -> None:
    """Raise `DesignError` unless the tolerance is between 0.01 um and 1 mm."""
    least, most = _TOLERANCES_M
    if not least <= tolerance_m <= most:
        raise DesignError(
            f"tolerance_um = {1e6 * tolerance_m:.6g} must be from {1e6 * least:g} to {1e6 * most:g}"
        )


def _as_arcs(edge: Edge, tolerance_m: float) -> tuple[NDArray, NDArray]:
    if isinstance(edge, OffsetEdge):
        return fit_biarcs(edge, _FIT_SHARE * tolerance_m)
    sweep = edge.end_rad - edge.start_rad if isinstance(edge, Arc) else 0.0
    count = max(1, int(np.ceil(abs(sweep) / _MAX_SWEEP)))
    starts = edge.point(np.arange(count) / count)
    return starts, np.full(count, np.tan(sweep / count / 4))


def _chord_starts(edge: Edge, tolerance_m: float) -> NDArray:
    """Start points of the fewest chords of equal sagitta ``turn * length / 8``."""
    t = np.linspace(0.0, 1.0, _CHORD_GRID + 1)
    tangent = edge.tangent(t)
    before, after = tangent[:-1], tangent[1:]
    cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    turn = np.abs(np.arctan2(cross, np.sum(before * after, axis=1)))
    step = np.linalg.norm(np.diff(edge.point(t), axis=0), axis=1)
    density = np.concatenate([[0.0], np.cumsum(np.sqrt(turn * step))])
    count = int(np.ceil(density[-1] / np.sqrt(8 * _FIT_SHARE * tolerance_m)))
    if isinstance(edge, Arc):
        count = max(count, int(np.ceil(abs(edge.end_rad - edge.start_rad) / _MAX_SWEEP)))
    if count <= 1:
        return edge.point(t[:1])
    return edge.point(np.interp(density[-1] * np.arange(count) / count, density, t))


class _ExactLoop:
    """Dense points of exact edges, and distances from them refined by projection."""

    def __init__(self, edges: Sequence[Edge]) -> None:
        self._edges = tuple(edges)
        counts = [
            max(_FEWEST_SAMPLES, int(np.ceil(edge.length_m / _SAMPLE_SPACING_M))) for edge in edges
        ]
        self._parameter = np.concatenate([np.linspace(0.0, 1.0, n + 1) for n in counts])
        self._owner = np.repeat(np.arange(len(counts)), np.add(counts, 1))
        self.points = np.concatenate(
            [edge.point(np.linspace(0.0, 1.0, n + 1)) for edge, n in zip(edges, counts)]
        )
        self._tree = cKDTree(self.points)

    def distance(self, points: NDArray) -> NDArray:
        """Distance (m) of points (m, 2), shape (m,); four candidates cover the joints."""
        _, nearest = self._tree.query(points, k=4)
        best = np.full(len(points), np.inf)
        for column in nearest.T:
            for index in np.unique(self._owner[column]):
                rows = np.flatnonzero(self._owner[column] == index)
                found = _projected(self._edges[index], points[rows], self._parameter[column[rows]])
                best[rows] = np.minimum(best[rows], found)
        return best


def _projected(edge: Edge, points: NDArray, t: NDArray) -> NDArray:
    """Distance (m) of points from an edge, by Newton on the foot from a nearby parameter."""
    small = 1e-6
    for _ in range(3):
        low, high = np.maximum(t - small, 0.0), np.minimum(t + small, 1.0)
        rate = np.linalg.norm(edge.point(high) - edge.point(low), axis=1) / (high - low)
        ahead = np.sum((points - edge.point(t)) * edge.tangent(t), axis=1)
        t = np.clip(t + ahead / rate, 0.0, 1.0)
    return np.linalg.norm(points - edge.point(t), axis=1)
