"""The loop that friction between the coils makes of the torque-angle curve."""

import numpy as np

from dftfs.analysis.strength.friction_loop import FrictionLoop
from dftfs.report.numbers import plain
from dftfs.report.style import (
    BLUE,
    GREY,
    INK,
    VERMILION,
    ReportFigure,
    as_svg,
    house_style,
    new_figure,
)

_SHOWN_FROM = 0.9  # of the first contact's deflection: before it both ways are one


def friction_loop_figure(loop: FrictionLoop) -> ReportFigure:
    """Torque out and back past the knee; below, the torque that friction adds either way."""
    turn = len(loop.torque_Nm) // 2
    halves = (
        ("loading", slice(0, turn + 1), VERMILION, "-"),
        ("unloading", slice(turn, None), BLUE, (0, (5, 2))),
    )
    touch, end = loop.onset.deflection_rad, loop.deflection_rad[turn]
    with house_style():
        figure = new_figure(5.2)
        upper, lower = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [1.3, 1]})
        for name, half, colour, dashes in halves:
            angle, torque = loop.deflection_rad[half], loop.torque_Nm[half]
            upper.plot(angle, torque, color=colour, ls=dashes, marker=".", ms=4, label=name)
            added = 1e3 * np.sign(touch) * (torque - loop.frictionless_Nm[half])
            lower.plot(angle, added, color=colour, ls=dashes, marker=".", ms=4, label=name)
        lower.fill_between(
            loop.deflection_rad[: turn + 1],
            1e3 * np.sign(touch) * (loop.torque_Nm - loop.frictionless_Nm)[: turn + 1],
            1e3 * np.sign(touch) * (loop.torque_Nm - loop.frictionless_Nm)[turn:][::-1],
            color=GREY,
            alpha=0.2,
            lw=0,
        )
        for axes in (upper, lower):
            axes.axvline(touch, color=INK, lw=0.9, ls=(0, (2, 2)))
        lower.axhline(0, color=GREY, lw=0.8)
        edges = sorted((_SHOWN_FROM * touch, end + 0.03 * (end - touch)))
        upper.set_xlim(*edges)
        inside = loop.torque_Nm[
            (loop.deflection_rad >= edges[0]) & (loop.deflection_rad <= edges[1])
        ]
        margin = 0.06 * float(np.ptp(inside))
        upper.set_ylim(inside.min() - margin, inside.max() + margin)
        upper.set_ylabel("torque (Nm)")
        upper.legend(loc="best")
        lower.set_ylabel("added by friction (mNm)")
        lower.set_xlabel("deflection (rad)")
        width, at = loop.widest
        return as_svg(
            figure,
            name="friction-loop",
            alt=f"Torque against deflection past the knee with friction coefficient"
            f" {loop.coefficient:g}: unloading below loading by at most {1e3 * width:.0f} mNm.",
            caption=f"One cycle with Coulomb friction of {plain(loop.coefficient, 2)} between the"
            f" coils (plane stress). Above, torque out and back; below, torque less that without"
            f" friction, counted in the direction of load: its area is the heat of the cycle,"
            f" {plain(1e3 * loop.loss_J, 3)} mJ. Widest, {plain(1e3 * width, 3)} mNm, at"
            f" {plain(at, 3)} rad. Dotted: first contact.",
        )


def friction_loop_sentence(loop: FrictionLoop) -> str:
    """The loop compared with the hysteresis in the thesis' figures 2.13 to 2.17."""
    width, _ = loop.widest
    turn = len(loop.torque_Nm) // 2
    share = width / float(np.max(np.abs(loop.torque_Nm)))
    work = abs(loop.imbalance) * 100
    return (
        f"Heat of one cycle {plain(1e3 * loop.loss_J, 3)} mJ, loss factor"
        f" {plain(loop.loss_factor, 2)}; it equals the torque's work round the cycle within"
        f" {plain(max(work, 0.01), 1)} %. The thesis notes hysteresis in its figures 2.13 to 2.17"
        f" without a number, in a test to 14.5 Nm (errata S22, S27). The part of it that friction"
        f" between coils explains exists only beyond first contact"
        f" ({plain(loop.onset.torque_Nm, 3)} Nm) and is here {plain(100 * share, 2)} % of the"
        f" largest torque ({plain(float(loop.torque_Nm[turn]), 3)} Nm) at most: a loop that opens"
        " below first contact, or is wider, has another cause: clamps, bearing, gear or material."
    )
