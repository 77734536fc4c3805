"""Filter and smoother of a replay's errors with one unknown signal as first state, compiled."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

NEARLY = 1e-10  # of a state's variance: keeps the smoother's inverse from round-off


class SignalModel(NamedTuple):
    """The errors' model with an unknown signal of unit size as first state, for compiled code.

    A (modes, d, d), C (p, d), R (p, p), Q, P (d, d), modes, drive (blocks,)
    """

    A: NDArray
    C: NDArray
    R: NDArray
    Q: NDArray
    P: NDArray
    modes: NDArray
    drive: NDArray


@njit(cache=True, error_model="numpy", nogil=True)
def signal_likelihoods(columns, signal, sizes, dets, grams):
    """A Kalman filter per size of the unknown signal, which is the first state."""
    A, C, R, Q1, P1, modes, drive = signal
    n, m, p = columns.shape
    d = A.shape[1]
    Q, P, x = np.empty((d, d)), np.empty((d, d)), np.empty((m, d))
    PC, L, W, e = np.empty((d, p)), np.empty((p, p)), np.empty((d, p)), np.empty((m, p))
    T, old = np.empty((d, d)), np.empty(d)
    for level in range(sizes.size):
        Q[:], P[:], x[:] = Q1, P1, 0.0
        Q[0, 0] *= sizes[level] ** 2
        P[0, 0] *= sizes[level] ** 2
        det = 0.0
        gram = grams[level]
        for t in range(n):
            for i in range(d):
                for c in range(p):
                    s = 0.0
                    for j in range(d):
                        s += P[i, j] * C[c, j]
                    PC[i, c] = s
            for a in range(p):  # the innovations' covariance, and its root
                for b in range(a + 1):
                    s = R[a, b]
                    for j in range(d):
                        s += C[a, j] * PC[j, b]
                    for c in range(b):
                        s -= L[a, c] * L[b, c]
                    L[a, b] = np.sqrt(s) if a == b else s / L[b, b]
                det += 2.0 * np.log(L[a, a])
            for i in range(d):  # gain times root: W L^T = P C^T
                for a in range(p):
                    s = PC[i, a]
                    for c in range(a):
                        s -= W[i, c] * L[a, c]
                    W[i, a] = s / L[a, a]
            for k_ in range(m):
                for a in range(p):
                    s = columns[t, k_, a]
                    for j in range(d):
                        s -= C[a, j] * x[k_, j]
                    for c in range(a):
                        s -= L[a, c] * e[k_, c]
                    e[k_, a] = s / L[a, a]
            for k_ in range(m):
                for q in range(k_ + 1):
                    s = 0.0
                    for a in range(p):
                        s += e[k_, a] * e[q, a]
                    gram[k_, q] += s
            last = drive[t]
            M = A[modes[t]]
            for k_ in range(m):
                for j in range(d):
                    s = x[k_, j]
                    for a in range(p):
                        s += W[j, a] * e[k_, a]
                    old[j] = s
                for i in range(d):
                    s = M[i, d - 1] * old[d - 1] * (1.0 if i == d - 1 else last)
                    for j in range(d - 1):
                        s += M[i, j] * old[j]
                    x[k_, i] = s
            for i in range(d):
                for j in range(i + 1):
                    s = P[i, j]
                    for a in range(p):
                        s -= W[i, a] * W[j, a]
                    P[i, j] = s
                    P[j, i] = s
            for i in range(d):
                for j in range(d):
                    s = M[i, d - 1] * (1.0 if i == d - 1 else last) * P[d - 1, j]
                    for c in range(d - 1):
                        s += M[i, c] * P[c, j]
                    T[i, j] = s
            for i in range(d):
                for j in range(i + 1):
                    s = Q[i, j] + T[i, d - 1] * M[j, d - 1] * (1.0 if j == d - 1 else last)
                    for c in range(d - 1):
                        s += T[i, c] * M[j, c]
                    P[i, j] = s
                    P[j, i] = s
        dets[level] = det
        for k_ in range(m):
            for q in range(k_):
                gram[q, k_] = gram[k_, q]


def smooth_errors(left, transitions, C, R, Q, P) -> tuple[NDArray, NDArray]:
    """Mean and variance of the first state (n,)."""
    n, d = left.shape[0], Q.shape[0]
    here, spread_here = np.zeros((n, d)), np.zeros((n, d, d))
    ahead, spread = np.zeros((n, d)), np.zeros((n, d, d))
    x = np.zeros(d)
    for t, A in enumerate(transitions):
        ahead[t], spread[t] = x, P
        PC = P @ C.T
        K = np.linalg.solve(C @ PC + R, PC.T)
        here[t] = x + K.T @ (left[t] - C @ x)
        spread_here[t] = P - PC @ K
        x = A @ here[t]
        P = A @ spread_here[t] @ A.T + Q
        P = 0.5 * (P + P.T)
    mean, variance = here[:, 0].copy(), spread_here[:, 0, 0].copy()
    s, V = here[-1], spread_here[-1]
    nearly = NEARLY * np.eye(d)
    for t in range(n - 2, -1, -1):
        size = np.sqrt(np.maximum(np.diag(spread[t + 1]), 0.0)) + 1e-150
        scaled = spread[t + 1] / np.outer(size, size) + nearly
        across = (transitions[t] @ spread_here[t]) / size[:, None]
        G = (np.linalg.solve(scaled, across) / size[:, None]).T
        s = here[t] + G @ (s - ahead[t + 1])
        V = spread_here[t] + G @ (V - spread[t + 1]) @ G.T
        mean[t], variance[t] = s[0], V[0, 0]
    return mean, variance
