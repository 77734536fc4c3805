"""The details of a drawing: the fillets of an arm's roots, enlarged and dimensioned.

The letters are the last of the alphabet: A and B are the datums.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dftfs.cad.drawing_pen import LINES, Pen, text
from dftfs.cad.drawing_sheet import Sheet, place, scale_text
from dftfs.design import SpringDesign
from dftfs.spring.edges import Arc, Edge

LETTERS = {"notch": "W", "foot": "X", "slit": "Y", "tip": "Z"}  # fillet to detail
_ON_ARC = np.linspace(0.2, 0.8, 13)  # of an arc: where its leader may end
_DISTANCES = np.linspace(0.1, 0.8, 15)  # of the detail's radius, from the arc to the text
_ROUND = np.radians(np.arange(0, 360, 10))
_CHORD_MM = 0.4  # of paper: an edge in a detail
_HELD = 0.97  # of a detail's radius: what its texts keep within
_NARROW = 1.3  # widths of a text: a slit that is narrower has it outside
_CLEAR_MM = 0.6  # least distance of a letter to a line


@dataclass(frozen=True, kw_only=True)
class Detail:
    """A detail: its letter, the fillet it is centred on, where it stands."""

    letter: str
    name: str
    fillet: Arc
    spot_mm: tuple[float, float]

    @property
    def centre_m(self) -> NDArray:
        """Centre of the fillet."""
        return np.asarray(self.fillet.centre_m)

    @property
    def bisector(self) -> NDArray:
        """Unit vector from the fillet's centre to the middle of its arc."""
        return (self.fillet.point(0.5) - self.centre_m) / self.fillet.radius_m


def details(design: SpringDesign, sheet: Sheet) -> tuple[Detail, ...]:
    """Hub roots of arm 0, and the end of the slit with the tip of the arm beside it."""
    edges = {edge.name: edge for edge in design.outline.coil_gaps[0]}
    return tuple(
        Detail(letter=letter, name=name, fillet=edges[f"{name}_fillet:0"], spot_mm=spot)
        for (name, letter), spot in zip(LETTERS.items(), sheet.spots_mm)
    )


def draw_detail(pen: Pen, design: SpringDesign, detail: Detail) -> None:
    """The ring in the front view, and the detail with the radius of its fillet."""
    space, sheet = pen.space, pen.sheet
    scale, radius = sheet.detail_scale, sheet.detail_radius_mm
    where = place(detail.centre_m[None], sheet.front_mm, sheet.scale)[0]
    _ring(pen, detail.letter, where, radius * sheet.scale / scale)
    space.add_circle(detail.spot_mm, radius, dxfattribs=LINES)
    x, y = detail.spot_mm
    title = f"{detail.letter} ({scale_text(scale)})"
    text(space, title, (x - 8, y + radius + 2), 4.0 * sheet.letters)
    for loop in (*design.outline.coil_gaps, (design.outline.rim_outer,), (design.outline.bore,)):
        for edge in loop:
            for run in _inside(edge, detail, sheet):
                space.add_lwpolyline(run, dxfattribs={"layer": "OUTLINE"})
                pen.drawn(run)
    if detail.name == "slit":
        _slit_width(pen, detail)
    _fillet_radius(pen, detail)


def _ring(pen: Pen, letter: str, where: NDArray, seen: float) -> None:
    """A detail's ring in the front view; its letter beside it where no line runs, else outside."""
    high = 3.5 * pen.sheet.letters
    size = 0.8 * high, high
    pen.space.add_circle(tuple(where), seen, dxfattribs=LINES)
    ring = np.column_stack([np.cos(_ROUND), np.sin(_ROUND)])
    pen.drawn(where + seen * ring)
    spots = np.concatenate([where + (seen + far * high) * ring for far in (0.9, 1.1, 1.4)])
    clear = pen.clearance_mm(spots, size)
    spot = spots[np.argmax(clear)]
    if np.max(clear) < _CLEAR_MM * pen.sheet.letters:
        spot = _outside(pen, where, size)
        toward = (spot - where) / np.linalg.norm(spot - where)
        ends = where + seen * toward, spot - 0.7 * high * toward
        pen.space.add_line(*map(tuple, ends), dxfattribs=LINES)
        pen.drawn(ends)
    corner = spot - np.array(size) / 2
    text(pen.space, letter, tuple(corner), high)
    pen.reserve((*corner, *(corner + size)))


def _outside(pen: Pen, where: NDArray, size: tuple[float, float]) -> NDArray:
    """The clearest place beyond the rim near the direction of a ring."""
    out, half = where - pen.sheet.front_mm, np.array(size) / 2
    middle = np.arctan2(out[1], out[0])
    rim = pen.rim_mm + 1.6 * size[1]
    angles = middle + np.radians([0, 5, -5, 10, -10, 15, -15, 20, -20, 30, -30, 40, -40])
    spots = np.asarray(pen.sheet.front_mm) + rim * np.column_stack([np.cos(angles), np.sin(angles)])
    free = [spot for spot in spots if pen.is_free((*(spot - half), *(spot + half)))]
    return free[0] if free else spots[0]


def _fillet_radius(pen: Pen, detail: Detail) -> None:
    """The radius: an arrow that ends on its arc, its text where there is most room around it."""
    scale = pen.sheet.detail_scale
    spot, radius = np.asarray(detail.spot_mm), 1e3 * detail.fillet.radius_m * scale
    away = (detail.fillet.point(_ON_ARC) - detail.centre_m) / detail.fillet.radius_m
    knee = _roomiest(pen, detail, spot + radius * away, away, "R0.5")
    away = (knee - spot) / np.linalg.norm(knee - spot)
    made = pen.space.add_radius_dim(
        center=tuple(spot),
        radius=radius,
        angle=float(np.degrees(np.arctan2(away[1], away[0]))),
        location=tuple(knee),
        **pen.options(scale, "EZ_RADIUS"),
    )
    pen.keep(f"{detail.name} fillet radius", made, scale, boxed=True)


def _roomiest(pen: Pen, detail: Detail, starts: NDArray, away: NDArray, content: str) -> NDArray:
    """Where a leader from a start (n, 2) in its direction has most room for a text, in the ring.

    On the middle one and near it, across the ring, if no place in the ring holds the text.
    """
    ring, (width, height) = pen.sheet.detail_radius_mm, pen.size_of(content)
    knees = np.concatenate([starts + far * ring * away for far in _DISTANCES])
    side = np.where(np.tile(away[:, 0], len(_DISTANCES)) < 0, -1, 1)
    middles = knees + np.column_stack([side * width / 2, np.full(len(side), height / 2)])
    corners = np.abs(middles - detail.spot_mm) + np.array([width, height]) / 2
    held = np.hypot(*corners.T) <= _HELD * ring
    if not np.any(held):
        return knees[len(starts) // 2]
    knees, middles = knees[held], middles[held]
    return knees[np.argmax(pen.clearance_mm(middles, (width, height)))]


def _slit_width(pen: Pen, detail: Detail) -> None:
    """Width of the slit where its fillet ends it: twice that radius, across the bisector."""
    scale, ring = pen.sheet.detail_scale, pen.sheet.detail_radius_mm
    spot, radius = np.asarray(detail.spot_mm), 1e3 * detail.fillet.radius_m * scale
    across = np.array([-detail.bisector[1], detail.bisector[0]])
    across = across if across[0] > 0 else -across  # so that the text stands upright
    ends = spot - radius * across, spot + radius * across
    base = spot - (radius + 0.15 * ring) * detail.bisector
    made = pen.space.add_linear_dim(
        base=tuple(base),
        p1=tuple(ends[0]),
        p2=tuple(ends[1]),
        angle=float(np.degrees(np.arctan2(across[1], across[0]))),
        **pen.options(scale),
    )
    content = f"{2e3 * detail.fillet.radius_m:g}"
    if 2 * radius < _NARROW * pen.size_of(content)[0]:  # its text beside the slit
        away = np.array([across, -across])
        knee = _roomiest(pen, detail, base + radius * away, away, content)
        made.set_location(tuple(knee + _half_text(pen, content, knee - base)), leader=True)
    pen.keep("slit width", made, scale, boxed=True)


def _half_text(pen: Pen, content: str, toward: NDArray) -> NDArray:
    """From a leader's knee to the middle of its text."""
    width, height = pen.size_of(content)
    return np.array([np.copysign(width / 2, toward[0]), height / 2])


def _inside(edge: Edge, detail: Detail, sheet: Sheet) -> list[NDArray]:
    """Runs of an edge's points inside a detail's circle, where the detail is drawn."""
    count = max(16, int(np.ceil(1e3 * edge.length_m * sheet.detail_scale / _CHORD_MM)))
    points = edge.point(np.linspace(0, 1, count + 1))
    near = (
        np.hypot(*(points - detail.centre_m).T)
        <= 1e-3 * sheet.detail_radius_mm / sheet.detail_scale
    )
    placed = place(points - detail.centre_m, detail.spot_mm, sheet.detail_scale)
    breaks = np.flatnonzero(np.diff(near.astype(int))) + 1
    parts = zip(np.split(placed, breaks), np.split(near, breaks))
    return [part for part, kept in parts if kept[0] and len(part) > 1]
