"""A dimensioned drawing, A4 to A1 at a standard scale: DXF with true dimensions, and SVG of it.

Front view, side view, and four details (hub roots; slit's end and tip), notes and a title
block. Every dimension is measured by the DXF entity between points
of the exact outline; no text repeats a number that a dimension could measure.
"""

from dataclasses import dataclass
from pathlib import Path

import ezdxf
import numpy as np
from ezdxf import units
from ezdxf.addons.drawing import Frontend, RenderContext, layout
from ezdxf.addons.drawing.config import BackgroundPolicy, ColorPolicy, Configuration
from ezdxf.addons.drawing.svg import SVGBackend
from ezdxf.document import Drawing
from numpy.typing import NDArray

from dftfs.cad.drawing_sheet import (
    Detail,
    Sheet,
    ShopData,
    add_sheet,
    chosen_sheet,
    place,
    scale_text,
    text,
)
from dftfs.cad.profile import arc_loop, outline_loops
from dftfs.design import SpringDesign
from dftfs.files import write_text
from dftfs.spring.edges import Edge
from dftfs.spring.outline import coil_gap

_TOLERANCE_M = 2e-6
# from the centre to where the sheet has room for a long text: below the rim, on the left
_ROOM_FOR_THICKNESS = np.array([np.cos(np.radians(224)), np.sin(np.radians(224))])
_ROOM_FOR_TEXT_MM = 7.0  # a narrower dimension has its text outside the part
_NAME_CODE, _SCALE_CODE = 1000, 1040  # DXF extended data: a string, a number
_LAYERS = {"OUTLINE": (7, 50), "CENTRE": (5, 18), "DIMENSIONS": (3, 18), "SHEET": (8, 25)}
_DIMENSION = {
    "dimtxt": 3.0,
    "dimasz": 2.5,
    "dimexe": 1.2,
    "dimexo": 0.8,
    "dimgap": 0.8,
}


@dataclass(frozen=True, kw_only=True)
class DrawingFiles:
    """The drawing's files and what its dimensions measure, in mm, by name."""

    dxf: Path
    svg: Path
    measured_mm: dict[str, float]


def write_drawing(
    design: SpringDesign,
    folder: Path,
    *,
    design_hash: str,
    shop: ShopData | None = None,
    sheet: Sheet | None = None,
) -> DrawingFiles:
    """Write ``<name>-drawing.dxf`` and ``.svg`` into a folder that exists.

    Parameters
    ----------
    design_hash : str
        Content of the design, for the title block.
    shop : ShopData, optional
        Tolerances, process, part number and what else a shop needs.
    sheet : Sheet, optional
        `chosen_sheet` without it.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    shop, sheet = shop or ShopData(), sheet or chosen_sheet(design, None, None)
    for bolt in shop.bolts:
        bolt.check(design)
    document = _document()
    measured = _views(document, design, sheet, shop)
    add_sheet(document, design, design_hash, sheet, shop)
    paths = {kind: folder / f"{design.name}-drawing.{kind}" for kind in ("dxf", "svg")}
    write_text(paths["dxf"], _dxf_text(document))
    write_text(paths["svg"], _svg_text(document, sheet))
    return DrawingFiles(dxf=paths["dxf"], svg=paths["svg"], measured_mm=measured)


def read_measurements(path: Path) -> dict[str, float]:
    """What the dimension entities of a drawing file measure, in mm, by the name each carries."""
    document = ezdxf.readfile(path)
    found = {}
    for entity in document.modelspace().query("DIMENSION"):
        if entity.has_xdata("DFTFS"):
            tags = {tag.code: tag.value for tag in entity.get_xdata("DFTFS")}
            found[tags[_NAME_CODE]] = float(entity.get_measurement()) / tags[_SCALE_CODE]
    return found


def _document() -> Drawing:
    document = ezdxf.new("R2010", setup=True)
    document.units = units.MM
    document.header["$MEASUREMENT"] = 1
    document.appids.add("DFTFS")
    for name, (colour, weight) in _LAYERS.items():
        kind = "CENTER2" if name == "CENTRE" else "CONTINUOUS"
        document.layers.add(name, color=colour, lineweight=weight, linetype=kind)
    return document


def _views(
    document: Drawing, design: SpringDesign, sheet: Sheet, shop: ShopData
) -> dict[str, float]:
    space, outline = document.modelspace(), design.outline
    for name, edges in outline_loops(outline):
        loop = arc_loop(name, edges, _TOLERANCE_M)
        placed = place(loop.vertices_m, sheet.front_mm, sheet.scale)
        points = np.column_stack([placed, loop.bulges])
        space.add_lwpolyline(points, format="xyb", close=True, dxfattribs={"layer": "OUTLINE"})
    p, (x, y) = outline.parameters, sheet.front_mm
    reach = 1e3 * sheet.scale * p.rim_outer_radius_m + 5
    for a, b in (((x - reach, y), (x + reach, y)), ((x, y - reach), (x, y + reach))):
        space.add_line(a, b, dxfattribs={"layer": "CENTRE"})
    pen = _Pen(document, sheet)
    _diameters(pen, design)
    _strip_and_gap(pen, design, shop)
    _side_view(pen, design, shop)
    _holes(pen, shop)
    for detail in _details(design, sheet):
        _draw_detail(pen, design, detail)
    return pen.measured


class _Pen:
    """Adds dimensions that carry their name and the scale they are drawn at."""

    def __init__(self, document: Drawing, sheet: Sheet) -> None:
        self.space, self.sheet = document.modelspace(), sheet
        self.measured: dict[str, float] = {}

    def options(self, scale: float, style: str = "EZDXF", tolerance_m: float | None = None) -> dict:
        """Attributes and overrides of a dimension at a scale, with a tolerance either way."""
        override = {name: self.sheet.letters * value for name, value in _DIMENSION.items()}
        override |= {"dimlfac": 1 / scale, "dimdec": 2, "dimrnd": 0.01, "dimzin": 8}
        if tolerance_m is not None:
            text = f"<> %%p{1e3 * tolerance_m:.3f}"
            override |= {"dimpost": text}
        return {
            "dimstyle": style,
            "override": override,
            "dxfattribs": {"layer": "DIMENSIONS"},
        }

    def keep(self, name: str, made, scale: float = 1.0) -> None:
        """Render a dimension and remember what it measures."""
        made.render()
        entity = made.dimension
        entity.set_xdata("DFTFS", [(_NAME_CODE, name), (_SCALE_CODE, scale)])
        self.measured[name] = float(entity.get_measurement()) / scale


def _diameters(pen: _Pen, design: SpringDesign) -> None:
    p = design.spiral
    sizes = {
        "rim outside diameter": (p.rim_outer_radius_m, 75.0),
        "rim inside diameter": (p.rim_inner_radius_m, 105.0),
        "hub diameter": (p.hub_radius_m, 205.0),
        "bore diameter": (p.bore_radius_m, 330.0),
    }
    sheet = pen.sheet
    rim = 1e3 * sheet.scale * p.rim_outer_radius_m
    for name, (radius_m, angle) in sizes.items():
        away = np.radians(angle)
        spot = np.array(sheet.front_mm) + (rim + 11 * sheet.factor) * np.array(
            [np.cos(away), np.sin(away)]
        )
        made = pen.space.add_diameter_dim(
            center=sheet.front_mm,
            radius=1e3 * sheet.scale * radius_m,
            angle=angle,
            location=tuple(spot),
            **pen.options(sheet.scale, "EZ_RADIUS"),
        )
        pen.keep(name, made, sheet.scale)


def _strip_and_gap(pen: _Pen, design: SpringDesign, shop: ShopData) -> None:
    """Thickness across the strip, and the narrowest gap between coils, where they are."""
    line = design.spiral.centreline
    sweep = line.start + np.linspace(0.2, 0.8, 601) * (line.end - line.start)
    away = np.array([point / np.linalg.norm(point) for point in map(line.point, sweep)])
    theta = float(sweep[np.argmax(away @ _ROOM_FOR_THICKNESS)])
    half = float(design.spiral.thickness_at(theta)) / 2
    point, normal = line.point(theta), line.normal(theta)
    ends = point - half * normal, point + half * normal
    _across(pen, design, "strip thickness", *ends, shop.thickness_tolerance_m)
    angles = np.arange(line.start + design.spiral.pitch_rad, line.end, 1e-3)
    if angles.size:
        gap = coil_gap(design.spiral, angles)
        theta = float(angles[np.argmin(gap)])
        half = float(design.spiral.thickness_at(theta)) / 2
        foot = line.point(theta) - half * line.normal(theta)
        over = foot - float(np.min(gap)) * line.normal(theta)
        _across(pen, design, "smallest gap between coils", foot, over)


def _across(
    pen: _Pen,
    design: SpringDesign,
    name: str,
    start_m: NDArray,
    end_m: NDArray,
    tolerance_m: float | None = None,
) -> None:
    sheet = pen.sheet
    centre = np.array(sheet.front_mm)
    a, b = place(np.array([start_m, end_m]), sheet.front_mm, sheet.scale)
    if b[0] < a[0]:  # so that the text stands upright
        a, b = b, a
    along = (b - a) / np.linalg.norm(b - a)
    made = pen.space.add_linear_dim(
        base=tuple(b),
        p1=tuple(a),
        p2=tuple(b),
        angle=float(np.degrees(np.arctan2(along[1], along[0]))),
        **pen.options(sheet.scale, tolerance_m=tolerance_m),
    )
    if float(np.linalg.norm(b - a)) < _ROOM_FOR_TEXT_MM * sheet.letters or tolerance_m is not None:
        out = (a + b) / 2 - centre
        reach = 1e3 * sheet.scale * design.spiral.rim_outer_radius_m
        reach += 8 if tolerance_m is None else 14
        made.set_location(tuple(centre + reach * out / np.linalg.norm(out)), leader=True)
    pen.keep(name, made, sheet.scale)


def _side_view(pen: _Pen, design: SpringDesign, shop: ShopData) -> None:
    sheet = pen.sheet
    rim = 1e3 * sheet.scale * design.spiral.rim_outer_radius_m
    width = 1e3 * sheet.scale * design.width_m
    x, y = sheet.side_mm, sheet.front_mm[1]
    corners = [(x, y - rim), (x + width, y - rim), (x + width, y + rim), (x, y + rim)]
    pen.space.add_lwpolyline(corners, close=True, dxfattribs={"layer": "OUTLINE"})
    pen.space.add_line((x - 4, y), (x + width + 4, y), dxfattribs={"layer": "CENTRE"})
    made = pen.space.add_linear_dim(
        base=(x, y + rim + 9),
        p1=corners[3],
        p2=corners[2],
        **pen.options(sheet.scale, tolerance_m=shop.width_tolerance_m),
    )
    pen.keep("width", made, sheet.scale)
    size = 3 * sheet.letters
    _datum(pen, "A", (x - 2.4 * size, y + 0.9 * rim), x)


def _datum(pen: _Pen, letter: str, corner: tuple[float, float], to_x: float) -> None:
    """A datum's letter in its box, joined to what it names by a line to the right."""
    size, (x, y) = 3 * pen.sheet.letters, corner
    box, ring = 1.6 * size, {"layer": "DIMENSIONS"}
    corners = [(x, y), (x + box, y), (x + box, y + box), (x, y + box)]
    pen.space.add_lwpolyline(corners, close=True, dxfattribs=ring)
    text(pen.space, letter, (x + 0.35 * size, y + 0.3 * size), size)
    pen.space.add_line((x + box, y + box / 2), (to_x, y + box / 2), dxfattribs=ring)


def _holes(pen: _Pen, shop: ShopData) -> None:
    """Fastening holes with their circle; the note gives their sizes."""
    sheet, centre = pen.sheet, np.array(pen.sheet.front_mm)
    for bolt in shop.bolts:
        radius = 1e3 * sheet.scale * bolt.circle_m / 2
        pen.space.add_circle(tuple(centre), radius, dxfattribs={"layer": "CENTRE"})
        for k in range(bolt.count):
            angle = 2 * np.pi * k / bolt.count
            spot = centre + radius * np.array([np.cos(angle), np.sin(angle)])
            hole = 1e3 * sheet.scale * bolt.hole_m / 2
            pen.space.add_circle(tuple(spot), hole, dxfattribs={"layer": "OUTLINE"})


def _details(design: SpringDesign, sheet: Sheet) -> tuple[Detail, ...]:
    """Hub roots of arm 0, and the end of the slit with the tip of the arm beside it."""
    edges = {edge.name: edge for edge in design.outline.coil_gaps[0]}
    notch = np.asarray(edges["notch_fillet:0"].centre_m)
    slit = np.asarray(edges["slit_fillet:0"].centre_m)
    tip = np.asarray(edges["tip_fillet:0"].centre_m)
    foot = np.asarray(edges["foot_fillet:0"].centre_m)
    roots = {"notch": notch, "foot": foot, "slit": slit, "tip": tip}
    return tuple(
        Detail(letter=letter, centre_m=centre, spot_mm=spot, fillets=((name, centre),))
        for letter, (name, centre), spot in zip("ABCD", roots.items(), sheet.spots_mm)
    )


def _draw_detail(pen: _Pen, design: SpringDesign, detail: Detail) -> None:
    space, sheet = pen.space, pen.sheet
    scale, radius = sheet.detail_scale, sheet.detail_radius_mm
    where = place(detail.centre_m[None], sheet.front_mm, sheet.scale)[0]
    seen = radius * sheet.scale / scale
    ring = {"layer": "DIMENSIONS"}
    space.add_circle(tuple(where), seen, dxfattribs=ring)
    text(space, detail.letter, tuple(where + seen * 0.8), 3.5 * sheet.letters)
    space.add_circle(detail.spot_mm, radius, dxfattribs=ring)
    x, y = detail.spot_mm
    text(
        space,
        f"{detail.letter} ({scale_text(scale)})",
        (x - 8, y + radius + 2),
        4.0 * sheet.letters,
    )
    for loop in (*design.outline.coil_gaps, (design.outline.rim_outer,), (design.outline.bore,)):
        for edge in loop:
            for run in _inside(edge, detail, sheet):
                space.add_lwpolyline(run, dxfattribs={"layer": "OUTLINE"})
    for name, centre in detail.fillets:
        spot = place(centre[None] - detail.centre_m, detail.spot_mm, scale)[0]
        made = space.add_radius_dim(
            center=tuple(spot),
            radius=1e3 * design.spiral.fillet_radius_m * scale,
            angle=detail.reach_deg(design, name),
            location=(x + radius * 0.55, y - radius * 0.72),
            **pen.options(scale, "EZ_RADIUS"),
        )
        pen.keep(f"{name} fillet radius", made, scale)


def _inside(edge: Edge, detail: Detail, sheet: Sheet) -> list[NDArray]:
    """Runs of an edge's points inside a detail's circle, where the detail is drawn."""
    count = max(16, int(np.ceil(edge.length_m / 1e-4)))
    points = edge.point(np.linspace(0, 1, count + 1))
    near = (
        np.hypot(*(points - detail.centre_m).T)
        <= 1e-3 * sheet.detail_radius_mm / sheet.detail_scale
    )
    placed = place(points - detail.centre_m, detail.spot_mm, sheet.detail_scale)
    breaks = np.flatnonzero(np.diff(near.astype(int))) + 1
    parts = zip(np.split(placed, breaks), np.split(near, breaks))
    return [part for part, kept in parts if kept[0] and len(part) > 1]


def _dxf_text(document: Drawing) -> str:
    import io

    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue()


def _svg_text(document: Drawing, sheet: Sheet) -> str:
    backend = SVGBackend()
    look = Configuration(background_policy=BackgroundPolicy.WHITE, color_policy=ColorPolicy.BLACK)
    Frontend(RenderContext(document), backend, config=look).draw_layout(document.modelspace())
    width, height = sheet.size_mm
    page = layout.Page(width, height, layout.Units.mm, layout.Margins.all(0))
    return backend.get_string(page, settings=layout.Settings(fit_page=False, scale=1.0))
