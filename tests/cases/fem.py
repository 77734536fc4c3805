"""Structured quadratic meshes for the tests of the finite-element engine."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from dftfs.fem.mesh import TaggedMesh

SIDES = ("low1", "high1", "low2", "high2")


def mapped_mesh(
    along: int,
    across: int,
    place: Callable[[NDArray, NDArray], tuple[NDArray, NDArray]],
    keep: Callable[[NDArray, NDArray], NDArray] | None = None,
) -> TaggedMesh:
    """Quad8 grid of the unit square (s, t), placed by a function that keeps it right-handed.

    Boundaries ``low1``, ``high1`` (s = 0, 1) and ``low2``, ``high2`` (t = 0, 1). ``keep`` selects
    cells by the (s, t) of their centres.
    """
    s, t = np.meshgrid(np.arange(2 * along + 1), np.arange(2 * across + 1), indexing="ij")
    corner_i, corner_j = np.meshgrid(
        np.arange(0, 2 * along, 2), np.arange(0, 2 * across, 2), indexing="ij"
    )
    i, j = corner_i.ravel(), corner_j.ravel()
    if keep is not None:
        kept = keep((i + 1) / (2 * along), (j + 1) / (2 * across))
        i, j = i[kept], j[kept]
    steps = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
    grid = np.arange(s.size).reshape(s.shape)
    cells = np.stack([grid[i + a, j + b] for a, b in steps], axis=1)
    used, cells = np.unique(cells, return_inverse=True)
    nodes = np.column_stack(place(s.ravel() / (2 * along), t.ravel() / (2 * across)))[used]
    number = np.full(s.size, -1)
    number[used] = np.arange(len(used))
    edges = {
        "low1": [(grid[0, k], grid[0, k + 2], grid[0, k + 1]) for k in range(0, 2 * across, 2)],
        "high1": [(grid[-1, k], grid[-1, k + 2], grid[-1, k + 1]) for k in range(0, 2 * across, 2)],
        "low2": [(grid[k, 0], grid[k + 2, 0], grid[k + 1, 0]) for k in range(0, 2 * along, 2)],
        "high2": [(grid[k, -1], grid[k + 2, -1], grid[k + 1, -1]) for k in range(0, 2 * along, 2)],
    }
    boundaries = {name: number[np.array(rows)] for name, rows in edges.items()}
    boundaries = {name: rows[(rows >= 0).all(axis=1)] for name, rows in boundaries.items()}
    return TaggedMesh(
        nodes=nodes,
        cells=cells.reshape(-1, 8),
        boundaries={name: rows for name, rows in boundaries.items() if len(rows)},
    )


def straight_bar(length_m: float, height_m: float, along: int, across: int) -> TaggedMesh:
    """A bar on the x axis, its middle line at y = 0; ``low1`` is at x = 0."""
    return mapped_mesh(along, across, lambda s, t: (length_m * s, height_m * (t - 0.5)))


def ring_part(
    inner_m: float,
    outer_m: float,
    angle_rad: float,
    around: int,
    through: int,
    *,
    lean_rad: float = 0.0,
    keep: Callable[[NDArray, NDArray], NDArray] | None = None,
) -> TaggedMesh:
    """Part of a ring: ``low1`` bore, ``high1`` rim, ``low2``, ``high2`` the cuts.

    ``lean_rad`` turns the rim against the bore, so that the cuts are no symmetry planes.
    """

    def place(s: NDArray, t: NDArray) -> tuple[NDArray, NDArray]:
        radius, angle = inner_m + (outer_m - inner_m) * s, angle_rad * t + lean_rad * s
        return radius * np.cos(angle), radius * np.sin(angle)

    return mapped_mesh(through, around, place, keep)


def slotted_sector(n_sectors: int) -> TaggedMesh:
    """One sector of a ring of leaning spokes: what turns the rim bends them."""
    return ring_part(
        0.020,
        0.050,
        2 * np.pi / n_sectors,
        8,
        6,
        lean_rad=0.9,
        keep=lambda s, t: (s < 0.2) | (s > 0.8) | ((t > 0.3) & (t < 0.6)),
    )


def side_by_side(**parts: TaggedMesh) -> TaggedMesh:
    """One mesh of several that share no node; boundaries are named ``part_boundary``."""
    nodes, cells, boundaries, first = [], [], {}, 0
    for part, mesh in parts.items():
        nodes.append(mesh.nodes)
        cells.append(mesh.cells + first)
        boundaries |= {f"{part}_{name}": rows + first for name, rows in mesh.boundaries.items()}
        first += len(mesh.nodes)
    return TaggedMesh(
        nodes=np.concatenate(nodes), cells=np.concatenate(cells), boundaries=boundaries
    )


def wrinkled(mesh: TaggedMesh, size_m: float, seed: int) -> NDArray[np.float64]:
    """A random nodal field (n, dim) of this size, the same for the same seed."""
    return size_m * np.random.default_rng(seed).uniform(-1, 1, mesh.nodes.shape)
