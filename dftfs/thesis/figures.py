"""Figures of the thesis: what of them can be drawn from its own numbers, or why not.

The text beside the errata holds tables and equations but no picture and no
row of a curve, so that no measured curve can be drawn as printed. Drawn are the fuzzy controller,
whose tables are its figures, as printed and as repaired, and every table's numbers as printed and
as recomputed. All other figures of the ranges have their reason in `REASONS`.
"""

from collections.abc import Sequence

import numpy as np

from dftfs.report.style import (
    BLUE,
    GREY,
    INK,
    VERMILION,
    ReportFigure,
    as_png,
    house_style,
    new_figure,
)
from dftfs.thesis.reproduction import REPRODUCED, Row

CURVES = "curves in a picture; the text has no rows of them"
MEASURED = f"measured {CURVES}, and no recording of that bench is published"
REASONS = (  # first and last figure, what they are, file that draws them or why none does
    ("2.24", "2.24", "model in Simulink, views of the solid", "a drawing without numbers"),
    ("2.25", "2.26", "open-loop runs, power", MEASURED),
    ("3.3", "3.4", "estimated and measured friction torque", MEASURED),
    ("4.2", "4.3", "step and sine of the PID loops", f"{CURVES}; the gains of Table 4.1 are in no"
     " stated unit and the reference is not stated"),
    ("4.4", "4.5", "block diagrams", "a drawing without numbers"),
    ("4.6", "4.6", "membership functions", "membership.png"),
    ("4.7", "4.7", "decision surface", "surface.png"),
    ("4.8", "4.9", "block diagrams", "a drawing without numbers"),
    ("4.10", "4.10", "FHIC with plain parameters", f"{CURVES}; reference, wall and load are not"
     " stated"),
    ("4.11", "4.11", "tuning process", "a drawing without numbers"),
    ("4.12", "4.14", "steps of the tuned FHIC", f"{CURVES}; their numbers are in the charts of"
     " the tables"),
    ("4.15", "4.15", "model in Simulink", "a drawing without numbers"),
    ("4.16", "4.18", "fuzzy sets and surface of AFHIC", "the sets are printed in a picture only"),
    ("4.19", "4.19", "block diagram", "a drawing without numbers"),
    ("4.20", "4.21", "simulated AFHIC", f"{CURVES}; its fuzzy sets are not in the text"),
    ("5.10", "5.14", "torque controllers on the bench", MEASURED),
    ("5.15", "5.16", "bench and dSPACE models", "a drawing without numbers"),
    ("5.17", "5.17", "FHIC with three sets of parameters", MEASURED),
    ("5.18", "5.18", "frequency responses", f"{MEASURED}; its margins are in the charts of the"
     " tables"),
    ("5.19", "5.41", "impedance controllers on the bench", MEASURED),
)  # fmt: skip
_SHAPE = 61
READINGS = ("as printed", "repaired")


def thesis_figures(rows: Sequence[Row], printed, repaired) -> dict[str, ReportFigure]:
    """Figures by the names of their PNG files; a chart for each table with pairs of numbers.

    Parameters
    ----------
    printed, repaired : FuzzySystem
        The thesis' fuzzy torque controller in both readings.
    """
    systems = (printed, repaired)
    found = {"membership": membership_figure(systems), "surface": surface_figure(systems)}
    for table in dict.fromkeys(row.table for row in rows):
        own = [row for row in rows if row.table == table and row.deviation is not None]
        if own:
            name = "table-" + "-".join("".join(c if c.isalnum() else " " for c in table).split())
            found[name] = deviation_figure(table, own)
    return found


def figure_list(names: Sequence[str]) -> str:
    """A document in Markdown: each figure of the ranges, and where it is drawn or why not."""
    lines = ["# Figures of the thesis", "", "| figure | what | drawn |", "| --- | --- | --- |"]
    for first, last, what, where in REASONS:
        number = first if first == last else f"{first} to {last}"
        lines.append(f"| {number} | {what} | {where} |")
    lines += ["", "Tables, printed against recomputed:", ""]
    lines += [f"- `{name}.png`" for name in names if name.startswith("table-")]
    return "\n".join([*lines, ""])


def deviation_figure(table: str, rows: Sequence[Row]) -> ReportFigure:
    """How far each recomputed number of a table is from the printed one."""
    with house_style():
        figure = new_figure(0.9 + 0.2 * len(rows))
        axes = figure.subplots()
        place = np.arange(len(rows))[::-1]
        off = 100.0 * np.array([row.deviation for row in rows])
        colours = [BLUE if row.verdict == REPRODUCED else VERMILION for row in rows]
        axes.hlines(place, 0.0, off, color=colours, lw=1.0)
        axes.scatter(off, place, color=colours, s=14)
        axes.axvline(0.0, color=INK, lw=0.8)
        axes.set_yticks(place, [row.what[:60] for row in rows], fontsize=6)
        axes.set_xscale("symlog", linthresh=10.0)
        axes.set_xlabel("recomputed over printed, less one (%)")
        axes.set_title(f"Table {table}" if table[0].isdigit() else table.capitalize())
    return as_png(
        figure,
        name=f"table-{table}",
        alt=f"Deviation of every recomputed number of {table} from the printed one.",
        caption="Blue: reproduced; red: the verdict says why not.",
    )


def membership_figure(systems: Sequence) -> ReportFigure:
    """Figure 4.6: sets of error, rate and command, as printed and as repaired."""
    with house_style():
        figure = new_figure(4.6)
        axes = figure.subplots(3, 2, sharey=True)
        for column, system in enumerate(systems):
            sizes = (
                (system.first, "error (Nm)"), (system.second, "rate (Nm/s)"),
                (system.output, "PWM (%)"),
            )  # fmt: skip
            for place, (sets, label) in enumerate(sizes):
                for corners, name in zip(sets, system.names[place], strict=True):
                    axes[place, column].plot(corners, (0.0, 1.0, 0.0), lw=0.9, color=BLUE)
                    axes[place, column].text(
                        corners[1], 1.02, name, fontsize=6, ha="center", color=GREY
                    )
                axes[place, column].set_xlabel(label)
        for axis, title in zip(axes[0], READINGS, strict=True):
            axis.set_title(title, pad=10)
    return as_png(
        figure,
        name="membership",
        alt="Membership functions of the fuzzy torque controller, printed and repaired.",
        caption="Figure 4.6 from Table 4.3; what was repaired is in rsea_core's thesis_rules.",
    )


def surface_figure(systems: Sequence) -> ReportFigure:
    """Figure 4.7: the fuzzy controller's answer, as printed and as repaired."""
    with house_style():
        figure = new_figure(3.0)
        axes = figure.subplots(1, 2, sharey=True)
        for axis, system, title in zip(axes, systems, READINGS, strict=True):
            error, rate = (
                np.linspace(sets.min(), sets.max(), _SHAPE)
                for sets in (system.first, system.second)
            )
            answer = system.evaluate(error[None, :], rate[:, None])
            drawn = axis.contourf(error, rate, answer, levels=np.linspace(0.0, 100.0, 21))
            axis.set_title(title)
            axis.set_xlabel("actual less desired torque (Nm)")
        axes[0].set_ylabel("its rate (Nm/s)")
        figure.colorbar(drawn, ax=list(axes), label="PWM (%)")
    return as_png(
        figure,
        name="surface",
        alt="Answer of the fuzzy torque controller over error and rate, printed and repaired.",
        caption="Figure 4.7 from Tables 4.2 and 4.3.",
    )
