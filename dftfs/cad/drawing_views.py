"""The front view and the side view of a drawing, with their dimensions and datums.

First angle: the side view, seen from the left, stands on the right; the lower face, z = 0 of the
STEP file, is its left edge.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dftfs.cad.drawing_pen import Box, Pen
from dftfs.cad.drawing_sheet import ShopData, place
from dftfs.cad.fits import h7_m
from dftfs.cad.profile import arc_loop, outline_loops
from dftfs.design import SpringDesign
from dftfs.spring.edges import Arc
from dftfs.spring.outline import coil_gap

_TOLERANCE_M = 2e-6
# from the centre to where the sheet has room for a long text: below the rim, on the left
_ROOM_FOR_THICKNESS = np.array([np.cos(np.radians(224)), np.sin(np.radians(224))])
_DATUM_MM = 10.0  # height of a datum symbol
_NEAR_ENDS = 0.1  # of an arc, where no arrow ends
_SEARCH = np.linspace(0, 1, 181)
_ASIDE_DEG = sorted(range(-60, 61, 2), key=abs)
_BEYOND_MM = np.arange(6.0, 30.0, 2.0)


def draw_front(pen: Pen, design: SpringDesign, shop: ShopData) -> None:
    """Outline, centre lines and holes of the front view."""
    sheet, outline = pen.sheet, design.outline
    for name, edges in outline_loops(outline):
        loop = arc_loop(name, edges, _TOLERANCE_M)
        placed = place(loop.vertices_m, sheet.front_mm, sheet.scale)
        points = np.column_stack([placed, loop.bulges])
        pen.space.add_lwpolyline(points, format="xyb", close=True, dxfattribs={"layer": "OUTLINE"})
        for edge in edges:
            count = max(2, int(1e3 * edge.length_m * sheet.scale))
            pen.drawn(place(edge.point(np.linspace(0, 1, count)), sheet.front_mm, sheet.scale))
    (x, y), reach = sheet.front_mm, pen.rim_mm + 5
    for ends in (((x - reach, y), (x + reach, y)), ((x, y - reach), (x, y + reach))):
        pen.space.add_line(*ends, dxfattribs={"layer": "CENTRE"})
        pen.drawn(ends)
    _holes(pen, shop)


def dimension_front(pen: Pen, design: SpringDesign, shop: ShopData) -> None:
    """Diameters, thickness and gap, where the other views leave room for their texts."""
    _diameters(pen, design)
    _strip_and_gap(pen, design, shop)


def draw_side(pen: Pen, design: SpringDesign, shop: ShopData) -> None:
    """Side view with the width and datum A on the lower face."""
    sheet, rim = pen.sheet, pen.rim_mm
    width = 1e3 * sheet.scale * design.width_m
    x, y = sheet.side_mm, sheet.front_mm[1]
    corners = [(x, y - rim), (x + width, y - rim), (x + width, y + rim), (x, y + rim)]
    pen.space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "OUTLINE"})
    pen.space.add_line((x - 4, y), (x + width + 4, y), dxfattribs={"layer": "CENTRE"})
    pen.reserve((x - 4, y - rim, x + width + 4, y + rim))
    made = pen.space.add_linear_dim(
        base=(x, y + rim + 9),
        p1=corners[3],
        p2=corners[2],
        **pen.options(sheet.scale, post=_either(shop.width_tolerance_m)),
    )
    pen.keep("width", made, sheet.scale)
    pen.datum("A", (x, y + 0.8 * rim), (-1.0, 0.0))


def _holes(pen: Pen, shop: ShopData) -> None:
    """Fastening holes with their circle; the note gives their sizes."""
    sheet, centre = pen.sheet, np.array(pen.sheet.front_mm)
    for bolt in shop.bolts:
        radius = 1e3 * sheet.scale * bolt.circle_m / 2
        pen.space.add_circle(tuple(centre), radius, dxfattribs={"layer": "CENTRE"})
        around = np.linspace(0, 2 * np.pi, 361)
        ring = np.column_stack([np.cos(around), np.sin(around)])
        pen.drawn(centre + radius * ring)
        for k in range(bolt.count):
            angle = 2 * np.pi * k / bolt.count
            spot = centre + radius * np.array([np.cos(angle), np.sin(angle)])
            hole = 1e3 * sheet.scale * bolt.hole_m / 2
            pen.space.add_circle(tuple(spot), hole, dxfattribs={"layer": "OUTLINE"})
            pen.drawn(spot + hole * ring)


def _arcs(design: SpringDesign, name: str) -> list[Arc]:
    """The arcs of hub or rim that are part of the outline, one of each gap."""
    edges = (edge for gap in design.outline.coil_gaps for edge in gap)
    return [edge for edge in edges if edge.name.startswith(f"{name}:")]


def _diameters(pen: Pen, design: SpringDesign) -> None:
    """The four circles; every arrow ends on an arc that is there."""
    p, outline, sheet = design.spiral, design.outline, pen.sheet
    bore = 2 * p.bore_radius_m
    h7 = f"<> H7 (+{1e3 * h7_m(bore):.3f} / 0)"
    sizes = {
        "rim outside diameter": (p.rim_outer_radius_m, [outline.rim_outer], 75.0, "<>"),
        "rim inside diameter": (p.rim_inner_radius_m, _arcs(design, "rim_inner"), 105.0, "<>"),
        "bore diameter": (p.bore_radius_m, [outline.bore], 300.0, h7),
        "hub diameter": (p.hub_radius_m, _arcs(design, "hub"), 245.0, "<>"),
    }
    for name, (radius_m, arcs, wanted, post) in sizes.items():
        is_bore = name == "bore diameter"
        content = post.replace("<>", f"D{2e3 * radius_m:g}")
        below = _DATUM_MM * sheet.letters if is_bore else 0.0
        angle = _free_angle(pen, arcs, wanted, pen.size_of(content), below)
        away = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
        made = pen.space.add_diameter_dim(
            center=sheet.front_mm,
            radius=1e3 * sheet.scale * radius_m,
            angle=angle,
            location=tuple(np.asarray(sheet.front_mm) + (pen.rim_mm + 11 * sheet.factor) * away),
            **pen.options(sheet.scale, "EZ_RADIUS", post),
        )
        landing = pen.keep(name, made, sheet.scale, boxed=not is_bore)
        if is_bore and landing is not None:  # on the line of the size: the datum is the axis
            pen.datum("B", landing[0] + 0.5 * (landing[1] - landing[0]), (0.0, -1.0))


def _free_angle(
    pen: Pen, arcs: Sequence[Arc], wanted_deg: float, size: tuple[float, float], below: float
) -> float:
    """The angle nearest to the one wanted that ends on an arc and leaves its text room."""
    shares = _NEAR_ENDS + (1 - 2 * _NEAR_ENDS) * _SEARCH
    angles = np.degrees(
        np.concatenate([a.start_rad + shares * (a.end_rad - a.start_rad) for a in arcs])
    )
    off = np.abs((angles - wanted_deg + 180) % 360 - 180)
    sorted_angles = angles[np.argsort(off, kind="stable")] % 360
    reach, (width, height) = pen.rim_mm + 11 * pen.sheet.factor, size
    centre = np.asarray(pen.sheet.front_mm)
    for angle in sorted_angles:
        away = np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
        x, y = centre + reach * away
        left = x if away[0] >= 0 else x - width
        box = (left, y - below, left + width, y + height)
        clear = pen.is_free(box) and _clear_of_rim(pen, box)
        if clear and not pen.crosses(centre, centre + reach * away):
            return float(angle)
    return float(sorted_angles[0])


def _clear_of_rim(pen: Pen, box: Box) -> bool:
    """Whether a box lies outside the rim."""
    centre = np.asarray(pen.sheet.front_mm)
    nearest = np.clip(centre, box[:2], box[2:])
    return bool(np.hypot(*(nearest - centre)) > pen.rim_mm + 2)


def _either(tolerance_m: float | None) -> str:
    """A size with its tolerance either way."""
    return "<>" if tolerance_m is None else f"<> %%p{1e3 * tolerance_m:.3f}"


def _strip_and_gap(pen: Pen, design: SpringDesign, shop: ShopData) -> None:
    """Thickness across the strip, and the narrowest gap between coils, where they are."""
    line = design.spiral.centreline
    sweep = line.start + np.linspace(0.2, 0.8, 601) * (line.end - line.start)
    away = np.array([point / np.linalg.norm(point) for point in map(line.point, sweep)])
    theta = float(sweep[np.argmax(away @ _ROOM_FOR_THICKNESS)])
    half = float(design.spiral.thickness_at(theta)) / 2
    point, normal = line.point(theta), line.normal(theta)
    ends = point - half * normal, point + half * normal
    _across(pen, "strip thickness", *ends, _either(shop.thickness_tolerance_m))
    angles = np.arange(line.start + design.spiral.pitch_rad, line.end, 1e-3)
    if angles.size:
        gap = coil_gap(design.spiral, angles)
        theta = float(angles[np.argmin(gap)])
        half = float(design.spiral.thickness_at(theta)) / 2
        foot = line.point(theta) - half * line.normal(theta)
        over = foot - float(np.min(gap)) * line.normal(theta)
        _across(pen, "smallest gap between coils", foot, over, "(<>)")


def _across(pen: Pen, name: str, start_m: NDArray, end_m: NDArray, post: str) -> None:
    """A dimension across a strip or a gap, its text beyond the rim."""
    sheet = pen.sheet
    a, b = place(np.array([start_m, end_m]), sheet.front_mm, sheet.scale)
    if b[0] < a[0]:  # so that the text stands upright
        a, b = b, a
    along = (b - a) / np.linalg.norm(b - a)
    made = pen.space.add_linear_dim(
        base=tuple(b),
        p1=tuple(a),
        p2=tuple(b),
        angle=float(np.degrees(np.arctan2(along[1], along[0]))),
        **pen.options(sheet.scale, post=post),
    )
    content = post.replace("%%p", "+").replace("<>", f"{1e3 * np.linalg.norm(end_m - start_m):.3f}")
    spot = _beyond_rim(pen, (a + b) / 2, pen.size_of(content))
    made.set_location(tuple(spot), leader=True)
    pen.keep(name, made, sheet.scale)


def _beyond_rim(pen: Pen, start: NDArray, size: tuple[float, float]) -> NDArray:
    """The centre of a free place beyond the rim for a text whose leader starts at a point."""
    toward = start - np.asarray(pen.sheet.front_mm)
    middle, half = np.degrees(np.arctan2(toward[1], toward[0])), np.asarray(size) / 2
    spots = [
        np.asarray(pen.sheet.front_mm)
        + (pen.rim_mm + beyond * pen.sheet.factor)
        * np.array([np.cos(np.radians(middle + aside)), np.sin(np.radians(middle + aside))])
        for aside in _ASIDE_DEG
        for beyond in _BEYOND_MM
    ]
    for spot in spots:
        box = (*(spot - half), *(spot + half))
        if pen.is_free(box) and _clear_of_rim(pen, box) and not pen.crosses(start, spot):
            return spot
    return spots[0]
