"""Von Mises stress on the deformed shape, the peak enlarged."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator
from matplotlib.tri import Triangulation
from numpy.typing import NDArray

from dftfs.analysis.torsion.result import FieldSnapshot
from dftfs.report.figures.cell_outlines import border_edges
from dftfs.report.numbers import plain, signed
from dftfs.report.style import (
    DIRECTION_COLOUR,
    GREY,
    INK,
    VERMILION,
    ReportFigure,
    as_png,
    house_style,
    new_figure,
)

# corner triangles, then the square of the midsides
_TRIANGLES = ((0, 4, 7), (1, 5, 4), (2, 6, 5), (3, 7, 6), (4, 5, 6), (4, 6, 7))
_BANDS = 16
_COLOURS = LinearSegmentedColormap.from_list(
    "stress", ["#f7fbff", "#d3e4f1", "#94c4df", "#4a98c9", "#1764ab", "#08306b"]
)
_BULK = 0.98  # share of the area that is not at a notch


@dataclass(frozen=True, kw_only=True)
class StressScale:
    """Top of the colour bar; values above have one colour, labelled by ``above``."""

    top_Pa: float
    above: str | None
    yield_strength_Pa: float | None


def stress_scale(
    snapshots: Mapping[str, FieldSnapshot], yield_strength_Pa: float | None
) -> StressScale:
    """One scale for all fields: up to the yield strength where a peak exceeds it.

    Elsewhere the scale ends where the notches' peaks begin, or at the peak if it is near: they
    would leave the arms without colour.
    """
    stress = np.concatenate([s.von_mises_Pa for s in snapshots.values()])
    peak = float(stress.max())
    if yield_strength_Pa is not None and yield_strength_Pa < peak:
        return StressScale(
            top_Pa=yield_strength_Pa, above="above yield", yield_strength_Pa=yield_strength_Pa
        )
    top = 1.4 * max(bulk_stress_Pa(s) for s in snapshots.values())
    above = f"above {plain(1e-6 * top, 2)} MPa" if top < peak else None
    return StressScale(top_Pa=min(top, peak), above=above, yield_strength_Pa=yield_strength_Pa)


def stress_figure(
    snapshot: FieldSnapshot,
    *,
    direction: str,
    model: str,
    scale: StressScale,
    zoom_m: float,
    largest_Pa: float,
) -> ReportFigure:
    """One direction's last state: field, undeformed outline, colour bar in MPa, peak enlarged.

    ``zoom_m`` is the half side of the enlargement, ``largest_Pa`` the peak in the whole body.
    """
    shape = 1e3 * (snapshot.nodes_m + snapshot.displacement_m)
    stress = 1e-6 * snapshot.von_mises_Pa
    border = border_edges(snapshot.nodes_m, snapshot.cells)
    peak = peak_node(snapshot)
    triangulation = Triangulation(*shape.T, _triangles(snapshot.cells))
    torque = f"{signed(snapshot.torque_Nm, 3)} Nm"
    degrees = signed(float(np.degrees(snapshot.deflection_rad)), 3)
    angle = f"{signed(snapshot.deflection_rad, 3)} rad ({degrees}°)"
    radius = 1e3 * float(np.hypot(*snapshot.nodes_m[peak]))
    value = plain(float(stress[peak]), 3)
    with house_style():
        figure = new_figure(4.25, 6.0, layout="none")
        whole = figure.add_axes((0.0, 0.0, 0.69, 0.93))
        bands = _field(whole, triangulation, stress, scale)
        _outline(whole, 1e3 * snapshot.nodes_m, border, GREY, 0.35, (0, (4, 3)))
        _outline(whole, shape, border, INK, 0.45, "-")
        _frame_part(whole, shape)
        close = figure.add_axes((0.715, 0.555, 0.275, 0.385))
        _field(close, triangulation, stress, scale)
        _outline(close, shape, border, INK, 0.8, "-")
        _enlarge(close, whole, shape[peak], 1e3 * zoom_m, f"peak {value} MPa")
        _colour_bar(figure, bands, scale)
        figure.text(
            0.012,
            0.955,
            f"{direction}: {torque} at {angle}",
            fontsize=10,
            weight="bold",
            color=DIRECTION_COLOUR[direction],
        )
        return as_png(
            figure,
            name=f"stress-{direction}",
            alt=f"Von Mises stress on the deformed spring, {direction}, at {torque} and {angle}:"
            f" peak {value} MPa at radius {radius:.1f} mm.",
            caption=f"{direction.capitalize()}, {model}, mid-plane, first contact:"
            f" {torque} at {angle}. Peak {value} MPa (ring) at radius {radius:.1f} mm;"
            f" {plain(1e-6 * largest_Pa, 3)} MPa anywhere in the body."
            " Deformation to scale; dashed: unloaded. One colour scale for both directions.",
        )


def bulk_stress_Pa(snapshot: FieldSnapshot) -> float:
    """Stress that all but the most stressed few percent of the area stay below (cells' means)."""
    x, y = np.moveaxis(snapshot.nodes_m[snapshot.cells[:, :4]], -1, 0)
    area = 0.5 * np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)
    stress = snapshot.von_mises_Pa[snapshot.cells].mean(axis=1)
    order = np.argsort(stress)
    share = np.cumsum(area[order]) / area.sum()
    return float(stress[order][np.searchsorted(share, _BULK)])


def peak_node(snapshot: FieldSnapshot) -> int:
    """Node nearest to where the snapshot says its peak is."""
    return int(np.argmin(np.linalg.norm(snapshot.nodes_m - snapshot.peak_at_m, axis=1)))


def _triangles(cells: NDArray) -> NDArray:
    return cells[:, np.array(_TRIANGLES)].reshape(-1, 3)


def _field(axes: Axes, triangulation: Triangulation, stress: NDArray, scale: StressScale):
    axes.set_aspect("equal")
    axes.grid(False)
    above = VERMILION if scale.above == "above yield" else "#041c40"
    return axes.tricontourf(
        triangulation,
        np.maximum(stress, 0),
        levels=np.linspace(0, 1e-6 * scale.top_Pa, _BANDS + 1),
        cmap=_COLOURS.with_extremes(over=above),
        extend="neither" if scale.above is None else "max",
    )


def _outline(axes: Axes, points: NDArray, edges: NDArray, colour: str, width: float, style) -> None:
    axes.add_collection(
        LineCollection(points[edges], colors=colour, linewidths=width, linestyles=style)
    )


def _frame_part(axes: Axes, shape: NDArray) -> None:
    outer = 1.012 * float(np.hypot(*shape.T).max())
    axes.set_xlim(-outer, outer)
    axes.set_ylim(-outer, outer)
    axes.axis("off")


def _enlarge(close: Axes, whole: Axes, centre: NDArray, half: float, title: str) -> None:
    close.set_xlim(centre[0] - half, centre[0] + half)
    close.set_ylim(centre[1] - half, centre[1] + half)
    close.set_xticks([])
    close.set_yticks([])
    close.set_title(title)
    for spine in close.spines.values():
        spine.set_visible(True)
        spine.set_color(INK)
    close.plot(*centre, "o", mfc="none", mec="white", ms=17, mew=3.0)
    close.plot(*centre, "o", mfc="none", mec=INK, ms=17, mew=1.3)
    whole.add_patch(Rectangle(centre - half, 2 * half, 2 * half, fc="none", ec=INK, lw=1.2))


def _colour_bar(figure: Figure, bands, scale: StressScale) -> None:
    axes = figure.add_axes((0.82, 0.035, 0.032, 0.42))
    bar = figure.colorbar(bands, cax=axes)
    bar.set_label("von Mises stress (MPa)")
    axes.yaxis.set_label_position("left")
    top = 1e-6 * scale.top_Pa
    round_values = [v for v in MaxNLocator(6).tick_values(0, top) if 0 <= v < 0.93 * top]
    bar.set_ticks([*round_values, top], labels=[*(f"{v:g}" for v in round_values), plain(top, 3)])
    bar.minorticks_off()
    if scale.above is not None:
        axes.text(1.35, 1.06, scale.above, transform=axes.transAxes, va="center", fontsize=8.5)
