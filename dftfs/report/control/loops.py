"""Loops of compared controllers: Bode, Nyquist, sensitivity; spectra; effort against error."""

from collections.abc import Callable, Sequence

import numpy as np

from dftfs.report.style import GREY, VERMILION, ReportFigure, as_svg, house_style, new_figure

Style = Callable[[int], dict]
_LARGEST = 2.0  # sensitivity that is drawn as a guide: modulus margin 0.5


def loop_figure(verdicts: Sequence, style: Style) -> ReportFigure:
    """Magnitude and phase, Nyquist's plot near -1, and the sensitivity of each linear loop."""
    with house_style():
        figure = new_figure(6.6)
        (size, nyquist), (phase, sensitivity) = figure.subplots(2, 2)
        for j, verdict in enumerate(verdicts):
            f, loop = verdict.open_loop
            size.loglog(f, np.abs(loop), lw=1.0, label=verdict.name, **style(j))
            turned = np.degrees(np.unwrap(np.angle(loop)))
            turned -= 360.0 * np.round((turned[f.size // 4] + 90.0) / 360.0)
            phase.semilogx(f, turned, lw=1.0, **style(j))
            nyquist.plot(loop.real, loop.imag, lw=1.0, **style(j))
            sensitivity.loglog(f, 1.0 / np.abs(1.0 + loop), lw=1.0, **style(j))
        size.axhline(1.0, color=GREY, lw=0.6)
        phase.axhline(-180.0, color=GREY, lw=0.6)
        phase.set_ylim(-540.0, 90.0)
        sensitivity.axhline(_LARGEST, color=VERMILION, lw=0.8, ls="--")
        turn = np.linspace(0.0, 2.0 * np.pi, 200)
        nyquist.plot(-1.0 + np.cos(turn) / _LARGEST, np.sin(turn) / _LARGEST, color=VERMILION,
                     lw=0.8, ls="--")  # fmt: skip
        nyquist.plot(-1.0, 0.0, "+", color=VERMILION, ms=8)
        nyquist.set_xlim(-3.0, 1.0)
        nyquist.set_ylim(-2.0, 2.0)
        nyquist.set_aspect("equal")
        for axes, x, y in (
            (size, "frequency (Hz)", "magnitude"),
            (phase, "frequency (Hz)", "phase (°)"),
            (sensitivity, "frequency (Hz)", "sensitivity"),
            (nyquist, "real part", "imaginary part"),
        ):
            axes.set_xlabel(x)
            axes.set_ylabel(y)
        figure.legend(loc="outside upper center", ncols=3)
    return as_svg(
        figure,
        name="loops",
        alt="Bode plot, Nyquist plot near -1 and sensitivity of every linear loop.",
        caption="Linear sampled loops, broken at the command, of the machine that the controllers"
        " are designed on; dashed: a largest sensitivity of 2. A fuzzy table is shown with its gain"
        " at rest.",
    )


def spectra_figure(comparison, verdicts: Sequence, style: Style) -> ReportFigure:
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
            effort.plot(verdict.following.rmse, verdict.command_change, ls="", ms=6, **own)
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
        " crosses are loops without a rank.",
    )


def _spectrum(time_s, signal):
    """Frequencies [Hz] above zero and amplitudes of a signal in evenly spaced rows."""
    window = np.hanning(signal.size)
    found = np.abs(np.fft.rfft((signal - signal.mean()) * window)) * 2.0 / window.sum()
    f = np.fft.rfftfreq(signal.size, time_s[1] - time_s[0])
    return f[1:], np.maximum(found[1:], 1e-12)
