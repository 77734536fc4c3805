"""The planar mesh, whole and close up where it is fine."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from dftfs.fem.mesh import TaggedMesh
from dftfs.report.figures.cell_outlines import cell_outlines, near
from dftfs.report.style import BLUE, INK, PART, ReportFigure, as_png, house_style, new_figure
from dftfs.spring.edges import rotate

_ZOOMS = (
    ("a", "notch", "notch_fillet"),
    ("b", "slit end", "slit_fillet"),
    ("c", "tip", "tip_face"),
)
_OTHER = "#f4ead3"  # the turned copies, beside the solved sector


def mesh_figure(sector: TaggedMesh, n_arms: int, thickness_m: float) -> ReportFigure:
    """The whole planar mesh from its sector; the notch, the slit's end and the tip enlarged."""
    outlines = 1e3 * cell_outlines(sector.nodes, sector.cells)
    turns = [2 * np.pi * k / n_arms for k in range(n_arms)]
    half = 0.95e3 * thickness_m
    with house_style():
        figure = new_figure(6.9)
        grid = figure.add_gridspec(2, 3, height_ratios=[3.0, 1.0])
        whole = figure.add_subplot(grid[0, :])
        for k, turn in enumerate(turns):
            _draw(whole, rotate(outlines, turn), PART if k % 2 == 0 else _OTHER, 0.32)
        outer = 1.01e3 * float(np.hypot(*sector.nodes.T).max())
        whole.set_xlim(-outer, outer)
        whole.set_ylim(-outer, outer)
        whole.set_aspect("equal")
        whole.axis("off")
        for column, (letter, title, boundary) in enumerate(_ZOOMS):
            if boundary not in sector.boundaries:
                continue
            centre = 1e3 * sector.nodes[sector.boundary_nodes(boundary)].mean(axis=0)
            _frame(whole, centre, half, letter)
            close = figure.add_subplot(grid[1, column])
            for k, turn in enumerate(turns):
                seen = near(rotate(outlines, turn), centre, half)
                _draw(close, seen, PART if k == 0 else _OTHER, 0.5)
            close.set_xlim(centre[0] - half, centre[0] + half)
            close.set_ylim(centre[1] - half, centre[1] + half)
            _dress(close, f"{letter}  {title}", half)
        return as_png(
            figure,
            name="mesh",
            alt="Planar finite element mesh of the whole spring, with enlargements of the hub"
            " notch, the end of the slit between arm and rim, and the tip of the arm.",
            caption="Planar mesh of quadratic elements; the 3D elements are extruded from it."
            + (" Blue: the sector that is solved; cream: its turned copies." if n_arms > 1 else "")
            + " The bars of a, b and c are 2 mm long.",
        )


def _draw(axes: Axes, outlines: NDArray, fill: str, width: float) -> None:
    axes.add_collection(PolyCollection(outlines, facecolors=fill, edgecolors="none"))
    axes.add_collection(LineCollection(outlines, colors=INK, linewidths=width))


def _frame(axes: Axes, centre: NDArray, half: float, letter: str) -> None:
    axes.add_patch(
        Rectangle(centre - half, 2 * half, 2 * half, fc="none", ec=BLUE, lw=1.4, zorder=5)
    )
    outward = centre / max(np.hypot(*centre), 1e-9)
    axes.text(
        *(centre + 1.75 * half * outward),
        letter,
        color=BLUE,
        weight="bold",
        fontsize=11,
        ha="center",
        va="center",
        zorder=6,
        bbox={"fc": "white", "ec": "none", "pad": 0.8, "alpha": 0.85},
    )


def _dress(axes: Axes, title: str, half: float) -> None:
    axes.set_aspect("equal")
    axes.set_xticks([])
    axes.set_yticks([])
    axes.grid(False)
    axes.set_title(title, color=BLUE)
    for spine in axes.spines.values():
        spine.set_visible(True)
        spine.set_color(BLUE)
    x0, y0 = axes.get_xlim()[0] + 0.1 * half, axes.get_ylim()[0] + 0.12 * half
    axes.plot([x0, x0 + 2.0], [y0, y0], color=INK, lw=2.5, solid_capstyle="butt")
