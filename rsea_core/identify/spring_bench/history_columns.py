"""Columns that remember the path of a deflection or a torque: play with friction, a low-pass."""

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy")
def stop(deflection, reach):
    """Deflection of an elastic element in series with a slider that gives way at `reach`.

    Rate-independent: the same path gives the same answer at any speed. It starts relaxed.
    """
    found = np.zeros(deflection.size)
    x = 0.0
    for row in range(1, deflection.size):
        x += deflection[row] - deflection[row - 1]
        if x > reach:
            x = reach
        elif x < -reach:
            x = -reach
        found[row] = x
    return found


@njit(cache=True, error_model="numpy")
def fading(torque, time, tau):
    """What is left of a torque after its low-pass of a time constant; starts at rest.

    The torque goes straight from row to row, and the answer is exact for that.
    """
    found = np.zeros(torque.size)
    for row in range(1, torque.size):
        step = time[row] - time[row - 1]
        kept = np.exp(-step / tau)
        slope = (torque[row] - torque[row - 1]) / step
        found[row] = kept * found[row - 1] + tau * (1.0 - kept) * slope
    return found
