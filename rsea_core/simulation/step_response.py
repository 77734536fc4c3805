"""Settling, overshoot and steady-state error of a torque step, as section 4 of the thesis has them.

Definitions: overshoot of the step's height, settling into 2 %, error over the last 20 %.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import InputError
from rsea_core.simulation.reference import AngleReference, Reference
from rsea_core.simulation.trajectory import Trajectory

SETTLING_BAND = 0.02  # of the step's height
LAST_SHARE = 0.2  # of the rows, for the steady state
LEAST_ROWS = 20


@dataclass(frozen=True, kw_only=True)
class StepMetrics:
    """How a torque step settles.

    Attributes
    ----------
    overshoot_percent : float
        Largest torque beyond the final mean, of the step's height; 0 if there is none.
    settling_s : float or None
        From the step until the torque stays within 2 % of the step's height around the
        reference; None if it is outside at the end.
    settling_to_final_s : float or None
        The same around the mean of the last 20 % of the rows.
    steady_state_error_Nm : float
        Mean of reference less torque over the last 20 % of the rows from the step on.
    """

    overshoot_percent: float
    settling_s: float | None
    settling_to_final_s: float | None
    steady_state_error_Nm: float


@dataclass(frozen=True, kw_only=True)
class StepShape:
    """How a signal answers a step, in the signal's own unit.

    Attributes
    ----------
    final : float
        Mean over the last 20 % of the rows.
    overshoot_percent, settling_s, settling_to_final_s : as `StepMetrics`
    """

    final: float
    overshoot_percent: float
    settling_s: float | None
    settling_to_final_s: float | None


def step_metrics(trajectory: Trajectory, reference: Reference) -> StepMetrics:
    """Judge the closed-loop answer to a torque step.

    Raises
    ------
    InputError
        If the reference is not a step of some height, the trajectory followed none, or fewer
        than 20 rows follow the step.
    """
    shape = step_of(trajectory, reference)
    rows = trajectory.time_s >= (reference.start_s or 0.0)
    error = (trajectory.reference - trajectory.torque_Nm)[rows]
    return StepMetrics(
        overshoot_percent=shape.overshoot_percent,
        settling_s=shape.settling_s,
        settling_to_final_s=shape.settling_to_final_s,
        steady_state_error_Nm=float(error[-_late(error) :].mean()),
    )


def step_of(trajectory: Trajectory, reference: Reference | AngleReference) -> StepShape:
    """How a closed loop's torque, or its load's angle, answers a step of the reference.

    Raises
    ------
    InputError
        As `step_metrics`.
    """
    of_torque = reference.unit == "Nm"
    height = reference.amplitude_Nm if of_torque else reference.amplitude_rad
    if reference.kind != "step" or height == 0.0:
        raise InputError(f"step metrics need a step reference, not a {reference.kind!r} one")
    if trajectory.reference is None:
        raise InputError("the trajectory followed no reference: there is no step to judge")
    start = reference.start_s or 0.0
    rows = trajectory.time_s >= start
    if rows.sum() < LEAST_ROWS:
        raise InputError(
            f"only {rows.sum()} rows follow the step at {start:g} s, needs {LEAST_ROWS}"
        )
    signal = trajectory.torque_Nm if of_torque else trajectory.load_angle_rad
    time, followed = trajectory.time_s[rows] - start, trajectory.reference[rows]
    return step_shape(time, signal[rows], followed=followed, height=height)


def step_shape(
    time_s: NDArray, signal: NDArray, *, followed: NDArray | float, height: float | None = None
) -> StepShape:
    """The figures of a signal from its step on; `followed` is what it should be.

    `height` is the step's; None: the way from the first row to the final value.
    """
    final = float(signal[-_late(signal) :].mean())
    height = final - float(signal[0]) if height is None else height
    band = SETTLING_BAND * abs(height)
    return StepShape(
        final=final,
        overshoot_percent=100.0 * max(float(np.max((signal - final) / height)), 0.0),
        settling_s=_settled(time_s, signal - followed, band),
        settling_to_final_s=_settled(time_s, signal - final, band),
    )


def _late(signal: NDArray) -> int:
    """Number of the rows that are the steady state."""
    return max(round(LAST_SHARE * signal.size), 1)


def _settled(time: NDArray, error: NDArray, band: float) -> float | None:
    """Time from which on the error stays within the band."""
    outside = np.flatnonzero(np.abs(error) > band)
    if outside.size == 0:
        return 0.0
    if outside[-1] == time.size - 1:
        return None
    return float(time[outside[-1] + 1])
