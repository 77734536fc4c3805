"""The outline's exact edges as a matplotlib path in mm: solid filled, coil gaps left open."""

import numpy as np
from matplotlib.path import Path as PlotPath
from numpy.typing import NDArray

from dftfs.spring.edges import Arc, Edge, Segment
from dftfs.spring.outline import SpringOutline

_CHORD_MM = 0.7


def edge_points_mm(edge: Edge) -> NDArray:
    """Points along an edge, (n, 2) in mm, close enough for the eye."""
    if isinstance(edge, Segment):
        return 1e3 * edge.point(np.array([0.0, 1.0]))
    count = int(np.ceil(1e3 * edge.length_m / _CHORD_MM))
    if isinstance(edge, Arc):
        count = max(8, int(np.ceil(abs(edge.end_rad - edge.start_rad) / 0.05)))
    return 1e3 * edge.point(np.linspace(0, 1, max(8, count) + 1))


def loop_points_mm(edges: tuple[Edge, ...]) -> NDArray:
    """Points along a closed loop of edges, (n, 2) in mm."""
    return np.concatenate([edge_points_mm(edge)[:-1] for edge in edges])


def outline_loops_mm(outline: SpringOutline) -> list[NDArray]:
    """Rim, bore and coil gaps as closed polygons, the rim first."""
    loops = [(outline.rim_outer,), (outline.bore,), *outline.coil_gaps]
    return [loop_points_mm(loop) for loop in loops]


def solid_path(outline: SpringOutline) -> PlotPath:
    """Compound path of the solid's section, holes wound the other way."""
    return PlotPath.make_compound_path(
        *(PlotPath(np.vstack([p, p[:1]]), closed=True) for p in outline_loops_mm(outline))
    )
