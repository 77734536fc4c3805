"""The front of a sizing: mass, stress and travel of its candidates."""

from collections.abc import Sequence

import numpy as np

from dftfs.analysis.sizing.rod_candidate import Candidate
from dftfs.report.style import (
    GREY,
    INK,
    LIGHT,
    VERMILION,
    ReportFigure,
    as_png,
    house_style,
    new_figure,
)


def front_figure(
    front: Sequence[Candidate],
    best: Candidate,
    strength_Pa: float,
    others: Sequence[tuple[str, Candidate]] = (),
) -> ReportFigure:
    """Stress over mass, coloured by the gap left; the best one, the limit, and others by name."""
    with house_style():
        figure = new_figure(4.4, 6.4)
        axes = figure.subplots()
        dots = axes.scatter(
            [1e3 * c.mass_kg for c in front],
            [c.stress_Pa / 1e6 for c in front],
            c=[1e3 * c.gap_left_m for c in front],
            s=26,
            edgecolor=LIGHT,
            lw=0.4,
            label=f"front, {len(front)} designs",
        )
        figure.colorbar(dots, ax=axes, label="gap left at the required torque (mm)")
        axes.plot(
            1e3 * best.mass_kg,
            best.stress_Pa / 1e6,
            "*",
            color=VERMILION,
            ms=15,
            mec=INK,
            label="best",
        )
        for name, one in others:
            if one.mass_kg is not None and one.stress_Pa is not None:
                axes.plot(1e3 * one.mass_kg, one.stress_Pa / 1e6, "X", color=INK, ms=9)
                axes.annotate(
                    name,
                    (1e3 * one.mass_kg, one.stress_Pa / 1e6),
                    xytext=(7, 0),
                    textcoords="offset points",
                    va="center",
                )
        axes.axhline(strength_Pa / 1e6, color=GREY, lw=1.0, ls=(0, (4, 2)))
        axes.annotate(
            "allowed stress",
            xy=(0.99, strength_Pa / 1e6),
            xycoords=axes.get_yaxis_transform(),
            xytext=(0, 4),
            textcoords="offset points",
            ha="right",
            color=GREY,
        )
        stresses = [c.stress_Pa for c in front] + [o.stress_Pa or 0.0 for _, o in others]
        axes.set_ylim(0, 1.15e-6 * float(np.max([*stresses, strength_Pa])))
        axes.set_xlabel("mass (g)")
        axes.set_ylabel("peak stress at the operating torque (MPa)")
        axes.legend(loc="lower left")
        return as_png(
            figure,
            name="front",
            alt="Peak stress over mass of the designs that no other beats.",
            caption="Rod model with notch factors; colour is the gap left at the required torque.",
        )
