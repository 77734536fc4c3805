"""Steps of a least-squares fit: damped ones, and ones along a curved valley."""

from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.multistep.kalman_filter import huber_weights

LONGEST_STEP = 3.0
UNDAMPED = 1e-12  # damping of a step along directions that only the priors determine
PROBE = 0.1  # share of such a step by which its second derivative is taken
SHARES = (1.0, 0.5, 0.25, 0.1)  # of such a step that are tried
ENOUGH = 1e-5  # relative fall of the cost below which a fit has converged
NEGLIGIBLE = 0.05  # units that no step is worth
FORESEEN = 0.5  # share of the foreseen fall, below which a corrected Jacobian is taken anew
CORRECTIONS = 4  # of one Jacobian
SHORTENED = 0.99  # of the longest step: a step of this length was shortened
BEYOND_FORESEEN = 3.0  # times the decrease that a Jacobian predicts, which a fit hardly exceeds


class Fitted(Protocol):
    """What is fitted: an estimator's problem, and the innovations and costs of trials."""

    problem: Problem
    tempering: float

    def innovations(self, trials: Sequence[tuple[Hypothesis, NDArray]]) -> list[NDArray]:
        """Innovations (m, n, p) of each recording."""

    def costs(self, trials: Sequence[tuple[Hypothesis, NDArray]], found=None) -> NDArray:
        """Costs (m,) of trials."""


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


class Step(NamedTuple):
    """Unknowns (n,) that lower the cost, that cost, and the innovations (n, p) there."""

    x: NDArray
    cost: float
    innovations: list[NDArray]


def normal(own: Fitted, h: Hypothesis, x: NDArray, level, columns) -> tuple[NDArray, NDArray]:
    """Gauss-Newton matrix (n, n) and gradient (n,) of the cost."""
    centre, weight = own.problem.prior(h)
    A, g = normal_equations(level, columns)
    return (
        np.diag(weight**2) + own.tempering * A,
        weight**2 * (x - centre) + own.tempering * g,
    )


def largest_decrease(own: Fitted, h: Hypothesis, x: NDArray, level, columns) -> float:
    """Decrease of the cost that a fit from x hardly exceeds.

    inf where the step is of the greatest length: a Jacobian that far from the minimum predicts
    no decrease.
    """
    A, g = normal(own, h, x, level, columns)
    v = damped_step(x, A, g, UNDAMPED, *own.problem.bounds(h)) - x
    if np.max(np.abs(v) / (LONGEST_STEP + np.abs(x)), initial=0.0) > SHORTENED:
        return np.inf
    return BEYOND_FORESEEN * -float(g @ v + 0.5 * v @ A @ v)


def best_step(
    own: Fitted, h: Hypothesis, x: NDArray, cost: float, A: NDArray, g: NDArray, damping: float,
    fresh: bool,
) -> tuple[Step | None, float]:  # fmt: skip
    """The best of some damped steps that lowers the cost, and the damping for the next one."""
    low, high = own.problem.bounds(h)
    for _attempt in range(3 if fresh else 1):
        factors = (damping, damping * 30.0, damping * 1000.0)[: 3 if fresh else 2]
        trials = [(h, damped_step(x, A, g, f, low, high)) for f in factors]
        found = own.innovations(trials)
        costs = own.costs(trials, found)
        best = int(np.argmin(costs))
        if costs[best] < cost:
            step = Step(trials[best][1], float(costs[best]), [e[best] for e in found])
            return step, max(damping * (0.1, 3.0, 100.0)[best], 1e-8)
        damping = damping * 1e4 if fresh else damping
    return None, damping


def along_valley(
    own: Fitted, start: Start, level: Sequence[NDArray], columns: Sequence[NDArray],
    step: Step | None,
) -> Step | None:  # fmt: skip
    """A step, or a better one along the curve that an undamped step begins (`curved`)."""
    h, x, cost, A, g = start
    bounds = own.problem.bounds(h)
    v = damped_step(x, A, g, UNDAMPED, *bounds) - x
    foreseen = -float(g @ v + 0.5 * v @ A @ v)
    fall = 0.0 if step is None else cost - step.cost
    if foreseen - fall < max(NEGLIGIBLE, FORESEEN * foreseen):
        return step
    probed = [e[0] for e in own.innovations([(h, x + PROBE * v)])]
    ends = curved(start, v, level, columns, probed, own.tempering)
    if not ends:
        return step
    trials = [(h, np.clip(end, *bounds)) for end in ends]
    found = own.innovations(trials)
    costs = own.costs(trials, found)
    best = int(np.argmin(costs))
    if not costs[best] < cost - fall:
        return step
    return Step(trials[best][1], float(costs[best]), [e[best] for e in found])


class End(NamedTuple):
    """Where the steps of one Jacobian end, and the Jacobian as they corrected it."""

    x: NDArray
    cost: float
    damping: float
    converged: bool
    columns: list[NDArray]


def least_decrease(cost: float, fine: bool = False) -> float:
    """Decrease of a cost below which a fit has converged."""
    return max(0.0 if fine else ENOUGH * abs(cost), NEGLIGIBLE)


def stepped(
    own: Fitted, begin: Start, level: list[NDArray], columns: list[NDArray], damping: float, *,
    fine: bool, all_new: bool,
) -> End:  # fmt: skip
    """Steps with one Jacobian, which each corrects, as long as the cost falls as foreseen.

    Parameters
    ----------
    all_new : bool
        Whether all of the Jacobian is new; if not, a fit has not converged where it gains nothing.
    """
    h, x, cost, A, g = begin
    for corrected in range(CORRECTIONS + 1):
        fresh = corrected == 0
        if not fresh:
            A, g = normal(own, h, x, level, columns)
        step, damping = best_step(own, h, x, cost, A, g, damping, fresh)
        if fresh and all_new:
            step = along_valley(own, begin, level, columns, step)
        if step is None:
            return End(x, cost, damping, fresh and all_new, columns)
        moved, fall = step.x - x, cost - step.cost
        little = fall < least_decrease(cost, fine)
        converged = fresh and all_new and little
        if fresh and fall < NEGLIGIBLE:  # the next fit begins where a Jacobian is known
            return End(x, cost, damping, converged, columns)
        foreseen = -float(g @ moved + 0.5 * moved @ A @ moved)
        x, cost = step.x, step.cost
        if little or fall < FORESEEN * foreseen or corrected == CORRECTIONS:
            break
        columns = [
            J + correction(J, moved, after - e)
            for J, e, after in zip(columns, level, step.innovations, strict=True)
        ]
        level = step.innovations
    return End(x, cost, damping, converged, columns)
