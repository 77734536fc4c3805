"""A dimensioned drawing, A4 to A1 at a standard scale: DXF with true dimensions, and SVG of it.

Front view, side view, and four details (hub roots; slit's end and tip), notes and a title
block. Every dimension is measured by the DXF entity between points
of the exact outline; no text repeats a number that a dimension could measure.

Thickness, width and bore carry limits. The other sizes are limited by the profile of the cut
edges and therefore theoretically exact, in boxes (ISO 1101); the gap between coils follows from
them and stands in brackets (ISO 129-1). Without a profile nothing is boxed: the general tolerance
of the title block holds.
"""

import io
from dataclasses import dataclass
from pathlib import Path

import ezdxf
from ezdxf import units
from ezdxf.addons.drawing import Frontend, RenderContext, layout
from ezdxf.addons.drawing.config import BackgroundPolicy, ColorPolicy, Configuration
from ezdxf.addons.drawing.svg import SVGBackend
from ezdxf.document import Drawing

from dftfs.cad.drawing_details import details, draw_detail
from dftfs.cad.drawing_notes import add_sheet
from dftfs.cad.drawing_pen import APPLICATION, NAME_CODE, SCALE_CODE, Pen
from dftfs.cad.drawing_sheet import Sheet, ShopData, chosen_sheet
from dftfs.cad.drawing_views import dimension_front, draw_front, draw_side
from dftfs.design import SpringDesign
from dftfs.files import write_text

_COLOURS = {"OUTLINE": 7, "CENTRE": 5, "DIMENSIONS": 3, "SHEET": 8}
_FRAME_WIDTH = 25  # mm / 100


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
    document = _document(sheet)
    exact = shop.profile_m is not None
    pen = Pen(document, sheet, rim_m=design.spiral.rim_outer_radius_m, exact=exact)
    draw_front(pen, design, shop)
    draw_side(pen, design, shop)
    add_sheet(pen, design, design_hash, shop)
    dimension_front(pen, design, shop)
    for detail in details(design, sheet):
        draw_detail(pen, design, detail)
    paths = {kind: folder / f"{design.name}-drawing.{kind}" for kind in ("dxf", "svg")}
    write_text(paths["dxf"], _dxf_text(document))
    write_text(paths["svg"], _svg_text(document, sheet))
    return DrawingFiles(dxf=paths["dxf"], svg=paths["svg"], measured_mm=pen.measured)


def read_measurements(path: Path) -> dict[str, float]:
    """What the dimension entities of a drawing file measure, in mm, by the name each carries."""
    document = ezdxf.readfile(path)
    found = {}
    for entity in document.modelspace().query("DIMENSION"):
        if entity.has_xdata(APPLICATION):
            tags = {tag.code: tag.value for tag in entity.get_xdata(APPLICATION)}
            found[tags[NAME_CODE]] = float(entity.get_measurement()) / tags[SCALE_CODE]
    return found


def _document(sheet: Sheet) -> Drawing:
    document = ezdxf.new("R2010", setup=True)
    document.units = units.MM
    document.header["$MEASUREMENT"] = 1
    document.appids.add(APPLICATION)
    wide, narrow = sheet.line_widths
    weights = {"OUTLINE": wide, "SHEET": _FRAME_WIDTH}
    for name, colour in _COLOURS.items():
        kind = "CENTER2" if name == "CENTRE" else "CONTINUOUS"
        document.layers.add(name, color=colour, lineweight=weights.get(name, narrow), linetype=kind)
    return document


def _dxf_text(document: Drawing) -> str:
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
