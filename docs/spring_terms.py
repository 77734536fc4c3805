"""The words for parts of a spring: `python docs/spring_terms.py` writes `docs/spring-terms.png`."""

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch

from dftfs.design import load_design
from dftfs.report.figures.outline_path import solid_path
from dftfs.spring.outline import SpringOutline

INK, GREY, PART, RED = "#1f2933", "#69737d", "#e6ebf1", "#D55E00"


def point_mm(outline: SpringOutline, name: str, at: float = 0.5) -> np.ndarray:
    """A point along an edge, in mm."""
    return 1e3 * outline.edge(name).point(np.array([at]))[0]


def draw(axes, outline: SpringOutline, labels: dict, size: float) -> None:
    """The solid, and words with arrows to their places."""
    axes.add_patch(PathPatch(solid_path(outline), facecolor=PART, edgecolor=INK, linewidth=0.9))
    for label, (point, place) in labels.items():
        axes.annotate(
            label, point, place, fontsize=size, color=INK, va="center", ha="center",
            annotation_clip=False,
            arrowprops={"arrowstyle": "-|>", "color": GREY, "shrinkA": 1, "shrinkB": 0},
        )  # fmt: skip
    axes.set_aspect("equal")
    axes.axis("off")


def main() -> None:
    """Draw al1 with its words."""
    outline = load_design("al1").outline
    rim = outline.parameters.rim_outer_radius_m * 1e3
    # void 0 holds the slit of the next arm: the slit of arm 0 is in the last void
    slit = point_mm(outline, f"slit_fillet:{len(outline.coil_gaps) - 1}")
    tip, fillet = point_mm(outline, "tip_face:0"), point_mm(outline, "tip_fillet:0")
    notch, arm = point_mm(outline, "notch_fillet:0"), point_mm(outline, "arm_outer:0", 0.45)
    figure = Figure(figsize=(9.6, 5.4), dpi=130, facecolor="white")
    whole = figure.add_axes((0.0, 0.0, 0.62, 1.0))
    whole.set(xlim=(-108, 108), ylim=(-100, 100))
    inner = point_mm(outline, "arm_inner:0", 0.62)
    gap = inner * (1 - 4.0 / np.linalg.norm(inner))
    labels = {
        "rim, on the load": (rim * np.array([0.68, 0.68]), (84, 92)),
        "hub, on the wheel": (np.array([0.0, -14.0]), (-70, -92)),
        "arm": (arm, (-96, 84)),
        "gap between coils": (gap, (78, -92)),
    }
    draw(whole, outline, labels, 10)
    middle = 0.5 * (slit + fillet)
    details = (
        (
            (0.64, 0.52, 0.35, 0.46),
            (notch, 9.0),
            {"hub notch": (notch, (-2.5, -4.5)), "root": (notch + np.array([2.0, 1.0]), (2, 5))},
        ),
        (
            (0.64, 0.02, 0.35, 0.46),
            (middle, 16.0),
            {"slit": (slit, (5, -6)), "tip": (tip, (5, 4)), "neck": (middle, (9, -3))},
        ),
    )
    for place, (centre, reach), places in details:
        labels = {
            label: (point, tuple(point + np.array(by))) for label, (point, by) in places.items()
        }
        detail = figure.add_axes(place)
        detail.set(
            xlim=(centre[0] - 1.3 * reach, centre[0] + 1.3 * reach),
            ylim=(centre[1] - reach, centre[1] + reach),
        )
        draw(detail, outline, labels, 10)
        box = centre + reach * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])
        whole.plot(*box.T, color=RED, linewidth=1.2)
    detail.plot(*np.array([slit, fillet]).T, color=RED, linewidth=1.6)
    FigureCanvasAgg(figure)
    figure.savefig(Path(__file__).with_name("spring-terms.png"), metadata={"Software": None})


if __name__ == "__main__":
    main()
