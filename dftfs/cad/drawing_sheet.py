"""The drawing's sheet: frame, notes, table of the centreline, title block, where views stand."""

from dataclasses import dataclass

import numpy as np
from ezdxf.document import Drawing
from ezdxf.enums import TextEntityAlignment
from numpy.typing import NDArray

from dftfs import __version__
from dftfs.design import SpringDesign
from dftfs.spring.centreline import ArchimedeanSpiral, FermatSpiral, LogarithmicSpiral

SHEET_MM = (420.0, 297.0)
_BLOCK_MM = (240.0, 10.0, 410.0, 62.0)  # title block: left, bottom, right, top
_NOTES_MM = (14.0, 70.0)


@dataclass(frozen=True, kw_only=True)
class DetailStyle:
    """Scale of the details and the radius of their circles on the sheet."""

    scale: float
    radius_mm: float


DETAIL = DetailStyle(scale=5.0, radius_mm=33.0)


@dataclass(frozen=True, kw_only=True)
class Detail:
    """A detail: what it is centred on, where it stands, the fillets dimensioned in it."""

    letter: str
    centre_m: NDArray
    spot_mm: tuple[float, float]
    fillets: tuple[tuple[str, NDArray], ...]

    def reach_deg(self, design: SpringDesign, name: str) -> float:
        """Angle from a fillet's centre to the middle of its arc."""
        edge = design.outline.edge(f"{name}_fillet:0")
        away = edge.point(0.5) - np.asarray(edge.centre_m)
        return float(np.degrees(np.arctan2(away[1], away[0])))


def place(points_m: NDArray, origin_mm: tuple[float, float], scale: float = 1.0) -> NDArray:
    """Points of the part (n, 2) on the sheet, in mm."""
    return np.asarray(origin_mm) + 1e3 * scale * np.asarray(points_m)


def text(space, words: str, at: tuple[float, float], height: float) -> None:
    """A line of text on the sheet's layer, its lower left corner at a point."""
    line = space.add_text(words, height=height, dxfattribs={"layer": "SHEET"})
    line.set_placement(at, align=TextEntityAlignment.BOTTOM_LEFT)


def add_sheet(document: Drawing, design: SpringDesign, design_hash: str) -> None:
    """Frame, notes and title block."""
    space, (width, height) = document.modelspace(), SHEET_MM
    for inset in (0.0, 10.0):
        corners = [(inset, inset), (width - inset, inset)]
        corners += [(width - inset, height - inset), (inset, height - inset)]
        space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "SHEET"})
    x, y = _NOTES_MM
    for k, line in enumerate(notes(design)):
        text(space, line, (x, y - 5.2 * k), 2.6)
    left, bottom, right, top = _BLOCK_MM
    frame = [(left, bottom), (right, bottom), (right, top), (left, top)]
    space.add_lwpolyline(frame, close=True, dxfattribs={"layer": "SHEET"})
    rows = title_block(design, design_hash)
    step = (top - bottom) / len(rows)
    for k, (name, value) in enumerate(rows):
        base = top - (k + 1) * step
        space.add_line((left, base), (right, base), dxfattribs={"layer": "SHEET"})
        text(space, name, (left + 2, base + 1.6), 2.4)
        text(space, value, (left + 40, base + 1.6), 3.0)
    space.add_line((left + 38, bottom), (left + 38, top), dxfattribs={"layer": "SHEET"})


def notes(design: SpringDesign) -> list[str]:
    """What the views cannot say: the centreline's equation and how the part is to be made."""
    p = design.spiral
    return [
        "NOTES",
        f"1  Arms: {design.n_arms}, each turned by {np.degrees(p.pitch_rad):g} degrees from the"
        " one before.",
        f"2  Centreline of an arm: {equation(design)}",
        f"3  Strip: parallel curves at +- half its thickness, from R {1e3 * p.inner_radius_m:.2f}"
        f" to R {1e3 * p.outer_radius_m:.2f}.",
        f"4  Four fillets at every arm's roots (A to D); convex corner at the arm's tip"
        f" R {1e3 * p.tip_radius_m:.2f}.",
        "5  Cut from the DXF profile or the STEP solid; this sheet is for inspection.",
        "6  No fastening holes are in the part: hub and rim are to be drilled with their mating"
        " parts,",
        f"    rim {1e3 * (p.rim_outer_radius_m - p.rim_inner_radius_m):.2f} mm and hub"
        f" {1e3 * (p.hub_radius_m - p.bore_radius_m):.2f} mm wide. A bearing must hold the rim.",
        "7  No burrs; notch surfaces free of marks across the strip.",
    ]


def equation(design: SpringDesign) -> str:
    """The centreline over the polar angle from where it leaves the hub, in mm and rad."""
    line = design.spiral.centreline
    inner, turns = 1e3 * line.inner_radius_m, line.turns
    span = f"0 <= t <= {2 * np.pi * turns:.5f} rad ({turns:g} turns)"
    if isinstance(line, FermatSpiral):
        return f"r = sqrt({inner**2:.4f} + {(1e3 * line.scale_m) ** 2:.4f} t) mm, {span}"
    if isinstance(line, ArchimedeanSpiral):
        return f"r = {inner:.4f} + {1e3 * line.pitch_m:.5f} t mm, {span}"
    if isinstance(line, LogarithmicSpiral):
        return f"r = {inner:.4f} exp({line.growth_per_rad:.6f} t) mm, {span}"
    return span


def title_block(design: SpringDesign, design_hash: str) -> list[tuple[str, str]]:
    """Names and values of the title block, top to bottom."""
    return [
        ("PART", f"{design.name}: flat torsion spring, {design.n_arms} arms"),
        ("MATERIAL", design.material.name),
        ("MASS", f"{design.mass_kg * 1e3:.1f} g"),
        ("SCALE, SHEET", "1:1 (details 5:1), A3, mm, first angle"),
        ("TOLERANCES", "ISO 2768-m unless the process gives finer"),
        ("DESIGN", design_hash),
        ("MADE BY", f"dftfs {__version__}"),
    ]
