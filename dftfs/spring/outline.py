"""The planar outline of the spring: hub, arms, rim, fillets and tips as named exact edges.

One object feeds CAD, mesh, rod model and closed forms. The solid is bounded by the rim's outer
circle, the bore, and one gap between the coils per arm. Coil gap k lies between the outer edge of
the next arm (its floor) and the inner edge of arm k (its ceiling), and is followed with the
material on the left:

    hub - foot_fillet - arm_outer - slit_fillet - rim_inner - tip_fillet - tip_face - tip_round
    - arm_inner - notch_fillet - back to hub

Taken from build123d and cadquery: a sketch is exact edges, not points, and every consumer reads
the same one.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dftfs.errors import DesignError
from dftfs.spring.edges import Arc, Edge, OffsetEdge
from dftfs.spring.fillets import Fillet, Tip, arm_tip, hub_fillet, polar, slit_fillet
from dftfs.spring.parameters import SpiralParameters

_CHORDS = 128  # of an edge, for the polar moment
_SETTLED_RAD = 1e-13  # of a foot on a centreline: its distance no longer changes


@dataclass(frozen=True, kw_only=True)
class ArmFeet:
    """Where arm 0's fillets and tip touch its edges, as centreline parameters (rad)."""

    foot_theta: float
    notch_theta: float
    slit_theta: float
    tip_theta: float


@dataclass(frozen=True, kw_only=True)
class SpringOutline:
    """The planar outline: exact named edges of the solid.

    ``rim_outer`` and ``bore`` are full circles; ``coil_gaps[k]`` is the closed loop of coil gap k,
    each edge named ``<kind>:<k>``. ``feet`` says where the free part of an arm begins and ends.
    """

    parameters: SpiralParameters
    rim_outer: Arc
    bore: Arc
    coil_gaps: tuple[tuple[Edge, ...], ...]
    feet: ArmFeet

    @property
    def area_m2(self) -> float:
        """Area of the solid's section, in m^2 (exact to round-off)."""
        # every coil gap is the first one turned about the axis
        holes = len(self.coil_gaps) * sum(edge.area_m2 for edge in self.coil_gaps[0])
        return self.rim_outer.area_m2 + self.bore.area_m2 + holes

    @property
    def polar_moment_m4(self) -> float:
        """Integral of the squared radius over the section, in m^4 (to 1e-6)."""
        p = self.parameters
        rings = np.pi / 2 * (p.rim_outer_radius_m**4 - p.bore_radius_m**4)
        # chords err with the square of their length: extrapolated
        gap = (4 * self._polar_of_gap(2 * _CHORDS) - self._polar_of_gap(_CHORDS)) / 3
        return float(rings - len(self.coil_gaps) * gap)

    def _polar_of_gap(self, chords: int) -> float:
        steps = np.linspace(0, 1, chords + 1)[:-1]
        loop = np.concatenate([edge.point(steps) for edge in self.coil_gaps[0]])
        (x, y), (u, v) = loop.T, np.roll(loop, -1, axis=0).T
        squares = x * x + x * u + u * u + y * y + y * v + v * v
        return abs(float(np.sum((x * v - u * y) * squares))) / 12

    @property
    def arm_length_m(self) -> float:
        """Arc length of one centreline from the inner to the outer radius, in m."""
        line = self.parameters.centreline
        return line.length(line.start, line.end)

    @property
    def free_arm_length_m(self) -> float:
        """Arc length from the notch fillet's foot to the slit fillet's foot, in m."""
        return self.parameters.centreline.length(self.feet.notch_theta, self.feet.slit_theta)

    def edge(self, name: str) -> Edge:
        """The edge of that name (``KeyError`` if there is none)."""
        by_name = {edge.name: edge for loop in self.coil_gaps for edge in loop}
        return {**by_name, "rim_outer": self.rim_outer, "bore": self.bore}[name]


def build_outline(parameters: SpiralParameters, *, advise: bool = True) -> SpringOutline:
    """Solve for the fillets and tips and assemble the outline.

    Parameters
    ----------
    advise : bool
        Whether the message for fillets that do not fit says which would; to find that out takes
        ten times as long as the outline.

    Raises
    ------
    DesignError
        For every combination that is no solid: overlapping arms, a slit that does not close, a
        tip inside the slit, fillets that do not fit; the message gives the number that would work.
    """
    p = parameters
    _check_strip(p)
    foot, notch = hub_fillet(p, side=+1), hub_fillet(p, side=-1)
    slit, tip = slit_fillet(p), arm_tip(p)
    _check_arm(p, foot, notch, slit, tip, advise)
    _check_arms_apart(p, foot)
    floor, ceiling, hub, rim = _coil_gap_edges(p, foot, notch, slit, tip, advise)
    gaps = []
    for k in range(p.n_arms):
        turn = k * p.pitch_rad
        loop = [hub.rotated(turn, f"hub:{k}")]
        loop += [edge.rotated(turn + p.pitch_rad, f"{edge.name}:{k}") for edge in floor]
        loop += [edge.rotated(turn, f"{edge.name}:{k}") for edge in (rim, *ceiling)]
        gaps.append(tuple(loop))
    return SpringOutline(
        parameters=p,
        rim_outer=_circle("rim_outer", p.rim_outer_radius_m, +1),
        bore=_circle("bore", p.bore_radius_m, -1),
        coil_gaps=tuple(gaps),
        feet=ArmFeet(
            foot_theta=foot.theta,
            notch_theta=notch.theta,
            slit_theta=slit.theta,
            tip_theta=tip.theta,
        ),
    )


def _circle(name: str, radius_m: float, sense: int) -> Arc:
    return Arc(
        name=name,
        centre_m=(0.0, 0.0),
        radius_m=radius_m,
        start_rad=0.0,
        end_rad=sense * 2 * np.pi,
    )


def _coil_gap_edges(
    p: SpiralParameters, foot: Fillet, notch: Fillet, slit: Fillet, tip: Tip, advise: bool
) -> tuple[list[Edge], list[Edge], Arc, Arc]:
    """Coil gap 0: its floor (of the next arm, not yet turned), its ceiling, hub arc and rim arc."""
    line, half = p.centreline, p.thickness_m / 2
    shape = {"centreline": line, "taper": p.taper}
    outer = OffsetEdge(name="arm_outer", **shape, offset_m=half, start=foot.theta, end=slit.theta)
    inner = OffsetEdge(name="arm_inner", **shape, offset_m=-half, start=tip.theta, end=notch.theta)
    hub_start, rim_end = polar(notch.ring_point_m), polar(tip.ring_point_m)
    hub_sweep, rim_sweep = _ring_sweeps(p, foot, notch, slit, tip)
    _check_ring_arc(p, hub_sweep, p.hub_radius_m, "hub", "notch", advise)
    _check_ring_arc(p, rim_sweep, p.rim_inner_radius_m, "rim", "slit", advise)
    hub = Arc(
        name="hub",
        centre_m=(0.0, 0.0),
        radius_m=p.hub_radius_m,
        start_rad=hub_start,
        end_rad=hub_start + hub_sweep,
    )
    rim = Arc(
        name="rim_inner",
        centre_m=(0.0, 0.0),
        radius_m=p.rim_inner_radius_m,
        start_rad=rim_end + rim_sweep,
        end_rad=rim_end,
    )
    return [foot.arc, outer, slit.arc], [*tip.edges, inner, notch.arc], hub, rim


def _ring_sweeps(
    p: SpiralParameters, foot: Fillet, notch: Fillet, slit: Fillet, tip: Tip
) -> tuple[float, float]:
    """Angles of the free arcs of hub and rim, in [0, 2 pi); beyond one pitch they have crossed."""
    hub = polar(foot.ring_point_m) + p.pitch_rad - polar(notch.ring_point_m)
    rim = polar(slit.ring_point_m) + p.pitch_rad - polar(tip.ring_point_m)
    return float(np.mod(hub, 2 * np.pi)), float(np.mod(rim, 2 * np.pi))


def _fillets_fit(p: SpiralParameters) -> bool:
    """Whether all fillets find their place, on an arm that is longer than they are."""
    try:
        foot, notch = hub_fillet(p, side=+1), hub_fillet(p, side=-1)
        slit, tip = slit_fillet(p), arm_tip(p)
    except DesignError:
        return False
    free = max(foot.theta, notch.theta) < min(slit.theta, tip.theta)
    return free and all(
        0 < sweep < p.pitch_rad for sweep in _ring_sweeps(p, foot, notch, slit, tip)
    )


def _largest_fitting(p: SpiralParameters, name: str) -> str:
    """``name`` with the largest value below the present one at which the fillets fit, in mm."""
    high = getattr(p, name)
    low = next(
        (high * 0.8**k for k in range(1, 30) if _fillets_fit(replace(p, **{name: high * 0.8**k}))),
        None,
    )
    if low is None:
        return ""
    high = low / 0.8
    for _ in range(30):
        middle = (low + high) / 2
        fits = _fillets_fit(replace(p, **{name: middle}))
        low, high = (middle, high) if fits else (low, middle)
    return f"{name[:-2]}_mm below {low * 1e3:.4g} or "


def _check_ring_arc(
    p: SpiralParameters, sweep: float, radius_m: float, ring: str, end: str, advise: bool
) -> None:
    """A free arc of a ring must lie inside one pitch, or its two fillets have crossed."""
    if 0 < sweep < p.pitch_rad:
        return
    crossed = min(sweep - p.pitch_rad, 2 * np.pi - sweep) if p.n_arms > 1 else 2 * np.pi - sweep
    fewer = f"fewer than {p.n_arms} arms" if p.n_arms > 1 else "more room between the rings"
    raise DesignError(
        f"{p.text('fillet_radius_m')} does not fit: at the {ring} the {end} fillet runs"
        f" {crossed * radius_m * 1e3:.3g} mm past the next arm's;"
        f" {_largest_fitting(p, 'fillet_radius_m') if advise else ''}{fewer} would work"
    )


def _check_strip(p: SpiralParameters) -> None:
    line = p.centreline
    theta = np.linspace(line.start, line.end, 400)
    tightest = float(1 / np.max(line.curvature(theta)))
    thickest = p.thickness_range_m[1]
    if tightest <= thickest / 2 + p.fillet_radius_m:
        raise DesignError(
            f"{p.text('thickness_m')}: the strip folds onto itself where the centreline's radius"
            f" of curvature is {tightest * 1e3:.4g} mm; thickness_mm below"
            f" {2 * (tightest - p.fillet_radius_m) * 1e3:.4g} would work"
        )


def _check_arm(
    p: SpiralParameters, foot: Fillet, notch: Fillet, slit: Fillet, tip: Tip, advise: bool
) -> None:
    if max(foot.theta, notch.theta) >= min(slit.theta, tip.theta):
        raise DesignError(
            f"{p.text('turns')}: nothing of the arm is left between its fillets;"
            f" {_largest_fitting(p, 'hub_radius_m') if advise else ''}more turns would work"
        )
    if p.taper is None:
        return
    # fillets are tangent to parallel curves: they must stand where the thickness is constant
    feet = max(foot.theta, notch.theta), min(slit.theta, tip.theta)
    if not feet[0] < p.taper.start < p.taper.end < feet[1]:
        raise DesignError(
            f"{p.tapered_by}: a fillet reaches into the tapered part of the arm;"
            " more turns or a smaller hub_radius_mm would work"
        )


def coil_gap(p: SpiralParameters, theta: NDArray) -> NDArray:
    """Distance (m) from arm 0's inner edge to the next arm's outer edge, along the normal.

    ``theta`` is arm 0's parameter; the foot on the next centreline follows by Newton from the
    point one pitch behind. Negative where the arms overlap. Shape of ``theta``.
    """
    line, next_line = p.centreline, p.centreline.rotated(p.pitch_rad)
    point = line.point(theta)
    foot = np.maximum(theta - p.pitch_rad, 0.2 * line.start)
    for _ in range(30):
        away = point - next_line.point(foot)
        step = np.sum(away * next_line.tangent(foot), axis=-1)
        factor = 1 + next_line.curvature(foot) * np.sum(away * next_line.normal(foot), axis=-1)
        ahead = np.maximum(foot + step / (next_line.speed(foot) * factor), 0.02 * line.start)
        settled = np.all(np.abs(ahead - foot) <= _SETTLED_RAD)
        foot = ahead
        if settled:
            break
    centres = np.linalg.norm(point - next_line.point(foot), axis=-1)
    return centres - (p.thickness_at(theta) + p.thickness_at(foot)) / 2


def _check_arms_apart(p: SpiralParameters, foot: Fillet) -> None:
    """Neighbouring coils must leave a gap wherever one lies over the other."""
    line = p.centreline
    theta = np.arange(foot.theta + p.pitch_rad, line.end, 0.02)
    if theta.size == 0:
        return
    gap = coil_gap(p, theta)
    closest = int(np.argmin(gap))
    if gap[closest] <= 0:
        centres = gap[closest] + p.thickness_m
        raise DesignError(
            f"{p.text('thickness_m')}: neighbouring arms overlap by {-gap[closest] * 1e3:.4g} mm"
            f" at radius {float(line.radius(theta[closest])) * 1e3:.4g} mm; thickness_mm below"
            f" {centres * 1e3:.4g} or turns below"
            f" {p.turns * centres / p.thickness_m:.4g} would work"
        )
