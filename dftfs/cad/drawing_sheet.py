"""The drawing's sheet: its size and scale, frame, notes, title block, where the views stand."""

from dataclasses import dataclass, field
from datetime import UTC, datetime
from math import sqrt

import numpy as np
from ezdxf.document import Drawing
from ezdxf.enums import TextEntityAlignment
from numpy.typing import NDArray

from dftfs import __version__
from dftfs.design import SpringDesign
from dftfs.errors import DesignError
from dftfs.spring.centreline import ArchimedeanSpiral, FermatSpiral, LogarithmicSpiral
from dftfs.spring.parameters import SpiralParameters

SHEETS_MM = {
    "A4": (297.0, 210.0),
    "A3": (420.0, 297.0),
    "A2": (594.0, 420.0),
    "A1": (841.0, 594.0),
}
STANDARD_SCALE = (10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1)  # ISO 5455
_DETAIL_FACTORS = (50.0, 20.0, 10.0, 5.0, 2.0, 1.0)
# places on A3, scaled to the other sheets
_A3_WIDTH_MM = 420.0
_FRONT_MM, _FRONT_RADIUS_MM = (112.0, 178.0), 92.0
_SIDE_X_MM, _SIDE_WIDTH_MM = 226.0, 24.0
_SPOTS_MM = ((285.0, 236.0), (362.0, 236.0), (285.0, 152.0), (362.0, 152.0))
_DETAIL_RADIUS_MM = 33.0
_DETAIL_REACH = 0.85  # of the strip's thickness that a detail must show around its fillet
_SMALLEST_TEXT_MM = 1.8
_BREAKS_MM, _BREAK_COSTS = (0.2, 0.1, 0.05, 0.03, 0.02, 0.01), 0.005  # of the stiffness


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """A sheet of a size at a scale, and where everything stands on it, in mm of paper."""

    name: str
    scale: float
    detail_scale: float

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height."""
        return SHEETS_MM[self.name]

    @property
    def factor(self) -> float:
        """Places over those on A3."""
        return self.size_mm[0] / _A3_WIDTH_MM

    @property
    def front_mm(self) -> tuple[float, float]:
        """Centre of the front view."""
        return self.at(_FRONT_MM)

    @property
    def side_mm(self) -> float:
        """Left edge of the side view."""
        return self.factor * _SIDE_X_MM

    @property
    def spots_mm(self) -> tuple[tuple[float, float], ...]:
        """Centres of the four details."""
        return tuple(self.at(spot) for spot in _SPOTS_MM)

    @property
    def detail_radius_mm(self) -> float:
        """Radius of a detail's circle."""
        return self.factor * _DETAIL_RADIUS_MM

    @property
    def letters(self) -> float:
        """Height of texts over those on A3."""
        return max(min(sqrt(self.factor), 1.4), _SMALLEST_TEXT_MM / 2.4)

    def at(self, place_mm: tuple[float, float]) -> tuple[float, float]:
        """A place on A3 on this sheet."""
        return self.factor * place_mm[0], self.factor * place_mm[1]


def chosen_sheet(design: SpringDesign, name: str | None, scale: float | None) -> Sheet:
    """The sheet and scale that are asked for, else the largest scale that fits, on A3 first.

    Raises
    ------
    DesignError
        If the sheet or scale is unknown, or the part does not fit.
    """
    rim = 1e3 * design.spiral.rim_outer_radius_m
    if name is not None and name not in SHEETS_MM:
        raise DesignError(f"--sheet {name} is unknown; known are {', '.join(SHEETS_MM)}")
    if scale is not None and scale not in STANDARD_SCALE:
        known = ", ".join(scale_text(one) for one in STANDARD_SCALE)
        raise DesignError(f"--scale {scale:g} is no standard scale; known are {known}")
    for sheet in [name] if name else ["A3", "A4", "A2", "A1"]:
        room = _FRONT_RADIUS_MM * SHEETS_MM[sheet][0] / _A3_WIDTH_MM
        side = _SIDE_WIDTH_MM * SHEETS_MM[sheet][0] / _A3_WIDTH_MM
        fits = [
            one
            for one in ([scale] if scale else STANDARD_SCALE)
            if rim * one <= room and 1e3 * design.width_m * one <= side
        ]
        if fits:
            reach = _DETAIL_RADIUS_MM * SHEETS_MM[sheet][0] / _A3_WIDTH_MM
            shown = _DETAIL_REACH * 1e3 * design.spiral.thickness_m
            details = [one for one in _DETAIL_FACTORS if one * shown <= reach]
            return Sheet(name=sheet, scale=fits[0], detail_scale=details[0] if details else fits[0])
    raise DesignError(
        f"{2 * rim:.4g} mm across, {1e3 * design.width_m:.4g} mm wide, does not fit at"
        f" {scale_text(scale or STANDARD_SCALE[-1])} on {name or 'any sheet up to A1'};"
        " a smaller --scale or a larger --sheet would work"
    )


def scale_text(scale: float) -> str:
    """1:2 for 0.5, 5:1 for 5."""
    return f"{scale:g}:1" if scale >= 1 else f"1:{1 / scale:g}"


@dataclass(frozen=True, kw_only=True)
class BoltCircle:
    """Through holes in hub or rim: their number, diameter and circle's diameter.

    Raises
    ------
    DesignError
        If a number is not positive.
    """

    where: str
    count: int
    hole_m: float
    circle_m: float

    def __post_init__(self) -> None:
        if not (self.count >= 1 and self.hole_m > 0 and self.circle_m > self.hole_m):
            raise DesignError(
                f"bolt circle of the {self.where}: COUNT, HOLE and CIRCLE must be positive, the"
                " circle larger than the hole, for example 6 4.2 165"
            )

    def check(self, design: SpringDesign) -> None:
        """DesignError unless the holes lie whole inside their ring."""
        p = design.spiral
        inner, outer = {
            "rim": (p.rim_inner_radius_m, p.rim_outer_radius_m),
            "hub": (p.bore_radius_m, p.hub_radius_m),
        }[self.where]
        low, high = (self.circle_m - self.hole_m) / 2, (self.circle_m + self.hole_m) / 2
        if not (inner < low and high < outer):
            raise DesignError(
                f"bolt circle of the {self.where}: holes from R {1e3 * low:.4g} to R"
                f" {1e3 * high:.4g} mm leave its ring, R {1e3 * inner:.4g} to"
                f" {1e3 * outer:.4g} mm; a circle of {1e3 * (inner + outer):.4g} mm would work"
            )


@dataclass(frozen=True, kw_only=True)
class ShopData:
    """What a shop needs beyond the shape; None leaves a line of the drawing out.

    ``thickness_tolerance_m`` either way, ``profile_m`` the whole zone, both so that the stated
    ``stiffness`` sentence holds (`dftfs.analysis.study.drawing_tolerance`).
    """

    part_number: str = ""
    revision: str = "A"
    date: str = field(default_factory=lambda: datetime.now(UTC).strftime("%Y-%m-%d"))
    author: str = ""
    process: str = ""
    temper: str = ""
    thickness_tolerance_m: float | None = None
    width_tolerance_m: float = 5e-5
    profile_m: float | None = None
    stiffness: str = ""
    roughness_um: float = 1.6
    bolts: tuple[BoltCircle, ...] = ()


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


def place(points_m: NDArray, origin_mm: tuple[float, float], scale: float) -> NDArray:
    """Points of the part (n, 2) on the sheet, in mm."""
    return np.asarray(origin_mm) + 1e3 * scale * np.asarray(points_m)


def text(space, content: str, at: tuple[float, float], height: float) -> None:
    """A line of text on the sheet's layer, its lower left corner at a point."""
    line = space.add_text(content, height=height, dxfattribs={"layer": "SHEET"})
    line.set_placement(at, align=TextEntityAlignment.BOTTOM_LEFT)


def add_sheet(
    document: Drawing, design: SpringDesign, design_hash: str, sheet: Sheet, shop: ShopData
) -> None:
    """Frame, notes and title block."""
    space, (width, height) = document.modelspace(), sheet.size_mm
    for inset in (0.0, 10.0):
        corners = [(inset, inset), (width - inset, inset)]
        corners += [(width - inset, height - inset), (inset, height - inset)]
        space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "SHEET"})
    big, f = sheet.letters, sheet.factor
    lines = notes(design, shop)
    top = 12.0 + 4.6 * big * (len(lines) - 1)
    for k, line in enumerate(lines):
        text(space, line, (14.0, top - 4.6 * big * k), 2.4 * big)
    left, right, bottom = 240 * f, width - 10.0, 10.0
    rows = title_block(design, design_hash, sheet, shop)
    step = 5.6 * big
    top = bottom + step * len(rows)
    frame = [(left, bottom), (right, bottom), (right, top), (left, top)]
    space.add_lwpolyline(frame, close=True, dxfattribs={"layer": "SHEET"})
    split = left + 32 * big
    for k, (name, value) in enumerate(rows):
        base = top - (k + 1) * step
        space.add_line((left, base), (right, base), dxfattribs={"layer": "SHEET"})
        text(space, name, (left + 2, base + 1.4 * big), 2.2 * big)
        text(space, value, (split + 2, base + 1.4 * big), 2.5 * big)
    space.add_line((split, bottom), (split, top), dxfattribs={"layer": "SHEET"})


def edge_break_mm(design: SpringDesign) -> float:
    """The largest usual break of a strip's four edges that costs at most 0.5 % of its stiffness.

    Triangles of side c take 6 c^2 / (w t) of the second moment of a strip t thick and w wide.
    """
    p = design.spiral
    largest = 1e3 * sqrt(_BREAK_COSTS * design.width_m * p.thickness_range_m[0] / 6)
    return max((c for c in _BREAKS_MM if c <= largest), default=_BREAKS_MM[-1])


def notes(design: SpringDesign, shop: ShopData) -> list[str]:
    """What the views cannot say: the centreline's equation and how the part is to be made."""
    p = design.spiral
    lines = [
        f"Arms: {design.n_arms}, each turned by {np.degrees(p.pitch_rad):g} degrees from the one"
        " before.",
        f"Centreline of an arm: {equation(design)}",
        _strip_note(p),
        f"Fillets at every arm's roots (A to D); corner at the arm's tip R"
        f" {1e3 * p.tip_radius_m:.2f}.",
        "Datum A: face of the hub. Datum B: axis of the bore, H7. Flatness of A 0.05.",
    ]
    if shop.profile_m is not None:
        lines.append(
            f"Profile of all cut edges (ISO 1660): {1e3 * shop.profile_m:.3f} to A, B, both sides."
        )
    if shop.stiffness:
        lines.append(shop.stiffness)
    lines += [
        f"Cut edges Ra {shop.roughness_um:g}, notches A to D free of marks across the strip.",
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


def title_block(
    design: SpringDesign, design_hash: str, sheet: Sheet, shop: ShopData
) -> list[tuple[str, str]]:
    """Names and values of the title block, top to bottom."""
    views = f"{scale_text(sheet.scale)} (details {scale_text(sheet.detail_scale)})"
    return [
        ("PART", f"{design.name}: flat torsion spring, {design.n_arms} arms"),
        ("NUMBER, REV.", f"{shop.part_number or design.name}, {shop.revision}"),
        ("DATE, AUTHOR", ", ".join(part for part in (shop.date, shop.author) if part)),
        ("MATERIAL", design.material.name),
        ("PROCESS", shop.process or "-"),
        ("MASS", f"{design.mass_kg * 1e3:.1f} g"),
        ("SCALE, SHEET", f"{views}, {sheet.name}, mm, first angle"),
        ("TOLERANCES", "as stated; ISO 2768-mK for lengths without one"),
        ("DESIGN", design_hash),
        ("MADE BY", f"dftfs {__version__}"),
    ]
