"""A page of recordings: a table, notes, and every column over time. Arrays only, no machine."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from dftfs.report.figures.actuator import decimated
from dftfs.report.live import Curve, Panel, with_live
from dftfs.report.numbers import readable
from dftfs.report.page import page_environment, render_page
from dftfs.report.study.tables import Table
from dftfs.report.style import BLUE, ReportFigure, as_svg, house_style, new_figure

DRAWN, LIVE = 24, 6  # recordings drawn, and those that can be zoomed: a page stays below 5 MB


def recording_page(
    title: str,
    head: Sequence[str],
    rows: Sequence[Sequence[str]],
    notes: Sequence[str],
    recordings: Sequence[tuple[str, NDArray, Mapping[str, NDArray]]],
    facts: Sequence[tuple[str, str]] = (),
    lead: Sequence[str] = (),
) -> str:
    """The page as HTML text, complete in itself.

    Parameters
    ----------
    recordings : sequence of (name, (n,) time in s, mapping of column to (n,) array)
    facts : sequence of (label, value)
        Where the page comes from.
    lead : sequence of sentences
        The result in short.
    """
    figures = [_plot(k, *recording) for k, recording in enumerate(recordings[:DRAWN])]
    if len(recordings) > DRAWN:
        notes = [*notes, f"drawn: the first {DRAWN} of {len(recordings)} recordings"]
    shown = tuple(tuple(_readable(str(cell)) for cell in row) for row in rows)
    return render_page(
        page_environment(),
        "plain.html",
        figures,
        title=title,
        kicker="Recordings",
        lead=tuple(lead),
        tables=[Table(caption="", head=tuple(head), rows=shown)],
        first_figures=(),
        notes=list(notes),
        figures=figures,
        facts=facts,
    )


def _readable(text: str) -> str:
    """A column's name as words and unit; other text as it is."""
    name, unit = readable(text) if text.isidentifier() else (text, "")
    return f"{name} ({unit})" if unit else text


def _plot(number: int, name: str, time: NDArray, columns: Mapping[str, NDArray]) -> ReportFigure:
    labels = [_readable(name) for name in columns]
    with house_style():
        figure = new_figure(1.1 * len(columns) + 0.6, width_in=9.0)
        panels = np.atleast_1d(figure.subplots(len(columns), 1, sharex=True))
        for axes, label, values in zip(panels, labels, columns.values(), strict=True):
            axes.plot(*decimated(time, np.asarray(values, dtype=float)), lw=0.8, color=BLUE)
            axes.set_title(label)
        panels[-1].set_xlabel("time (s)")
        drawn = as_svg(
            figure,
            name=f"recording-{number}",
            alt=f"Columns of {name} over time: {', '.join(labels)}.",
            caption=f"{name}: every column over time.",
        )
    own = tuple(
        Panel(label=label, curves=(Curve(name=label, values=values, colour=BLUE),))
        for label, values in zip(labels, columns.values(), strict=True)
    )
    return drawn if number >= LIVE else with_live(drawn, time, own)
