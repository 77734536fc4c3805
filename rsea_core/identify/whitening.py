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

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray
from scipy.linalg import expm

import rsea_core.kernel as k
from rsea_core.linearise import linear_plant

BLOCK_s = 0.004  # residuals are averaged to this: faster than any mode that matters here
SLOW_COUNTS = 4.0  # wandering zero of a bridge: motion, rms, in motor encoder counts
SLOW_SHARE = 1e-4  # the same of the motor's motion, where counts are finer than that
GAIN_SHARE = 7e-4  # wandering gain of a bridge, rms: some tens of counts where the motor turns far
SLOW_TIME_s = 0.7  # its correlation time at the drive
START_COUNTS = 0.5  # uncertainty of a start, counts
# an incremental encoder counts from a random place between two counts: half a count, uniform, is a
# constant error of a recording's readings (the floor itself, rms). The motor's is nothing behind
# the gear; the load's would be taken for gravity, mass and stiffness
COUNTED = ("load_angle_rad",)


@dataclass(frozen=True, kw_only=True)
class Whitener:
    """The filter of one recording.

    Attributes
    ----------
    channels : tuple of str
    block : int
        Rows averaged to one.
    begins : (blocks,) bool array
        Where a replay begins anew.
    """

    channels: tuple[str, ...]
    block: int
    begins: NDArray
    A: NDArray
    C: NDArray
    modes: NDArray
    drive: NDArray
    gain: NDArray
    root: NDArray

    @property
    def size(self) -> int:
        """Blocks times channels."""
        return self.modes.size * len(self.channels)

    def __call__(self, residual: NDArray) -> NDArray:
        """Innovations (m, blocks, channels) of residuals (m, rows, channels)."""
        m, _rows, p = residual.shape
        n = self.modes.size
        used = residual[:, : n * self.block].reshape(m, n, self.block, p).mean(axis=2)
        out = np.empty_like(used)
        _whiten(
            used, self.A, self.modes, self.drive, self.C, self.gain, self.root, self.begins, out
        )
        return out


def whitener(
    plant: k.Plant,
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
    block = block_rows(row_s)
    n = max(rows // block, 1)
    h = row_s * block
    modes = in_contact[: n * block].reshape(n, block).any(axis=1).astype(np.int64)
    states, A = [], []
    counted = [name for name in channels if name in COUNTED]
    given = drive[: n * block].reshape(n, block).mean(axis=1)
    for contact in (False, True):
        linear = linear_plant(
            plant,
            tangent=stiffness,
            gravity_stiffness=plant.gravity,
            in_contact=contact,
        )
        states = moving_states(plant)
        full = _augmented(plant, linear.A, states, len(counted))
        A.append(expm(full * h))
    A = np.array(A)
    d = A.shape[1]
    C = np.array([reading_row(plant, stiffness, name, states, d) for name in channels])
    for j, name in enumerate(counted, start=len(states)):
        C[channels.index(name), j] = 1.0
    R = np.diag([floors[name] ** 2 / _averaged(name, block) for name in channels])
    level = np.hypot(SLOW_COUNTS * (plant.motor_count or 0.0), SLOW_SHARE * motion) or SLOW_SHARE
    Q = np.zeros((d, d))
    Q[-2, -2] = 1.0 - np.exp(-2.0 * h / SLOW_TIME_s)
    unit = _slow_motion(A[0], Q, n, _motor_row(plant, states, d))
    scale = (level / unit) ** 2 if unit > 0.0 else 0.0
    Q[-1, -1] = Q[-2, -2] * GAIN_SHARE**2
    Q[-2, -2] *= scale
    P = np.zeros((d, d))
    P[-2, -2], P[-1, -1] = scale, GAIN_SHARE**2
    for name, state, per in (
        ("motor_angle_rad", k.TW, plant.gear_ratio),
        ("load_angle_rad", k.TL, 1.0),
    ):
        if state in states and name in floors:
            P[states.index(state), states.index(state)] = (
                START_COUNTS * 3.46 * floors[name] / per
            ) ** 2
    for j, name in enumerate(counted, start=len(states)):
        P[j, j] = floors[name] ** 2
    if start_std is not None:
        for j, state in enumerate(states):
            P[j, j] = start_std[state] ** 2
    if begins is None:
        begins = np.arange(n) == 0
    gain, root = np.zeros((n, d, len(channels))), np.zeros((n, len(channels), len(channels)))
    _riccati(A, Q, C, R, P, modes, given, begins, gain, root)
    return Whitener(
        channels=channels,
        block=block,
        begins=begins,
        A=A,
        C=C,
        modes=modes,
        drive=given,
        gain=gain,
        root=root,
    )


def _averaged(name: str, block: int) -> float:
    # counts of a slow motion stay the same over a block: no gain from averaging those of a load
    return 1.0 if name.startswith("load") else float(block)


def block_rows(row_s: float) -> int:
    """Rows averaged to one."""
    return max(1, round(BLOCK_s / row_s))


def moving_states(plant: k.Plant) -> list[int]:
    """Indices of the states that this machine has."""
    winding = plant.drive in (k.DUTY, k.VOLTAGE) and plant.inductance > 0.0
    states = [k.IM] if winding else []
    if plant.structure in (k.ELASTIC_FREE, k.ELASTIC_HELD, k.RIGID_FREE):
        states += [k.TW, k.WW]
    if plant.structure == k.ELASTIC_FREE:
        states += [k.TL, k.WL]
    return states


def _augmented(plant: k.Plant, full: NDArray, states: list[int], constants: int) -> NDArray:
    """The error's dynamics with constants of the readings, then the bridge's zero and gain.

    Zero and gain wander; the gain's column is for a drive of one unit.
    """
    n = len(states)
    d = n + constants + 2
    M = np.zeros((d, d))
    M[:n, :n] = full[np.ix_(states, states)]
    if plant.structure == k.RIGID_FREE:
        M[:n, :n] = one_body(full)[np.ix_(states, states)]
    if k.IM in states:
        M[states.index(k.IM), -2:] = 1.0 / plant.inductance
    elif k.WW in states:
        inertia = plant.inertia
        if plant.structure == k.RIGID_FREE:
            inertia += plant.load_inertia
        per = 1.0
        if plant.drive in (k.DUTY, k.VOLTAGE):
            per = plant.torque_per_ampere / plant.resistance
        M[states.index(k.WW), -2:] = per / inertia
    M[-2, -2] = M[-1, -1] = -1.0 / SLOW_TIME_s
    return M


def one_body(full: NDArray) -> NDArray:
    """Dynamics of wheel and load as one: columns of the load added to the wheel's."""
    moved = np.zeros_like(full)
    moved[:, k.TW], moved[:, k.WW] = full[:, k.TL], full[:, k.WL]
    moved[k.TL], moved[k.WL] = 0.0, 0.0
    return full + moved * (np.arange(k.N_STATES) == k.WW)[:, None]


def reading_row(plant: k.Plant, stiffness: float, name: str, states: list[int], d: int) -> NDArray:
    """What a column reads of the states."""
    row = np.zeros(d)

    def put(state: int, value: float) -> None:
        if state in states:
            row[states.index(state)] += value
        elif plant.structure == k.RIGID_FREE and state == k.TL:
            row[states.index(k.TW)] += value

    if name == "motor_angle_rad":
        put(k.TW, plant.gear_ratio)
    elif name == "load_angle_rad":
        put(k.TL, 1.0)
    elif name in ("torque_Nm", "spring_deflection_rad"):
        factor = stiffness if name == "torque_Nm" else 1.0
        if plant.structure in (k.ELASTIC_FREE, k.ELASTIC_HELD):
            put(k.TW, factor)
            put(k.TL, -factor)
    elif name == "current_A":
        if k.IM in states:
            put(k.IM, 1.0)
        elif plant.drive in (k.DUTY, k.VOLTAGE):
            put(k.WW, -plant.volts_per_speed / plant.resistance)
    return row


def _motor_row(plant: k.Plant, states: list[int], d: int) -> NDArray:
    """The row that reads the motor's angle."""
    return reading_row(plant, 0.0, "motor_angle_rad", states, d)


def _slow_motion(A: NDArray, Q: NDArray, n: int, row: NDArray) -> float:
    """Standard deviation of the motor's angle half way, for a disturbance of variance 1."""
    P = np.zeros_like(Q)
    P[-2, -2] = 1.0
    for _ in range(max(n // 2, 1)):
        P = A @ P @ A.T + Q
    return float(np.sqrt(max(row @ P @ row, 0.0)))


@njit(cache=True, error_model="numpy")
def _riccati(A, Q, C, R, start, modes, drive, begins, gain, root):
    """Gains and whitening roots of every block."""
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


@njit(cache=True, error_model="numpy", parallel=True)
def _whiten(residual, A, modes, drive, C, gain, root, begins, out):
    m, n, p = residual.shape
    d = A.shape[1]
    for j in prange(m):
        x = np.zeros(d)
        z = np.zeros(d)
        e = np.zeros(p)
        for t in range(n):
            if begins[t]:
                x[:] = 0.0
            for i in range(p):
                s = residual[j, t, i]
                for a in range(d):
                    s -= C[i, a] * x[a]
                e[i] = s
            for i in range(p):
                s = 0.0
                for a in range(i + 1):
                    s += root[t, i, a] * e[a]
                out[j, t, i] = s
            for a in range(d):
                s = x[a]
                for i in range(p):
                    s += gain[t, a, i] * e[i]
                z[a] = s
            T = A[modes[t]]
            for a in range(d):
                s = 0.0
                for b in range(d - 1):
                    s += T[a, b] * z[b]
                last = T[a, d - 1] * z[d - 1]
                x[a] = s + (last if a == d - 1 else last * drive[t])
