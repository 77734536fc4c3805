"""Frame, notes and title block of a drawing."""

from math import sqrt

import numpy as np

from dftfs import __version__
from dftfs.cad.drawing_details import LETTERS
from dftfs.cad.drawing_pen import Pen, text
from dftfs.cad.drawing_sheet import Sheet, ShopData, scale_text
from dftfs.cad.fits import h7_m
from dftfs.design import SpringDesign
from dftfs.spring.centreline import ArchimedeanSpiral, FermatSpiral, LogarithmicSpiral
from dftfs.spring.parameters import SpiralParameters

_GLYPH = 0.68  # width of a character over its height
_SCALE, _SYMBOL_MM = "SCALE, SHEET", 20.0  # the row with the symbol of the projection, its width
_DETAILS = f"{min(LETTERS.values())} to {max(LETTERS.values())}"
# Ceratizit, Surface quality (DIN 4768): Ra 1.6 with Rz 10, 12.5 with 63: Rz is 5 to 6 times Ra
_RZ_OVER_RA, _BORE_RA_UM = 6.0, 1.6
_BREAKS_MM, _BREAK_COSTS = (0.2, 0.1, 0.05, 0.03, 0.02, 0.01), 0.005  # of the stiffness


def add_sheet(pen: Pen, design: SpringDesign, design_hash: str, shop: ShopData) -> None:
    """Frame, notes, title block with the symbol of the projection; their places are reserved."""
    space, sheet = pen.space, pen.sheet
    width, height = sheet.size_mm
    for inset in (0.0, 10.0):
        corners = [(inset, inset), (width - inset, inset)]
        corners += [(width - inset, height - inset), (inset, height - inset)]
        space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "SHEET"})
    big = sheet.letters
    lines = notes(design, shop)
    top = 12.0 + 4.6 * big * (len(lines) - 1)
    for k, line in enumerate(lines):
        text(space, line, (14.0, top - 4.6 * big * k), 2.4 * big)
    longest = max(len(line) for line in lines)
    pen.reserve((14.0, 12.0, 14.0 + _GLYPH * 2.4 * big * longest, top + 3 * big))
    _add_title_block(pen, title_block(design, design_hash, sheet, shop))


def _add_title_block(pen: Pen, rows: list[tuple[str, str]]) -> None:
    """The block's lines and texts; a value too long for its field is written smaller."""
    space, sheet, big = pen.space, pen.sheet, pen.sheet.letters
    left, right, bottom = 240 * sheet.factor, sheet.size_mm[0] - 10.0, 10.0
    step = 5.6 * big
    top = bottom + step * len(rows)
    frame = [(left, bottom), (right, bottom), (right, top), (left, top)]
    space.add_lwpolyline(frame, close=True, dxfattribs={"layer": "SHEET"})
    pen.reserve((left, bottom, right, top))
    split = left + 32 * big
    for k, (name, value) in enumerate(rows):
        base = top - (k + 1) * step
        space.add_line((left, base), (right, base), dxfattribs={"layer": "SHEET"})
        text(space, name, (left + 2, base + 1.4 * big), 2.2 * big)
        room = right - split - 4 - (_SYMBOL_MM * big if name == _SCALE else 0.0)
        high = min(2.5 * big, room / (_GLYPH * max(len(value), 1)))
        text(space, value, (split + 2, base + 1.4 * big), high)
        if name == _SCALE:
            _first_angle(pen, (right - 4 * big, base + step / 2), 4.4 * big)
    space.add_line((split, bottom), (split, top), dxfattribs={"layer": "SHEET"})


def _first_angle(pen: Pen, right_mm: tuple[float, float], large: float) -> None:
    """Symbol of ISO 5456-2: a frustum, its small end on the left, and on its right that end's view.

    ``large`` : diameter of the large end; the small one is half of it, the length as the large.
    """
    (x, y), lines = right_mm, {"layer": "SHEET"}
    circles, small = (x - large / 2, y), large / 2
    for diameter in (large, small):
        pen.space.add_circle(circles, diameter / 2, dxfattribs=lines)
    end = x - 1.5 * large
    start = end - large
    corners = [(start, y - small / 2), (end, y - large / 2), (end, y + large / 2)]
    corners.append((start, y + small / 2))
    pen.space.add_lwpolyline(corners, close=True, dxfattribs=lines)
    for a, b in (((start - 1, y), (end + 1, y)), ((x - large - 1, y), (x + 1, y))):
        pen.space.add_line(a, b, dxfattribs={"layer": "CENTRE"})
    tall = large / 2 + 0.5
    vertical = (circles[0], y - tall), (circles[0], y + tall)
    pen.space.add_line(*vertical, dxfattribs={"layer": "CENTRE"})


def edge_break_mm(design: SpringDesign) -> float:
    """The largest usual break of a strip's four edges that costs at most 0.5 % of its stiffness.

    Triangles of side c take 6 c^2 / (w t) of the second moment of a strip t thick and w wide.
    """
    p = design.spiral
    largest = 1e3 * sqrt(_BREAK_COSTS * design.width_m * p.thickness_range_m[0] / 6)
    return max((c for c in _BREAKS_MM if c <= largest), default=_BREAKS_MM[-1])


def notes(design: SpringDesign, shop: ShopData) -> list[str]:
    """What the views cannot say: the centreline's equation and how the part is to be made."""
    p, bore = design.spiral, 2 * design.spiral.bore_radius_m
    lines = [
        f"Arms: {design.n_arms}, each turned by {np.degrees(p.pitch_rad):g} degrees from the one"
        " before.",
        f"Centreline of an arm: {equation(design)}",
        _strip_note(p),
        f"Fillets at every arm's roots ({_DETAILS}); corner at the arm's tip R"
        f" {1e3 * p.tip_radius_m:.2f}.",
        "Datum A: lower face. Datum B: axis of the bore, H7:"
        f" {1e3 * bore:.3f} to {1e3 * (bore + h7_m(bore)):.3f}. Flatness of A 0.05.",
    ]
    if shop.profile_m is not None:
        lines.append(
            f"Profile of all cut edges but the bore (ISO 1660): {1e3 * shop.profile_m:.3f} to A, B,"
            " half to either side; their sizes in boxes are exact."
        )
    if shop.stiffness:
        lines.append(shop.stiffness)
    lines += [
        f"{_surface(shop)}; notches {_DETAILS} free of marks across the strip.",
        *_taper(shop),
        f"Edges broken {edge_break_mm(design):g} at most (ISO 13715); no burrs.",
        f"Temper before cutting: {shop.temper or 'as the material states'}; no heat after.",
    ]
    if shop.bolts:
        lines += [
            f"{bolt.where}: {bolt.count} holes D {1e3 * bolt.hole_m:.2f} H13 on D"
            f" {1e3 * bolt.circle_m:.2f}, position 0.1 to A, B, first"
            " on the right-hand centre line; not in the files."
            for bolt in shop.bolts
        ]
    else:
        lines.append("No fastening holes: hub and rim are drilled with their mating parts.")
    lines.append("A bearing must hold the rim. Cut from the DXF or STEP; this sheet inspects.")
    return ["NOTES", *(f"{k}  {line}" for k, line in enumerate(lines, start=1))]


def _surface(shop: ShopData) -> str:
    """Roughness of the cut edges, and of the bore where the process cuts too roughly for a fit."""
    if shop.roughness_um is None:
        return f"Cut edges Ra {_BORE_RA_UM:g}"
    average = shop.roughness_um / _RZ_OVER_RA
    bore = f", bore Ra {_BORE_RA_UM:g}" if average > 1.1 * _BORE_RA_UM else ""
    return f"Cut edges Ra {average:.2g} (Rz {shop.roughness_um:g}) at most{bore}"


def _taper(shop: ShopData) -> list[str]:
    """What the cut's taper is and whether the profile has room for it."""
    least, most = (1e3 * value for value in shop.taper_m)
    if not most:
        return []
    line = f"Taper of the cut through the width {least:g} to {most:g} by {shop.process},"
    zone = shop.profile_m
    if zone is not None and most > 1e3 * zone:
        return [f"{line} more than the profile allows: correct it."]
    return [f"{line} within the profile."]


def _strip_note(p: SpiralParameters) -> str:
    ends = f"R {1e3 * p.inner_radius_m:.2f} to R {1e3 * p.outer_radius_m:.2f}"
    if p.taper is None:
        return f"Strip: parallel curves at +- half its thickness, {ends}."
    line = p.centreline
    thickness = 1e3 * p.thickness_at(np.linspace(line.start, line.end, 400))
    return (
        f"Strip: {thickness[0]:.2f} thick at the hub, {thickness[-1]:.2f} at the rim,"
        f" {np.min(thickness):.2f} to {np.max(thickness):.2f} between, {ends}: see the DXF."
    )


def equation(design: SpringDesign) -> str:
    """The centreline over the polar angle from where it leaves the hub, in mm and rad."""
    line = design.spiral.centreline
    inner, turns = 1e3 * line.inner_radius_m, line.turns
    span = f"0 <= t <= {2 * np.pi * turns:.5f} rad ({turns:g} turns)"
    if design.spiral.centreline_offset_m:
        most = 1e3 * max(abs(offset) for offset in design.spiral.centreline_offset_m)
        span += f", and an offset of at most {most:.2f} mm: see the DXF"
    if isinstance(line, FermatSpiral):
        return f"r = sqrt({inner**2:.4f} + {(1e3 * line.scale_m) ** 2:.4f} t) mm, {span}"
    if isinstance(line, ArchimedeanSpiral):
        return f"r = {inner:.4f} + {1e3 * line.pitch_m:.5f} t mm, {span}"
    if isinstance(line, LogarithmicSpiral):
        return f"r = {inner:.4f} exp({line.growth_per_rad:.6f} t) mm, {span}"
    return span


def _tolerances(shop: ShopData) -> str:
    """What holds for a size without limits of its own."""
    if shop.profile_m is None:
        return "as stated; ISO 2768-mK for lengths without one; (): auxiliary"
    return "as stated, ISO 8015; boxed: exact (ISO 1101); (): auxiliary"


def title_block(
    design: SpringDesign, design_hash: str, sheet: Sheet, shop: ShopData
) -> list[tuple[str, str]]:
    """Names and values of the title block, top to bottom."""
    material = design.material
    views = f"{scale_text(sheet.scale)} (details {scale_text(sheet.detail_scale)})"
    return [
        ("PART", f"{design.name}: flat torsion spring, {design.n_arms} arms"),
        ("NUMBER, REV.", f"{shop.part_number or design.name}, {shop.revision}"),
        ("DRAWN", ", ".join(part for part in (shop.date, shop.author) if part)),
        ("APPROVED", "date:                              name:"),
        ("MATERIAL", f"{material.name}: {material.alloy or material.description}"),
        ("PROCESS", shop.process or "-"),
        ("MASS", f"{design.mass_kg * 1e3:.1f} g"),
        (_SCALE, f"{views}, {sheet.name}, mm, first angle"),
        ("TOLERANCES", _tolerances(shop)),
        ("DESIGN", design_hash),
        ("MADE BY", f"dftfs {__version__}"),
    ]
