"""Least squares on innovations: bounded, robust, with priors, Jacobians by batches of replays."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.fitting.problem import Hypothesis, PreparedRecording, Problem

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
    msni : (recordings,) array
        Mean square innovation of each recording (robust); 1 is the noise.
    energies : list of (windows,) arrays
        Sums of squares of each recording over windows of `WINDOW_s`, robust.
    hessian, per_recording : (n, n) array, list of them
        Gauss-Newton, without priors; None where it was not asked for.
    gradients : list of (n,) arrays
    """

    hypothesis: Hypothesis
    x: NDArray
    cost: float
    prior_cost: float
    msni: NDArray
    hessian: NDArray | None = None
    per_recording: tuple[NDArray, ...] = ()
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
        self,
        hypothesis: Hypothesis,
        X: NDArray,
        recordings: Sequence[PreparedRecording] | None = None,
    ) -> tuple[NDArray, NDArray, list[NDArray]]:
        """Costs (m,), MSNI (m, recordings) and innovations of many unknowns."""
        found = self.innovations(hypothesis, X, recordings)
        costs, msnis = self.judged(hypothesis, X, found)
        return costs, msnis, found

    def innovations(
        self, hypothesis: Hypothesis, X: NDArray, recordings: Sequence[PreparedRecording] | None
    ) -> list[NDArray]:
        """Innovations (m, rows, channels) of each recording, counted as m replays."""
        self.replays += len(X)
        return self.problem.innovations(hypothesis, X, recordings)

    def judged(
        self, hypothesis: Hypothesis, X: NDArray, found: Sequence[NDArray]
    ) -> tuple[NDArray, NDArray]:
        """Costs (m,) and MSNI (m, recordings) of innovations of unknowns (m, n)."""
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
        recordings: Sequence[PreparedRecording] | None = None,
    ) -> NDArray:
        """Costs (m,) of unknowns of different hypotheses; infinite where a replay failed."""
        self.replays += len(trials)
        total = np.zeros(len(trials))
        for j, (hypothesis, x) in enumerate(trials):
            centre, weight = self.problem.prior(hypothesis)
            total[j] = 0.5 * np.sum((weight * (x - centre)) ** 2)
        for e in self.problem.innovations_of(trials, recordings):
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
        recordings: Sequence[PreparedRecording] | None = None,
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
        descent = _Descent(self, hypothesis, x, free, recordings, tempering)
        while descent.taken < iterations:
            columns = descent.differences(central)
            if columns is None or descent.follow(columns, iterations):
                break
        return descent.fit()


class _Descent:
    """One descent of Levenberg and Marquardt: where it is, and what is known there."""

    def __init__(
        self,
        fitter: Fitter,
        hypothesis: Hypothesis,
        x: NDArray,
        free: NDArray | None,
        recordings: Sequence[PreparedRecording] | None,
        tempering: float,
    ):
        problem = fitter.problem
        self.fitter, self.hypothesis, self.prepared = fitter, hypothesis, recordings
        self.tempering = tempering
        self.low, self.high = problem.bounds(hypothesis)
        self.centre, self.weight = problem.prior(hypothesis)
        self.x = np.clip(x, self.low, self.high)
        self.at = np.flatnonzero(np.ones(x.size, bool) if free is None else free)
        self.damping, self.taken = 1e-2, 0
        self.cost, self.msni = np.inf, None
        self.hessian, self.parts, self.gradients = None, (), ()
        self.sizes = np.full(x.size, STEP)
        self.here = None  # innovations at x, where they are known

    def differences(self, central: bool) -> list[NDArray] | None:
        """Each recording's columns (n, innovations) at x; None where the replay failed."""
        x, at, fitter = self.x, self.at, self.fitter
        offsets = np.diag(np.where(x + self.sizes > self.high, -self.sizes, self.sizes))[at]
        back = 0.0 * offsets
        if central:
            back = np.maximum(np.minimum(x - offsets, self.high), self.low) - x
        X = np.vstack([x, *(x + offsets), *(x + back if central else ())])
        lengths = (offsets - back).sum(axis=1)
        if self.here is None:
            found = fitter.innovations(self.hypothesis, X, self.prepared)
            self.here = [e[0] for e in found]
            found = [e[1:] for e in found]
        else:
            found = fitter.innovations(self.hypothesis, X[1:], self.prepared)
        costs, msnis = fitter.judged(self.hypothesis, X[:1], [e[None] for e in self.here])
        self.cost, self.msni = costs[0], msnis[0]
        if not np.isfinite(self.cost):
            return None
        columns = []
        for e, there in zip(found, self.here, strict=True):
            flat, level = e.reshape(len(e), -1), there.ravel()
            J = flat[: at.size] - (flat[at.size :] if central else level)
            J /= lengths[:, None]
            J[~np.all(np.isfinite(J), axis=1)] = 0.0
            columns.append(J)
        return columns

    def follow(self, columns: Sequence[NDArray], iterations: int) -> bool:
        """Step by these differences while they serve; whether the descent has converged."""
        fell, converged = 0.0, True
        for again in range(1 + self.fitter.reuses):
            before = self._tempered(self.cost, self.x)
            step = self._step(columns, before, reused=again > 0)
            if step is None:
                break
            moved, came, fall = step
            self.taken += 1
            small = fall < ENOUGH * max(abs(before), 1.0)
            converged = small and not again
            if small or self.taken == iterations or fall < SHARE * fell:
                break
            fell = fall
            if again < self.fitter.reuses:
                broyden_update(columns, moved, came, self.here)
        return converged

    def _step(
        self, columns: Sequence[NDArray], before: float, *, reused: bool
    ) -> tuple[NDArray, list[NDArray], float] | None:
        """A step that betters `before`: it, the innovations it came from, the fall; else None."""
        at, x = self.at, self.x
        now, gradients = self._normal(columns)
        if not reused:  # the curvature handed out is one of differences made here
            self.parts, self.gradients, self.hessian = now, gradients, sum(now)
            count = sum(e.size for e in self.here)
            mean = float(np.mean(self.msni))
            self.sizes[at] = step_sizes(self.hessian / self.tempering, count, mean)
        prior_weight = self.weight[at] ** 2
        gradient = sum(gradients) + prior_weight * (x[at] - self.centre[at])
        full = sum(now) + np.diag(prior_weight + 1e-9)
        for _attempt in range(1 if reused else 3):
            factors = (self.damping, self.damping * 30.0)
            trials = [self._trial(full, gradient, factor) for factor in factors]
            costs, msnis, tried = self.fitter.evaluate(
                self.hypothesis, np.array(trials), self.prepared
            )
            scores = [self._tempered(c, t) for c, t in zip(costs, trials, strict=True)]
            best = int(np.argmin(scores))
            if scores[best] < before:
                came, self.here = self.here, [e[best] for e in tried]
                self.damping = max(self.damping * (0.2 if best == 0 else 6.0), 1e-6)
                self.x, self.cost, self.msni = trials[best], costs[best], msnis[best]
                return (self.x - x)[at], came, before - scores[best]
            if not reused:
                self.damping = min(self.damping * 300.0, 1e8)
        return None

    def fit(self) -> Fit:
        """Where the descent is."""
        wide = np.zeros((self.x.size, self.x.size))
        if self.hessian is not None:
            wide[np.ix_(self.at, self.at)] = self.hessian
        count, n = len(self.fitter.problem.fitted), self.x.size
        return Fit(
            hypothesis=self.hypothesis,
            x=self.x,
            cost=float(self.cost),
            prior_cost=self._prior(self.x),
            msni=np.full(count, np.inf) if self.msni is None else self.msni,
            hessian=wide,
            per_recording=tuple(_widen(part, self.at, n) for part in self.parts),
            gradients=tuple(_widen_vector(g, self.at, n) for g in self.gradients),
        )

    def _normal(self, columns: Sequence[NDArray]) -> tuple[list[NDArray], list[NDArray]]:
        """Each recording's Gauss-Newton matrix (n, n) and gradient (n,)."""
        parts, gradients = [], []
        for J, there in zip(columns, self.here, strict=True):
            level = there.ravel()
            far = self.fitter.far
            w = np.ones(level.size) if np.isinf(far) else robust(level, far)[1]
            Jw = J * w
            parts.append(self.tempering * Jw @ J.T)
            gradients.append(self.tempering * Jw @ level)
        return parts, gradients

    def _prior(self, x: NDArray) -> float:
        return 0.5 * float(np.sum((self.weight * (x - self.centre)) ** 2))

    def _tempered(self, cost: float, x: NDArray) -> float:
        prior = self._prior(x)
        return self.tempering * (cost - prior) + prior

    def _trial(self, full: NDArray, gradient: NDArray, damping: float) -> NDArray:
        """The unknowns after a damped step, those that stand at a bound held there."""
        x, at, low, high = self.x, self.at, self.low, self.high
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
            trial[at[use]] += d
            out = (trial < low) | (trial > high)
            stuck = out[at] & use & ((x[at] <= low[at]) | (x[at] >= high[at]))
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
