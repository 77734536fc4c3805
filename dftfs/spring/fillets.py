"""Where the fillets and the tip of arm 0 sit: circles tangent to a spiral edge and a ring.

A fillet of radius r tangent to the arm's edge (offset +-w/2) and to a ring of radius R has its
centre on the parallel curve at +-(w/2 + r), at distance R + r (outside the hub) or R - r (inside
the rim) from the axis: one scalar equation in the centreline parameter.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from dftfs.errors import DesignError
from dftfs.spring.edges import Arc, Edge, Segment
from dftfs.spring.parameters import SpiralParameters

_MIN_START_FRACTION = 0.02  # of the start parameter: how far inwards an edge may be continued
_TOLERANCE = {"xtol": 1e-15, "rtol": 8.9e-16}


@dataclass(frozen=True, kw_only=True)
class Fillet:
    """A fillet arc, the centreline parameter of its foot on the arm, and its foot on the ring."""

    arc: Arc
    theta: float
    ring_point_m: NDArray


@dataclass(frozen=True, kw_only=True)
class Tip:
    """The edges that end an arm, from the rim to its inner edge, and where they touch both."""

    edges: tuple[Edge, ...]
    theta: float
    ring_point_m: NDArray


def polar(point: NDArray) -> float:
    """Polar angle of a point, in (-pi, pi]."""
    return float(np.arctan2(point[1], point[0]))


def arc_between(name: str, centre: NDArray, start: NDArray, end: NDArray, sense: int) -> Arc:
    """The arc from ``start`` to ``end`` about ``centre``; ``sense`` +1 is anticlockwise."""
    first = polar(start - centre)
    sweep = sense * np.mod(sense * (polar(end - centre) - first), 2 * np.pi)
    return Arc(
        name=name,
        centre_m=(float(centre[0]), float(centre[1])),
        radius_m=float(np.hypot(*(start - centre))),
        start_rad=first,
        end_rad=first + float(sweep),
    )


def _parallel(p: SpiralParameters, theta: float, offset_m: float) -> NDArray:
    return p.centreline.offset_point(theta, offset_m)


def _distance(p: SpiralParameters, theta: float, offset_m: float) -> float:
    return float(np.hypot(*_parallel(p, theta, offset_m)))


def hub_fillet(p: SpiralParameters, *, side: int) -> Fillet:
    """Fillet between the hub and the arm's outer (``side`` +1) or inner (-1) edge.

    Raises
    ------
    DesignError
        If that edge never meets the hub.
    """
    line, r = p.centreline, p.fillet_radius_m
    offset = side * (p.thickness_m / 2 + r)
    target = p.hub_radius_m + r
    low = _MIN_START_FRACTION * line.start
    if _distance(p, low, offset) >= target:
        least = _distance(p, low, offset) - r
        raise DesignError(
            f"{p.text('hub_radius_m')}: the arm's {'outer' if side > 0 else 'inner'} edge passes"
            f" the hub without meeting it; hub_radius_mm above {least * 1e3:.4g} would work"
        )
    if _distance(p, line.end, offset) <= target:
        raise DesignError(
            f"{p.text('hub_radius_m')}: the hub covers the whole arm; hub_radius_mm below"
            f" {(_distance(p, line.end, offset) - r) * 1e3:.4g} would work"
        )
    theta = float(brentq(lambda t: _distance(p, t, offset) - target, low, line.end, **_TOLERANCE))
    centre = _parallel(p, theta, offset)
    on_arm = _parallel(p, theta, side * p.thickness_m / 2)
    on_hub = centre * p.hub_radius_m / target
    ends = (on_hub, on_arm) if side > 0 else (on_arm, on_hub)
    name = "foot_fillet" if side > 0 else "notch_fillet"
    return Fillet(arc=arc_between(name, centre, *ends, -1), theta=theta, ring_point_m=on_hub)


def slit_fillet(p: SpiralParameters) -> Fillet:
    """Fillet that ends the slit between the arm's outer edge and the rim.

    Raises
    ------
    DesignError
        If the outer edge never comes within two fillet radii of the rim (the slit does not
        close, or the arm's tip stands inside it), or is never that far from it.
    """
    line, r = p.centreline, p.fillet_radius_m
    offset = p.thickness_at_rim_m / 2 + r
    target = p.rim_inner_radius_m - r
    reach = _distance(p, line.end, offset)
    if reach <= target:
        raise DesignError(
            f"{p.text('rim_inner_radius_m')}: the slit between arm and rim does not close before"
            f" the arm's tip; rim_inner_radius_mm below {(reach + r) * 1e3:.6g} or"
            f" fillet_radius_mm above {self_closing_fillet(p) * 1e3:.4g} would work"
        )
    at_start = _distance(p, line.start, offset)
    if at_start >= target:
        raise DesignError(
            f"{p.text('rim_inner_radius_m')}: the rim touches the arm along its whole length;"
            f" rim_inner_radius_mm above {(at_start + r) * 1e3:.4g} would work"
        )
    theta = float(
        brentq(lambda t: _distance(p, t, offset) - target, line.start, line.end, **_TOLERANCE)
    )
    centre = _parallel(p, theta, offset)
    on_arm = _parallel(p, theta, p.thickness_at_rim_m / 2)
    on_rim = centre * p.rim_inner_radius_m / target
    arc = arc_between("slit_fillet", centre, on_arm, on_rim, -1)
    return Fillet(arc=arc, theta=theta, ring_point_m=on_rim)


def self_closing_fillet(p: SpiralParameters) -> float:
    """Smallest fillet radius (m) whose circle closes the slit just at the arm's tip."""
    gap = p.rim_inner_radius_m - _distance(p, p.centreline.end, p.thickness_at_rim_m / 2)
    return max(gap, 0.0) / 2


def arm_tip(p: SpiralParameters) -> Tip:
    """The face along the normal at the outer radius, its fillet to the rim and its rounded corner.

    Raises
    ------
    DesignError
        If the face is too short for its fillet and its rounding.
    """
    line, half = p.centreline, p.thickness_at_rim_m / 2
    r, round_m = p.fillet_radius_m, p.tip_radius_m
    normal, tangent = line.normal(line.end), line.tangent(line.end)
    corner = line.point(line.end) - half * normal
    base = corner + r * tangent
    along = -float(base @ normal)
    along += np.sqrt(max(along**2 + (p.rim_inner_radius_m - r) ** 2 - float(base @ base), 0.0))
    if along <= round_m:
        raise DesignError(
            f"{p.text('fillet_radius_m')} does not fit at the arm's tip, whose face is"
            f" {(along + r) * 1e3:.4g} mm long; at most {max(along + r - round_m, 0) * 1e3:.4g}"
            " would work"
        )
    centre = base + along * normal
    on_rim = centre * p.rim_inner_radius_m / (p.rim_inner_radius_m - r)
    on_face = corner + along * normal
    edges: list[Edge] = [arc_between("tip_fillet", centre, on_rim, on_face, -1)]
    if round_m == 0:
        edges.append(_segment("tip_face", on_face, corner))
        return Tip(edges=tuple(edges), theta=line.end, ring_point_m=on_rim)
    offset = -(half - round_m)

    def ahead(theta: float) -> float:
        return float((_parallel(p, theta, offset) - corner) @ tangent) + round_m

    theta = float(brentq(ahead, line.end - 4 * round_m / p.outer_radius_m, line.end, **_TOLERANCE))
    round_centre = _parallel(p, theta, offset)
    face_end = round_centre + round_m * tangent
    edges.append(_segment("tip_face", on_face, face_end))
    edges.append(arc_between("tip_round", round_centre, face_end, _parallel(p, theta, -half), +1))
    return Tip(edges=tuple(edges), theta=theta, ring_point_m=on_rim)


def _segment(name: str, start: NDArray, end: NDArray) -> Segment:
    return Segment(
        name=name, start_m=(float(start[0]), float(start[1])), end_m=(float(end[0]), float(end[1]))
    )
