"""One cyclic sector of the outline cut into a hub block, an arm block and a rim block.

The sector of arm 0 reaches from the middle of one free hub and rim arc to the middle of the next;
its two cuts are radial lines that a turn by one pitch maps onto each other. The arm between the
roots is a plain strip (meshed as a grid); the roots, with their notches, are not.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dftfs.errors import DesignError
from dftfs.spring.edges import Arc, Edge, OffsetEdge, Segment
from dftfs.spring.fillets import polar
from dftfs.spring.outline import SpringOutline

CROSS_SECTION = "cross_section"
_ROOT = 1.2  # thicknesses of the strip that belong to a root block, beside its fillets


@dataclass(frozen=True, kw_only=True)
class MeshSizing:
    """How fine the planar mesh is; every number is of the mesh that is solved on.

    across : even number of elements across the strip.
    along : element length along the arm over the strip's thickness.
    fillet : elements per fillet radius at the notch, foot and slit fillets.
    growth : increase of element size per distance from a fillet.
    ring : element size in hub and rim over the strip's thickness.
    """

    across: int = 2
    along: float = 0.6
    fillet: float = 6.0
    growth: float = 0.35
    ring: float = 0.5

    def __post_init__(self) -> None:
        if self.across < 2 or self.across % 2:
            raise DesignError(f"across = {self.across} must be an even number, 2 or more")
        for name in ("along", "fillet", "growth", "ring"):
            if not getattr(self, name) > 0:
                raise DesignError(f"mesh sizing: {name} = {getattr(self, name)} must be positive")

    def finer(self, factor: float) -> "MeshSizing":
        """The same grading with every size divided by ``factor`` (``across`` to the next even)."""
        return replace(
            self,
            across=max(2, 2 * round(self.across * factor / 2)),
            along=self.along / factor,
            fillet=self.fillet * factor,
            ring=self.ring / factor,
        )


@dataclass(frozen=True, kw_only=True)
class SectorBlocks:
    """Closed loops of the hub and rim blocks, and the arm's cross-section parameters between.

    A block has one loop, or two (an outer and a hole) where one arm is the whole spring.
    """

    hub_loops: tuple[tuple[Edge, ...], ...]
    rim_loops: tuple[tuple[Edge, ...], ...]
    arm_start: float
    arm_end: float


def sector_blocks(outline: SpringOutline) -> SectorBlocks:
    """Cut arm 0's sector out of the outline.

    Raises
    ------
    DesignError
        If the arm is too short to leave a strip between its roots.
    """
    p, feet = outline.parameters, outline.feet
    line = p.centreline
    fillets = 2 * p.fillet_radius_m
    arm_start = feet.notch_theta + (_ROOT * p.thickness_m + fillets) / float(
        line.speed(feet.notch_theta)
    )
    arm_end = feet.slit_theta - (_ROOT * p.thickness_at_rim_m + fillets) / float(
        line.speed(feet.slit_theta)
    )
    if arm_end - arm_start < 0.1:
        raise DesignError(
            f"{p.text('turns')}: the free arm is too short to mesh; turns above"
            f" {p.turns + (0.1 + arm_start - arm_end) / (2 * np.pi):.3g} would work"
        )
    # coil gap -1 carries the foot and slit of arm 0; it is gap n-1 turned back by a full circle
    before = {e.name.split(":")[0]: e.rotated(-p.pitch_rad, e.name) for e in outline.coil_gaps[0]}
    after = {e.name.split(":")[0]: e for e in outline.coil_gaps[0]}
    hub_cut = _middle_angle(before["hub"])
    rim_cut = _middle_angle(before["rim_inner"])
    return SectorBlocks(
        hub_loops=_opened(p.n_arms, _hub_loop(outline, before, after, arm_start, hub_cut)),
        rim_loops=_opened(p.n_arms, _rim_loop(outline, before, after, arm_end, rim_cut)),
        arm_start=arm_start,
        arm_end=arm_end,
    )


def _opened(n_arms: int, loop: tuple[Edge, ...]) -> tuple[tuple[Edge, ...], ...]:
    """The loop as it is; for one arm, whose two cuts coincide, the two rings without the cuts."""
    if n_arms > 1:
        return (loop,)
    ring = tuple(edge for edge in loop if edge.name in ("bore", "rim_outer"))
    rest = tuple(edge for edge in loop if edge not in ring and not edge.name.startswith("cut_"))
    return (rest, ring)


def _middle_angle(arc: Edge) -> float:
    return polar(arc.point(0.5))


def _radial(name: str, angle: float, start_m: float, end_m: float) -> Segment:
    ray = np.array([np.cos(angle), np.sin(angle)])
    start, end = start_m * ray, end_m * ray
    return Segment(
        name=name, start_m=(float(start[0]), float(start[1])), end_m=(float(end[0]), float(end[1]))
    )


def _ring_arc(name: str, radius_m: float, start: float, end: float) -> Arc:
    return Arc(name=name, centre_m=(0.0, 0.0), radius_m=radius_m, start_rad=start, end_rad=end)


def _part(arc: Arc, start: float, end: float, name: str) -> Arc:
    sweep = arc.end_rad - arc.start_rad
    return replace(
        arc,
        name=name,
        start_rad=arc.start_rad + start * sweep,
        end_rad=arc.start_rad + end * sweep,
    )


def _cross_section(outline: SpringOutline, theta: float, *, outwards: bool) -> Segment:
    line, half = outline.parameters.centreline, outline.parameters.thickness_at(theta) / 2
    inner = line.point(theta) - half * line.normal(theta)
    outer = line.point(theta) + half * line.normal(theta)
    start, end = (inner, outer) if outwards else (outer, inner)
    return Segment(
        name=CROSS_SECTION,
        start_m=(float(start[0]), float(start[1])),
        end_m=(float(end[0]), float(end[1])),
    )


def _trim(edge: Edge, start: float | None, end: float | None, name: str) -> OffsetEdge:
    return replace(
        edge,
        name=name,
        start=edge.start if start is None else start,
        end=edge.end if end is None else end,
    )


def _hub_loop(
    outline: SpringOutline, before: dict, after: dict, arm_start: float, cut: float
) -> tuple[Edge, ...]:
    p = outline.parameters
    high = cut + p.pitch_rad
    bore = _ring_arc("bore", p.bore_radius_m, high, cut)
    return (
        _radial("cut_low", cut, p.bore_radius_m, p.hub_radius_m),
        _part(before["hub"], 0.5, 1.0, "hub"),
        replace(before["foot_fillet"], name="foot_fillet"),
        _trim(before["arm_outer"], None, arm_start, "arm_outer"),
        _cross_section(outline, arm_start, outwards=False),
        _trim(after["arm_inner"], arm_start, None, "arm_inner"),
        replace(after["notch_fillet"], name="notch_fillet"),
        _part(after["hub"], 0.0, 0.5, "hub"),
        _radial("cut_high", high, p.hub_radius_m, p.bore_radius_m),
        bore,
    )


def _rim_loop(
    outline: SpringOutline, before: dict, after: dict, arm_end: float, cut: float
) -> tuple[Edge, ...]:
    p = outline.parameters
    high = cut + p.pitch_rad
    rim_outer = _ring_arc("rim_outer", p.rim_outer_radius_m, cut, high)
    tip = [
        replace(after[name], name=name)
        for name in ("tip_fillet", "tip_face", "tip_round")
        if name in after
    ]
    return (
        _cross_section(outline, arm_end, outwards=True),
        _trim(before["arm_outer"], arm_end, None, "arm_outer"),
        replace(before["slit_fillet"], name="slit_fillet"),
        _part(before["rim_inner"], 0.0, 0.5, "rim_inner"),
        _radial("cut_low", cut, p.rim_inner_radius_m, p.rim_outer_radius_m),
        rim_outer,
        _radial("cut_high", high, p.rim_outer_radius_m, p.rim_inner_radius_m),
        _part(after["rim_inner"], 0.5, 1.0, "rim_inner"),
        *tip,
        _trim(after["arm_inner"], None, arm_end, "arm_inner"),
    )


def size_at(
    outline: SpringOutline, loops: tuple[tuple[Edge, ...], ...], sizing: MeshSizing
) -> Callable[[NDArray], NDArray]:
    """Element size (m) as a function of position, small at the block's fillets.

    The tip's fillet and rounding carry little stress: half as fine.
    """
    p = outline.parameters
    fine = {"notch_fillet": 1.0, "foot_fillet": 1.0, "slit_fillet": 1.0, "tip_fillet": 0.5}
    sources, sizes = [], []
    for edge in (edge for loop in loops for edge in loop):
        if edge.name in fine:
            points = edge.point(np.linspace(0, 1, 24))
            sources.append(points)
            sizes.append(np.full(len(points), edge.radius_m / (sizing.fillet * fine[edge.name])))
        elif edge.name == "tip_round":
            sources.append(edge.point(np.linspace(0, 1, 5)))
            sizes.append(np.full(5, 0.8 * edge.radius_m))
    centres, base = np.concatenate(sources), np.concatenate(sizes)
    largest = sizing.ring * p.thickness_m

    def size(points: NDArray) -> NDArray:
        distance = np.linalg.norm(points[:, None] - centres[None], axis=2)
        return np.minimum(largest, np.min(base + sizing.growth * distance, axis=1))

    return size
