"""The Haigh diagram of a spring's places: every block's amplitude over its mean stress."""

from collections.abc import Sequence

from dftfs.analysis.strength.fatigue_lives import FatigueLife
from dftfs.report.style import (
    BLUE,
    GREEN,
    GREY,
    VERMILION,
    ReportFigure,
    as_png,
    house_style,
    new_figure,
)


def haigh_figure(
    lives: Sequence[FatigueLife], ultimate_Pa: float, yield_Pa: float | None, survival: float
) -> ReportFigure:
    """Points of every place, its own Goodman line at the stated survival, first yield."""
    with house_style():
        figure = new_figure(4.4, 6.4)
        axes = figure.subplots()
        for life, colour in zip(lives, (VERMILION, BLUE, GREEN)):
            left = life.endurance_Pa / 1e6
            ends = [-ultimate_Pa / 1e6, 0, ultimate_Pa / 1e6]
            axes.plot(ends, [left, left, 0], color=colour, lw=1.1)
            largest = max(point.cycles for point in life.points)
            axes.scatter(
                [point.mean_Pa / 1e6 for point in life.points],
                [point.amplitude_Pa / 1e6 for point in life.points],
                s=[14 + 40 * point.cycles / largest for point in life.points],
                color=colour,
                alpha=0.7,
                label=f"{life.region}, damage {max(life.goodman_damage, life.swt_damage):.2g}",
                zorder=3,
            )
        if yield_Pa is not None:
            limit = yield_Pa / 1e6
            yielding = {"color": GREY, "ls": (0, (4, 2)), "lw": 1.0, "label": "first yield"}
            axes.plot([-limit, 0, limit], [0, limit, 0], **yielding)
        axes.axvline(0, color=GREY, lw=0.6)
        top = max(
            *(point.amplitude_Pa for life in lives for point in life.points),
            *(life.endurance_Pa for life in lives),
        )
        axes.set_ylim(0, 1.6e-6 * top)
        means = [abs(point.mean_Pa) for life in lives for point in life.points]
        reach = max(*means, 0.3 * ultimate_Pa) / 1e6
        axes.set_xlim(-1.05 * reach, 1.05 * reach)
        axes.set_xlabel("mean stress (MPa)")
        axes.set_ylabel("stress amplitude (MPa)")
        axes.legend(loc="upper right", frameon=True)
        return as_png(
            figure,
            name="haigh",
            alt="Stress amplitude over mean stress of every load block at every place.",
            caption=(
                "Lines: amplitude left at the cycles of the material's fatigue strength and"
                f" {100 * survival:g} % survival, to the ultimate strength (Goodman)."
            ),
        )
