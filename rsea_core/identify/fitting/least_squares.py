"""Least squares on innovations: bounded, robust, with priors, Jacobians by batches of replays."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.fitting.problem import Bench, Hypothesis, Problem

STEP = 0.05  # longest of the unknowns' steps for differences: survives the jumps of stick and slip
LEAST_STEP = 1e-5
FAR = 3.0  # innovations beyond this many rms count linearly
ENOUGH = 1e-3  # relative fall of the cost below which a fit ends
LARGEST_STEP = 4.0
SHARE = 0.1  # of the last fall of the cost: after less, old differences serve no longer


@dataclass(frozen=True, kw_only=True)
class Fit:
    """A fitted hypothesis.

    Attributes
    ----------
    x : (n,) array
    cost : float
        Half the robust sum of squares, priors included.
    prior_cost : float
    msni : (benches,) array
        Mean square innovation of each recording (robust); 1 is the noise.
    energies : list of (windows,) arrays
        Sums of squares of each recording over windows of `WINDOW_s`, robust.
    hessian, per_bench : (n, n) array, list of them
        Gauss-Newton, without priors; None where it was not asked for.
    gradients : list of (n,) arrays
    """

    hypothesis: Hypothesis
    x: NDArray
    cost: float
    prior_cost: float
    msni: NDArray
    hessian: NDArray | None = None
    per_bench: tuple[NDArray, ...] = ()
    gradients: tuple[NDArray, ...] = ()


def step_sizes(hessian: NDArray, innovations: int, msni: float) -> NDArray:
    """Steps (n,) that change innovations by about what is left of them.

    A resonance that runs for a hundred periods knows its stiffness to a millionth: over a fixed
    step its phase turns, and the columns of a direction that is nearly free no longer cancel.
    """
    with np.errstate(over="ignore"):  # a value that moves nothing: the longest step
        size = np.sqrt(innovations * max(msni, 1.0) / np.maximum(np.diag(hessian), 1e-300))
    return np.clip(size, LEAST_STEP, STEP)


def robust(innovation: NDArray, far: float) -> tuple[NDArray, NDArray]:
    """Pseudo-Huber squares and the weights of the squares."""
    ratio = (innovation / far) ** 2
    root = np.sqrt(1.0 + ratio)
    return 2.0 * far**2 * (root - 1.0), 1.0 / root


class Fitter:
    """Fits hypotheses of one problem; the robust scale is common to all, set once.

    Parameters
    ----------
    far : float
        Innovation beyond which a residual counts linearly.
    reuses : int
        Further steps that differences serve, mended by what each step showed (Broyden 1965).
    """

    def __init__(self, problem: Problem, *, far: float = np.inf, reuses: int = 0):
        self.problem, self.far, self.reuses = problem, far, reuses
        self.replays = 0

    def evaluate(
        self, hypothesis: Hypothesis, X: NDArray, benches: Sequence[Bench] | None = None
    ) -> tuple[NDArray, NDArray, list[NDArray]]:
        """Costs (m,), MSNI (m, benches) and innovations of many unknowns."""
        found = self._innovations(hypothesis, X, benches)
        costs, msnis = self._judged(hypothesis, X, found)
        return costs, msnis, found

    def _innovations(self, hypothesis: Hypothesis, X: NDArray, benches) -> list[NDArray]:
        self.replays += len(X)
        return self.problem.innovations(hypothesis, X, benches)

    def _judged(
        self, hypothesis: Hypothesis, X: NDArray, found: Sequence[NDArray]
    ) -> tuple[NDArray, NDArray]:
        """Costs (m,) and MSNI (m, benches) of innovations of unknowns (m, n)."""
        centre, weight = self.problem.prior(hypothesis)
        costs = 0.5 * np.sum((weight * (X - centre)) ** 2, axis=1)
        msnis = np.empty((len(X), len(found)))
        for b, e in enumerate(found):
            squares = e**2 if np.isinf(self.far) else robust(e, self.far)[0]
            total = squares.sum(axis=(1, 2))
            msnis[:, b] = total / (e.shape[1] * e.shape[2])
            costs = costs + 0.5 * total
        costs[~np.isfinite(costs)] = np.inf
        return costs, msnis

    def costs(
        self,
        trials: Sequence[tuple[Hypothesis, NDArray]],
        benches: Sequence[Bench] | None = None,
    ) -> NDArray:
        """Costs (m,) of unknowns of different hypotheses; infinite where a replay failed."""
        self.replays += len(trials)
        total = np.zeros(len(trials))
        for j, (hypothesis, x) in enumerate(trials):
            centre, weight = self.problem.prior(hypothesis)
            total[j] = 0.5 * np.sum((weight * (x - centre)) ** 2)
        for e in self.problem.innovations_of(trials, benches):
            squares = e**2 if np.isinf(self.far) else robust(e, self.far)[0]
            total += 0.5 * squares.sum(axis=(1, 2))
        return np.where(np.isfinite(total), total, np.inf)

    def fit(
        self,
        hypothesis: Hypothesis,
        x: NDArray,
        *,
        iterations: int = 8,
        free: NDArray | None = None,
        benches: Sequence[Bench] | None = None,
        tempering: float = 1.0,
        central: bool = False,
    ) -> Fit:
        """Levenberg-Marquardt from x.

        Parameters
        ----------
        iterations : int
            Steps that are taken at most.
        free : (n,) bool array or None
            Which unknowns move.
        tempering : float
            Innovations count this share (their effective number over their number), so that
            priors keep their weight where innovations are dependent.
        central : bool
            Central differences, twice the replays: where priors alone settle a direction, the
            curvature that one-sided ones leave in a column would settle it instead.
        """
        problem = self.problem
        low, high = problem.bounds(hypothesis)
        centre, weight = problem.prior(hypothesis)
        x = np.clip(x, low, high)
        move = np.ones(x.size, bool) if free is None else free
        at = np.flatnonzero(move)
        damping = 1e-2
        cost, msni, hessian, parts, bench_gradients = np.inf, None, None, (), ()
        sizes = np.full(x.size, STEP)
        here = None  # innovations at x, where they are known
        taken = 0
        while taken < iterations:
            steps = np.where(x + sizes > high, -sizes, sizes)
            offsets = np.diag(steps)[at]
            back = np.maximum(np.minimum(x - offsets, high), low) - x if central else 0.0 * offsets
            X = np.vstack([x, *(x + offsets), *(x + back if central else ())])
            lengths = (offsets - back).sum(axis=1)
            if here is None:
                found = self._innovations(hypothesis, X, benches)
                here = [e[0] for e in found]
                found = [e[1:] for e in found]
            else:
                found = self._innovations(hypothesis, X[1:], benches)
            costs, msnis = self._judged(hypothesis, X[:1], [e[None] for e in here])
            cost, msni = costs[0], msnis[0]
            if not np.isfinite(cost):
                break
            columns = []
            for e, there in zip(found, here, strict=True):
                flat, level = e.reshape(len(e), -1), there.ravel()
                J = flat[: at.size] - (flat[at.size :] if central else level)
                J /= lengths[:, None]
                J[~np.all(np.isfinite(J), axis=1)] = 0.0
                columns.append(J)
            fell, arrived = 0.0, True
            for again in range(1 + self.reuses):
                now, gradients = self._normal(columns, here, tempering)
                if not again:  # the curvature handed out is one of differences made here
                    parts, bench_gradients, hessian = now, gradients, sum(now)
                    count = sum(e.size for e in here)
                    sizes[at] = step_sizes(hessian / tempering, count, float(np.mean(msni)))
                prior_weight = weight[at] ** 2
                gradient = sum(gradients) + prior_weight * (x[at] - centre[at])
                full = sum(now) + np.diag(prior_weight + 1e-9)
                tempered = self._tempered(cost, x, centre, weight, tempering)
                better = None
                for _attempt in range(1 if again else 3):
                    trials = []
                    for factor in (damping, damping * 30.0):
                        trials.append(self._step(x, at, full, gradient, factor, low, high))
                    costs, msnis, tried = self.evaluate(hypothesis, np.array(trials), benches)
                    scores = [
                        self._tempered(c, t, centre, weight, tempering)
                        for c, t in zip(costs, trials, strict=True)
                    ]
                    best = int(np.argmin(scores))
                    if scores[best] < tempered:
                        better = trials[best]
                        came, here = here, [e[best] for e in tried]
                        damping = max(damping * (0.2 if best == 0 else 6.0), 1e-6)
                        break
                    if not again:
                        damping = min(damping * 300.0, 1e8)
                if better is None:
                    break
                moved, fall = (better - x)[at], tempered - scores[best]
                x, cost, msni = better, costs[best], msnis[best]
                taken += 1
                small = fall < ENOUGH * max(abs(tempered), 1.0)
                arrived = small and not again
                if small or taken == iterations or fall < SHARE * fell:
                    break
                fell = fall
                if again < self.reuses:
                    broyden_update(columns, moved, came, here)
            if arrived:
                break
        wide = np.zeros((x.size, x.size))
        if hessian is not None:
            wide[np.ix_(at, at)] = hessian
        return Fit(
            hypothesis=hypothesis,
            x=x,
            cost=float(cost),
            prior_cost=float(0.5 * np.sum((weight * (x - centre)) ** 2)),
            msni=np.full(len(self.problem.fitted), np.inf) if msni is None else msni,
            hessian=wide,
            per_bench=tuple(_widen(part, at, x.size) for part in parts),
            gradients=tuple(parts and [_widen_vector(g, at, x.size) for g in bench_gradients]),
        )

    def _normal(
        self, columns: Sequence[NDArray], here: Sequence[NDArray], tempering: float
    ) -> tuple[list[NDArray], list[NDArray]]:
        """Each recording's Gauss-Newton matrix (n, n) and gradient (n,)."""
        parts, bench_gradients = [], []
        for J, there in zip(columns, here, strict=True):
            level = there.ravel()
            w = np.ones(level.size) if np.isinf(self.far) else robust(level, self.far)[1]
            Jw = J * w
            parts.append(tempering * Jw @ J.T)
            bench_gradients.append(tempering * Jw @ level)
        return parts, bench_gradients

    @staticmethod
    def _tempered(cost, x, centre, weight, tempering) -> float:
        prior = 0.5 * float(np.sum((weight * (x - centre)) ** 2))
        return tempering * (cost - prior) + prior

    @staticmethod
    def _step(x, at, full, gradient, damping, low, high) -> NDArray:
        free = at
        trial = x.copy()
        held = np.zeros(at.size, bool)
        for _ in range(3):
            use = ~held
            A = full[np.ix_(use, use)]
            A = A + damping * np.diag(np.diag(A))
            try:
                d = -np.linalg.solve(A, gradient[use])
            except np.linalg.LinAlgError:
                return x
            largest = np.max(np.abs(d)) if d.size else 0.0
            if largest > LARGEST_STEP:
                d *= LARGEST_STEP / largest
            trial = x.copy()
            trial[free[use]] += d
            out = (trial < low) | (trial > high)
            stuck = out[free] & use & ((x[free] <= low[free]) | (x[free] >= high[free]))
            if not np.any(stuck):
                break
            held |= stuck
        return np.clip(trial, low, high)


def broyden_update(
    columns: Sequence[NDArray], moved: NDArray, came: Sequence[NDArray], here: Sequence[NDArray]
) -> None:
    """Broyden's rank-one update: differences (n, innovations) of each recording fit a step (n,)."""
    along = moved / (moved @ moved)
    for J, new, old in zip(columns, here, came, strict=True):
        J += np.outer(along, new.ravel() - old.ravel() - moved @ J)


def _widen(part: NDArray, at: NDArray, n: int) -> NDArray:
    wide = np.zeros((n, n))
    wide[np.ix_(at, at)] = part
    return wide


def _widen_vector(part: NDArray, at: NDArray, n: int) -> NDArray:
    wide = np.zeros(n)
    wide[at] = part
    return wide
