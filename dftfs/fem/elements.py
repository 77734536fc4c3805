"""Serendipity elements: shape functions and Gauss points as plain tables.

Taken from scikit-fem: its element classes and quadrature, evaluated once. The local node order
here is Abaqus' (CPS8, C3D20): corners counter-clockwise (bottom, then top), then midsides
(bottom edges, top edges, vertical edges); scikit-fem's own order is matched by coordinates.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from skfem.element import ElementHexS2, ElementQuadS2
from skfem.quadrature import get_quadrature
from skfem.refdom import RefLine

_SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
_QUAD_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0)]
_HEX_EDGES = [
    *_QUAD_EDGES,
    *[(i + 4, j + 4) for i, j in _QUAD_EDGES],
    *[(i, i + 4) for i in range(4)],
]
_HEX_FACES = (
    (0, 3, 2, 1, 11, 10, 9, 8),
    (4, 5, 6, 7, 12, 13, 14, 15),
    (0, 1, 5, 4, 8, 17, 12, 16),
    (1, 2, 6, 5, 9, 18, 13, 17),
    (2, 3, 7, 6, 10, 19, 14, 18),
    (3, 0, 4, 7, 11, 16, 15, 19),
)


@dataclass(frozen=True, kw_only=True, eq=False)
class ElementKind:
    """A serendipity element on the unit square or cube.

    Parameters
    ----------
    name : str
        ``quad8`` or ``hex20``.
    node_points : (n, dim) array
        Reference coordinates of the nodes, in [0, 1].
    facets : (m, 3) or (m, 8) int array
        Local nodes of every facet, corners first, then midsides; a quadrilateral facet turns
        counter-clockwise seen from outside, an edge has the outside on its right.
    """

    name: str
    node_points: NDArray[np.float64]
    facets: NDArray[np.int64]

    @property
    def dim(self) -> int:
        return self.node_points.shape[1]

    @property
    def n_nodes(self) -> int:
        return len(self.node_points)

    @property
    def n_corners(self) -> int:
        return 2**self.dim


@dataclass(frozen=True, kw_only=True, eq=False)
class ShapeTable:
    """Shape functions of an element at given reference points.

    Parameters
    ----------
    points : (q, dim) array
    weights : (q,) array
        Quadrature weights (sum 1 on the unit cell), zeros where the points are no rule.
    values : (q, n) array
    gradients : (q, dim, n) array
        Derivatives with respect to the reference coordinates.
    """

    points: NDArray[np.float64]
    weights: NDArray[np.float64]
    values: NDArray[np.float64]
    gradients: NDArray[np.float64]


def _with_midsides(corners: list[tuple], edges: list[tuple[int, int]]) -> NDArray[np.float64]:
    points = np.array(corners, dtype=float)
    return np.concatenate([points, [(points[i] + points[j]) / 2 for i, j in edges]])


QUAD8 = ElementKind(
    name="quad8",
    node_points=_with_midsides(_SQUARE, _QUAD_EDGES),
    facets=np.array([(i, j, 4 + k) for k, (i, j) in enumerate(_QUAD_EDGES)]),
)
HEX20 = ElementKind(
    name="hex20",
    node_points=_with_midsides([(*p, z) for z in (0, 1) for p in _SQUARE], _HEX_EDGES),
    facets=np.array(_HEX_FACES),
)
_SKFEM = {"quad8": ElementQuadS2(), "hex20": ElementHexS2()}


def shape_table(
    kind: ElementKind,
    points: NDArray[np.float64],
    weights: NDArray[np.float64] | None = None,
) -> ShapeTable:
    """Shape functions and their reference gradients at ``points`` (q, dim)."""
    element = _SKFEM[kind.name]
    distance = np.abs(kind.node_points[:, None] - element.doflocs[None]).max(axis=2)
    order = distance.argmin(axis=1)
    columns = [element.lbasis(points.T.copy(), i) for i in order]
    return ShapeTable(
        points=points,
        weights=np.zeros(len(points)) if weights is None else weights,
        values=np.stack([phi for phi, _ in columns], axis=1),
        gradients=np.ascontiguousarray(
            np.stack([dphi for _, dphi in columns], axis=-1).transpose(1, 0, 2)
        ),
    )


@cache
def gauss_table(name: str, per_direction: int) -> ShapeTable:
    """The table at the tensor Gauss rule with ``per_direction`` points (3 full, 2 reduced)."""
    kind = {"quad8": QUAD8, "hex20": HEX20}[name]
    points, weights = get_quadrature(_SKFEM[name], 2 * per_direction - 1)
    return shape_table(kind, np.ascontiguousarray(points.T), weights)


@cache
def face_table(dim: int) -> ShapeTable:
    """Shape functions of a facet (3-node edge, 8-node face) at three Gauss points a direction."""
    return facet_table(dim, 3)


@cache
def facet_table(dim: int, per_direction: int) -> ShapeTable:
    """Shape functions of a facet of a ``dim``-dimensional mesh at its Gauss points."""
    if dim == 3:
        return gauss_table("quad8", per_direction)
    points, weights = get_quadrature(RefLine, 2 * per_direction - 1)
    x = points[0]
    # corners at 0 and 1, midside at 1/2: the order of a facet here
    values = np.stack([(1 - x) * (1 - 2 * x), x * (2 * x - 1), 4 * x * (1 - x)], axis=1)
    gradients = np.stack([4 * x - 3, 4 * x - 1, 4 - 8 * x], axis=1)[:, None]
    return ShapeTable(points=points.T, weights=weights, values=values, gradients=gradients)
