"""Figures that judge how a trajectory follows its reference and what it takes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import InputError
from rsea_core.simulation.reference import Reference
from rsea_core.simulation.trajectory import Trajectory


@dataclass(frozen=True, kw_only=True)
class TrackingMetrics:
    """How well the torque follows, over the rows from `from_s` on.

    Attributes
    ----------
    from_s : float
    rmse_Nm, peak_error_Nm : float
        Root mean square and largest magnitude of reference less torque.
    amplitude_ratio, phase_deg : float or None
        Of the torque's part at the reference's frequency against the reference's, by least
        squares on sine, cosine, constant and slope; None for other references than a sine.
    overshoot_percent : float or None
        Largest torque beyond the final reference, of the step's height; None but for a step.
    command_rms, command_peak : float
        In the command's own unit.
    current_rms_A, current_peak_A : float
    motor_speed_peak_rad_per_s : float
    """

    from_s: float
    rmse_Nm: float
    peak_error_Nm: float
    amplitude_ratio: float | None
    phase_deg: float | None
    overshoot_percent: float | None
    command_rms: float
    command_peak: float
    current_rms_A: float
    current_peak_A: float
    motor_speed_peak_rad_per_s: float


def tracking_metrics(
    trajectory: Trajectory, reference: Reference, *, from_s: float = 0.0
) -> TrackingMetrics:
    """Judge a closed-loop trajectory from a time on.

    Raises
    ------
    InputError
        If the trajectory has no reference, or fewer than 8 rows are left to judge.
    """
    if trajectory.reference is None:
        raise InputError("the trajectory followed no reference: there is no tracking to judge")
    t = trajectory.time_s
    rows = t >= from_s
    if rows.sum() < 8:
        raise InputError(f"from_s = {from_s:g} s leaves {rows.sum()} rows of {t[-1]:g} s to judge")
    t, followed, torque = t[rows], trajectory.reference[rows], trajectory.torque_Nm[rows]
    ratio = phase = overshoot = None
    if reference.kind == "sine":
        response = phasor(t, torque, reference.frequency_Hz)
        response = response / phasor(t, followed, reference.frequency_Hz)
        ratio, phase = float(abs(response)), float(np.rad2deg(np.angle(response)))
    if reference.kind == "step":
        height = reference.amplitude_Nm
        overshoot = 100.0 * max(float(np.max((torque - followed[-1]) / height)), 0.0)
    error, command = followed - torque, trajectory.command[rows]
    current = trajectory.current_A[rows]
    return TrackingMetrics(
        from_s=from_s,
        rmse_Nm=rms(error),
        peak_error_Nm=float(np.abs(error).max()),
        amplitude_ratio=ratio,
        phase_deg=phase,
        overshoot_percent=overshoot,
        command_rms=rms(command),
        command_peak=float(np.abs(command).max()),
        current_rms_A=rms(current),
        current_peak_A=float(np.abs(current).max()),
        motor_speed_peak_rad_per_s=float(np.abs(trajectory.motor_velocity_rad_per_s[rows]).max()),
    )


def rms(values: NDArray) -> float:
    """Root of the mean of squares."""
    return float(np.sqrt(np.mean(np.square(values))))


def phasor(time_s: NDArray, signal: NDArray, frequency_Hz: float) -> complex:
    """Complex amplitude of a signal at a frequency: Re(p) cos(wt) - Im(p) sin(wt) fits best.

    A constant and a slope are fitted beside it, so that whole periods are not needed.

    Raises
    ------
    InputError
        If the signal is shorter than half a period, where slope and sine cannot be told apart.
    """
    if (time_s[-1] - time_s[0]) * frequency_Hz < 0.5:
        raise InputError(
            f"{time_s[-1] - time_s[0]:g} s are less than half a period at {frequency_Hz:g} Hz"
        )
    angle = 2.0 * np.pi * frequency_Hz * time_s
    columns = (np.cos(angle), -np.sin(angle), np.ones(angle.size), time_s - time_s.mean())
    (real, imaginary, *_), *_ = np.linalg.lstsq(np.column_stack(columns), signal)
    return complex(real, imaginary)
