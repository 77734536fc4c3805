"""Kalman filter, innovations and smoother of the errors' linear machine, compiled.

The covariances do not depend on what is read: gains are computed once, and the innovations of many
residuals with them side by side.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rsea_core.numeric.threads import share_out

LEAST_PIVOT = 1e-9  # of a variance that is left of a reading when others are known
LANES = 8  # residuals whitened side by side
SETTLED = 1e-10  # relative change of gains from row to row, below which they stay
HUBER = 4.0  # innovations beyond so many deviations count linearly


class Filter(NamedTuple):
    """A (modes, d, d), mode (n,), C (p, d), gain (n, d, p), root (n, p, p), begins (n,).

    Transition of each mode, mode of each row, readings, Kalman gains, whitening roots of the
    innovations' covariances, rows at which a window begins.
    """

    A: NDArray
    mode: NDArray
    C: NDArray
    gain: NDArray
    root: NDArray
    begins: NDArray


@njit(error_model="numpy")
def _inverse_root(S, L, inverse):
    """Inverse of the lower Cholesky factor of a covariance (p, p), into `inverse`.

    Round-off below a share of a variance is taken for none. L (p, p) is work space.
    """
    p = S.shape[0]
    for j in range(p):
        s = S[j, j]
        for m in range(j):
            s -= L[j, m] * L[j, m]
        L[j, j] = np.sqrt(max(s, LEAST_PIVOT * S[j, j]))
        for i in range(j + 1, p):
            s = 0.5 * (S[i, j] + S[j, i])
            for m in range(j):
                s -= L[i, m] * L[j, m]
            L[i, j] = s / L[j, j]
    for j in range(p):
        for i in range(j, p):
            s = 1.0 if i == j else 0.0
            for m in range(j, i):
                s -= L[i, m] * inverse[m, j]
            inverse[i, j] = s / L[i, i]


@njit(error_model="numpy")
def _propagated(P, step, add, T):
    """Covariance step P step' + add of the next row, into P (d, d); T (d, d) is work space.

    Transitions are sparse: a constant of a reading keeps itself alone.
    """
    d = len(P)
    T[:] = 0.0
    for a in range(d):
        for m in range(d):
            if step[a, m] != 0.0:
                for b in range(d):
                    T[a, b] += step[a, m] * P[m, b]
    for b in range(d):
        for a in range(b, d):
            P[b, a] = 0.5 * (add[a, b] + add[b, a])
        for m in range(d):
            if step[b, m] != 0.0:
                for a in range(b, d):
                    P[b, a] += T[a, m] * step[b, m]
        for a in range(b, d):
            P[a, b] = P[b, a]


@njit(cache=True, nogil=True, error_model="numpy")
def filter_gains(A, Q, mode, C, R, start, begins):
    """Gains (n, d, p), whitening roots (n, p, p) of a time-varying Kalman filter.

    start : (n_begins, d) variances where `begins` (n,) says that a run begins anew
    """
    n, p, d = mode.size, C.shape[0], C.shape[1]
    gain, root = np.zeros((n, d, p)), np.zeros((n, p, p))
    P, T, PC, W = np.zeros((d, d)), np.zeros((d, d)), np.zeros((d, p)), np.zeros((d, p))
    S, L = np.zeros((p, p)), np.zeros((p, p))
    begun, settled = 0, False
    for t in range(n):
        if begins[t]:
            P[:] = np.diag(start[begun])
            begun += 1
            settled = False
        if settled and mode[t] == mode[t - 1]:
            gain[t], root[t] = gain[t - 1], root[t - 1]
            continue
        settled = False
        PC[:] = 0.0
        for j in range(p):
            for m in range(d):
                if C[j, m] != 0.0:
                    for i in range(d):
                        PC[i, j] += C[j, m] * P[m, i]
        for i in range(p):
            for j in range(p):
                S[i, j] = R[i] if i == j else 0.0
                for m in range(d):
                    S[i, j] += C[i, m] * PC[m, j]
        inverse = root[t]
        _inverse_root(S, L, inverse)
        for a in range(d):
            for i in range(p):
                W[a, i] = 0.0
                for m in range(i + 1):
                    W[a, i] += inverse[i, m] * PC[a, m]
            for j in range(p):
                for i in range(j, p):
                    gain[t, a, j] += W[a, i] * inverse[i, j]
        for a in range(d):
            for b in range(a + 1):
                for i in range(p):
                    P[a, b] -= W[a, i] * W[b, i]
                P[b, a] = P[a, b]
        _propagated(P, A[mode[t]], Q[mode[t]], T)
        if t > 0 and not begins[t] and mode[t] == mode[t - 1]:
            change, size = 0.0, 0.0
            for j in range(p):
                unit = np.sqrt(S[j, j])
                for i in range(d):
                    change = max(change, abs(gain[t, i, j] - gain[t - 1, i, j]) * unit)
                    size = max(size, abs(gain[t, i, j]) * unit)
            settled = change <= SETTLED * size
    return gain, root


def innovations(given: Filter, residual: NDArray) -> NDArray:
    """Whitened innovations (m, n, p) of residuals (m, n, p), on threads."""
    residual = np.ascontiguousarray(residual)
    out, m = np.empty_like(residual), len(residual)
    lanes = LANES if m > 2 else 1
    kernel = _side_by_side if m > 2 else _one_by_one

    def run(begin: int, end: int) -> None:
        kernel(given, residual, out, lanes * begin, min(lanes * end, m))

    share_out(run, -(-m // lanes))
    return out


def _whitening(lanes: int):
    """The kernel of `innovations`, with so many residuals side by side in each instruction."""

    @njit(cache=True, nogil=True, error_model="numpy")
    def kernel(given, residual, out, begin, end):
        A, mode, C, gain, root, begins = given
        _, n, p = residual.shape
        d = C.shape[1]
        x, z = np.zeros((d, lanes)), np.zeros((d, lanes))
        e, white = np.zeros((p, lanes)), np.zeros(lanes)
        for first in range(begin, end, lanes):
            used = min(lanes, end - first)
            e[:] = 0.0
            x[:] = 0.0
            for t in range(n):
                if begins[t]:
                    x[:] = 0.0
                for i in range(p):
                    for j in range(used):
                        e[i, j] = residual[first + j, t, i]
                    for a in range(d):
                        if C[i, a] != 0.0:
                            for j in range(lanes):
                                e[i, j] -= C[i, a] * x[a, j]
                for i in range(p):
                    white[:] = 0.0
                    for a in range(i + 1):
                        for j in range(lanes):
                            white[j] += root[t, i, a] * e[a, j]
                    for j in range(used):
                        out[first + j, t, i] = white[j]
                for a in range(d):
                    for j in range(lanes):
                        z[a, j] = x[a, j]
                    for i in range(p):
                        for j in range(lanes):
                            z[a, j] += gain[t, a, i] * e[i, j]
                step = A[mode[t]]
                for a in range(d):
                    for j in range(lanes):
                        x[a, j] = 0.0
                    for b in range(d):
                        if step[a, b] != 0.0:
                            for j in range(lanes):
                                x[a, j] += step[a, b] * z[b, j]

    return kernel


_side_by_side, _one_by_one = _whitening(LANES), _whitening(1)


@njit(cache=True, nogil=True, error_model="numpy")
def smoothed(A, Q, mode, C, R, start, residual):
    """Estimates (n, d) of the errors' states by all rows, and their variances (n, d).

    The modified Bryson-Frazier smoother (Bierman, Int. J. Control 18 (1973), 65-75) with the
    Joseph form of the filter's covariance. Unlike the Rauch-Tung-Striebel smoother it inverts no
    state covariance, which is ill-conditioned where the start's variance far exceeds a sensor's.
    """
    n, p, d = mode.size, C.shape[0], C.shape[1]
    C, CT, one = np.ascontiguousarray(C), np.ascontiguousarray(C.T), np.eye(d)
    x, P = np.zeros(d), np.diag(start[0])
    found, Pf, kept = np.zeros((n, d)), np.zeros((n, d, d)), np.zeros((n, d, d))
    e, weight = np.zeros((n, p)), np.zeros((n, d, p))
    for t in range(n):
        PC = P @ CT
        S = C @ PC
        for i in range(p):
            S[i, i] += R[i]
        inverse = np.linalg.inv(S)
        K = PC @ inverse
        e[t], weight[t], kept[t] = residual[t] - C @ x, CT @ inverse, one - K @ C
        x = x + K @ e[t]
        P = kept[t] @ P @ np.ascontiguousarray(kept[t].T) + (K * R) @ np.ascontiguousarray(K.T)
        P = 0.5 * (P + P.T)
        found[t], Pf[t] = x, P
        a = np.ascontiguousarray(A[mode[t]])
        x = a @ x
        P = a @ P @ np.ascontiguousarray(a.T) + Q[mode[t]]
        P = 0.5 * (P + P.T)
    variance, later, information = np.zeros((n, d)), np.zeros(d), np.zeros((d, d))
    for t in range(n - 1, -1, -1):
        found[t] -= Pf[t] @ later
        variance[t] = np.diag(Pf[t]) - np.diag(Pf[t] @ information @ Pf[t])
        if t == 0:
            break
        step = np.ascontiguousarray(A[mode[t - 1]])
        a, seen = kept[t] @ step, C @ step
        aT, stepT = np.ascontiguousarray(a.T), np.ascontiguousarray(step.T)
        later = aT @ later - stepT @ (weight[t] @ e[t])
        information = aT @ information @ a + (stepT @ weight[t]) @ seen
    return found, variance


def huber_squares(e: NDArray) -> NDArray:
    """Squares that grow linearly beyond `HUBER` (pseudo-Huber)."""
    return 2.0 * HUBER**2 * (np.sqrt(1.0 + (e / HUBER) ** 2) - 1.0)


def huber_weights(e: NDArray) -> NDArray:
    """Weights of the squares for reweighted least squares."""
    return 1.0 / np.sqrt(1.0 + (e / HUBER) ** 2)
