"""Loops of controllers: step, Bode, Nyquist, sensitivity, port, limit cycles, fuzzy tables."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

from dftfs.report.live import Curve, Panel, with_live
from dftfs.report.study.tables import Table
from dftfs.report.style import GREY, VERMILION, ReportFigure, as_svg, house_style, new_figure

Style = Callable[[int], dict]
DASH = {"-": "solid", "--": "dash", "-.": "dashdot", ":": "dot"}  # as plotly names them
_LARGEST = 2.0  # sensitivity that is drawn as a guide: modulus margin 0.5
_POINTS = 900


def study_figures(studies: Sequence, style: Style) -> dict[str, ReportFigure]:
    """Every figure that these loops have, by name, in the order of a page."""
    loops = [(j, s) for j, s in enumerate(studies) if s.open_loop is not None]
    found = {}
    if any(s.step is not None for s in studies):
        found["step"] = _step_figure(studies, style)
    if loops:
        found["bode"] = _bode_figure(loops, style)
        found["nyquist"] = _nyquist_figure(loops, style)
    if any(s.port is not None for s in studies):
        found["port"] = _port_figure([(j, s) for j, s in enumerate(studies) if s.port], style)
    if any(s.predicted for s in studies):
        found["cycles"] = _cycle_figure(studies, style)
    if any(s.surface is not None for s in studies):
        found["surface"] = _surface_figure([s for s in studies if s.surface is not None])
    return found


def margins_table(studies: Sequence) -> Table | None:
    """Signed margins of each linear loop, and from where on its port is active."""
    rows = tuple(
        (
            s.name, *(f"{x:+.4g}" for x in (s.margins.gain_rise_dB, s.margins.gain_fall_dB,
                                            s.margins.phase_margin_deg)),
            f"{s.margins.crossover_Hz:.3g}", f"{1e3 * s.margins.delay_margin_s:.3g}",
            f"{1.0 / s.margins.modulus_margin:.3g}", f"{s.margins.pole_radius:.5f}",
            "-" if s.active_from_Hz is None else f"{s.active_from_Hz:.3g}",
        )
        for s in studies if s.margins is not None
    )  # fmt: skip
    if not rows:
        return None
    return Table(
        caption="Margins of the linear loop at rest, signed (negative phase: beyond -180°)",
        head=("controller", "gain may rise (dB)", "gain may fall (dB)", "phase margin (°)",
              "crossover (Hz)", "delay margin (ms)", "largest sensitivity", "pole radius",
              "port active from (Hz)"),
        rows=rows,
        numeric=tuple(range(1, 9)),
    )  # fmt: skip


def _looks(style: Style, j: int) -> dict:
    return {"colour": style(j)["color"], "dash": DASH[style(j)["linestyle"]]}


def _step_figure(studies: Sequence, style: Style) -> ReportFigure:
    ran = [(j, s) for j, s in enumerate(studies) if s.step is not None]
    unit, height = ran[0][1].unit, ran[0][1].step_height
    with house_style():
        figure = new_figure(3.6)
        response, command = figure.subplots(2, 1, sharex=True, height_ratios=[1.5, 1.0])
        response.axhline(height, color=GREY, lw=2.5, alpha=0.5, label="reference")
        for j, s in ran:
            time, values, given = s.step
            every = slice(None, None, max(time.size // _POINTS, 1))
            response.plot(time[every], values[every], lw=1.0, label=s.name, **style(j))
            command.plot(time[every], given[every], lw=0.9, **style(j))
        response.set_ylabel(f"{'torque' if unit == 'Nm' else 'angle'} ({unit})")
        command.set_ylabel("command")
        command.set_xlabel("time (s)")
        figure.legend(loc="outside upper center", ncols=3)
    drawn = as_svg(
        figure,
        name="step",
        alt="Response and command of every loop after a step of the reference.",
        caption=f"Step of {height:g} {unit} from rest, on the machine with its effects.",
    )
    time = ran[0][1].step[0]
    if any(not np.array_equal(s.step[0], time) for _, s in ran):
        return drawn
    reference = Curve(name="reference", values=np.full(time.size, height), colour=GREY, width=3.0)

    def curves(column: int, in_legend: bool) -> tuple[Curve, ...]:
        return tuple(
            Curve(name=s.name, values=s.step[column], in_legend=in_legend, **_looks(style, j))
            for j, s in ran
        )

    panels = (
        Panel(label=response.get_ylabel(), curves=(reference, *curves(1, True)), height=1.5),
        Panel(label="command", curves=curves(2, False)),
    )
    return with_live(drawn, time, panels)


def _degrees(values) -> np.ndarray:
    """Phase without jumps, its start between -270 and 90 degrees."""
    turned = np.degrees(np.unwrap(np.angle(values)))
    return turned - 360.0 * np.round((turned[turned.size // 4] + 90.0) / 360.0)


def _bode_figure(loops: Sequence, style: Style) -> ReportFigure:
    """Magnitude, phase and sensitivity of each linear loop, its margins marked."""
    with house_style():
        figure = new_figure(6.0)
        size, phase, sensitivity = figure.subplots(3, 1, sharex=True)
        for j, s in loops:
            f, loop = s.open_loop
            size.loglog(f, np.abs(loop), lw=1.0, label=s.name, **style(j))
            phase.semilogx(f, _degrees(loop), lw=1.0, **style(j))
            sensitivity.loglog(f, 1.0 / np.abs(1.0 + loop), lw=1.0, **style(j))
            if np.isfinite(s.margins.crossover_Hz):
                at = s.margins.crossover_Hz, s.margins.phase_margin_deg - 180.0
                phase.plot(*at, "o", ms=4, color=style(j)["color"])
            if np.isfinite(s.margins.gain_margin_dB):
                at = s.margins.gain_margin_Hz, 10.0 ** (-s.margins.gain_margin_dB / 20.0)
                size.plot(*at, "s", ms=4, color=style(j)["color"])
        size.axhline(1.0, color=GREY, lw=0.6)
        phase.axhline(-180.0, color=GREY, lw=0.6)
        phase.set_ylim(-540.0, 90.0)
        sensitivity.axhline(_LARGEST, color=VERMILION, lw=0.8, ls="--")
        sensitivity.set_xlabel("frequency (Hz)")
        for axes, label in (
            (size, "magnitude"), (phase, "phase (°)"), (sensitivity, "sensitivity")
        ):  # fmt: skip
            axes.set_ylabel(label)
        figure.legend(loc="outside upper center", ncols=3)
    drawn = as_svg(
        figure,
        name="loops",
        alt="Magnitude, phase and sensitivity of every linear loop.",
        caption="Linear sampled loops, broken at the command, of the machine that the controllers"
        " are designed on; a fuzzy table with its gain at rest. In print, squares mark the gain"
        " margin, circles the phase margin, the dashed line a largest sensitivity of 2.",
    )
    shared = loops[0][1].open_loop[0]
    if any(not np.array_equal(s.open_loop[0], shared) for _, s in loops):
        return drawn

    def curves(of, in_legend: bool = False) -> tuple[Curve, ...]:
        return tuple(
            Curve(name=s.name, values=of(s.open_loop[1]), in_legend=in_legend, **_looks(style, j))
            for j, s in loops
        )

    panels = (
        Panel(label="magnitude", curves=curves(np.abs, in_legend=True), log=True),
        Panel(label="phase (°)", curves=curves(_degrees)),
        Panel(label="sensitivity", curves=curves(lambda x: 1.0 / np.abs(1.0 + x)), log=True),
    )
    return with_live(drawn, shared, panels, label="frequency (Hz)", log=True)


def _nyquist_figure(loops: Sequence, style: Style) -> ReportFigure:
    with house_style():
        figure = new_figure(4.6)
        axes = figure.subplots()
        for j, s in loops:
            loop, m = s.open_loop[1], s.margins
            label = f"{s.name}: {m.gain_margin_dB:+.3g} dB, {m.phase_margin_deg:+.3g}°"
            axes.plot(loop.real, loop.imag, lw=1.0, label=label, **style(j))
        turn = np.linspace(0.0, 2.0 * np.pi, 200)
        axes.plot(np.cos(turn), np.sin(turn), color=GREY, lw=0.5)
        guide = np.exp(1j * turn) / _LARGEST - 1.0
        axes.plot(guide.real, guide.imag, color=VERMILION, lw=0.8, ls="--")
        axes.plot(-1.0, 0.0, "+", color=VERMILION, ms=8)
        axes.set_xlim(-3.0, 1.0)
        axes.set_ylim(-2.0, 2.0)
        axes.set_aspect("equal")
        axes.set_xlabel("real part")
        axes.set_ylabel("imaginary part")
        figure.legend(loc="outside upper center", ncols=2 if len(loops) > 1 else 1, fontsize=7)
    return as_svg(
        figure,
        name="nyquist",
        alt="Nyquist plot of every linear loop near -1.",
        caption="The same loops near -1, with their signed gain and phase margins; dashed: distance"
        " 0.5 from -1.",
    )


def _port_figure(loops: Sequence, style: Style) -> ReportFigure:
    with house_style():
        figure = new_figure(3.4)
        size, phase = figure.subplots(2, 1, sharex=True)
        for j, s in loops:
            f, port = s.port
            size.loglog(f, np.abs(port), lw=1.0, label=s.name, **style(j))
            phase.semilogx(f, np.degrees(np.angle(port)), lw=1.0, **style(j))
        for bound in (-90.0, 90.0):
            phase.axhline(bound, color=VERMILION, lw=0.8, ls="--")
        phase.set_ylim(-180.0, 180.0)
        phase.set_yticks((-180, -90, 0, 90, 180))
        size.set_ylabel("size (Nms/rad)")
        phase.set_ylabel("phase (°)")
        phase.set_xlabel("frequency (Hz)")
        figure.legend(loc="outside upper center", ncols=3)
    active = [f"{s.name} from {s.active_from_Hz:.3g} Hz" for _, s in loops if s.active_from_Hz]
    return as_svg(
        figure,
        name="port",
        alt="Magnitude and phase of the impedance that the load feels.",
        caption="What the load feels: spring torque over its speed, reference zero, linear loop."
        " Passive where the phase is within ±90° (dashed); not everywhere passive: "
        + (", ".join(active) or "none")
        + ".",
    )


def _cycle_figure(studies: Sequence, style: Style) -> ReportFigure:
    unit = studies[0].unit
    with house_style():
        figure = new_figure(3.4)
        delay, frequency = figure.subplots(1, 2)
        for j, s in enumerate(studies):
            for axes, of in (
                (delay, lambda c: 1e3 * c.delay_s),
                (frequency, lambda c: c.frequency_Hz),
            ):
                points = [(of(c), c.amplitude) for c in s.predicted]
                if points:
                    label = s.name if axes is delay else None
                    axes.plot(*zip(*points), lw=1.0, label=label, **style(j))
                for cycles, face in ((s.bare, "none"), (s.whole, style(j)["color"])):
                    for c in cycles:
                        axes.plot(of(c), c.amplitude, "o", ms=5, mfc=face, color=style(j)["color"])
        for axes, label in ((delay, "additional delay (ms)"), (frequency, "frequency (Hz)")):
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.set_xlabel(label)
            axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
            axes.xaxis.set_minor_formatter(NullFormatter())
        delay.set_ylabel(f"amplitude ({unit})")
        figure.legend(loc="outside upper center", ncols=3)
    return as_svg(
        figure,
        name="cycles",
        alt="Amplitude of limit cycles against additional delay and against frequency.",
        caption="Limit cycles that an additional delay of the command would start. Lines:"
        " describing function; open circles: runs of the machine without its effects; filled:"
        " with them (friction may let none persist).",
    )


def _surface_figure(studies: Sequence) -> ReportFigure:
    with house_style():
        figure = new_figure(0.4 + 2.4 * ((len(studies) + 1) // 2))
        places = figure.subplots((len(studies) + 1) // 2, 2, squeeze=False).ravel()
        for axes in places[len(studies) :]:
            axes.set_axis_off()
        for axes, s in zip(places, studies):
            error, rate, answer = s.surface
            drawn = axes.contourf(error, rate, answer, levels=np.linspace(-100.0, 100.0, 21))
            axes.contour(error, rate, answer, levels=[0.0], colors="white", linewidths=0.8)
            axes.set_title(s.name)
            axes.set_xlabel("error (Nm)")
            axes.set_ylabel("its rate (Nm/s)")
        figure.colorbar(drawn, ax=list(places), label="% of the command")
    return as_svg(
        figure,
        name="surface",
        alt="Answer of each fuzzy table over error and its rate.",
        caption="Answer of each fuzzy table over error and its rate, scaled as tuned; white: zero.",
    )


def spectra_figure(comparison, verdicts: Sequence, style: Style, front=()) -> ReportFigure:
    """Amplitude spectra of error and command over the judged time, and effort against error."""
    column = "torque_Nm" if comparison.task.reference.unit == "Nm" else "load_angle_rad"
    unit = comparison.task.reference.unit
    with house_style():
        figure = new_figure(3.4)
        error, command, effort = figure.subplots(1, 3)
        for j, verdict in enumerate(verdicts):
            run = verdict.trajectory
            rows = run.time_s >= comparison.task.from_s
            goal = comparison.task.reference.sample(run.time_s[rows])[:, 0]
            for axes, signal in (
                (error, goal - getattr(run, column)[rows]),
                (command, run.command[rows]),
            ):
                f, amplitude = _spectrum(run.time_s[rows], signal)
                axes.loglog(f, amplitude, lw=0.8, label=verdict.name, **style(j))
            own = {"color": style(j)["color"], "marker": "o" if not verdict.reasons else "x"}
            at = verdict.following.rmse, verdict.command_change
            effort.plot(*at, ls="", ms=6, **own)
            if verdict.name in front:
                effort.plot(*at, "o", ms=11, mfc="none", color=style(j)["color"])
        for axes, x, y in (
            (error, "frequency (Hz)", f"error ({unit})"),
            (command, "frequency (Hz)", verdicts[0].trajectory.command_name),
            (effort, f"RMSE ({unit})", "command change per sample"),
        ):
            axes.set_xlabel(x)
            axes.set_ylabel(y)
        effort.set_xscale("log")
        effort.set_yscale("log")
        handles, labels = error.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return as_svg(
        figure,
        name="spectra",
        alt="Amplitude spectra of error and command, and command change against RMSE.",
        caption="Amplitude spectra over the judged time (Hann window), and chatter against error;"
        " rings are on the Pareto front of error, effort, chatter and spread, crosses are loops"
        " without a rank.",
    )


def _spectrum(time_s, signal):
    """Frequencies [Hz] above zero and amplitudes of a signal in evenly spaced rows."""
    window = np.hanning(signal.size)
    found = np.abs(np.fft.rfft((signal - signal.mean()) * window)) * 2.0 / window.sum()
    f = np.fft.rfftfreq(signal.size, time_s[1] - time_s[0])
    return f[1:], np.maximum(found[1:], 1e-12)
