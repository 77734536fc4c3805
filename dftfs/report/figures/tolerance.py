"""The spread of stiffness and first contact, and the share of every cause in it."""

import numpy as np

from dftfs.analysis.study.tolerance import RESPONSES, ToleranceResult
from dftfs.report.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    SKY,
    VERMILION,
    ReportFigure,
    as_png,
    house_style,
    new_figure,
)

_TITLES = dict(
    zip(
        RESPONSES,
        ("Stiffness (Nm/rad)", "First contact, winding (Nm)", "First contact, unwinding (Nm)"),
    )
)
_COLOURS = {
    "thickness": BLUE, "kerf": SKY, "width": GREEN, "modulus": ORANGE, "fillet": VERMILION,
    "inclination": GREY, "arms": INK,
}  # fmt: skip


def tolerance_figure(result: ToleranceResult) -> ReportFigure:
    """A histogram per response with its 95 % interval; below, its variance by cause."""
    with house_style():
        figure = new_figure(4.6, 9.0)
        count = len(result.spreads)
        axes = figure.subplots(2, count, squeeze=False, gridspec_kw={"height_ratios": [2.4, 1]})
        for k, spread in enumerate(result.spreads):
            upper, lower = axes[0, k], axes[1, k]
            upper.hist(result.samples[spread.response], bins=60, color=GREY, alpha=0.55)
            upper.axvline(spread.nominal, color=INK, lw=1.2)
            for end in (spread.low, spread.high):
                upper.axvline(end, color=INK, lw=0.9, ls=(0, (3, 2)))
            upper.set_title(_TITLES[spread.response])
            upper.set_yticks([])
            upper.set_xlabel(f"{spread.nominal:.2f}, 95 %: {spread.low:.2f} to {spread.high:.2f}")
            causes = spread.causes[::-1]
            lower.barh(
                [cause.cause for cause in causes],
                [100 * cause.share for cause in causes],
                color=[_COLOURS[cause.cause] for cause in causes],
            )
            lower.set_xlim(0, 100)
            lower.set_xlabel("share of the variance (%)")
            lower.grid(axis="y", visible=False)
        count = np.size(next(iter(result.samples.values())))
        return as_png(
            figure,
            name="tolerance",
            alt="Histograms of stiffness and torques at first contact; shares of their causes.",
            caption=f"{count} parts. Full line: nominal; dashed: 95 % of the parts.",
        )
