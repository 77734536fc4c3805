"""The actuator with this spring: reference, error, command and current."""

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from dftfs.report.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    ORANGE,
    VERMILION,
    ReportFigure,
    as_svg,
    house_style,
    new_figure,
)

_POINTS = 1200  # per curve: more than the page has pixels
_TRANSIENT = 2.5  # of the judged peak: an earlier error this much larger leaves the scale
_NEAR_LIMIT = 0.5  # of a limit: a curve that comes this close is drawn with it


def actuator_figure(actuator, encode=as_svg) -> ReportFigure:
    """Torque and reference, error, command and current against time, with their limits.

    ``actuator`` has ``trajectory`` and ``metrics`` as a simulated scenario has; ``encode`` is
    `as_svg` or `as_png`.
    """
    run = actuator.trajectory
    time = run.time_s
    with house_style():
        figure = new_figure(6.4)
        grid = figure.add_gridspec(4, 1, height_ratios=[1.7, 1.0, 1.0, 1.0])
        torque = figure.add_subplot(grid[0])
        others = [figure.add_subplot(grid[k], sharex=torque) for k in (1, 2, 3)]
        signal, what, unit = followed(run)
        if run.reference is not None:
            _line(torque, time, run.reference, ORANGE, width=3.0, label="reference")
            error = run.reference - signal
            _line(others[0], time, error, INK, width=1.0)
            _fit_to_judged(others[0], error, time >= actuator.metrics.from_s, unit)
        _line(torque, time, signal, BLUE, width=1.2, label=what)
        torque.set_ylabel(f"{what.split()[-1]} ({unit})")
        torque.legend(loc="upper right", ncols=2)
        torque.set_ylim(*_headroom(torque.get_ylim()))
        others[0].set_ylabel(f"error ({unit})")
        _line(others[1], time, run.command, GREEN, width=1.0)
        others[1].set_ylabel(_command_label(run.command_name))
        if run.command_name == "duty":
            _limit(others[1], 1.0, run.command, "full supply voltage")
        _line(others[2], time, run.current_A, INK, width=1.0)
        others[2].set_ylabel("current (A)")
        limit = run.model.rig.current_limit_A
        if limit is not None:
            _limit(others[2], limit, run.current_A, f"limit {limit:g} A")
        others[2].set_xlabel("time (s)")
        for axes in (torque, *others[:2]):
            axes.tick_params(labelbottom=False)
        start = actuator.metrics.from_s
        if start > time[0]:
            for axes in (torque, *others):
                axes.axvspan(time[0], start, color="#eef1f4", zorder=0)
        torque.set_xlim(time[0], time[-1])
        figure.align_ylabels()
        rmse = next(v for k, v in vars(actuator.metrics).items() if k.startswith("rmse_"))
        return encode(
            figure,
            name="actuator",
            alt=f"Simulated actuator over {time[-1]:g} s: {what} follows its reference with"
            f" {rmse:.3g} {unit} rms error; {run.command_name} and current with their"
            " limits.",
            caption=f"From above: reference and {what}; reference less {what}; the drive's"
            " command; the motor's current (direct-current equivalent)."
            + (f" Shaded: before {start:g} s, not evaluated." if start > time[0] else ""),
        )


def followed(run) -> tuple[NDArray, str, str]:
    """What a run's reference belongs to, its name and unit."""
    if (run.reference_name or "").endswith("_rad"):
        return run.load_angle_rad, "load angle", "rad"
    return run.torque_Nm, "spring torque", "Nm"


def decimated(time_s: NDArray, values: NDArray, points: int = _POINTS) -> tuple[NDArray, NDArray]:
    """The curve with fewer points, keeping the lowest and the highest of every stretch."""
    if len(values) <= points:
        return time_s, values
    bounds = np.linspace(0, len(values), points // 2 + 1).astype(int)
    kept = {0, len(values) - 1}
    for first, last in pairwise(bounds):
        kept |= {
            first + int(np.argmin(values[first:last])),
            first + int(np.argmax(values[first:last])),
        }
    index = np.array(sorted(kept))
    return time_s[index], values[index]


def _line(axes: Axes, time: NDArray, values: NDArray, colour: str, *, width: float, label=None):
    axes.plot(*decimated(time, np.asarray(values)), color=colour, lw=width, label=label)


def _fit_to_judged(axes: Axes, error: NDArray, judged: NDArray, unit: str) -> None:
    """Scale to the rows that are judged; a larger error before them is stated as text."""
    inside, peak = float(np.max(np.abs(error[judged]))), float(np.max(np.abs(error)))
    if inside > 0 and peak > _TRANSIENT * inside:
        axes.set_ylim(-2.2 * inside, 2.2 * inside)
        axes.text(
            0.995,
            0.96,
            f"start: up to {peak:.2g} {unit}, off the scale",
            transform=axes.transAxes,
            ha="right",
            va="top",
            fontsize=8.5,
        )


def _headroom(limits: tuple[float, float]) -> tuple[float, float]:
    low, high = limits
    return low, high + 0.28 * (high - low)


def _limit(axes: Axes, limit: float, values: NDArray, text: str) -> None:
    """Lines at plus and minus a limit; stated as text where the curve stays far below it."""
    peak = float(np.max(np.abs(values)))
    if peak < _NEAR_LIMIT * limit:
        axes.set_ylim(-1.75 * peak, 1.75 * peak)
        text = f"{text} is {limit / peak:.3g} times the peak" if peak > 0 else text
        axes.text(0.995, 0.95, text, transform=axes.transAxes, ha="right", va="top", fontsize=8.5)
        return
    for sign in (+1, -1):
        axes.axhline(sign * limit, color=VERMILION, lw=1.0, ls=(0, (4, 2)))
    axes.text(
        0.995,
        limit,
        text,
        transform=axes.get_yaxis_transform(),
        ha="right",
        va="bottom",
        color=VERMILION,
        fontsize=8.5,
    )
    axes.set_ylim(-1.15 * limit, 1.5 * limit)
    axes.axhline(0, color=GREY, lw=0.5)


def _command_label(name: str | None) -> str:
    labels = {
        "duty": "duty (1 = full)",
        "voltage_V": "voltage (V)",
        "current_command_A": "current command (A)",
        "motor_torque_Nm": "motor torque (Nm)",
    }
    return labels.get(name or "", "command")
