"""Lines to draw of quad8 cells: their curved outlines, and the border of what they cover."""

import numpy as np
from numpy.typing import NDArray

_PIECES = 4  # straight ones that a curved edge is drawn in
_MERGE_M = 1e-8


def cell_outlines(nodes: NDArray, cells: NDArray) -> NDArray:
    """Closed outlines (m, 17, 2) of quad8 cells, their curved edges in four pieces each."""
    s = np.arange(_PIECES) / _PIECES
    shape = np.stack([(1 - s) * (1 - 2 * s), 4 * s * (1 - s), s * (2 * s - 1)], axis=1)
    sides = []
    for k in range(4):
        corners = nodes[cells[:, [k, 4 + k, (k + 1) % 4]]]
        sides.append(np.einsum("sn,mnd->msd", shape, corners))
    outline = np.concatenate(sides, axis=1)
    return np.concatenate([outline, outline[:, :1]], axis=1)


def border_edges(nodes_m: NDArray, cells: NDArray) -> NDArray:
    """Edges (k, 3: corner, middle, corner) of quad8 cells that bound one cell only.

    Nodes at one place count as one, so the joints between turned sectors are no border.
    """
    middles = cells[:, 4:].ravel()
    _, place = np.unique(np.round(nodes_m[middles] / _MERGE_M), axis=0, return_inverse=True)
    alone = np.bincount(place.ravel())[place.ravel()] == 1
    edges = np.stack([cells[:, :4], cells[:, 4:], np.roll(cells[:, :4], -1, axis=1)], axis=-1)
    return edges.reshape(-1, 3)[alone]


def near(outlines: NDArray, centre: NDArray, half: float) -> NDArray:
    """Those of the outlines (m, k, 2) that reach into a square window."""
    low, high = outlines.min(axis=1), outlines.max(axis=1)
    return outlines[np.all((low < centre + half) & (high > centre - half), axis=1)]
