"""The gap between the coils along an arm, at rest and at each direction's last state."""

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from numpy.typing import NDArray

from dftfs.analysis.torsion.result import ContactOnset, FieldSnapshot
from dftfs.report.figures.cell_outlines import border_edges, cell_outlines, near
from dftfs.report.figures.gap_profile import GapProfile
from dftfs.report.numbers import minus, signed
from dftfs.report.style import (
    DIRECTION_COLOUR,
    DIRECTION_MARKER,
    GREY,
    INK,
    PART,
    ReportFigure,
    as_svg,
    house_style,
    new_figure,
)

_TOP_OVER_REST = 2.4
_TOUCHING_M = 1e-6
_VIEW = 2.2  # half side of a close view over the strip's thickness


def gap_figure(
    rest: GapProfile, loaded: Mapping[str, GapProfile], labels: Mapping[str, str]
) -> ReportFigure:
    """Gap in mm along the arm's outer edge; ``labels`` names the state of each direction."""
    with house_style():
        figure = new_figure(3.6)
        axes = figure.add_subplot()
        axes.plot(1e3 * rest.arc_length_m, 1e3 * rest.gap_m, color=INK, lw=1.2, label="at rest")
        smallest = []
        for direction, profile in loaded.items():
            colour = DIRECTION_COLOUR[direction]
            axes.plot(
                1e3 * profile.arc_length_m,
                1e3 * profile.gap_m,
                color=colour,
                ls="-" if direction == "winding" else (0, (5, 1.5)),
                label=labels[direction],
            )
            axes.plot(
                1e3 * profile.smallest_at_m,
                1e3 * profile.smallest_m,
                DIRECTION_MARKER[direction],
                color=colour,
                ms=9,
                clip_on=False,
                zorder=5,
            )
            smallest.append(f"{direction} {_gap_text(profile.smallest_m)}")
        known = 1e3 * rest.gap_m[np.isfinite(rest.gap_m)]
        axes.set_ylim(0, _TOP_OVER_REST * float(np.median(known)))
        axes.set_xlim(0, 1e3 * rest.arc_length_m[-1])
        axes.set_xlabel("distance along the arm's outer edge from the hub (mm)")
        axes.set_ylabel("gap to the facing edge (mm)")
        distance, angle = 1e3 * rest.arc_length_m, np.degrees(rest.angle_rad)
        top = axes.secondary_xaxis(
            "top",
            functions=(
                lambda x: np.interp(x, distance, angle),
                lambda a: np.interp(a, angle, distance),
            ),
        )
        top.set_xlabel("angle about the axis from there (degrees)")
        top.spines["top"].set_visible(True)
        axes.legend(loc="best")
        text = ", ".join(smallest) if smallest else "no loaded state"
        return as_svg(
            figure,
            name="gap",
            alt=f"Gap between the coils in mm along the arm. Smallest gaps: {text}.",
            caption="Gap from the outer edge of one arm, outwards, to what faces it: first the next"
            " coil, beyond that coil's tip (the jump) the rim, where the slit closes at the arm's"
            f" root. Triangles: smallest gap of the state, facing corners included: {text}.",
        )


def contact_figure(
    snapshots: Mapping[str, FieldSnapshot],
    onsets: Mapping[str, ContactOnset | None],
    thickness_m: float,
) -> ReportFigure | None:
    """Close views of where the coils touch first, deformed; None where none do."""
    shown = [d for d in snapshots if onsets.get(d) is not None]
    if not shown:
        return None
    half = _VIEW * 1e3 * thickness_m
    with house_style():
        figure = new_figure(3.05)
        for column, direction in enumerate(shown):
            snapshot, onset = snapshots[direction], onsets[direction]
            axes = figure.add_subplot(1, len(shown), column + 1)
            centre = 1e3 * np.asarray(onset.at_m)
            _close_view(axes, snapshot, centre, half)
            axes.plot(*centre, "o", mfc="none", mec=DIRECTION_COLOUR[direction], ms=13, mew=2)
            axes.set_title(
                f"{direction}, {signed(onset.torque_Nm, 3)} Nm", color=DIRECTION_COLOUR[direction]
            )
        gap_text = "; ".join(
            f"{d} at x = {1e3 * onsets[d].at_m[0]:.1f}, y = {1e3 * onsets[d].at_m[1]:.1f} mm"
            f" (radius {1e3 * np.hypot(*onsets[d].at_m):.1f} mm)"
            for d in shown
        )
        return as_svg(
            figure,
            name="contact",
            alt=minus(f"Where the coils first touch on the deformed spring: {gap_text}."),
            caption=minus(
                f"Where the coils touch first (ring), deformed: {gap_text}. Dashed: unloaded."
            ),
        )


def _close_view(axes: Axes, snapshot: FieldSnapshot, centre: NDArray, half: float) -> None:
    """Cells and border of a deformed field within a square window."""
    rest = 1e3 * snapshot.nodes_m
    shape = rest + 1e3 * snapshot.displacement_m
    axes.set_xlim(centre[0] - half, centre[0] + half)
    axes.set_ylim(centre[1] - half, centre[1] + half)
    cells = near(cell_outlines(shape, snapshot.cells), centre, half)
    axes.add_collection(PolyCollection(cells, facecolors=PART, edgecolors=PART, linewidths=0.4))
    border = border_edges(snapshot.nodes_m, snapshot.cells)
    dashes = (0, (4, 3))
    for points, colour, width, style in ((rest, GREY, 0.7, dashes), (shape, INK, 1.0, "-")):
        lines = near(points[border], centre, half)
        axes.add_collection(
            LineCollection(lines, colors=colour, linewidths=width, linestyles=style)
        )
    axes.set_aspect("equal")
    axes.grid(False)
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_visible(True)


def _gap_text(gap_m: float) -> str:
    if abs(gap_m) < _TOUCHING_M:
        return "0 (first contact)"
    return minus(f"{1e3 * gap_m:.3f} mm")
