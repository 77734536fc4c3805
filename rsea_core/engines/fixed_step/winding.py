"""How the current of a winding moves within one step of the fast engine."""

import numpy as np
from numba import njit


@njit(error_model="numpy")
def winding_gains(x):
    """How a winding's current follows over x time constants at a speed that changes evenly.

    Decay, lag, bend and last bend; none of them where the current follows at once (x = 0).

    With the back-EMF's current at the mean speed taken for `final`, and `gained` what it changes
    by: the end is final + (current - final) decay - last_bend gained, the mean is final +
    (current - final) lag + bend gained. Exact; a step is about as long as L / R, so that the mean
    speed alone leaves milliamperes.
    """
    if x == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    decay = np.exp(-x)
    lag = (1.0 - decay) / x
    if x < 1e-3:
        return decay, lag, x / 12.0, x * x / 12.0
    return decay, lag, (1.0 - lag) / x - 0.5 * lag, 0.5 * (1.0 + decay) - lag


@njit(error_model="numpy")
def near_mean(current, final, x):
    """About the mean over x time constants of a current that heads for `final`; at once: 0."""
    return final if x == 0.0 else current + (final - current) * x / (2.0 + x)


@njit(error_model="numpy")
def mean_to_edge(current, final, edge, x):
    """Mean of a current that heads for `final` over x time constants and is held at an edge."""
    if x == 0.0:
        return edge
    left = (edge - final) / (current - final) if current != final else 1.0
    if not 0.0 < left < 1.0:
        return edge
    share = min(-np.log(left) / x, 1.0)
    return share * final + (current - edge) / x + (1.0 - share) * edge
