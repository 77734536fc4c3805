"""A recording cut into windows that start from smoothed states, and machines' readings in them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.variant import TrialMachine
from rsea_core.engines.fixed_step.replay import CHANNELS, Numbers
from rsea_core.errors import RecordingError, RseaError
from rsea_core.identify.fitting.predictions import restore_angles, shift_starts, undeflect_link
from rsea_core.identify.fitting.problem import PreparedRecording, Problem
from rsea_core.identify.smoothing.smoother import Smoothed, port_torques

WINDOW_s = 2.5
OVERLAP = 5
FITTED_ROWS = 250  # of each window at most


@dataclass(frozen=True, kw_only=True)
class Cut:
    """One recording in windows.

    Attributes
    ----------
    windows : (w, 2) array of int
        First and last row of each, side by side: what is measured on.
    overlapping : (v, 2) array of int
        The same length, `OVERLAP` times as many: what is fitted to, so that a start that the
        smoother gets wrong is one of many.
    path : mapping
        The smoothed motion, arguments of `Replay.warm`.
    """

    prepared: PreparedRecording
    windows: NDArray
    overlapping: NDArray
    path: Mapping[str, NDArray]

    @property
    def decimation(self) -> int:
        """Every how manieth row is fitted to: errors of windows are slow."""
        return max(1, int(np.diff(self.windows[0])[0]) // FITTED_ROWS)


def cut(problem: Problem, prepared: PreparedRecording, window_s: float = WINDOW_s) -> Cut:
    """The windows of a recording and the smoothed motion that they start from.

    Raises
    ------
    RecordingError
        If the recording is too short for one window, or its states cannot be smoothed.
    """
    r = prepared.recording
    length = round(window_s / r.sample_time_s)
    count = (r.rows - 1) // length if length > 0 else 0
    if count < 1 or length < 2:
        raise RecordingError(f"{r.file}: too short for windows of {window_s:g} s")
    try:
        states = port_torques(problem.case.rig, r)
    except (RseaError, np.linalg.LinAlgError) as refused:
        raise RecordingError(f"{r.file}: no states to start from: {refused}") from None
    if not isinstance(states, Smoothed):
        raise RecordingError(f"{r.file}: no motion to start from")
    first = np.arange(count) * length
    often = np.arange(0, r.rows - length, max(length // OVERLAP, 1))
    return Cut(
        prepared=prepared,
        windows=np.stack([first, first + length], axis=1),
        overlapping=np.stack([often, often + length], axis=1),
        path=_path(states, prepared),
    )


def _path(states: Smoothed, prepared: PreparedRecording) -> dict[str, NDArray]:
    """The smoothed motion; bodies that the smoother did not need move with the other."""
    s = states.signals
    angle = s.get("wheel_angle_rad", s.get("load_angle_rad"))
    speed = s.get("wheel_velocity_rad_per_s", s.get("load_velocity_rad_per_s"))
    held = prepared.where.kind in ("locked", "imposed") and "load_angle_rad" not in s
    still = np.full(angle.size, prepared.recording.first("load_angle_rad")) if held else angle
    return {
        "wheel_angle_rad": angle,
        "wheel_velocity_rad_per_s": speed,
        "load_angle_rad": s.get("load_angle_rad", still),
        "load_velocity_rad_per_s": s.get(
            "load_velocity_rad_per_s", np.zeros(angle.size) if held else speed
        ),
        "current_A": s.get("current_A", np.zeros(angle.size)),
    }


def predict_windows(
    piece: Cut, machine: TrialMachine, windows: NDArray | None = None
) -> list[NDArray]:
    """Readings (rows, channels) of each window, NaN where a replay failed."""
    return predict_many(piece, [machine], windows)[0]


def predict_many(
    piece: Cut, machines: Sequence[TrialMachine], windows: NDArray | None = None
) -> list[list[NDArray]]:
    """As `predict_windows`, of several machines."""
    prepared, replay = piece.prepared, piece.prepared.replay
    windows = piece.windows if windows is None else windows
    numbers = [Numbers(d.plant, d.regions, d.fx) for d in machines]
    starts = np.stack([replay.warm(n, **piece.path)[windows[:, 0]] for n in numbers])
    undeflect_link(starts)
    for y, d in zip(starts, machines, strict=True):  # the smoothed motion is what sensors read
        shift_starts(y, d, prepared.where)
    runs = replay.run_windows(numbers, windows, starts, failures="nan", parallel=len(numbers) > 1)
    found: list[list[NDArray]] = [[] for _ in machines]
    for w, run in enumerate(runs):
        first, last = windows[w]
        for i, d in enumerate(machines):
            restore_angles(run[i], d, prepared.where)
            found[i].append(_readings(run[i], d, prepared, slice(first, last + 1)))
    return found


def _readings(
    run: NDArray, machine: TrialMachine, prepared: PreparedRecording, rows: slice
) -> NDArray:
    out = np.empty((run.shape[0], len(prepared.channels)))
    for j, name in enumerate(prepared.channels):
        if name == "spring_deflection_rad":
            wheel = run[:, CHANNELS.index("motor_angle_rad")] / prepared.where.ratio
            out[:, j] = wheel - run[:, CHANNELS.index("load_angle_rad")]
        else:
            out[:, j] = run[:, CHANNELS.index(name)]
    for column, change in machine.reads:
        if column in prepared.channels:
            j = prepared.channels.index(column)
            whole = np.array(prepared.measured[:, j])  # a delayed reading needs what was before
            whole[rows] = out[:, j]
            out[:, j] = change(whole)[rows]
    return out
