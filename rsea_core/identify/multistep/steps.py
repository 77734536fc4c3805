"""Steps of a least-squares fit: damped ones, and ones along a curved valley."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.multistep.kalman_filter import huber_weights

LONGEST_STEP = 3.0
UNDAMPED = 1e-12  # damping of a step along directions that only the priors determine
PROBE = 0.1  # share of such a step by which its second derivative is taken
SHARES = (1.0, 0.5, 0.25, 0.1)  # of such a step that are tried


class Start(NamedTuple):
    """Where a step begins: unknowns (n,), cost, Gauss-Newton matrix (n, n) and gradient (n,)."""

    hypothesis: Hypothesis
    x: NDArray
    cost: float
    A: NDArray
    g: NDArray


def normal_equations(
    level: Sequence[NDArray], columns: Sequence[NDArray]
) -> tuple[NDArray, NDArray]:
    """Gauss-Newton matrix (u, u) and gradient (u,) of half the robust squares of innovations.

    Parameters
    ----------
    level, columns : sequences of (n, p) and (u, n, p) arrays
        Innovations and their derivatives, of each recording or piece of one.
    """
    A, g = 0.0, 0.0
    for e, J in zip(level, columns, strict=True):
        flat = J.reshape(len(J), -1)
        weighted = flat * huber_weights(e).ravel()
        A = A + weighted @ flat.T
        g = g + weighted @ e.ravel()
    return A, g


def correction(J: NDArray, moved: NDArray, change: NDArray) -> NDArray:
    """What makes derivatives (u, n, p) agree with how a step (u,) changed innovations (n, p)."""
    rest = change - np.tensordot(moved, J, axes=1)
    return moved[:, None, None] * (rest / float(moved @ moved))


def damped_step(x, A, g, damping, low, high) -> NDArray:
    """A damped Gauss-Newton step within bounds: what a bound stops is left out."""
    use = np.ones(x.size, bool)
    trial = x
    for _ in range(3):
        B = A[np.ix_(use, use)]
        B = B + damping * np.diag(np.diag(B)) + 1e-9 * np.eye(len(B))
        d = -np.linalg.solve(B, g[use])
        largest = np.max(np.abs(d) / (LONGEST_STEP + np.abs(x[use])), initial=0.0)
        if largest > 1.0:
            d /= largest
        trial = x.copy()
        trial[use] += d
        stuck = use & (((trial < low) & (x <= low)) | ((trial > high) & (x >= high)))
        if not np.any(stuck):
            break
        use &= ~stuck
    return np.clip(trial, low, high)


def curved(
    start: Start, v: NDArray, level: Sequence[NDArray], columns: Sequence[NDArray],
    probed: Sequence[NDArray], tempering: float,
) -> list[NDArray]:  # fmt: skip
    """Ends (n,) of curved steps; none where the probe failed or the matrix is singular.

    Scales of torque and inertia that no reading states are determined by their priors alone. The
    cost has a narrow curved valley along them, in which damped straight steps hardly advance. The
    second derivative of the innovations along the step gives the valley's curvature (geodesic
    acceleration: Transtrum and Sethna, arXiv:1201.5885, section 4).

    Parameters
    ----------
    v : (n,) array
        Straight step.
    level, columns : sequences of (m, p) and (n, m, p) arrays
        Innovations at the start and their derivatives.
    probed : sequence of (m, p) arrays
        Innovations after the share `PROBE` of the straight step.
    tempering : float
        What an innovation counts.
    """
    rhs = np.zeros(v.size)
    for e, J, other in zip(level, columns, probed, strict=True):
        second = 2.0 / PROBE * ((other - e) / PROBE - np.tensordot(v, J, axes=1))
        rhs += J.reshape(len(J), -1) @ (huber_weights(e) * second).ravel()
    if not np.all(np.isfinite(rhs)):
        return []
    free = v != 0.0
    a = np.zeros(v.size)
    try:
        a[free] = -tempering * np.linalg.solve(start.A[np.ix_(free, free)], rhs[free])
    except np.linalg.LinAlgError:  # nothing determines an unknown
        return []
    return [start.x + s * v + 0.5 * s**2 * a for s in SHARES]
