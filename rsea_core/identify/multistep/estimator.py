"""Fits of hypotheses to the innovations of all recordings, and their Jacobians."""

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.multistep.experiment import MultistepProblem
from rsea_core.identify.multistep.kalman_filter import HUBER, huber_squares, huber_weights
from rsea_core.identify.multistep.steps import (
    Start,
    largest_decrease,
    least_decrease,
    normal,
    stepped,
)
from rsea_core.identify.multistep.tracks import Track, block_rows, initial_track, prepared
from rsea_core.numeric.work_limit import count_work

STEP = 0.02  # of the unknowns, for differences
MOST_MOVED = 100.0  # root of the sum of squares by which such a step may move the innovations
FINE = 1e-3  # of such a step, where a direction that no reading determines matters
LEAST_STEP = 1e-5  # of the unknowns
ALIKE = 4.0  # factor within which a step stays: simulations are used again
MOST_KEPT = 1e8  # bytes of residuals
ROWS_OF_RUN = 1000  # as work: what a run costs beside its rows
STRETCHES = 40  # over all recordings, at least two of each
LEAST_SHARE = 0.01  # of independent innovations


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """A fitted hypothesis.

    Attributes
    ----------
    x : (n,) array
    cost : float
        Tempered negative log-likelihood and priors.
    negative_log_likelihood, prior_cost : float
        Not tempered, robust (`huber_squares`), up to a constant; half the priors' squares.
    converged : bool
        Whether the last step no longer lowered it.
    """

    hypothesis: Hypothesis
    x: NDArray
    cost: float
    negative_log_likelihood: float
    prior_cost: float
    converged: bool


@dataclass
class EstimatorCache:
    """Results that estimators of one problem use again.

    Attributes
    ----------
    steps : dict of float
        Longest step of an unknown, by its name, for differences: what Jacobians before show.
    residuals : ordered dict
        Latest simulations: their residuals, with what they depend on. A fit that begins where
        another ended, in other noise, simulates nothing again.
    """

    steps: dict[str, float] = field(default_factory=dict)
    residuals: OrderedDict = field(default_factory=OrderedDict)

    def keep(self, key, depends_on, values: list[NDArray]) -> None:
        """Keep residuals (n, p) of each recording, and remove the oldest ones."""
        size = sum(v.nbytes for v in values)
        if size > MOST_KEPT / 16:
            return
        self.residuals[key] = (depends_on, values)
        while len(self.residuals) * size > MOST_KEPT:
            self.residuals.popitem(last=False)


class Estimator:
    """Fits hypotheses to the tracks of one problem.

    Parameters
    ----------
    tempering : float
        What an innovation counts: the share of them that are independent (`independent_share`).
    cache : EstimatorCache or None
        Of other estimators of the same problem.
    """

    def __init__(
        self, problem: MultistepProblem, tracks: Sequence[Track], *, tempering: float = 1.0,
        cache: EstimatorCache | None = None,
    ):  # fmt: skip
        self.problem, self.tracks, self.tempering = problem, list(tracks), tempering
        self.cache = EstimatorCache() if cache is None else cache

    def having(self, tracks: Sequence[Track]) -> "Estimator":
        """The same with other tracks."""
        return Estimator(self.problem, tracks, tempering=self.tempering, cache=self.cache)

    def residuals(self, trials: Sequence[tuple[Hypothesis, NDArray]]) -> list[NDArray]:
        """Residuals (m, n, p) of each recording; NaN where a prediction failed."""
        within = tuple((id(t.experiment), id(t.windows)) for t in self.tracks)
        keys = [(within, tuple(map(id, h.laws)), x.tobytes()) for h, x in trials]
        held = [self.cache.residuals.get(key) for key in keys]
        new = [j for j, entry in enumerate(held) if entry is None]
        simulated = self._simulated([trials[j] for j in new]) if new else []
        if len(new) == len(trials):
            found = simulated
        else:
            places = {j: i for i, j in enumerate(new)}
            found = [
                np.stack([simulated[b][places[j]] if j in places else held[j][1][b]
                          for j in range(len(trials))])
                for b in range(len(self.tracks))
            ]  # fmt: skip
        depends_on = tuple((t.experiment, t.windows) for t in self.tracks)
        for j in new:
            self.cache.keep(keys[j], (depends_on, trials[j][0].laws), [r[j] for r in found])
        return found

    def _simulated(self, trials: Sequence[tuple[Hypothesis, NDArray]]) -> list[NDArray]:
        """As `residuals`, of trials that are not held."""
        found = []
        for t in self.tracks:
            e = t.experiment
            machines = [self.problem.trial_machine(e, h, x) for h, x in trials]
            first: dict[bytes, int] = {}  # of machines that run alike, whatever their sensors read
            which = [first.setdefault(m.machine, len(first)) for m in machines]
            unlike = [machines[which.index(j)] for j in range(len(first))]
            count_work(len(unlike) * (e.rows * e.finer + ROWS_OF_RUN))
            runs = e.runs(unlike, t.windows)
            runs = runs if len(unlike) == len(machines) else runs[which]
            found.append(e.measured[None] - e.readings(runs, machines, t.windows))
        return found

    def innovations(self, trials: Sequence[tuple[Hypothesis, NDArray]]) -> list[NDArray]:
        """Whitened innovations (m, n, p) of each recording."""
        return [t.innovations(r) for t, r in zip(self.tracks, self.residuals(trials), strict=True)]

    def costs(self, trials: Sequence[tuple[Hypothesis, NDArray]], found=None) -> NDArray:
        """Costs (m,) of trials."""
        found = self.innovations(trials) if found is None else found
        total = np.zeros(len(trials))
        for j, (h, x) in enumerate(trials):
            centre, weight = self.problem.prior(h)
            total[j] = 0.5 * float(np.sum((weight * (x - centre)) ** 2))
        for t, e in zip(self.tracks, found, strict=True):
            power = huber_squares(e).sum(axis=(1, 2)) + t.log_det
            total += 0.5 * self.tempering * power
        return np.where(np.isfinite(total), total, np.inf)

    def jacobian(
        self, h: Hypothesis, x: NDArray, *, fine: bool = False,
        shared: Sequence[NDArray] | None = None,
    ) -> tuple[list[NDArray], list[NDArray]]:  # fmt: skip
        """Innovations (n, p) and their derivatives (u, n, p) of each recording.

        Forward differences err by their step. Where readings are so good that this is much of
        their noise, a fit would end beside its optimum: steps are as short as the Jacobian before
        asks for. They are not shorter, because stick, slip and play make the cost rough, and a fit
        would stay in its first local minimum.

        Parameters
        ----------
        fine : bool
            Much shorter steps, for directions that no reading determines: their curvature is a
            small difference of large ones, and a step's error passes for curvature.
        shared : sequence of (s, n, p) arrays or None
            Derivatives by the first s unknowns, taken as they are.
        """
        first = 0 if shared is None else len(shared[0])
        high = self.problem.bounds(h)[1][first:]
        names = self.problem.names(h)[first:]
        longest = self.cache.steps
        size = np.minimum(
            STEP * (1.0 + 0.1 * np.abs(x[first:])), [longest.get(name, np.inf) for name in names]
        )
        size = FINE * size if fine else size
        steps = np.where(x[first:] + size > high, -size, size)
        moves = np.eye(x.size)[first:] * steps[:, None]
        trials = [(h, x)] + [(h, x + move) for move in moves]
        level, columns = [], []
        for e in self.innovations(trials):
            level.append(e[0])
            J = (e[1:] - e[0]) / steps[:, None, None]
            J[~np.all(np.isfinite(J), axis=(1, 2))] = 0.0
            columns.append(J)
        power = sum(np.sum(J**2, axis=(1, 2)) for J in columns)
        allowed = np.maximum(MOST_MOVED / np.sqrt(np.maximum(power, 1e-300)), LEAST_STEP)
        for name, step in zip(names, allowed, strict=True):
            if not step / ALIKE < longest.get(name, np.inf) < step * ALIKE:
                longest[name] = step
        if shared is not None:
            columns = [np.concatenate(both) for both in zip(shared, columns, strict=True)]
        return level, columns

    def fit(
        self, h: Hypothesis, x: NDArray, *, iterations: int = 8, fine: bool = False,
        target_cost: float = np.inf, shared: Sequence[NDArray] | None = None,
    ) -> Estimate:  # fmt: skip
        """Levenberg-Marquardt from x.

        Simulations for a Jacobian are most of the work. As long as steps lower the cost as
        foreseen, the Jacobian is corrected by what they change (Broyden, Math. Comp. 19 (1965)
        577) and not taken anew; only a fit that gains nothing by a new one has converged.

        Parameters
        ----------
        iterations : int
            New Jacobians, at most.
        fine : bool
            On to where no step lowers the cost, with fine differences.
        target_cost : float
            Cost that the fit must reach to be of use. It ends where a new Jacobian predicts less
            than a third of the decrease that is needed, unless the step is of the greatest length.
        shared : sequence of (s, n, p) arrays or None
            Derivatives by the first s unknowns near x, of each recording. As long as steps lower
            the cost with them, new Jacobians are of the other unknowns only: candidates fitted
            beside the same base have most unknowns in common.
        """
        x = np.clip(x, *self.problem.bounds(h))
        cost = self.costs([(h, x)])[0]
        damping, converged, taken = 1e-3, False, 0
        while taken < iterations and np.isfinite(cost) and not converged:
            level, columns = self.jacobian(h, x, fine=fine, shared=shared)
            needed = cost - target_cost
            if needed > 0.0 and needed > largest_decrease(self, h, x, level, columns):
                break
            begin = Start(h, x, cost, *normal(self, h, x, level, columns))
            end = stepped(self, begin, level, columns, damping, fine=fine, all_new=shared is None)
            if shared is not None:
                little = cost - end.cost < least_decrease(cost)
                shared = None if little else [J[: len(s)] for J, s in zip(end.columns, shared)]
            x, cost, damping, converged, _ = end
            taken += 1
        centre, weight = self.problem.prior(h)
        prior_cost = 0.5 * float(np.sum((weight * (x - centre)) ** 2))
        return Estimate(
            hypothesis=h, x=x, cost=float(cost), converged=converged, prior_cost=prior_cost,
            negative_log_likelihood=float(cost - prior_cost) / self.tempering,
        )  # fmt: skip


def independent_share(estimator: Estimator, h: Hypothesis, x: NDArray) -> float:
    """Share of the innovations that count: expected over found variance of stretches' scores.

    Innovations of a machine that is not quite the model's are dependent, and their sheer number
    must not outweigh what the rig file says. The score of an unknown is the derivative of the
    data's part of the cost by it, up to its sign, summed over a stretch. The share is one over the
    median over the unknowns of found over expected variance of the scores, within `LEAST_SHARE` and
    1. Both variances belong to the middle matrix of the sandwich of Huber and White; its inverse
    Hessians are not applied. The ratio of an unknown is therefore that of its sandwich variances
    only with one unknown or a diagonal Hessian. Unknowns that the prior determines take part like
    any other.
    """
    level, columns = estimator.jacobian(h, x)
    expected, found = np.zeros(x.size), np.zeros(x.size)
    for block, e, J in zip(stretches_of(estimator.tracks), level, columns, strict=True):
        w = huber_weights(e)
        expected += np.einsum("itc,itc,tc->i", J, J, w**2 * np.minimum(e**2, HUBER**2).mean())
        scores = np.einsum("itc,tc->it", J, w * e)
        found += np.array([np.sum(np.bincount(block, s) ** 2) for s in scores])
    seen = expected > 1e-12 * max(float(expected.max()), 1e-300)
    ratio = float(np.median(found[seen] / expected[seen])) if np.any(seen) else 1.0
    return float(np.clip(1.0 / max(ratio, 1e-9), LEAST_SHARE, 1.0))


def stretches_of(tracks: Sequence[Track]) -> list[NDArray]:
    """Stretch (blocks,) of each averaged row of each recording: of about equal numbers of rows."""
    rows = [t.blocks for t in tracks]
    counts = [max(2, round(STRETCHES * n / sum(rows))) for n in rows]
    return [np.arange(n) * count // n for n, count in zip(rows, counts, strict=True)]


def initial_estimator(
    problem: MultistepProblem, zeros: Sequence[tuple[int, ...]] | None = None
) -> Estimator:
    """All recordings that are fitted, each one run, before anything is known of their noise.

    Parameters
    ----------
    zeros : sequence of tuple of int
        `Track.zeros` of each recording; None: none.
    """
    blocks = block_rows(problem.fitted)
    tracks = [initial_track(e, b) for e, b in zip(problem.fitted, blocks, strict=True)]
    if zeros is not None:
        tracks = [prepared(t, zeros=own) for t, own in zip(tracks, zeros, strict=True)]
    return Estimator(problem, tracks)
