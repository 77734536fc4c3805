"""One look for every figure: palette, type, and encoding for a page without other files.

Colours are Okabe and Ito's, told apart by the colour-blind; no meaning rests on colour alone.
Figures are made without pyplot, so that nothing is shared or left open between them.
"""

import base64
import io
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import matplotlib
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure

INK, GREY, LIGHT, PART = "#1f2933", "#69737d", "#cfd6de", "#e6ebf1"
BLUE, VERMILION, GREEN, ORANGE, SKY = "#0072B2", "#D55E00", "#009E73", "#E69F00", "#56B4E9"
DARK = {  # what takes the place of a colour where the reader prefers a dark page
    INK: "#e4e8ec", GREY: "#98a2ac", LIGHT: "#46515c", PART: "#2a323b", "#e3e7ec": "#2b333c",
    "#ffffff": "#14181d", "#eef1f4": "#20272e", BLUE: "#4aa8e0", "#cbd5df": "#46515c",
}  # fmt: skip
DIRECTION_COLOUR = {"winding": BLUE, "unwinding": VERMILION}
DIRECTION_MARKER = {"winding": "^", "unwinding": "v"}
FIGURE_WIDTH_IN = 5.6  # at 9 pt still legible on a phone's width
PNG_DPI = 190

_RC = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9,
    "axes.edgecolor": GREY,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e3e7ec",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "text.color": INK,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "hatch.linewidth": 0.6,
    "svg.fonttype": "path",
    "axes.unicode_minus": True,
    "image.cmap": "viridis",
}
_IDENTIFIER = re.compile(r'(\bid="|(?:xlink:)?href="#|url\(#)')
_HEAD = re.compile(r"^.*?(?=<svg)|<metadata>.*?</metadata>", re.DOTALL)
_PLACES = re.compile(r'(?<=[ "])(?:d|x|y)="[^"]*"')
_LONG_NUMBER = re.compile(r"-?\d+\.\d{3,}")
_BLANK = re.compile(r" ?\n(?=[A-Za-z])|(?<=[A-Za-z]) (?=[-.\d])")
_NAMESPACE = re.compile(r'\s+xmlns(?::\w+)?="[^"]*"')


@dataclass(frozen=True, kw_only=True)
class ReportFigure:
    """A figure ready for the page: markup or image, text for those who cannot see it, caption.

    Exactly one of ``svg`` (markup to be put inline) and ``png`` (bytes) is set; ``live`` is the
    data of the form that can be hovered over (`dftfs.report.live`).
    """

    name: str
    alt: str
    caption: str
    svg: str | None = None
    png: bytes | None = None
    live: str | None = None

    @property
    def data_uri(self) -> str:
        """The PNG as an address that holds it."""
        return "data:image/png;base64," + base64.b64encode(self.png or b"").decode("ascii")


@contextmanager
def house_style() -> Iterator[None]:
    """The rules of drawing for the figures made inside."""
    with matplotlib.rc_context(_RC):
        yield


def new_figure(
    height_in: float, width_in: float = FIGURE_WIDTH_IN, *, layout: str = "constrained"
) -> Figure:
    """An empty figure (call inside `house_style`); layout "none" leaves axes where they are put."""
    return Figure(figsize=(width_in, height_in), layout=layout)


def as_svg(figure: Figure, *, name: str, alt: str, caption: str) -> ReportFigure:
    """The figure as inline markup whose identifiers no other figure of the page has."""
    buffer = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": name}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph")  # of a file's name, in a font without it
        # `savefig` would draw the figure once more before, only to lay it out
        FigureCanvasSVG(figure).print_svg(buffer, metadata={"Date": None, "Creator": None})
    return ReportFigure(
        name=name, alt=alt, caption=caption, svg=inline_svg(buffer.getvalue(), name)
    )


def as_png(figure: Figure, *, name: str, alt: str, caption: str) -> ReportFigure:
    """The figure as an image."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=PNG_DPI, metadata={"Software": None})
    return ReportFigure(name=name, alt=alt, caption=caption, png=buffer.getvalue())


def inline_svg(document: str, name: str) -> str:
    """An SVG document as an element of an HTML page: no prologue, no address, own identifiers.

    Coordinates are rounded to 0.01 points (0.004 mm on paper): half of a curve's length in bytes.
    """
    markup = _NAMESPACE.sub("", _HEAD.sub("", document)).replace("xlink:href", "href")
    markup = _PLACES.sub(_shorter, markup)
    return _IDENTIFIER.sub(lambda found: f"{found.group(1)}{name}-", markup).strip()


def _shorter(found: re.Match) -> str:
    text = _LONG_NUMBER.sub(lambda n: f"{float(n.group()):.2f}".rstrip("0").rstrip("."), found[0])
    return _BLANK.sub("", text)
