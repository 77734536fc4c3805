"""How a shape evened out the stress: outlines, thickness and stress along the arm."""

import numpy as np

from dftfs.analysis.shape.compare import Comparison
from dftfs.design import SpringDesign
from dftfs.report.style import (
    GREY,
    INK,
    VERMILION,
    ReportFigure,
    as_png,
    house_style,
    new_figure,
)


def shape_figure(found: Comparison) -> ReportFigure:
    """Outline before (grey) and after; thickness; stress over torque of the worse direction."""
    with house_style():
        figure = new_figure(7.2, 9.0)
        grid = figure.add_gridspec(3, 2, height_ratios=(2.2, 1, 1))
        for column, one in enumerate((found.start, found.shaped)):
            axes = figure.add_subplot(grid[0, column])
            _draw(axes, one)
            axes.set_title(f"{one.name}, {1e3 * one.mass_kg:.0f} g")
        thickness = figure.add_subplot(grid[1, :])
        stress = figure.add_subplot(grid[2, :])
        for one, shape, colour in (
            (found.start, found.before, GREY),
            (found.shaped, found.after, VERMILION),
        ):
            feet = one.outline.feet
            theta = np.linspace(feet.notch_theta, feet.slit_theta, 300)
            share = np.linspace(0, 1, 300)
            label = {"color": colour, "label": one.name}
            thickness.plot(share, 1e3 * one.spiral.thickness_at(theta), **label)
            worst = 1e-6 * np.reshape(shape.stress_per_torque, (2, -1)).max(axis=0)
            along = shape.arc_m / shape.arc_m[-1]
            stress.plot(along, worst[1:-1], **label)
            stress.plot([0, 1], worst[[0, -1]], "o", color=colour)
        thickness.set_ylabel("thickness (mm)")
        stress.set_ylabel("stress over torque (MPa/Nm)")
        stress.set_xlabel("along the arm, hub to rim (dots: notches; rod model, worse direction)")
        stress.set_ylim(bottom=0)
        stress.legend()
        return as_png(
            figure,
            name="shape",
            alt="Outline, thickness and stress along the arm before and after.",
            caption="Stress over torque by the rod model; dots are the notches at both roots.",
        )


def _draw(axes, design: SpringDesign) -> None:
    outline, t = design.outline, np.linspace(0, 1, 200)
    loops = [[outline.rim_outer], [outline.bore], *outline.coil_gaps]
    for loop in loops:
        points = 1e3 * np.concatenate([edge.point(t) for edge in loop])
        axes.plot(*points.T, color=INK, lw=0.8)
    axes.set_aspect("equal")
    axes.axis("off")
