"""Residuals of a free-run replay turned into innovations.

What a replay leaves is the machine's answer to what it does not know: the bridge's slow
unrepeatability, the start within a count, the sensors' noise, and the missing physics. The first
three are filtered through the machine, so neighbouring residuals are anything but independent. A
Kalman filter of the *error* of the nominal linear machine (no input: the replay has had it) with
a slow torque at the drive's port makes them white with unit variance; a parameter error or a
missing term passes through the same linear filter, so whatever was linear in the residual stays
linear, exactly. (Innovations and the generalised likelihood ratio: Willsky & Jones, IEEE TAC 21
(1976) 108.)
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg import expm

import rsea_core.machine.plant as mp
from rsea_core.identify.smoothing.error_model import error_model
from rsea_core.numeric.threads import share_out

BLOCK_s = 0.004  # residuals are averaged to this: faster than any mode that matters here


class ErrorFilter(NamedTuple):
    """The arrays of a whitener, for compiled code.

    A (modes, d, d), modes, drive (blocks,), C (p, d), gain (blocks, d, p), root (blocks, p, p),
    begins (blocks,) bool
    """

    A: NDArray
    modes: NDArray
    drive: NDArray
    C: NDArray
    gain: NDArray
    root: NDArray
    begins: NDArray


@dataclass(frozen=True, kw_only=True)
class Whitener:
    """The filter of one recording.

    Attributes
    ----------
    channels : tuple of str
    block : int
        Rows averaged to one.
    filter : ErrorFilter
        `begins` is where a replay begins anew.
    """

    channels: tuple[str, ...]
    block: int
    filter: ErrorFilter

    @property
    def blocks(self) -> int:
        """How many there are."""
        return self.filter.modes.size

    @property
    def size(self) -> int:
        """Blocks times channels."""
        return self.blocks * len(self.channels)

    def __call__(self, residual: NDArray) -> NDArray:
        """Innovations (m, blocks, channels) of residuals (m, rows, channels)."""
        m, _rows, p = residual.shape
        out = np.empty((m, self.blocks, p))

        def run(begin: int, end: int) -> None:
            _whiten(residual, self.block, self.filter, out, begin, end)

        share_out(run, m)
        return out


def whitener(
    plant: mp.Plant,
    stiffness: float,
    *,
    channels: tuple[str, ...],
    floors: Mapping[str, float],
    row_s: float,
    rows: int,
    in_contact: NDArray,
    motion: float,
    drive: NDArray,
    begins: NDArray | None = None,
    start_std: NDArray | None = None,
) -> Whitener:
    """The whitener of a recording on a machine.

    Parameters
    ----------
    floors : column -> standard deviation of one reading
    in_contact : (rows,) bool array
    motion : float
        Standard deviation of the motor's angle (or what stands for it) over the recording.
    drive : (rows,) array
        What the bridge gives: volts at the winding, or torque on the wheel.
    begins : (blocks,) bool array or None
        Where a replay of windows begins anew; None: at the first row only, within a count.
    start_std : (5,) array or None
        Standard deviations there of current, wheel angle and speed, load angle and speed.
    """
    model = error_model(
        plant, stiffness, channels=channels, floors=floors, row_s=row_s, rows=rows,
        block=block_rows(row_s), in_contact=in_contact, motion=motion, drive=drive,
    )  # fmt: skip
    A = np.array([expm(rates * model.step_s) for rates in model.rates])
    n, d = model.modes.size, A.shape[1]
    P = model.P.copy()
    if start_std is not None:
        for j, state in enumerate(model.states):
            P[j, j] = start_std[state] ** 2
    if begins is None:
        begins = np.arange(n) == 0
    gain, root = np.zeros((n, d, len(channels))), np.zeros((n, len(channels), len(channels)))
    errors = ErrorFilter(A, model.modes, model.drive, model.C, gain, root, begins)
    _riccati(errors, model.Q, model.R, P)
    return Whitener(channels=channels, block=model.block, filter=errors)


def block_rows(row_s: float) -> int:
    """Rows averaged to one."""
    return max(1, round(BLOCK_s / row_s))


@njit(cache=True, error_model="numpy")
def _riccati(errors, Q, R, start):
    """Gains and whitening roots of every block, into the filter's."""
    A, modes, drive, C, gain, root, begins = errors
    p = C.shape[0]
    P = start.copy()
    for t in range(modes.size):
        if begins[t]:
            P = start.copy()
        PC = P @ C.T
        S = C @ PC + R
        L = np.linalg.cholesky(S)
        inverse = np.zeros((p, p))
        for j in range(p):
            for i in range(j, p):
                s = 1.0 if i == j else 0.0
                for m in range(j, i):
                    s -= L[i, m] * inverse[m, j]
                inverse[i, j] = s / L[i, i]
        root[t] = inverse
        K = PC @ (inverse.T @ inverse)
        gain[t] = K
        P = P - K @ PC.T
        a = A[modes[t]].copy()
        a[:-1, -1] *= drive[t]
        P = a @ P @ a.T + Q
        P = 0.5 * (P + P.T)


@njit(error_model="numpy")
def average_run(measured, run, columns, block, out):
    """What columns of a run (rows, c) leave of readings (rows, p), averaged: (blocks, p)."""
    n, p = out.shape
    for t in range(n):
        for i in range(p):
            s = 0.0
            for row in range(t * block, (t + 1) * block):
                s += measured[row, i] - run[row, columns[i]]
            out[t, i] = s / block


@njit(error_model="numpy")
def whiten_one(residual, errors, out):
    """Innovations (blocks, p) of averaged residuals of the same shape, which may be `out`."""
    A, modes, drive, C, gain, root, begins = errors
    n, p = residual.shape
    d = A.shape[1]
    x = np.zeros(d)
    z = np.zeros(d)
    e = np.zeros(p)
    for t in range(n):
        if begins[t]:
            x[:] = 0.0
        for i in range(p):
            s = residual[t, i]
            for a in range(d):
                s -= C[i, a] * x[a]
            e[i] = s
        for i in range(p):
            s = 0.0
            for a in range(i + 1):
                s += root[t, i, a] * e[a]
            out[t, i] = s
        for a in range(d):
            s = x[a]
            for i in range(p):
                s += gain[t, a, i] * e[i]
            z[a] = s
        mode = modes[t]
        for a in range(d):
            s = 0.0
            for b in range(d - 1):
                s += A[mode, a, b] * z[b]
            last = A[mode, a, d - 1] * z[d - 1]
            x[a] = s + (last if a == d - 1 else last * drive[t])


@njit(cache=True, nogil=True, error_model="numpy")
def _whiten(residual, block, errors, out, begin, end):
    """Innovations (m, blocks, p) of residuals (m, rows, p), of begin..end - 1."""
    n, p = out.shape[1:]
    for j in range(begin, end):
        for t in range(n):
            for i in range(p):
                s = 0.0
                for row in range(t * block, (t + 1) * block):
                    s += residual[j, row, i]
                out[j, t, i] = s / block
        whiten_one(out[j], errors, out[j])
