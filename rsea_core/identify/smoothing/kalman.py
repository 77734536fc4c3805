"""Fixed-interval smoothing of a linear machine, compiled.

The filter takes one scalar reading after another, so that a row with fewer or less certain
readings costs nothing extra; the smoother is the modified Bryson-Frazier recursion, which never
inverts a covariance and is therefore exact where a state is known (a start at rest).

Source
------
Bierman, Fixed interval smoothing with discrete measurements, Int. J. Control 18 (1973);
Durbin & Koopman, Time Series Analysis by State Space Methods (2012), ch. 4 and 6.4.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

LOG_2PI = float(np.log(2.0 * np.pi))


class Dynamics(NamedTuple):
    """How states go on from row to row: row k goes to row k + 1 by A[mode[k]].

    A : (m, d, d) array, the transition of each mode
    mode : (n,) int array
    drift : (n, d) array, what the known inputs add from row k to row k + 1
    """

    A: NDArray
    mode: NDArray
    drift: NDArray


class Filtered(NamedTuple):
    """What a filter leaves of each row.

    predicted (n, d), covariance (n, d, d): of the states before the row is read
    innovation, spread (n, p): of each reading, and its variance; infinite where none was read
    gain (n, p, d)
    """

    predicted: NDArray
    covariance: NDArray
    innovation: NDArray
    spread: NDArray
    gain: NDArray


@njit(cache=True, error_model="numpy")
def filter_rows(dynamics, Q, H, readings, variance, x0, P0, keep):
    """Kalman filter over the rows of a recording.

    Parameters
    ----------
    dynamics : Dynamics
    Q : (d, d) array
    H : (p, d) array
    readings, variance : (n, p) arrays
        A reading of infinite variance is left out.
    keep : bool
        Whether to store what the smoother needs; without it only the likelihood is right.

    Returns
    -------
    log_likelihood, count, Filtered
    """
    A, mode, drift = dynamics
    n, p = readings.shape
    d = x0.size
    stored = n if keep else 1
    predicted = np.zeros((stored, d))
    covariance = np.zeros((stored, d, d))
    innovation = np.zeros((stored, p))
    spread = np.full((stored, p), np.inf)
    gain = np.zeros((stored, p, d))
    x, P = x0.copy(), P0.copy()
    half, column = np.zeros((d, d)), np.zeros(d)
    log_likelihood, count = 0.0, 0
    for k in range(n):
        if keep:
            predicted[k] = x
            covariance[k] = P
        for j in range(p):
            if not np.isfinite(variance[k, j]):
                continue
            e = readings[k, j]
            s = variance[k, j]
            for a in range(d):
                e -= H[j, a] * x[a]
                column[a] = 0.0
                for b in range(d):
                    column[a] += P[a, b] * H[j, b]
            for a in range(d):
                s += H[j, a] * column[a]
            log_likelihood -= 0.5 * (LOG_2PI + np.log(s) + e * e / s)
            count += 1
            for a in range(d):
                x[a] += column[a] * e / s
                for b in range(a + 1):
                    P[a, b] -= column[a] * column[b] / s
                    P[b, a] = P[a, b]
            if keep:
                innovation[k, j] = e
                spread[k, j] = s
                gain[k, j] = column / s
        T = A[mode[k]]
        for a in range(d):
            column[a] = drift[k, a]
            for b in range(d):
                column[a] += T[a, b] * x[b]
                half[a, b] = 0.0
            for c in range(d):
                if T[a, c] != 0.0:
                    for b in range(d):
                        half[a, b] += T[a, c] * P[c, b]
        x[:] = column
        for a in range(d):
            for b in range(a + 1):
                s = Q[a, b]
                for c in range(d):
                    s += half[a, c] * T[b, c]
                P[a, b] = s
                P[b, a] = s
    return log_likelihood, count, Filtered(predicted, covariance, innovation, spread, gain)


@njit(cache=True, error_model="numpy")
def smooth_rows(A, mode, H, outputs, filtered):
    """Smoothed linear outputs of the states and their variances.

    Parameters
    ----------
    outputs : (q, d) array
        The combinations of states that are wanted.

    Returns
    -------
    mean, variance : (n, q) arrays
    """
    predicted, covariance, innovation, spread, gain = filtered
    n, d = predicted.shape
    p, q = H.shape[0], outputs.shape[0]
    mean, variance = np.zeros((n, q)), np.zeros((n, q))
    r, N = np.zeros(d), np.zeros((d, d))
    half, column = np.zeros((d, d)), np.zeros(d)
    for k in range(n - 1, -1, -1):
        if k < n - 1:
            T = A[mode[k]]
            for a in range(d):
                column[a] = 0.0
                for b in range(d):
                    half[a, b] = 0.0
            for c in range(d):
                for a in range(d):
                    if T[c, a] != 0.0:
                        column[a] += T[c, a] * r[c]
                        for b in range(d):
                            half[a, b] += T[c, a] * N[c, b]
            r[:] = column
            for a in range(d):
                for b in range(a + 1):
                    s = 0.0
                    for c in range(d):
                        s += half[a, c] * T[c, b]
                    N[a, b] = s
                    N[b, a] = s
        for j in range(p - 1, -1, -1):
            if not np.isfinite(spread[k, j]):
                continue
            g = gain[k, j]
            correction, stiff = 0.0, 0.0
            for a in range(d):
                correction += g[a] * r[a]
                column[a] = 0.0
                for b in range(d):
                    column[a] += N[a, b] * g[b]
            for a in range(d):
                stiff += g[a] * column[a]
            weight = 1.0 / spread[k, j]
            for a in range(d):
                r[a] += H[j, a] * (innovation[k, j] * weight - correction)
                for b in range(a + 1):
                    N[a, b] += (
                        H[j, a] * H[j, b] * (weight + stiff)
                        - H[j, a] * column[b]
                        - column[a] * H[j, b]
                    )
                    N[b, a] = N[a, b]
        P = covariance[k]
        for w in range(q):
            value, own, known = 0.0, 0.0, 0.0
            for a in range(d):
                column[a] = 0.0
                for b in range(d):
                    column[a] += outputs[w, b] * P[b, a]
                value += outputs[w, a] * predicted[k, a]
            for a in range(d):
                value += column[a] * r[a]
                own += column[a] * outputs[w, a]
                for b in range(d):
                    known += column[a] * N[a, b] * column[b]
            mean[k, w] = value
            variance[k, w] = max(own - known, 0.0)
    return mean, variance


@njit(cache=True, error_model="numpy")
def respond_rows(dynamics, H, outputs, readings, x0, filtered):
    """What the smoother makes of other readings, drift and start with the gains that it has.

    The smoother is linear, so this is its sensitivity to a bias in a reading (Schmidt's consider
    analysis). Arguments as in `filter_rows` and `smooth_rows`.

    Returns
    -------
    mean : (n, q) array
    """
    A, mode, drift = dynamics
    covariance, spread, gain = filtered.covariance, filtered.spread, filtered.gain
    n, p = readings.shape
    d, q = x0.size, outputs.shape[0]
    predicted, innovation = np.zeros((n, d)), np.zeros((n, p))
    mean = np.zeros((n, q))
    x, column = x0.copy(), np.zeros(d)
    for k in range(n):
        predicted[k] = x
        for j in range(p):
            if np.isfinite(spread[k, j]):
                e = readings[k, j]
                for a in range(d):
                    e -= H[j, a] * x[a]
                innovation[k, j] = e
                for a in range(d):
                    x[a] += gain[k, j, a] * e
        T = A[mode[k]]
        for a in range(d):
            column[a] = drift[k, a]
            for b in range(d):
                column[a] += T[a, b] * x[b]
        x[:] = column
    r = np.zeros(d)
    for k in range(n - 1, -1, -1):
        if k < n - 1:
            T = A[mode[k]]
            column[:] = 0.0
            for c in range(d):
                for a in range(d):
                    column[a] += T[c, a] * r[c]
            r[:] = column
        for j in range(p - 1, -1, -1):
            if np.isfinite(spread[k, j]):
                correction = innovation[k, j] / spread[k, j]
                for a in range(d):
                    correction -= gain[k, j, a] * r[a]
                for a in range(d):
                    r[a] += H[j, a] * correction
        for w in range(q):
            for a in range(d):
                value = predicted[k, a]
                for b in range(d):
                    value += covariance[k, a, b] * r[b]
                mean[k, w] += outputs[w, a] * value
    return mean


@njit(cache=True, error_model="numpy")
def innovations_of(dynamics, H, readings, x0, filtered):
    """Scaled innovations (n, p) that other readings, drift and start leave with given gains.

    The filter is linear: with the drift of a port torque's opposite and zero readings these are
    what that torque puts into the innovations. Where nothing was read they are zero.
    """
    (A, mode, drift), spread, gain = dynamics, filtered.spread, filtered.gain
    n, p = readings.shape
    d = x0.size
    found = np.zeros((n, p))
    x, column = x0.copy(), np.zeros(d)
    for k in range(n):
        for j in range(p):
            if np.isfinite(spread[k, j]):
                e = readings[k, j]
                for a in range(d):
                    e -= H[j, a] * x[a]
                found[k, j] = e / np.sqrt(spread[k, j])
                for a in range(d):
                    x[a] += gain[k, j, a] * e
        T = A[mode[k]]
        for a in range(d):
            column[a] = drift[k, a]
            for b in range(d):
                column[a] += T[a, b] * x[b]
        x[:] = column
    return found
