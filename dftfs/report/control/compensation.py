"""What each part of a torque controller's command carries over a run."""

from dftfs.report.live import Curve, Panel, with_live
from dftfs.report.style import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    SKY,
    VERMILION,
    ReportFigure,
    as_svg,
    house_style,
    new_figure,
)

COLOURS = (GREY, GREEN, SKY, VERMILION, ORANGE, BLUE)  # in the order of the parts


def compensation_figure(trace, from_s: float) -> ReportFigure:
    """The parts of a simulated command as torques, a `CompensationTrace`, judged from a time on."""
    colours = dict(zip(trace.parts, COLOURS, strict=True))
    rms = trace.rms_Nm(from_s) if trace.time_s[-1] >= from_s else {}
    acting = {name: part for name, part in trace.parts.items() if part.any()}
    added = {name: part for name, part in acting.items() if name != "reference"}
    with house_style():
        figure = new_figure(3.2)
        axes = figure.subplots()
        for name, part in added.items():
            axes.plot(trace.time_s, part, lw=0.9, color=colours[name], label=name)
        axes.set_xlabel("time (s)")
        axes.set_ylabel("torque at the wheel (Nm)")
        figure.legend(loc="outside upper center", ncols=5)
    sizes = ", ".join(f"{name} {rms[name]:.3g}" for name in acting if name in rms)
    drawn = as_svg(
        figure,
        name="compensation",
        alt="Inertia, damping, friction, back-EMF and feedback in the command, over time.",
        caption="What the command asks beside the reference itself, as torques at the wheel:"
        " compensation along the wanted motion, and the feedback that is left to do."
        + (f" Root mean square (Nm): {sizes}." if sizes else ""),
    )
    curves = tuple(Curve(name=n, values=p, colour=colours[n]) for n, p in added.items())
    return with_live(drawn, trace.time_s, (Panel(label="torque (Nm)", curves=curves),))
