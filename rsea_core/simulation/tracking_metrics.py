"""Figures that judge how a trajectory follows its reference and what it takes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import InputError
from rsea_core.simulation.reference import AngleReference, Reference
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

    @property
    def sentence(self) -> str:
        """The error in words."""
        return f"the tracking error is {self.rmse_Nm:.3g} Nm rms"


@dataclass(frozen=True, kw_only=True)
class AngleMetrics:
    """How well the load's angle follows, over the rows from `from_s` on; see `TrackingMetrics`.

    Attributes
    ----------
    steady_state_error_rad : float
        Mean of the last 20 %.
    """

    from_s: float
    rmse_rad: float
    peak_error_rad: float
    steady_state_error_rad: float
    amplitude_ratio: float | None
    phase_deg: float | None
    overshoot_percent: float | None
    command_rms: float
    command_peak: float
    current_rms_A: float
    current_peak_A: float
    motor_speed_peak_rad_per_s: float

    @property
    def sentence(self) -> str:
        """The error in words."""
        return f"the error of the angle is {self.rmse_rad:.3g} rad rms"


def tracking_metrics(
    trajectory: Trajectory, reference: Reference | AngleReference, *, from_s: float = 0.0
) -> TrackingMetrics | AngleMetrics:
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
    of_torque = reference.unit == "Nm"
    column = trajectory.torque_Nm if of_torque else trajectory.load_angle_rad
    t, followed, response = t[rows], trajectory.reference[rows], column[rows]
    ratio = phase = overshoot = None
    height = getattr(reference, "amplitude_Nm" if of_torque else "amplitude_rad")
    if reference.kind == "sine" and height != 0.0:
        turned = phasor(t, response, reference.frequency_Hz)
        turned = turned / phasor(t, followed, reference.frequency_Hz)
        ratio, phase = float(abs(turned)), float(np.rad2deg(np.angle(turned)))
    if reference.kind == "step" and height != 0.0:
        overshoot = 100.0 * max(float(np.max((response - followed[-1]) / height)), 0.0)
    error, command = followed - response, trajectory.command[rows]
    current = trajectory.current_A[rows]
    shared = {
        "from_s": from_s,
        "amplitude_ratio": ratio,
        "phase_deg": phase,
        "overshoot_percent": overshoot,
        "command_rms": rms(command),
        "command_peak": float(np.abs(command).max()),
        "current_rms_A": rms(current),
        "current_peak_A": float(np.abs(current).max()),
        "motor_speed_peak_rad_per_s": float(
            np.abs(trajectory.motor_velocity_rad_per_s[rows]).max()
        ),
    }
    peak = float(np.abs(error).max())
    if of_torque:
        return TrackingMetrics(rmse_Nm=rms(error), peak_error_Nm=peak, **shared)
    last = float(error[t >= t[0] + 0.8 * (t[-1] - t[0])].mean())
    return AngleMetrics(
        rmse_rad=rms(error), peak_error_rad=peak, steady_state_error_rad=last, **shared
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
