"""The plots of the diagnosis report: comparisons, mismatch, candidates, laws, experiment."""

from itertools import groupby

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm

from dftfs.report.diagnosis.page import (
    Candidate,
    Comparison,
    LawCurve,
    NextExperiment,
    PortTrace,
    Remainder,
    StateMap,
    TimeStrip,
)
from dftfs.report.figures.actuator import decimated
from dftfs.report.live import Curve, Panel, with_live
from dftfs.report.numbers import plain
from dftfs.report.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    LIGHT,
    ORANGE,
    SKY,
    VERMILION,
    ReportFigure,
    as_svg,
    house_style,
    new_figure,
)

BEFORE, PARAMETERS, AFTER = VERMILION, ORANGE, BLUE
_DASH = (0, (4, 2))
_BAND = 1.96
QUANTITY = {
    "motor_angle_rad": "motor angle",
    "load_angle_rad": "load angle",
    "spring_deflection_rad": "deflection",
    "torque_Nm": "torque",
    "current_A": "current",
}


def quantity(signal: str) -> str:
    """A column's name in words, without its unit."""
    return QUANTITY.get(signal, signal.rsplit("_", 1)[0].replace("_", " "))


def comparison_figure(item: Comparison, number: int) -> ReportFigure:
    """Above, recording and three simulations; below, their errors."""
    runs = [("before", item.before, BEFORE, item.nrmse_before, 1.1)]
    if item.parameters_only is not None:
        value = item.nrmse_parameters_only
        runs.append(("parameters only", item.parameters_only, PARAMETERS, value, 1.1))
    if item.after is not None:
        runs.append(("after", item.after, AFTER, item.nrmse_after, 1.3))
    with house_style():
        figure = new_figure(3.9)
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[1.6, 1.0])
        upper.plot(*decimated(item.time_s, item.recorded), color=INK, lw=3.4, alpha=0.22)
        upper.plot([], [], color=INK, lw=3.4, alpha=0.22, label="recorded")
        floor = _BAND * item.noise_floor
        lower.axhspan(-floor, floor, color="#e3e7ec", zorder=0)
        for name, values, colour, error, width in runs:
            style = _DASH if name != "after" else "-"
            label = name if error is None else f"{name} {plain(100 * error, 2)} %"
            upper.plot(
                *decimated(item.time_s, values), color=colour, lw=width, ls=style, label=label
            )
            lower.plot(*decimated(item.time_s, values - item.recorded), color=colour, lw=0.9)
        upper.set_ylabel(f"{quantity(item.signal)} ({item.unit})")
        lower.set_ylabel("simulated less\nrecorded")
        lower.set_xlabel("time (s)")
        low, high = upper.get_ylim()
        upper.set_ylim(low, high + 0.32 * (high - low))
        upper.legend(loc="upper left", ncols=2, handlelength=1.6, columnspacing=1.2)
        upper.set_xlim(item.time_s[0], item.time_s[-1])
        figure.align_ylabels()
        errors = "; ".join(f"{n} {100 * e:.3g} %" for n, _, _, e, _ in runs if e is not None)
        held = "held out: not used in any fit or choice" if item.role == "validation" else item.role
        drawn = as_svg(
            figure,
            name=f"comparison-{number}",
            alt=f"{quantity(item.signal)} of {item.file}, recorded and simulated: {errors}.",
            caption=f"{item.file}, {item.description} ({held}). Error of the open-loop simulation"
            " over the signal's standard deviation in the legend; grey band below: 95 % of the"
            " sensor's own noise.",
        )
    return _live_comparison(drawn, item, runs)


def _live_comparison(drawn: ReportFigure, item: Comparison, runs: list[tuple]) -> ReportFigure:
    floor = _BAND * item.noise_floor
    recorded = Curve(name="recorded", values=item.recorded, colour=LIGHT, width=4.0)
    solid = {"after": "solid"}
    above = [
        Curve(
            name=name if error is None else f"{name} {plain(100 * error, 2)} %",
            values=values,
            colour=colour,
            dash=solid.get(name, "dash"),
        )
        for name, values, colour, error, _ in runs
    ]
    below = [
        Curve(name=f"{name}, error", values=values - item.recorded, colour=colour, in_legend=False)
        for name, values, colour, _, _ in runs
    ]
    upper_label = f"{quantity(item.signal)} ({item.unit})"
    panels = (
        Panel(label=upper_label, curves=(recorded, *above), height=1.6),
        Panel(label=f"error ({item.unit})", curves=tuple(below), band=floor),
    )
    return with_live(drawn, item.time_s, panels)


def trace_figure(traces: tuple[PortTrace, ...], name: str = "port-torques") -> ReportFigure:
    """What must be added at each port, over time, with its 95 % band; one recording a column."""
    files = list(dict.fromkeys(t.file for t in traces))
    ports = list(dict.fromkeys(t.port for t in traces))
    with house_style():
        figure = new_figure(1.0 + 1.25 * len(ports), width_in=11.6)
        grid = figure.subplots(len(ports), len(files), squeeze=False, sharex="col", sharey="row")
        for axes in grid.ravel():
            axes.axhline(0.0, color=GREY, lw=0.6)
        for trace in traces:
            axes = grid[ports.index(trace.port), files.index(trace.file)]
            step = max(1, trace.value.size // 700)
            time, value = trace.time_s[::step], trace.value[::step]
            band = _BAND * trace.std[::step]
            axes.fill_between(time, value - band, value + band, color=SKY, alpha=0.45, lw=0)
            axes.plot(time, value, color=BLUE, lw=0.8)
            axes.set_xlim(time[0], time[-1])
            # in the first column, where an output that is held has no trace of the load
            grid[ports.index(trace.port), 0].set_ylabel(f"{trace.label}\n({trace.unit})")
        for axes, file in zip(grid[0], files, strict=True):
            axes.set_title(file)
        for axes in grid[-1]:
            axes.set_xlabel("time (s)")
        return as_svg(
            figure,
            name=name,
            alt="Unknown torques at the ports over time: " + ", ".join(ports) + ".",
            caption="What must be added to the nominal machine at each place for the recording to"
            " come out, smoothed from the readings alone, with its 95 % band. Zero: nothing is"
            " missing there.",
        )


def strip_figure(strips: tuple[TimeStrip, ...]) -> ReportFigure:
    """When the mismatch is large: one bar of time a recording."""
    top = max(2.0, max(float(np.nanmax(s.level)) for s in strips))
    with house_style():
        figure = new_figure(0.9 + 0.42 * len(strips))
        axes = figure.subplots()
        for k, strip in enumerate(strips):
            mesh = axes.pcolormesh(
                strip.edges_s,
                [k - 0.4, k + 0.4],
                np.clip(strip.level, 0.5, None)[None, :],
                cmap="magma_r",
                norm=LogNorm(0.5, top),
            )
        axes.set_yticks(range(len(strips)), [s.file for s in strips])
        axes.invert_yaxis()
        axes.grid(False)
        axes.set_xlabel("time (s)")
        figure.colorbar(mesh, ax=axes, label="times the noise floor", pad=0.02, aspect=12)
        worst = max(strips, key=lambda s: float(np.nanmax(s.level)))
        at = float(worst.edges_s[int(np.nanargmax(worst.level))])
        return as_svg(
            figure,
            name="mismatch-time",
            alt=f"Mismatch over time; largest in {worst.file} near {at:.3g} s.",
            caption="When: mismatch over time after the best parameters, in noise floors. Dark is"
            f" large; the largest is in {worst.file} near {at:.3g} s.",
        )


def state_figure(item: StateMap) -> ReportFigure:
    """Where in the machine's states the mismatch lives."""
    with house_style():
        figure = new_figure(3.1)
        axes = figure.subplots()
        level = np.ma.masked_invalid(np.clip(item.level, 0.5, None))
        top = max(2.0, float(level.max()))
        mesh = axes.pcolormesh(
            item.x_edges, item.y_edges, level, cmap="magma_r", norm=LogNorm(0.5, top)
        )
        axes.axhline(0.0, color=GREY, lw=0.6)
        axes.axvline(0.0, color=GREY, lw=0.6)
        axes.grid(False)
        axes.set_xlabel(item.x_label)
        axes.set_ylabel(item.y_label)
        figure.colorbar(mesh, ax=axes, label="times the noise floor", pad=0.02)
        return as_svg(
            figure,
            name="mismatch-state",
            alt=f"Mismatch over {item.x_label} and {item.y_label}. {item.sentence}",
            caption=f"Where: {item.sentence} White: not visited by the recordings.",
        )


def ranked_explanations_figure(ranked: tuple[Candidate, ...], weighed: str = "") -> ReportFigure:
    """Gain of each explanation over parameters alone, with standard errors."""
    with house_style():
        figure = new_figure(0.95 + 0.34 * len(ranked))
        axes = figure.subplots()
        for k, row in enumerate(ranked):
            colour = BLUE if row.chosen else LIGHT
            axes.barh(k, row.gain, color=colour, height=0.62)
            axes.errorbar(
                row.gain, k, xerr=2.0 * row.se, color=INK, lw=1.0, capsize=2.5, fmt="none"
            )
        axes.axvline(0.0, color=GREY, lw=0.8)
        axes.set_yticks(range(len(ranked)), [row.name for row in ranked])
        for tick, row in zip(axes.get_yticklabels(), ranked, strict=True):
            tick.set_fontweight("bold" if row.chosen else "normal")
        axes.invert_yaxis()
        axes.grid(axis="y", visible=False)
        figure.supxlabel(  # long names leave the axes narrower than these words
            "gain of log score over parameters alone (2 s.e.)", fontsize="medium"
        )
        best = max(ranked, key=lambda row: row.gain)
        return as_svg(
            figure,
            name="ladder",
            alt=f"Candidates by gain; best {best.name} with {best.gain:.3g}.",
            caption="What was considered, by how much better than parameters alone it explains"
            f" {weighed or 'these recordings'}. Filled: chosen. A bar within its error of the"
            " chosen one cannot be distinguished from it.",
        )


def law_figure(law: LawCurve, number: int) -> ReportFigure:
    """The identified law with its band, the nominal one, and the estimate from each sample."""
    with house_style():
        figure = new_figure(3.2)
        axes = figure.subplots()
        if law.points is not None:
            x, y = law.points
            step = max(1, x.size // 1500)
            axes.plot(x[::step], y[::step], ".", color=GREY, ms=2.6, alpha=0.5, rasterized=False)
        if np.any(law.high > law.low):
            axes.fill_between(
                law.x, law.low, law.high, color=SKY, alpha=0.5, lw=0, label="95 % band"
            )
        axes.plot(law.x, law.nominal, color=VERMILION, ls=_DASH, lw=1.2, label="nominal")
        axes.plot(law.x, law.found, color=BLUE, label="found")
        axes.set_xlabel(law.x_label)
        axes.set_ylabel(law.y_label)
        axes.set_title(law.title, pad=22)
        # outside: a periodic law fills the axes
        axes.legend(loc="lower left", bbox_to_anchor=(-0.02, 0.99), ncols=3)
        return as_svg(
            figure,
            name=f"law-{number}",
            alt=f"{law.title}: identified law against the nominal one.",
            caption=law.caption or f"{law.title}: the law that was identified, with its 95 % band.",
        )


def remainder_figure(item: Remainder) -> ReportFigure:
    """Held-out errors over the noise floor, signal by signal."""
    k = np.arange(len(item.signals))
    rows = (
        ("before", item.before, BEFORE, "v"),
        ("parameters only", item.parameters_only, PARAMETERS, "s"),
        ("after", item.after, AFTER, "o"),
    )
    with house_style():
        figure = new_figure(1.15 + 0.32 * len(k))
        axes = figure.subplots()
        axes.axvspan(0.0, 1.0, color="#e3e7ec", zorder=0)
        for j in k:
            values = [float(v[j]) for _, v, _, _ in rows if np.isfinite(v[j])]
            axes.plot([min(values), max(values)], [j, j], color=LIGHT, lw=2.0, zorder=1)
        for name, values, colour, marker in rows:
            axes.plot(values, k, marker, color=colour, ms=6, label=name)
        axes.set_xscale("log")
        axes.set_xlim(left=0.4)
        axes.set_yticks(k, item.signals)
        axes.invert_yaxis()
        axes.grid(axis="y", visible=False)
        axes.set_xlabel("error of held-out recordings, in noise floors")
        figure.legend(loc="outside upper left", ncols=3)
        return as_svg(
            figure,
            name="remainder",
            alt="Held-out errors over the noise floor before, with parameters only and after.",
            caption="Largest error of each signal, open loop over a whole recording. At 1 (grey)"
            " only the sensors' own noise is left; the motor angle keeps some tens, because no"
            " drive repeats to one encoder count.",
        )


def next_figure(item: NextExperiment) -> ReportFigure:
    """The input to run, and the responses that the two rivals predict."""
    with house_style():
        figure = new_figure(3.4)
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[1.0, 1.5])
        upper.plot(*decimated(item.time_s, item.command), color=GREEN, lw=1.2)
        upper.set_ylabel(item.command_label)
        for name, values, colour, style in zip(
            item.rivals, item.predicted, (BLUE, VERMILION), ("-", _DASH), strict=True
        ):
            lower.plot(*decimated(item.time_s, values), color=colour, ls=style, lw=1.2, label=name)
        lower.set_ylabel(f"{quantity(item.signal)} ({item.unit})")
        lower.set_xlabel("time (s)")
        lower.legend(loc="upper right", ncols=2)
        _room_above(lower)
        lower.set_xlim(item.time_s[0], item.time_s[-1])
        figure.align_ylabels()
        return as_svg(
            figure,
            name="next-experiment",
            alt=f"Next experiment: {item.sentence}",
            caption=f"Input to run, and what {item.rivals[0]} and {item.rivals[1]} predict of it"
            " (each with parameters of its own).",
        )


def _room_above(axes: Axes) -> None:
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.25 * (high - low))


def by_file(traces: tuple[PortTrace, ...], most: int) -> tuple[PortTrace, ...]:
    """The traces of the first few recordings, which is what a page has room for."""
    found = [tuple(group) for _, group in groupby(traces, key=lambda t: t.file)]
    return tuple(t for group in found[:most] for t in group)
