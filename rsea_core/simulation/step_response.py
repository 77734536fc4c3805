"""Settling, overshoot and steady-state error of a torque step, as section 4 of the thesis has them.

Definitions: overshoot of the step's height, settling into 2 %, error over the last 20 %.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import InputError
from rsea_core.simulation.reference import Reference
from rsea_core.simulation.trajectory import Trajectory

SETTLING_BAND = 0.02  # of the step's height
LAST_SHARE = 0.2  # of the rows, for the steady state


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


def step_metrics(trajectory: Trajectory, reference: Reference) -> StepMetrics:
    """Judge the closed-loop answer to a torque step.

    Raises
    ------
    InputError
        If the reference is not a step of some height, the trajectory followed none, or fewer
        than 20 rows follow the step.
    """
    if reference.kind != "step" or reference.amplitude_Nm == 0.0:
        raise InputError(f"step metrics need a step reference, not a {reference.kind!r} one")
    if trajectory.reference is None:
        raise InputError("the trajectory followed no reference: there is no step to judge")
    start = reference.start_s or 0.0
    rows = trajectory.time_s >= start
    if rows.sum() < 20:
        raise InputError(f"only {rows.sum()} rows follow the step at {start:g} s, needs 20")
    time, torque = trajectory.time_s[rows] - start, trajectory.torque_Nm[rows]
    followed, height = trajectory.reference[rows], reference.amplitude_Nm
    late = max(round(LAST_SHARE * time.size), 1)
    final = float(torque[-late:].mean())
    band = SETTLING_BAND * abs(height)
    return StepMetrics(
        overshoot_percent=100.0 * max(float(np.max((torque - final) / height)), 0.0),
        settling_s=_settled(time, torque - followed, band),
        settling_to_final_s=_settled(time, torque - final, band),
        steady_state_error_Nm=float((followed - torque)[-late:].mean()),
    )


def _settled(time: NDArray, error: NDArray, band: float) -> float | None:
    """Time from which on the error stays within the band."""
    outside = np.flatnonzero(np.abs(error) > band)
    if outside.size == 0:
        return 0.0
    if outside[-1] == time.size - 1:
        return None
    return float(time[outside[-1] + 1])
