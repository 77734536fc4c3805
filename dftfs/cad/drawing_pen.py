"""Dimensions, boxes and texts of a drawing: every dimension carries what it measures.

The pen remembers where lines and texts stand, so that later labels find free places.
"""

from collections.abc import Iterable

import ezdxf
import numpy as np
from ezdxf.document import Drawing
from ezdxf.entities import Dimension
from ezdxf.enums import TextEntityAlignment
from ezdxf.tools.text_size import mtext_size
from numpy.typing import ArrayLike, NDArray

from dftfs.cad.drawing_sheet import Sheet

NAME_CODE, SCALE_CODE = 1000, 1040  # DXF extended data: a string, a number
APPLICATION = "DFTFS"
LINES = {"layer": "DIMENSIONS"}
Box = tuple[float, float, float, float]  # left, lower, right, upper in mm of paper
_DIMENSION = {
    "dimtxt": 3.0,
    "dimasz": 2.5,
    "dimexe": 1.2,
    "dimexo": 0.8,
    "dimgap": 0.8,
}
_GLYPH = 0.75  # width of a character over its height, rather too wide
_STEP_MM = 0.5  # between the points that stand for a line
_MARGIN_MM = 12.0  # from the sheet's edge to the nearest label


def text(space, content: str, at: tuple[float, float], height: float) -> None:
    """A line of text on the sheet's layer, its lower left corner at a point."""
    line = space.add_text(content, height=height, dxfattribs={"layer": "SHEET"})
    line.set_placement(at, align=TextEntityAlignment.BOTTOM_LEFT)


class Pen:
    """Adds dimensions that carry their name and the scale they are drawn at.

    ``exact``: whether sizes that no tolerance is given for are theoretically exact (ISO 1101), in
    boxes, because a profile toleranced to datums limits their edges.
    """

    def __init__(self, document: Drawing, sheet: Sheet, *, rim_m: float, exact: bool) -> None:
        self.space, self.sheet, self.exact = document.modelspace(), sheet, exact
        self.rim_mm = 1e3 * sheet.scale * rim_m  # radius of the front view on paper
        self.measured: dict[str, float] = {}
        self._boxes: list[Box] = []
        self._points: list[NDArray] = []

    # --- what stands where -----------------------------------------------------------------

    def drawn(self, points_mm: ArrayLike) -> None:
        """Remember a line through points (n, 2)."""
        points = np.asarray(points_mm, dtype=float)
        steps = np.hypot(*np.diff(points, axis=0).T)
        for start, end, step in zip(points[:-1], points[1:], steps):
            share = np.linspace(0, 1, max(2, int(np.ceil(step / _STEP_MM)) + 1))[:, None]
            self._points.append(start + share * (end - start))

    def reserve(self, box: Box) -> None:
        """Keep a box free of labels."""
        left, lower, right, upper = box
        self._boxes.append(box)
        self.drawn([(left, lower), (right, lower), (right, upper), (left, upper), (left, lower)])

    def is_free(self, box: Box) -> bool:
        """Whether a box lies on the sheet, a millimetre clear of every reserved one."""
        left, lower, right, upper = box
        width, height = self.sheet.size_mm
        inside = left >= _MARGIN_MM and lower >= _MARGIN_MM
        inside = inside and right <= width - _MARGIN_MM and upper <= height - _MARGIN_MM
        return inside and not any(
            left < b[2] + 1 and b[0] < right + 1 and lower < b[3] + 1 and b[1] < upper + 1
            for b in self._boxes
        )

    def crosses(self, start_mm: NDArray, end_mm: NDArray) -> bool:
        """Whether a line crosses a reserved box."""
        steps = max(2, int(np.hypot(*(end_mm - start_mm)) / _STEP_MM))
        points = start_mm + np.linspace(0, 1, steps)[:, None] * (end_mm - start_mm)
        return any(
            bool(np.any(np.all((points > b[:2]) & (points < b[2:]), axis=1))) for b in self._boxes
        )

    def clearance_mm(self, centres_mm: ArrayLike, size_mm: tuple[float, float]) -> NDArray:
        """Distance from boxes of one size, at centres (n, 2), to the nearest line or box."""
        points, half = np.concatenate(self._points), np.asarray(size_mm) / 2
        return np.array(
            [
                float(np.min(np.hypot(*np.maximum(np.abs(points - centre) - half, 0).T)))
                for centre in np.atleast_2d(centres_mm)
            ]
        )

    def size_of(self, content: str) -> tuple[float, float]:
        """Width and height that a dimension's text takes, roughly."""
        height = self.sheet.letters * _DIMENSION["dimtxt"]
        return _GLYPH * height * len(content) + height, 2 * height

    # --- dimensions ------------------------------------------------------------------------

    def options(self, scale: float, style: str = "EZDXF", post: str = "<>") -> dict:
        """Attributes and overrides of a dimension at a scale; ``post`` is its text around <>."""
        override = {name: self.sheet.letters * value for name, value in _DIMENSION.items()}
        override |= {"dimlfac": 1 / scale, "dimdec": 3, "dimrnd": 0.001, "dimzin": 8}
        override |= {"dimpost": post, "dimtoh": 1}
        return {"dimstyle": style, "override": override, "dxfattribs": LINES}

    def keep(
        self, name: str, made, scale: float = 1.0, *, boxed: bool = False
    ) -> tuple[NDArray, NDArray] | None:
        """Render a dimension, box it if it is exact, and remember what it measures.

        Returns
        -------
        tuple of point, or None
            Where the line below its text begins and ends, if there is one.
        """
        made.render()
        entity = made.dimension
        entity.set_xdata(APPLICATION, [(NAME_CODE, name), (SCALE_CODE, scale)])
        self.measured[name] = float(entity.get_measurement()) / scale
        block, gap = entity.get_geometry_block(), 0.5 * self.sheet.letters
        (label,) = block.query("MTEXT")
        landing = _shortened_landing(entity, label, 2 * gap)
        corners = _corners(label, gap)
        if boxed and self.exact:
            block.add_lwpolyline(corners, close=True, dxfattribs=LINES)
            style = entity.override()
            style["dimgap"] = -self.sheet.letters * _DIMENSION["dimgap"]  # DXF: negative boxes it
            style.commit()
        self.reserve((*np.min(corners, axis=0), *np.max(corners, axis=0)))
        for line in block.query("LINE"):
            self.drawn([line.dxf.start.vec2, line.dxf.end.vec2])
        return landing

    def datum(self, letter: str, foot_mm: ArrayLike, away: ArrayLike) -> None:
        """A datum after ISO 5459: a filled triangle on its feature, a line, the letter's box.

        ``away`` : unit vector from the feature to the box.
        """
        size = 3 * self.sheet.letters
        foot, away = np.asarray(foot_mm, dtype=float), np.asarray(away, dtype=float)
        aside, apex = np.array([-away[1], away[0]]), foot + 0.85 * size * away
        left, right = foot + 0.5 * size * aside, foot - 0.5 * size * aside
        self.space.add_solid([left, right, apex, apex], dxfattribs=LINES)
        edge, centre = apex + 0.6 * size * away, apex + 1.4 * size * away
        self.space.add_line(apex, edge, dxfattribs=LINES)
        x, y = centre - 0.8 * size
        box = (x, y, x + 1.6 * size, y + 1.6 * size)
        corners = [(x, y), (box[2], y), (box[2], box[3]), (x, box[3])]
        self.space.add_lwpolyline(corners, close=True, dxfattribs=LINES)
        line = self.space.add_text(letter, height=size, dxfattribs={"layer": "SHEET"})
        line.set_placement(tuple(centre), align=TextEntityAlignment.MIDDLE_CENTER)
        self.reserve(box)
        self.drawn([foot, edge])


def _corners(label: ezdxf.entities.MText, gap: float) -> NDArray:
    """Corners (4, 2) of a text that is centred on its place, with a gap around it."""
    size = mtext_size(label)
    half = np.array([size.total_width / 2 + gap, size.total_height / 2 + gap])
    turn = np.radians(label.dxf.rotation)
    along = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    return np.array([label.dxf.insert.x, label.dxf.insert.y]) + signs * half @ along


def _shortened_landing(
    entity: Dimension, label: ezdxf.entities.MText, gap: float
) -> tuple[NDArray, NDArray] | None:
    """Make the line below a text as long as the text, which ezdxf only guesses; its ends."""
    lines = list(entity.get_geometry_block().query("LINE"))
    for line in lines:
        start, end = line.dxf.start, line.dxf.end
        level = abs(start.y - end.y) < 1e-9 and start.y < label.dxf.insert.y
        if not level or abs((start.x + end.x) / 2 - label.dxf.insert.x) > 1e-6:
            continue
        others = [e for o in lines if o is not line for e in (o.dxf.start, o.dxf.end)]
        if _touches(end, others):  # from the leader's knee outwards
            start, end = end, start
        elif not _touches(start, others):  # no leader: the dimension line itself
            continue
        side = np.sign(end.x - start.x)
        far = start + ezdxf.math.Vec3(side * (mtext_size(label).total_width + 2 * gap), 0)
        line.dxf.start, line.dxf.end = start, far
        label.dxf.insert = ezdxf.math.Vec3((start.x + far.x) / 2, label.dxf.insert.y)
        entity.dxf.text_midpoint = label.dxf.insert
        return np.array(start.vec2), np.array(far.vec2)
    return None


def _touches(point: ezdxf.math.Vec3, others: Iterable[ezdxf.math.Vec3]) -> bool:
    return any(point.isclose(other, abs_tol=1e-6) for other in others)
