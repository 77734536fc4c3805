"""Curves to hover over, zoom into and switch off, in a page that needs no other file.

The drawn figure stays in the page for print and for readers without scripts; where scripts run,
plotly takes its place. Its library is kept compressed in the page (1.9 MB instead of 4.8) and
unpacked by the browser.
"""

import base64
import gzip
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dftfs.report.figures.actuator import decimated
from dftfs.report.style import DARK, GREY, INK, ReportFigure

POINTS = 3000  # of a curve: more than twice what a screen is wide
GAP = 0.04  # between panels, of the height
CHARACTER_px, HEAD_px = 7.0, 22  # of a panel's label: width of a character, height of its line
STARTER = """
(async () => {
  const packed = document.getElementById("plotly-gzip").textContent.trim();
  const bytes = Uint8Array.from(atob(packed), c => c.charCodeAt(0));
  const text = await new Response(new Blob([bytes]).stream()
    .pipeThrough(new DecompressionStream("gzip"))).text();
  const library = document.createElement("script");
  library.textContent = text;
  document.head.append(library);
  const dark = matchMedia("(prefers-color-scheme: dark)");
  dark.addEventListener("change", () => location.reload());
  const colour = found => dark.matches ? DARK[found.toLowerCase()] || found : found;
  for (const data of document.querySelectorAll("script.live")) {
    const figure = JSON.parse(data.textContent.replace(/#[0-9a-f]{6}/gi, colour));
    const still = data.parentElement.querySelector(".still");
    const place = document.createElement("div");
    place.className = "living";
    place.setAttribute("role", "img");
    place.setAttribute("aria-label", still.getAttribute("aria-label"));
    still.after(place);
    if (innerWidth < 600) {
      Object.assign(figure.layout.legend, {y: -0.16, yanchor: "top"});
      figure.layout.margin.b = 110;
      figure.layout.height += 70;
    }
    await Plotly.newPlot(place, figure.data, figure.layout,
      {responsive: true, displaylogo: false, modeBarButtonsToRemove: ["lasso2d", "select2d"]});
    still.classList.add("print-only");
  }
})().catch(() => {});
"""


@dataclass(frozen=True, kw_only=True)
class Curve:
    """One line: name, values over the panel's abscissa, colour; ``dash`` as plotly names it."""

    name: str
    values: NDArray
    colour: str = INK
    width: float = 1.3
    dash: str = "solid"
    in_legend: bool = True


@dataclass(frozen=True, kw_only=True)
class Panel:
    """Curves on one ordinate; ``height`` is the share beside the other panels'.

    ``band`` is half the height of a grey band about zero, None without one; ``log`` a logarithmic
    ordinate.
    """

    label: str
    curves: tuple[Curve, ...]
    height: float = 1.0
    band: float | None = None
    log: bool = False


def with_live(
    figure: ReportFigure,
    abscissa: NDArray,
    panels: Sequence[Panel],
    *,
    label: str = "time (s)",
    shaded_to: float | None = None,
    log: bool = False,
) -> ReportFigure:
    """A figure with the data of its living form; as it is where plotly is not installed.

    Parameters
    ----------
    abscissa : (n,) array
        What all panels share, so that the cursor runs through all of them.
    shaded_to : float or None
        The abscissa up to which the panels are shaded.
    log : bool
        A logarithmic abscissa.
    """
    if find_spec("plotly") is None:
        return figure
    heights = np.array([panel.height for panel in panels])
    layout = _layout(label, len(panels))
    drawn_px = layout["height"] - layout["margin"]["t"] - layout["margin"]["b"]
    room_px = heights / heights.sum() * drawn_px * (1.0 - GAP * (len(panels) - 1))
    above = any(len(p.label) * CHARACTER_px > px for p, px in zip(panels, room_px))
    gap = max(GAP, HEAD_px / drawn_px) if above else GAP
    usable = 1.0 - gap * (len(panels) - 1)
    tops = 1.0 - np.concatenate([[0.0], np.cumsum(heights / heights.sum() * usable + gap)[:-1]])
    # the labels say what a legend would
    named = all(len(p.curves) == 1 and p.curves[0].name == p.label for p in panels)
    if log:
        layout["xaxis"]["type"] = "log"
    if shaded_to is not None:
        whole = {"xref": "x", "x0": float(abscissa[0]), "x1": shaded_to}
        layout["shapes"].append(_shade(whole | {"yref": "paper", "y0": 0, "y1": 1}))
    data = []
    for k, panel in enumerate(panels):
        suffix = "" if k == 0 else str(k + 1)
        low = tops[k] - heights[k] / heights.sum() * usable
        layout[f"yaxis{suffix}"] = {
            "title": {"text": "" if above else panel.label}, "domain": [max(low, 0.0), tops[k]],
            "gridcolor": "#e3e7ec", "zerolinecolor": "#cfd6de", "anchor": "x",
            "type": "log" if panel.log else "linear",
        }  # fmt: skip
        if above:
            layout["annotations"].append(_head(panel.label, tops[k]))
        if panel.band is not None:
            band = {"y0": -panel.band, "y1": panel.band, "yref": f"y{suffix}", "x0": 0, "x1": 1}
            layout["shapes"].append(_shade(band | {"xref": "paper"}))
        data += [
            _trace(abscissa, curve, f"y{suffix}", shown=curve.in_legend and not named)
            for curve in panel.curves
        ]
    layout["xaxis"]["anchor"] = f"y{len(panels)}" if len(panels) > 1 else "y"
    text = json.dumps({"data": data, "layout": layout}, separators=(",", ":"))
    return replace(figure, live=text.replace("<", "\\u003c"))


def _trace(abscissa: NDArray, curve: Curve, ordinate: str, *, shown: bool) -> dict:
    x, y = decimated(abscissa, np.asarray(curve.values, dtype=float), POINTS)
    return {
        "type": "scattergl" if len(x) > 20_000 else "scatter", "mode": "lines",
        "name": curve.name, "x": _packed(x), "y": _packed(y), "yaxis": ordinate,
        "line": {"color": curve.colour, "width": curve.width, "dash": curve.dash},
        "legendgroup": curve.name, "showlegend": shown,
    }  # fmt: skip


def _layout(label: str, panels: int) -> dict:
    axis = {
        "title": {"text": label}, "gridcolor": "#e3e7ec", "zeroline": False, "showspikes": True,
        "spikemode": "across", "spikethickness": 1, "spikecolor": GREY, "spikedash": "dot",
    }  # fmt: skip
    return {
        "xaxis": axis, "hovermode": "x unified", "hoversubplots": "axis",
        "height": 200 + 110 * panels,
        "margin": {"l": 62, "r": 40, "t": 34, "b": 44}, "shapes": [], "annotations": [],
        "paper_bgcolor": "rgba(0,0,0,0)", "plot_bgcolor": "rgba(0,0,0,0)",
        "font": {"color": INK, "size": 12}, "hoverlabel": {"bgcolor": "#ffffff"},
        "modebar": {"orientation": "v", "bgcolor": "rgba(0,0,0,0)", "color": GREY},
        "legend": {"orientation": "h", "x": 0, "y": 1.02, "yanchor": "bottom"},
    }  # fmt: skip


def _head(text: str, top: float) -> dict:
    """The label of a panel above it, for one that is too low to have it at its side."""
    return {
        "text": text, "xref": "paper", "x": 0, "xanchor": "left", "yref": "paper", "y": top,
        "yanchor": "bottom", "showarrow": False,
    }  # fmt: skip


def _shade(where: dict) -> dict:
    return where | {"type": "rect", "fillcolor": "#eef1f4", "line": {"width": 0}, "layer": "below"}


def _packed(values: NDArray) -> dict:
    most = np.finfo(np.float32).max  # a diverging simulation is drawn up to here
    packed = np.clip(np.asarray(values, dtype=float), -most, most).astype("<f4")
    return {"dtype": "f4", "bdata": base64.b64encode(packed.tobytes()).decode("ascii")}


def library(figures: Sequence[ReportFigure]) -> str:
    """The scripts at the end of a page; empty where no figure is living."""
    if not any(figure.live for figure in figures):
        return ""
    packed = f'<script type="text/plain" id="plotly-gzip">{_plotly()}</script>'
    return f'{packed}\n<script type="text/javascript">{_starter()}</script>'


def _starter() -> str:
    return f"const DARK = {json.dumps({c.lower(): d for c, d in DARK.items()})};{STARTER}"


@cache
def _plotly() -> str:
    found = find_spec("plotly")
    place = Path(found.submodule_search_locations[0]) / "package_data" / "plotly.min.js"
    return base64.b64encode(gzip.compress(place.read_bytes(), mtime=0)).decode("ascii")
