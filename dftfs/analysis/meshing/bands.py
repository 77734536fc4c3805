"""Bands of ordered elements along the fillets: the boundary moved inwards by one coarse element.

Stress peaks on the fillets' edge; a row of square elements there, two after splitting, resolves
it far better than whatever an unstructured mesher leaves. What the mesher sees is the boundary
with the bands cut away.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dftfs.spring.edges import Edge

BANDED_FILLETS = ("notch_fillet", "foot_fillet", "slit_fillet", "tip_fillet")
_REACH = 1.5  # fillet radii on either side of a fillet that its band covers
_DEPTH = 0.9  # of the coarse element size

Piece = tuple[Edge, float, float]


@dataclass(frozen=True, kw_only=True)
class BandedRing:
    """A closed ring of boundary pieces with some of them under a band.

    Attributes
    ----------
    pieces : the boundary pieces, in travel order; piece k starts at ``points_m[k]`` (n, 2).
    banded : (n,) bool
        Whether piece k lies under a band.
    covered : (n,) bool
        Points that the mesher does not see (both neighbouring pieces are banded).
    polygon_m : (m, 2)
        The boundary given to the mesher. polygon_index : (n,), index of a visible point in it.
    inward : (n,)
        Index of the inward copy of a point in the polygon (-1 without a band).
    """

    pieces: tuple[Piece, ...]
    points_m: NDArray
    banded: NDArray
    covered: NDArray
    polygon_m: NDArray
    polygon_index: NDArray
    inward: NDArray


def banded_ring(
    pieces: list[Piece], size: Callable[[NDArray], NDArray], fillet_radius_m: float
) -> BandedRing:
    """Cut a band off a ring along its fillets and a little beyond.

    ``size`` gives the element size (m) at points (n, 2); the band is about twice as deep.
    """
    points = np.array([edge.point(start) for edge, start, _ in pieces])
    tangents = np.array([edge.tangent(start) for edge, start, _ in pieces])
    banded = _banded(pieces, fillet_radius_m)
    before = np.roll(banded, 1)
    touched = banded | before
    covered = banded & before
    inwards = np.stack([-tangents[:, 1], tangents[:, 0]], axis=1)
    moved = points + (_DEPTH * 2 * size(points))[:, None] * inwards
    polygon: list[NDArray] = []
    index, inward = np.full(len(pieces), -1), np.full(len(pieces), -1)
    for k in range(len(pieces)):
        ends_here = before[k] and not banded[k]
        if touched[k] and ends_here:  # leaving a band: first its inner corner, then the boundary
            inward[k] = len(polygon)
            polygon.append(moved[k])
        if not covered[k]:
            index[k] = len(polygon)
            polygon.append(points[k])
        if touched[k] and not ends_here:
            inward[k] = len(polygon)
            polygon.append(moved[k])
    return BandedRing(
        pieces=tuple(pieces),
        points_m=points,
        banded=banded,
        covered=covered,
        polygon_m=np.array(polygon),
        polygon_index=index,
        inward=inward,
    )


def _banded(pieces: list[Piece], fillet_radius_m: float) -> NDArray:
    """Fillet pieces and their neighbours up to the reach; corners and cuts stay free."""
    names = [edge.name for edge, _, _ in pieces]
    lengths = np.array(
        [np.hypot(*(edge.point(end) - edge.point(start))) for edge, start, end in pieces]
    )
    count, reach = len(pieces), _REACH * fillet_radius_m
    banded = np.array([name in BANDED_FILLETS for name in names])
    carriers = ("hub", "arm_outer", "arm_inner", "rim_inner", "tip_face")
    for k in np.flatnonzero(banded):
        for direction in (+1, -1):
            along, j = 0.0, (k + direction) % count
            while along + lengths[j] / 2 < reach and names[j] in carriers:
                banded[j] = True
                along, j = along + lengths[j], (j + direction) % count
    # never up to a corner of the block or the tip's rounding: leave one piece between
    for k in range(count):
        adjacent = names[(k + 1) % count], names[(k - 1) % count]
        if names[k] not in BANDED_FILLETS and any(
            n.startswith("cut") or n in ("cross_section", "tip_round") for n in adjacent
        ):
            banded[k] = False
    return banded
