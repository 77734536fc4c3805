"""A page of recordings: a table, notes, and every column over time. Arrays only, no machine."""

import io
from collections.abc import Mapping, Sequence
from html import escape

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

MOST_ROWS = 3000
STYLE = (
    "body{font-family:sans-serif;max-width:1100px;margin:2em auto;padding:0 1em;color:#222}"
    "table{border-collapse:collapse;font-size:14px}td,th{border-bottom:1px solid #ddd;"
    "padding:4px 10px;text-align:left;vertical-align:top}li{margin:.3em 0}svg{max-width:100%}"
)


def recording_page(
    title: str,
    header: Sequence[str],
    rows: Sequence[Sequence[str]],
    notes: Sequence[str],
    recordings: Sequence[tuple[str, NDArray, Mapping[str, NDArray]]],
) -> str:
    """The page as HTML text, complete in itself.

    Parameters
    ----------
    recordings : sequence of (name, (n,) time in s, mapping of column to (n,) array)
    """
    head = "".join(f"<th>{escape(h)}</th>" for h in header)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows
    )
    listed = "".join(f"<li>{escape(note)}</li>" for note in notes) or "<li>none</li>"
    plots = "".join(f"<h2>{escape(name)}</h2>{_plot(t, c)}" for name, t, c in recordings)
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{escape(title)}</title>'
        f"<style>{STYLE}</style><h1>{escape(title)}</h1><table><tr>{head}</tr>{body}</table>"
        f"<h2>Notes</h2><ul>{listed}</ul>{plots}</html>\n"
    )


def _plot(time: NDArray, columns: Mapping[str, NDArray]) -> str:
    figure = Figure(figsize=(10.5, 1.3 * len(columns) + 0.5), layout="constrained")
    axes = np.atleast_1d(figure.subplots(len(columns), 1, sharex=True))
    stride = max(1, time.size // MOST_ROWS)
    for own, (name, values) in zip(axes, columns.items()):
        own.plot(time[::stride], values[::stride], linewidth=0.8, color="#1f5f99")
        own.set_title(name, fontsize=9, loc="left")
        own.tick_params(labelsize=8)
        own.grid(alpha=0.3)
    axes[-1].set_xlabel("time in s", fontsize=9)
    stream = io.StringIO()
    figure.savefig(stream, format="svg")
    return stream.getvalue()[stream.getvalue().index("<svg") :]
