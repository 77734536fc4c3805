"""Figures of the proof's report: confusion, detection, calibration, held-out errors."""

import numpy as np

from dftfs.proof.summary import STRENGTH_EDGES, Summary
from dftfs.report.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    LIGHT,
    ORANGE,
    SKY,
    VERMILION,
    ReportFigure,
    as_png,
    house_style,
    new_figure,
)

METHODS = {
    "nominal": ("rig file as it is", GREY),
    "refit": ("parameters only", INK),
    "sparse": ("sparse regression", ORANGE),
    "gaussian-process": ("Gaussian process", SKY),
    "friction-family": ("friction family", GREEN),
    "predicted": ("diagnosis", BLUE),
}
WHITE_ON = 0.55  # share of a row above which the number in a cell is white


def confusion_figure(summary: Summary) -> ReportFigure:
    """True effect against what was claimed first, counts; rows are normalised for the colour."""
    claims = {c for row in summary.confusion.values() for c in row}
    in_order = sorted(claims | set(summary.confusion), key=lambda c: (c.startswith("("), c))
    truths = [c for c in in_order if c in summary.confusion]
    claimed = [c for c in in_order if c in claims]
    table = np.array([[summary.confusion[t].get(c, 0) for c in claimed] for t in truths], float)
    share = table / np.maximum(table.sum(1, keepdims=True), 1.0)
    with house_style():
        figure = new_figure(1.6 + 0.24 * len(truths), 2.6 + 0.27 * len(claimed))
        axes = figure.subplots()
        axes.imshow(share, cmap="Blues", vmin=0.0, vmax=1.0, aspect="auto")
        axes.set_xticks(range(len(claimed)), claimed, rotation=90)
        axes.set_yticks(range(len(truths)), truths)
        axes.grid(False)
        for i, j in zip(*np.nonzero(table), strict=True):
            colour = "white" if share[i, j] > WHITE_ON else INK
            axes.text(j, i, f"{int(table[i, j])}", ha="center", va="center", color=colour)
        axes.set_xlabel("claimed first, or the verdict in brackets")
        axes.set_ylabel("true")
        return as_png(
            figure,
            name="confusion",
            alt="Confusion matrix of true effects against claims",
            caption="Cases with one effect, none, or one outside the library: what was there (rows)"
            " and what was claimed first (columns).",
        )


def detection_figure(summary: Summary) -> ReportFigure:
    """Share of the true effects found against the strength of their trace."""
    rows = summary.detection
    with house_style():
        figure = new_figure(2.9)
        axes = figure.subplots()
        top = max((r[0] for r in rows), default=STRENGTH_EDGES[-2]) * 2.0
        for low, high, found, count in rows:
            p = found / count
            centre = np.sqrt(low * min(high, top))
            axes.plot(centre, p, "o", color=BLUE, ms=4 + 1.2 * np.sqrt(count))
            axes.annotate(
                f"{found}/{count}",
                (centre, p),
                textcoords="offset points",
                xytext=(0, -14 if p > 0.15 else 8),
                ha="center",
                fontsize=8,
            )
        if summary.half_detected_at:
            axes.axvline(summary.half_detected_at, color=VERMILION, lw=1, ls="--")
            axes.annotate(
                f"half found at {summary.half_detected_at:.1f}",
                (summary.half_detected_at, 0.08),
                textcoords="offset points",
                xytext=(4, 0),
                color=VERMILION,
                fontsize=8.5,
            )
        axes.set_xscale("log")
        axes.set_ylim(-0.05, 1.08)
        axes.set_xlabel("strength: what no constants mimic, over the noise floor")
        axes.set_ylabel("share found")
        return as_png(
            figure,
            name="detection",
            alt="Detection curve against strength",
            caption="How often a true effect is claimed, against the size of the trace that"
            " re-estimated constants leave (root mean square over the noise floor, worst channel).",
        )


def reliability_figure(summary: Summary) -> ReportFigure:
    """Stated confidence against the share that was true."""
    with house_style():
        figure = new_figure(3.1, 3.6)
        axes = figure.subplots()
        axes.plot([0, 1], [0, 1], color=LIGHT, lw=1.2)
        rows = summary.calibration.rows if summary.calibration else []
        for stated, true, count in rows:
            size = 4 + 1.2 * np.sqrt(count)
            axes.plot(stated, true, "o", color=BLUE, ms=size)
            axes.annotate(
                str(count), (stated, true), textcoords="offset points", fontsize=8,
                xytext=(0, -0.5 * size - 2), ha="center", va="top",
            )  # fmt: skip
        axes.set_xlim(-0.03, 1.06)
        axes.set_ylim(-0.08, 1.08)
        axes.set_xlabel("stated confidence")
        axes.set_ylabel("share true")
        return as_png(
            figure,
            name="reliability",
            alt="Reliability diagram of the stated confidences",
            caption="Effects by stated confidence: mean stated against share true; numbers are"
            " counts.",
        )


def held_out_figure(errors: dict[str, list[float]]) -> ReportFigure:
    """Hidden-test error over the floor, per method: every case and channel, median as a bar."""
    names = [m for m in METHODS if errors.get(m)]
    with house_style():
        figure = new_figure(0.9 + 0.42 * len(names))
        axes = figure.subplots()
        spread = np.random.default_rng(0)
        for row, name in enumerate(reversed(names)):
            values = np.maximum(np.array(errors[name]), 0.5)
            y = row + spread.uniform(-0.22, 0.22, values.size)
            axes.plot(values, y, ".", color=METHODS[name][1], alpha=0.45, ms=4)
            middle = float(np.median(values))
            axes.plot([middle, middle], [row - 0.34, row + 0.34], color=INK, lw=2)
            axes.annotate(
                f"{middle:.1f}", (middle, row + 0.34), ha="center", va="bottom", fontsize=8
            )
        axes.set_yticks(range(len(names)), [METHODS[n][0] for n in reversed(names)])
        axes.set_xscale("log")
        axes.axvline(1.0, color=GREY, lw=0.8, ls="--")
        axes.set_xlabel("error of the hidden test over the error of the exact truth")
        return as_png(
            figure,
            name="held-out",
            alt="Hidden-test errors of the methods",
            caption="Free-run error on hidden recordings, every case and channel that an"
            " effect changes; the bar is the median, 1 is what the exact truth scores.",
        )
