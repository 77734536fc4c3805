"""The heat that a motor keeps from one recording to the next, and to an unseen one after them.

Two bodies, winding and case, as `rsea_core.effects.drive_thermal`; rises are over the ambient.
"""

import numpy as np
from numba import njit

from rsea_core.effects.drive_thermal import COPPER_per_K

CASE_J_per_K = 500.0  # of a case whose law does not say
CASE_TO_AIR_W_per_K = 0.5
TOLD_K = 0.5  # a case that is cooler than expected by less is as warm as the session left it
LONGEST_s = 1e5


@njit(cache=True, error_model="numpy")
def heat_of_the_past(past, resistance, capacity, across, case, pause_s):
    """Rise of winding and case [K] after all that a motor has done, from cold.

    Parameters
    ----------
    past : (n, 2) array
        Stretches of time [s] and the mean squared current in each [A^2]; a length below zero is
        the pause between two recordings, whose length is not known.
    resistance : of the cold winding [ohm]
    capacity, across, case : winding [J/K], winding to case [W/K], case [J/K]
    """
    winding, warm = 0.0, 0.0
    for row in range(past.shape[0]):
        length, heat, pieces = past[row, 0], past[row, 1] * resistance, 1
        if length < 0.0:
            length, pieces = pause_s, 40
        h = length / pieces
        decay = np.exp(-h * across / capacity)
        for _ in range(pieces):
            settled = warm + heat * (1.0 + COPPER_per_K * winding) / across
            after = settled + (winding - settled) * decay
            flow = across * (0.5 * (winding + after) - warm)
            warm += h * (flow - CASE_TO_AIR_W_per_K * warm) / case
            winding = after
    return winding, warm


def rested(
    left_K: tuple[float, float],
    told_K: float,
    capacity: float,
    across: float,
    case: float,
    pause_s: float,
) -> tuple[float, float]:
    """Rise of winding and case [K] when a further recording begins, `told_K` of the case known.

    The motor rested after the session for as long as between its recordings; longer where the
    case has become cooler than that.

    Parameters
    ----------
    left_K : (float, float)
        Winding and case when the last recording ended.
    capacity, across, case : as `heat_of_the_past`
    """
    times = np.append(pause_s, np.geomspace(max(pause_s, 1e-3), LONGEST_s, 400)[1:])
    winding, warm = cooled(left_K, capacity, across, case, times)
    cool = np.flatnonzero(warm <= told_K + TOLD_K)
    at = int(cool[0]) if cool.size else -1
    return float(winding[at]), float(warm[at])


def cooled(left_K, capacity: float, across: float, case: float, times) -> tuple:
    """Rises (n,) of winding and case after resting for times [s] without current. Exact."""
    rates = np.array(
        [
            [-across / capacity, across / capacity],
            [across / case, -(across + CASE_TO_AIR_W_per_K) / case],
        ]
    )
    values, vectors = np.linalg.eig(rates)
    parts = vectors * np.linalg.solve(vectors, np.asarray(left_K, dtype=float))
    after = np.exp(np.outer(times, values)) @ parts.T
    return after[:, 0], after[:, 1]
