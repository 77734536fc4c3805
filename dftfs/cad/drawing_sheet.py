"""The drawing's sheet: its size and scale, where the views stand, what a shop needs beside them."""

from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from dftfs.design import SpringDesign
from dftfs.errors import DesignError

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
# the details stand in two columns on the right of the side view; a wide one makes them smaller
_SIDE_X_MM, _USUAL_SIDE_MM, _WIDEST_SIDE_MM = 226.0, 24.0, 84.0
_DETAILS_END_MM, _DETAIL_ROWS_MM = 408.0, (236.0, 152.0)
_DETAIL_RADIUS_MM, _BETWEEN_DETAILS_MM, _AFTER_SIDE_MM = 33.0, 11.0, 2.0
_DETAIL_REACH = 0.85  # of the strip's thickness that a detail must show around its fillet
_LEGIBLE_MM = 1.0  # of paper: a thinner strip runs into its own outlines, if a sheet helps it
# strip's thickness on paper, from which the outline and the other lines have these widths in mm/100
_LINE_WIDTHS = ((3.0, (50, 18)), (1.5, (35, 18)), (0.0, (25, 13)))  # ISO 128-2: about 2 to 1
_SMALLEST_TEXT_MM = 1.8


@dataclass(frozen=True, kw_only=True)
class Sheet:
    """A sheet of a size at a scale, and where everything stands on it, in mm of paper.

    ``side_width_mm`` : of the side view as drawn; ``line_widths`` of the outline and of the other
    lines, in mm / 100.
    """

    name: str
    scale: float
    detail_scale: float
    side_width_mm: float = 0.0
    line_widths: tuple[int, int] = (50, 18)

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
    def _details_left_mm(self) -> float:
        side = max(self.side_width_mm, self.factor * _USUAL_SIDE_MM)
        return self.side_mm + side + self.factor * _AFTER_SIDE_MM

    @property
    def detail_radius_mm(self) -> float:
        """Radius of a detail's circle."""
        room = self.factor * (_DETAILS_END_MM - _BETWEEN_DETAILS_MM) - self._details_left_mm
        return min(self.factor * _DETAIL_RADIUS_MM, room / 4)

    @property
    def spots_mm(self) -> tuple[tuple[float, float], ...]:
        """Centres of the four details."""
        first = self._details_left_mm + self.detail_radius_mm
        second = first + 2 * self.detail_radius_mm + self.factor * _BETWEEN_DETAILS_MM
        return tuple((x, self.factor * y) for y in _DETAIL_ROWS_MM for x in (first, second))

    @property
    def letters(self) -> float:
        """Height of texts over those on A3."""
        return max(min(sqrt(self.factor), 1.4), _SMALLEST_TEXT_MM / 2.4)

    def at(self, place_mm: tuple[float, float]) -> tuple[float, float]:
        """A place on A3 on this sheet."""
        return self.factor * place_mm[0], self.factor * place_mm[1]


def chosen_sheet(design: SpringDesign, name: str | None, scale: float | None) -> Sheet:
    """The sheet and scale that are asked for, else the largest scale that fits, on A3 first.

    A larger sheet is taken where it shows a strip that is thinner than a millimetre on A3 larger.

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
    strip, width, best = 1e3 * design.spiral.thickness_range_m[0], 1e3 * design.width_m, None
    for sheet in [name] if name else ["A3", "A4", "A2", "A1"]:
        factor = SHEETS_MM[sheet][0] / _A3_WIDTH_MM
        room, side = factor * _FRONT_RADIUS_MM, factor * _WIDEST_SIDE_MM
        for one in [scale] if scale else STANDARD_SCALE:
            if rim * one <= room * (1 + 1e-9) and width * one <= side:
                if best is None or one > best[1]:
                    best = sheet, one
                break
        if best is not None and strip * best[1] >= _LEGIBLE_MM * (1 - 1e-9):
            break
    if best is not None:
        return _laid_out(design, *best)
    raise DesignError(
        f"{2 * rim:.4g} mm across, {1e3 * design.width_m:.4g} mm wide, does not fit at"
        f" {scale_text(scale or STANDARD_SCALE[-1])} on {name or 'any sheet up to A1'};"
        " a smaller --scale or a larger --sheet would work"
    )


def _laid_out(design: SpringDesign, name: str, scale: float) -> Sheet:
    """The sheet with the largest scale of its details, and lines as wide as the strip bears."""
    p = design.spiral
    strip = 1e3 * p.thickness_range_m[0] * scale
    widths = next(widths for least, widths in _LINE_WIDTHS if strip >= least)
    plain = Sheet(
        name=name, scale=scale, detail_scale=scale, side_width_mm=1e3 * design.width_m * scale,
        line_widths=widths,
    )  # fmt: skip
    shown = _DETAIL_REACH * 1e3 * p.thickness_m
    details = [one for one in _DETAIL_FACTORS if one * shown <= plain.detail_radius_mm]
    return replace(plain, detail_scale=details[0] if details else scale)


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
    ``stiffness`` sentence holds (`dftfs.analysis.study.drawing_tolerance`). ``roughness_um`` is
    the Rz that the process leaves, which the life assumes; ``taper_m`` the least and the most by
    which its cuts are wider at one end of the width, 0 where none is known.
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
    roughness_um: float | None = None
    taper_m: tuple[float, float] = (0.0, 0.0)
    bolts: tuple[BoltCircle, ...] = ()


def place(points_m: NDArray, origin_mm: tuple[float, float], scale: float) -> NDArray:
    """Points of the part (n, 2) on the sheet, in mm."""
    return np.asarray(origin_mm) + 1e3 * scale * np.asarray(points_m)
