"""How well the fitted values are known: blocks, whole recordings, other laws.

Innovations of a law that is nearly right are dependent, so the inverse of the Hessian alone is
far too sure. Three sources are held against each other: a sandwich whose middle is the scatter of
the gradients of whole blocks (Huber, 5th Berkeley Symposium (1967); White, Econometrica 50
(1982) 1); the jackknife over recordings, which sees what is wrong all through a recording (Miller,
Biometrika 61 (1974) 1; Bell and McCaffrey, Survey Methodology 28 (2002) 169); and the scatter of a
figure among laws that fit about as well (Hoeting et al., Statistical Science 14 (1999) 382).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.variant import AT_ONE, FROM_ZERO
from rsea_core.identify.fitting.jacobian import jacobian_at
from rsea_core.identify.fitting.least_squares import Fit, Fitter
from rsea_core.identify.fitting.problem import Problem
from rsea_core.identify.judgement.quantisation_error import STEP_LEFT, counts_of, finer_of, pulls_of

BLOCK_s = 0.5
PIECES = 5  # of each recording
NO_PRIOR = 30.0  # white deviations within which values without a prior may scatter
LAW_SPREAD = 0.015  # of what a law does: error of its form, as between laws of one effect
LEAST_SQUARE = 1e-9  # of the largest variance: less is round-off
ALONE = 4.0  # growth of a variance without one recording, above which that recording is needed


@dataclass(frozen=True)
class Spread:
    """How far the unknowns of a fit may be off, as several sources see it.

    The variance of anything that follows from them is that of the source that sees it largest:
    taken per figure, so that errors that cancel in it cancel.

    Attributes
    ----------
    sources : tuple of (n, n) arrays
        Covariances.
    """

    sources: tuple[NDArray, ...]

    def variance(self, slope: NDArray) -> float:
        """Of a figure whose derivatives by the unknowns are given (n,)."""
        return max(0.0, *(float(slope @ C @ slope) for C in self.sources))

    def mean_square(self, figure: Callable[[NDArray], float], x: NDArray) -> float:
        """Of the change of a figure that is no straight line of the unknowns x (n,).

        One deviation each way along the principal axes of each source: the size of a wave that is
        small against the error of its other phase has no slope along that one.
        """
        here, found = figure(x), [0.0]
        for C in self.sources:
            squares, axes = np.linalg.eigh(C)
            moves = (axes * np.sqrt(np.maximum(squares, 0.0))).T
            changes = [figure(x + sign * move) - here for move in moves for sign in (1.0, -1.0)]
            found.append(0.5 * float(np.sum(np.square(changes))))
        return max(found)

    def squared_distance(self, at: Sequence[int], apart: NDArray) -> float:
        """Smallest squared Mahalanobis distance of some unknowns, among the sources' covariances.

        Sources in which these unknowns have no variance are left out.

        Parameters
        ----------
        at, apart : (k,) sequences
            Indices of the unknowns, and by how much each differs.
        """
        found = []
        for C in self.sources:
            squares, axes = np.linalg.eigh(C[np.ix_(at, at)])
            if squares[-1] > 0.0:
                squares = np.maximum(squares, LEAST_SQUARE * squares[-1])
                found.append(float(np.sum((axes.T @ apart) ** 2 / squares)))
        return min(found, default=0.0)

    @property
    def std(self) -> NDArray:
        """Standard deviations (n,) of the unknowns."""
        variances = np.array([np.diag(C) for C in self.sources])
        return np.sqrt(np.maximum(variances.max(axis=0), 0.0))

    def with_move(self, moved: NDArray) -> "Spread":
        """The same where the unknowns are known no better than by a move (n,)."""
        return Spread(sources=tuple(C + np.outer(moved, moved) for C in self.sources))


def covariance(fitter: Fitter, fit: Fit, *, tempering: float = 1.0) -> tuple[Spread, NDArray]:
    """Spread of the unknowns and the Hessian of innovations (n, n), no priors.

    Parameters
    ----------
    tempering : float
        The share that innovations counted in the fit, so that priors weigh here as they did there.
    """
    problem = fitter.problem
    n = fit.x.size
    found = jacobian_at(fitter, fit)
    hessians, recording_gradients, middle = [], [], np.zeros((n, n))
    pieces: list[NDArray] = []
    gradients: list[NDArray] = []
    for prepared, e, w, J in zip(
        problem.fitted, found.innovations, found.weights, found.columns, strict=True
    ):
        blocks = e.shape[0]
        edges = np.linspace(0, blocks, PIECES + 1).astype(int)
        for a, b in pairwise(edges):
            part = J[:, a:b] * w[a:b]
            pieces.append(tempering * np.einsum("itc,jtc->ij", part, J[:, a:b], optimize=True))
            gradients.append(tempering * np.einsum("itc,tc->i", part, e[a:b], optimize=True))
        hessians.append(sum(pieces[-PIECES:]))
        slope = tempering * np.einsum("itc,tc->it", J, w * e, optimize=True)
        row_s = prepared.recording.sample_time_s * prepared.whitener.block
        length = max(1, round(BLOCK_s / row_s))
        sums = np.add.reduceat(slope, np.arange(0, blocks, length), axis=1)
        middle += sums @ sums.T
        recording_gradients.append(slope.sum(axis=1))
    _, weight = problem.prior(fit.hypothesis)
    prior = np.diag(weight**2)
    inverse = np.linalg.inv(sum(hessians) + prior + 1e-9 * np.eye(n))
    # a fit has taken part of the scatter away; never less than white innovations of that MSNI
    white = inverse * max(tempering * float(fit.msni.mean()), 1.0)
    sandwich = inverse @ (middle + prior) @ inverse
    apart = jackknife_of_identifiable(hessians, recording_gradients, prior)
    known = inverse_prior_std(white, weight)
    # what the innovations cannot show joins each source: it is the same in every block
    gain = tempering * inverse
    counts = [gain @ g for g in pulls_of(found, counts_of(problem, fit))]
    step = STEP_LEFT * gain @ sum(pulls_of(found, finer_of(problem, fit, found)), np.zeros(n))
    laws = [inverse @ moved for moved in law_moves(problem, fit, pieces)]
    held = sum((np.outer(move, move) for move in (*counts, step, *laws)), np.zeros((n, n)))
    scattered = (sandwich + held, apart + held, jackknife(pieces, gradients, prior) + held)
    spread = Spread(sources=(white + held, *scattered))
    spread = Spread(sources=tuple(no_wider(C, known) for C in spread.sources))
    return spread, sum(hessians) / tempering


def law_moves(problem: Problem, fit: Fit, pieces: Sequence[NDArray]) -> list[NDArray]:
    """Gradients (n,) by the error of a law's form, which differs from piece to piece.

    Each number in proportion to which a law acts is off by `LAW_SPREAD` of itself in each piece,
    independently: what all pieces share the law's own numbers take.

    Parameters
    ----------
    pieces : (n, n) arrays
        Hessians of pieces of recordings.
    """
    sizes = np.zeros(fit.x.size)
    at = len(problem.nominals)
    for law in fit.hypothesis.laws:
        for parameter in law.unknowns:
            if parameter.scale > 0.0:
                if parameter.name in FROM_ZERO or parameter.name in AT_ONE:
                    neutral = (
                        0.0
                        if parameter.log or parameter.name in FROM_ZERO
                        else 1.0 / parameter.scale
                    )
                    off = 1.0 / parameter.scale if parameter.log else fit.x[at] - neutral
                    sizes[at] = LAW_SPREAD * off
                at += 1
    acting = np.flatnonzero(sizes)
    return [H[:, i] * sizes[i] for H in pieces for i in acting]


def inverse_prior_std(white: NDArray, weight: NDArray) -> NDArray:
    """Inverse deviations (n,) of the priors; of values without one, by `NO_PRIOR`.

    Parameters
    ----------
    white : (n, n) array
        Covariance by white innovations.
    weight : (n,) array
        Inverse deviations of the priors; 0 without one.
    """
    far = NO_PRIOR * np.sqrt(np.maximum(np.diag(white), 1e-300))
    return np.where(weight > 0.0, weight, 1.0 / far)


def no_wider(covariance: NDArray, weight: NDArray) -> NDArray:
    """The covariance (n, n) with no direction wider than its prior (1/weight, (n,)).

    Where hardly any data speak, the scatter of what little they say is no measure of anything.
    """
    values, vectors = np.linalg.eigh(covariance * np.outer(weight, weight))
    clipped = (vectors * np.clip(values, 0.0, 1.0)) @ vectors.T
    return clipped / np.outer(weight, weight)


def _variance_growth(hessians: Sequence[NDArray], prior: NDArray) -> NDArray:
    """By how much the variance of each unknown grows (n,) without the recording it needs most."""
    own = _variances(sum(hessians) + prior + 1e-9 * np.eye(len(prior)))
    return np.max([_variances(H) for H in _without_each(hessians, prior)], axis=0) / own


def _variances(hessian: NDArray) -> NDArray:
    """Variances (n,) of unknowns by a Hessian (n, n) that may be singular but for round-off."""
    scale = np.sqrt(np.diag(hessian))
    values, vectors = np.linalg.eigh(hessian / np.outer(scale, scale))
    return np.sum(vectors**2 / np.maximum(values, 1e-12), axis=1) / scale**2


def _without_each(hessians: Sequence[NDArray], prior: NDArray) -> list[NDArray]:
    """Sums of all but one of the Hessians (n, n), with the prior's: differences would cancel."""
    ridge = prior + 1e-9 * np.eye(len(prior))
    return [
        sum((H for k, H in enumerate(hessians) if k != left_out), ridge)
        for left_out in range(len(hessians))
    ]


def jackknife(
    hessians: Sequence[NDArray], recording_gradients: Sequence[NDArray], prior: NDArray
) -> NDArray:
    """Covariance (n, n) from Gauss-Newton fits that leave out one recording each.

    The optimum of the others lies (H - H_b + P)^-1 g_b away, g_b the gradient of the recording
    left out, as all gradients and the prior's pull cancel at the optimum of all. Zero for a
    single recording, of which nothing can be left out.

    Parameters
    ----------
    hessians, recording_gradients : (n, n) and (n,) arrays of each recording
        Of half the sum of squares, at the optimum.
    prior : (n, n) array
        Inverse covariance of the priors.
    """
    n, count = prior.shape[0], len(hessians)
    if count < 2:
        return np.zeros((n, n))
    others = _without_each(hessians, prior)
    moves = np.array(  # least squares: two values that rows do not tell apart leave no inverse
        [
            np.linalg.lstsq(H, g, rcond=None)[0]
            for H, g in zip(others, recording_gradients, strict=True)
        ]
    )
    moves = moves - moves.mean(axis=0)
    return (count - 1) / count * moves.T @ moves


def jackknife_of_identifiable(
    hessians: Sequence[NDArray], gradients: Sequence[NDArray], prior: NDArray
) -> NDArray:
    """`jackknife` of the values that stay identifiable without any one recording, or piece of one.

    The variance of the others is zero here: without the recording that determines it a value may
    move anywhere, and other sources state how well it is known.
    """
    use = _variance_growth(hessians, prior) <= ALONE
    found = np.zeros(prior.shape)
    if use.any():
        square = np.ix_(use, use)
        found[square] = jackknife(
            [H[square] for H in hessians], [g[use] for g in gradients], prior[square]
        )
    return found


def between_laws(value: float, others: Sequence[tuple[float, float]], temperature: float) -> float:
    """Variance of a figure among laws of the same effect, by how well each fits.

    Parameters
    ----------
    others : sequence of (value, log-likelihood units behind the best)
    temperature : float
        Log-likelihood units by which the weight of a law falls to 1/e.
    """
    behind = np.array([0.0, *(gap for _, gap in others)])
    weights = np.exp(-np.maximum(behind, 0.0) / temperature)
    apart = np.array([0.0, *(other - value for other, _ in others)])
    return float(weights @ apart**2 / weights.sum())
