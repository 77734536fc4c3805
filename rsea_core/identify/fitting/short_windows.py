"""Short runs of every recording from its smoothed motion.

A free run of a machine with dry friction or a torque periodic in an angle soon diverges from the
recording, and then says nothing of the law at hand. A run of half a second that begins at the
smoothed states does not diverge, so that least squares has one minimum; the error of the starts
enters the whitener as the covariance of its state (fixed-start multiple shooting: Bock,
Springer Ser. Chem. Phys. 18 (1981) 102; docs/diagnosis.md 5.3).
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
from rsea_core.errors import InputError, RigError
from rsea_core.identify.fitting.problem import PreparedRecording, Problem, Windows, machine_of
from rsea_core.identify.smoothing.smoother import Smoothed, smooth

SHORT_s, LONGER_s = 0.15, 0.6
UNSURE = 2.0  # the smoother's machine lacks the missing physics: its spreads count so many times
STATES = {
    k.IM: "current_A",
    k.TW: "wheel_angle_rad",
    k.WW: "wheel_velocity_rad_per_s",
    k.TL: "load_angle_rad",
    k.WL: "load_velocity_rad_per_s",
}


def prepared_for_short_runs(problem: Problem, *windows_s: float) -> list[list[PreparedRecording]]:
    """The fitted recordings in windows of each length; one that cannot be smoothed stays whole."""
    rates: dict[tuple, Mapping[str, float]] = {}
    found: list[list[PreparedRecording]] = [[] for _ in windows_s]
    for prepared in problem.fitted:
        try:
            motion, spread = _motion(prepared, _smoothed(problem, prepared, rates))
        except (InputError, RigError, np.linalg.LinAlgError):
            motion = None
        for window_s, recordings in zip(windows_s, found, strict=True):
            if motion is None or not np.all(np.isfinite(motion)):
                recordings.append(prepared)
                continue
            rows = _windows(prepared, window_s)
            std = UNSURE * np.median(spread[rows[:, 0]], axis=0)
            recordings.append(problem.in_windows(prepared, Windows(rows=rows, motion=motion), std))
    return found


def _smoothed(problem: Problem, prepared: PreparedRecording, rates: dict) -> Smoothed:
    """Smoothed motion; rates of one recording serve all others with the same ports."""
    r = prepared.recording
    key = (r.load.kind, *sorted(r.columns))
    result = smooth(
        problem.case.rig, r.load, r.columns, ignore=r.derived, rate_density=rates.get(key)
    )
    rates[key] = result.rate_density
    return result


def _motion(prepared: PreparedRecording, smoothed: Smoothed) -> tuple[NDArray, NDArray]:
    """The five states and their standard deviations (n, 5)."""
    n = prepared.recording.rows
    plant = machine_of(prepared.base)
    motion, spread = np.zeros((n, 5)), np.zeros((n, 5))
    for state, name in STATES.items():
        if name in smoothed.signals:
            motion[:, state] = smoothed.signals[name]
            spread[:, state] = smoothed.signals_std[name]
    if plant.structure == mp.RIGID_FREE:
        motion[:, k.TL : k.WL + 1] = motion[:, k.TW : k.WW + 1]
    elif plant.structure in (mp.ELASTIC_HELD, mp.RIGID_HELD):
        motion[:, k.TL] = prepared.replay.start_state(prepared.base)[k.TL]
    return motion, spread


def _windows(prepared: PreparedRecording, window_s: float) -> NDArray:
    """Windows of whole blocks over all rows; the last takes what is left."""
    block = prepared.whitener.block
    rows = prepared.recording.rows
    blocks = max(round(window_s / (prepared.recording.sample_time_s * block)), 2)
    first = np.arange(0, max(rows - blocks * block // 2, 1), blocks * block)
    last = np.append(first[1:] - 1, rows - 1)
    return np.stack([first, last], axis=1)
