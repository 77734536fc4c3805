"""The gap between the coils along an arm, at rest and at each direction's last state."""

from collections.abc import Mapping

import numpy as np

from dftfs.report.gap_profile import GapProfile
from dftfs.report.numbers import minus
from dftfs.report.style import (
    DIRECTION_COLOUR,
    DIRECTION_MARKER,
    INK,
    ReportFigure,
    as_svg,
    house_style,
    new_figure,
)

_TOP_OVER_REST = 1.6
_TOUCHING_M = 1e-6


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
            smallest.append(f"{direction} {_gap_words(profile.smallest_m)}")
        known = 1e3 * rest.gap_m[np.isfinite(rest.gap_m)]
        axes.set_ylim(0, _TOP_OVER_REST * float(np.quantile(known, 0.9)))
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


def _gap_words(gap_m: float) -> str:
    if abs(gap_m) < _TOUCHING_M:
        return "0 (first contact)"
    return minus(f"{1e3 * gap_m:.3f} mm")
