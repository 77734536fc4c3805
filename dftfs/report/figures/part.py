"""The part on paper: its dimensioned outline, and how it is held and turned."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, FancyArrowPatch, PathPatch, Rectangle
from matplotlib.path import Path as PlotPath
from numpy.typing import NDArray

from dftfs.design import SpringDesign
from dftfs.report.figures.outline_path import solid_path
from dftfs.report.style import (
    BLUE,
    DIRECTION_COLOUR,
    FIGURE_WIDTH_IN,
    GREY,
    INK,
    PART,
    VERMILION,
    ReportFigure,
    as_svg,
    house_style,
    new_figure,
)

_LEADER = {"arrowstyle": "-|>,head_width=0.16,head_length=0.32", "lw": 0.7, "color": INK}


@dataclass(frozen=True, kw_only=True)
class _Callout:
    """A label and the point of the part (mm) that its leader ends on."""

    text: str
    point_mm: tuple[float, float]


def part_drawing(design: SpringDesign) -> ReportFigure:
    """Plan with the radii, the strip and the fillets, and the side view with the width, in mm."""
    spiral = design.spiral
    radius = 1e3 * spiral.rim_outer_radius_m
    with house_style():
        axes = _bare_axes(1.78 * radius, (-1.42 * radius - 1e3 * design.width_m, 1.03 * radius))
        axes.add_patch(PathPatch(solid_path(design.outline), fc=PART, ec=INK, lw=0.8))
        _centreline(axes, design)
        _thickness(axes, design)
        left, right = _callouts(design)
        _place(axes, left, -1.2 * radius, "right", radius)
        _place(axes, right, 1.2 * radius, "left", radius)
        _side_view(axes, radius, 1e3 * design.width_m)
        arms = "One arm" if design.n_arms == 1 else f"{design.n_arms} arms"
        return as_svg(
            axes.figure,
            name="drawing",
            alt=f"Plan and side view of the spring {design.name} with its dimensions in mm: "
            + "; ".join(c.text.replace("\n", " ").replace("$", "") for c in (*left, *right)),
            caption=f"Dimensions in mm. {arms} of {spiral.turns:g} turns; dash-dotted: centreline"
            f" of one arm, r = c √θ from R_i to R_o, {1e3 * design.outline.arm_length_m:.1f} mm"
            f" long, of which {1e3 * design.outline.free_arm_length_m:.1f} mm between the fillets."
            " Radii R_i and R_o are the centreline's.",
        )


def _bare_axes(half_width: float, heights: tuple[float, float]) -> Axes:
    """Axes in mm without frame that fill a new figure, about the part's axis."""
    height = FIGURE_WIDTH_IN * (heights[1] - heights[0]) / (2 * half_width)
    figure = new_figure(height, layout="none")
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_xlim(-half_width, half_width)
    axes.set_ylim(*heights)
    axes.axis("off")
    return axes


def _centreline(axes: Axes, design: SpringDesign) -> None:
    line = design.spiral.centreline
    points = 1e3 * line.point(np.linspace(line.start, line.end, 400))
    axes.plot(*points.T, color=BLUE, lw=0.9, ls=(0, (7, 2, 1, 2)))
    axes.plot(*points[[0, -1]].T, "o", color=BLUE, ms=3)


def _thickness(axes: Axes, design: SpringDesign) -> None:
    """A dimension arrow across the strip where its callout points."""
    line, theta = design.spiral.centreline, _strip_theta(design)
    across = float(design.spiral.thickness_at(theta)) / 2 * line.normal(theta)
    ends = [tuple(1e3 * (line.point(theta) + side * across)) for side in (-1, +1)]
    _dimension(axes, *ends)


def _callouts(design: SpringDesign) -> tuple[list[_Callout], list[_Callout]]:
    """Hub's features to the left, the rim's and the strip's to the right."""
    s, line = design.spiral, design.spiral.centreline
    feet = design.outline.feet
    notch, slit = (design.outline.edge(f"{kind}_fillet:0") for kind in ("notch", "slit"))
    strip = _strip_theta(design)
    left = [
        _on_circle("$R_b$", "bore", s.bore_radius_m, 2.75),
        _on_circle("$R_h$", "hub", s.hub_radius_m, 3.45),
        _at("$R_i$", "arm starts", s.inner_radius_m, line.point(line.start)),
        _at("$r_f$", "notch fillet", s.fillet_radius_m, notch.point(0.5)),
    ]
    right = [
        _on_circle("$R_{ro}$", "rim, outer", s.rim_outer_radius_m, 0.75),
        _on_circle("$R_{ri}$", "rim, inner", s.rim_inner_radius_m, _free_rim_angle(design)),
        _at("$R_o$", "arm ends", s.outer_radius_m, line.point(line.end)),
        _at("$w_1$", "strip", float(s.thickness_at(strip)), line.point(strip)),
    ]
    slit_callout = _at("$r_f$", "slit fillet", s.fillet_radius_m, slit.point(0.5))
    (right if slit_callout.point_mm[0] > 0 else left).append(slit_callout)
    if feet.tip_theta and s.tip_radius_m > 0:
        corner = _at(
            "$r_t$", "tip corner", s.tip_radius_m, design.outline.edge("tip_round:0").point(0.5)
        )
        (right if corner.point_mm[0] > 0 else left).append(corner)
    return left, right


def _at(symbol: str, what: str, size_m: float, point_m: NDArray) -> _Callout:
    x, y = 1e3 * np.asarray(point_m)
    return _Callout(text=f"{symbol} {1e3 * size_m:g}\n{what}", point_mm=(float(x), float(y)))


def _on_circle(symbol: str, what: str, radius_m: float, polar_rad: float) -> _Callout:
    return _at(symbol, what, radius_m, radius_m * np.array([np.cos(polar_rad), np.sin(polar_rad)]))


def _free_rim_angle(design: SpringDesign) -> float:
    """Polar angle of the rightmost point of the rim's inner circle that borders a coil gap."""
    points = np.concatenate(
        [
            design.outline.edge(f"rim_inner:{k}").point(np.linspace(0.05, 0.95, 60))
            for k in range(design.n_arms)
        ]
    )
    right = points[np.argmax(points[:, 0] - 0.25 * np.abs(points[:, 1]))]
    return float(np.arctan2(right[1], right[0]))


def _strip_theta(design: SpringDesign) -> float:
    """Where the strip of arm 0 runs furthest to the right, inside its outermost coil."""
    line = design.spiral.centreline
    theta = np.linspace(design.outline.feet.notch_theta, line.end, 600)
    x, y = line.point(theta).T
    inside = np.hypot(x, y) < 0.9 * design.spiral.outer_radius_m
    return float(theta[inside][np.argmax((x - 0.5 * np.abs(y))[inside])])


def _place(axes: Axes, callouts: list[_Callout], x: float, align: str, radius: float) -> None:
    """Labels in a column beside the part, in the order of what they point at."""
    ordered = sorted(callouts, key=lambda c: c.point_mm[1])
    heights = np.linspace(-0.82, 0.82, len(ordered)) * radius
    for callout, y in zip(ordered, heights):
        axes.annotate(
            callout.text,
            xy=callout.point_mm,
            xytext=(x, y),
            ha=align,
            va="center",
            linespacing=1.15,
            arrowprops={**_LEADER, "shrinkA": 2, "shrinkB": 0},
        )


def _side_view(axes: Axes, radius: float, width: float) -> None:
    bottom = -1.22 * radius - width
    axes.add_patch(Rectangle((-radius, bottom), 2 * radius, width, fc=PART, ec=INK, lw=0.8))
    for y in (bottom, bottom + width):
        axes.plot([1.02 * radius, 1.2 * radius], [y, y], color=INK, lw=0.5)
    _dimension(axes, (1.13 * radius, bottom), (1.13 * radius, bottom + width))
    axes.text(1.24 * radius, bottom + width / 2, f"$w_2$ {width:g}", va="center")
    below = bottom - 0.12 * radius
    for x in (-radius, radius):
        axes.plot([x, x], [bottom - 0.02 * radius, below - 0.03 * radius], color=INK, lw=0.5)
    _dimension(axes, (-radius, below), (radius, below))
    axes.text(
        0,
        below,
        f"⌀ {2 * radius:g}",
        ha="center",
        va="center",
        bbox={"fc": "white", "ec": "none", "pad": 2},
    )


def _dimension(axes: Axes, start: tuple[float, float], end: tuple[float, float]) -> None:
    axes.annotate(
        "",
        xy=start,
        xytext=end,
        arrowprops={**_LEADER, "arrowstyle": "<|-|>,head_width=0.16", "shrinkA": 0, "shrinkB": 0},
    )


def boundary_conditions(design: SpringDesign, lateral_stiffness_N_per_m: float) -> ReportFigure:
    """How the spring is held and turned: clamped bore, rim turned rigidly, the two directions."""
    s = design.spiral
    outer, bore = 1e3 * s.rim_outer_radius_m, 1e3 * s.bore_radius_m
    with house_style():
        axes = _bare_axes(1.55 * outer, (-1.3 * outer, 1.3 * outer))
        axes.add_patch(PathPatch(solid_path(design.outline), fc=PART, ec=GREY, lw=0.6))
        axes.add_patch(Circle((0, 0), bore, fc="white", ec=INK, lw=1.6, hatch="//////"))
        axes.add_patch(Circle((0, 0), outer, fc="none", ec=INK, lw=2.2))
        axes.plot(0, 0, "+", color=INK, ms=9, mew=1.4)
        _turn_arrow(axes, 1.1 * outer, 0.42, 1.1, BLUE)
        _turn_arrow(axes, 1.1 * outer, -0.42, -1.1, VERMILION)
        corner = 1.53 * outer, 1.26 * outer
        _legend(
            axes, "winding", "+φ winding", "anticlockwise: the\narms tighten on the hub", corner
        )
        _legend(axes, "unwinding", "−φ unwinding", "clockwise: the arms\nopen to the rim", corner)
        _note(
            axes, "bore clamped:\nno displacement", (-0.7 * bore, 0.7 * bore), corner[0], corner[1]
        )
        rim = (outer * np.cos(3.95), outer * np.sin(3.95))
        _note(
            axes,
            "rim turned as a rigid ring\nby φ about the fixed axis",
            rim,
            corner[0],
            -corner[1],
        )
        return as_svg(
            axes.figure,
            name="boundary",
            alt="Boundary conditions: the bore is clamped, the rim is turned as a rigid ring"
            " about the fixed axis; anticlockwise is winding and positive, clockwise unwinding"
            " and negative.",
            caption="Boundary condition “bearing”: a bearing must keep the axes of hub and rim"
            " together, for the spring alone holds the rim sideways with only"
            f" {lateral_stiffness_N_per_m / 1e3:.0f} N/mm in its softest direction. The torque is"
            " the reaction to the imposed angle φ. Seen along the axis, from +z.",
        )


def _legend(axes: Axes, direction: str, title: str, text: str, corner: tuple[float, float]) -> None:
    """Words beside a direction's arrow: winding in the upper right corner, else in the lower."""
    x, y = corner
    up = direction == "winding"
    style = {"ha": "right", "color": DIRECTION_COLOUR[direction], "va": "top" if up else "bottom"}
    first, second = (title, text) if up else (text, title)
    sign = 1 if up else -1
    bold, normal = {"weight": "bold"}, {}
    axes.text(x, sign * y, first, **style, **(bold if up else normal))
    axes.annotate(
        second,
        (x, sign * y),
        xytext=(0, -12 * sign if up else 24),
        textcoords="offset points",
        **style,
        **(normal if up else bold),
    )


def _note(axes: Axes, text: str, point: tuple[float, float], x: float, y: float) -> None:
    axes.annotate(
        text,
        xy=point,
        xytext=(-x, y),
        ha="left",
        va="top" if y > 0 else "bottom",
        arrowprops={**_LEADER, "shrinkA": 2, "shrinkB": 0, "relpos": (0.5, 0 if y > 0 else 1)},
    )


def _turn_arrow(axes: Axes, radius: float, start: float, end: float, colour: str) -> None:
    angle = np.linspace(start, end, 40)
    points = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    axes.add_patch(
        FancyArrowPatch(
            path=PlotPath(points),
            arrowstyle="-|>,head_width=5,head_length=8",
            lw=2.4,
            color=colour,
            shrinkA=0,
            shrinkB=0,
        )
    )
