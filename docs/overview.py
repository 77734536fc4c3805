"""The picture of the README: `python docs/overview.py` writes `docs/overview.png`."""

from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

INK, GREY, BLUE, VERMILION, GREEN = "#1f2933", "#69737d", "#0072B2", "#D55E00", "#009E73"
SIZE_in, DPI = (12.4, 4.5), 160
HEIGHT, WIDTH = 0.92, 1.86

# centre, title, what it holds, command, colour
BOXES = {
    "design": ((1.05, 3.45), "Spring design", "one TOML file", "dftfs design, size", BLUE),
    "solve": (
        (3.55, 3.45),
        "CAD, mesh, FE",
        "STEP; contact of the coils",
        "dftfs export, verify",
        BLUE,
    ),
    "curve": ((6.05, 3.45), "Torque curve", "both ways, with error bar", "dftfs study", BLUE),
    "recordings": ((1.05, 1.25), "Recordings", "CSV files and rig.toml", "", VERMILION),
    "diagnosis": ((3.55, 1.25), "Diagnosis", "where, what, how sure", "dftfs diagnose", VERMILION),
    "corrected": ((6.05, 1.25), "Corrected model", "model.toml", "dftfs predict", VERMILION),
    "model": ((8.75, 2.35), "Actuator model", "rig, spring, effects", "ActuatorModel", INK),
    "simulate": ((11.3, 3.45), "Simulation", "torque, energy, limits", "dftfs simulate", GREEN),
    "control": ((11.3, 1.25), "Control", "tuned, compared, C header", "dftfs tune, compare", GREEN),
}
ARROWS = [
    ("design", "solve"),
    ("solve", "curve"),
    ("curve", "model"),
    ("recordings", "diagnosis"),
    ("diagnosis", "corrected"),
    ("corrected", "model"),
    ("model", "simulate"),
    ("model", "control"),
]


def box(axes, centre, title, holds, command, colour) -> None:
    """A rounded box with a title, what it holds and the command that makes it."""
    x, y = centre
    axes.add_patch(
        FancyBboxPatch(
            (x - WIDTH / 2, y - HEIGHT / 2), WIDTH, HEIGHT,
            boxstyle="round,pad=0,rounding_size=0.09", facecolor="white", edgecolor=colour,
            linewidth=1.8,
        )
    )  # fmt: skip
    above = 0.24 if command else 0.12
    axes.text(
        x, y + above, title, ha="center", va="center", fontsize=11.5, weight="bold", color=INK
    )
    axes.text(x, y + above - 0.25, holds, ha="center", va="center", fontsize=8.6, color=GREY)
    axes.text(
        x, y - 0.28, command, ha="center", va="center", fontsize=8.6, color=colour,
        family="DejaVu Sans Mono",
    )  # fmt: skip


def arrow(axes, begin, end, **style) -> None:
    """An arrow between two points."""
    axes.add_patch(
        FancyArrowPatch(
            begin, end, arrowstyle="-|>", mutation_scale=13, color=GREY, linewidth=1.5,
            shrinkA=0, shrinkB=0, **style,
        )
    )  # fmt: skip


def edge(name: str, towards: str) -> tuple[float, float]:
    """Where an arrow leaves or enters a box: at the side that faces the other one."""
    (x, y), (other, level) = BOXES[name][0], BOXES[towards][0]
    side = x + (WIDTH / 2 + 0.05) * (1 if other > x else -1)
    return side, y + (0.22 if level > y else -0.22 if level < y else 0.0) * (name == "model")


def main() -> None:
    """Draw it."""
    figure = Figure(figsize=SIZE_in, dpi=DPI, facecolor="white")
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, SIZE_in[0]), ylim=(0.05, 0.05 + SIZE_in[1]))
    axes.axis("off")
    for content in BOXES.values():
        box(axes, *content)
    for begin, end in ARROWS:
        arrow(axes, edge(begin, end), edge(end, begin))
    (left, low), (right, _) = BOXES["recordings"][0], BOXES["diagnosis"][0]
    arrow(
        axes, (right, low - HEIGHT / 2 - 0.04), (left, low - HEIGHT / 2 - 0.04),
        connectionstyle="arc3,rad=-0.22", linestyle=(0, (4, 3)),
    )  # fmt: skip
    axes.text(
        (left + right) / 2, low - 1.0, "next experiment", ha="center", fontsize=8.6, color=GREY
    )
    axes.text(0.12, 4.2, "From a design", fontsize=10, weight="bold", color=BLUE)
    axes.text(0.12, 2.0, "From a real machine", fontsize=10, weight="bold", color=VERMILION)
    FigureCanvasAgg(figure)
    figure.savefig(Path(__file__).with_name("overview.png"))


if __name__ == "__main__":
    main()
