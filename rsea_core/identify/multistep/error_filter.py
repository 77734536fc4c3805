"""What a prediction errs by, as a linear stochastic machine: innovations, likelihood, smoothing.

The difference of a recording and a simulation of it follows, as far as both stay near each other,
the linear machine driven by what neither knows: a white torque at the gear and at the load, a
white voltage at the winding. Their densities are estimated from the data by maximum likelihood
(grey-box models with diffusion: Kristensen, Madsen & Jorgensen, Automatica 40 (2004) 225), so that
a torque that no log holds does not pass for physics, and the readings' noise with them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg import expm

import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
from rsea_core.engines.linear.linearise import linear_plant
from rsea_core.identify.smoothing.error_model import moving_states, one_body, reading_row
from rsea_core.numeric.threads import share_out

GRAVITY_LEVELS = 5  # levels of cos(load angle) between which gravity's stiffness is told apart
LEAST_PIVOT = 1e-9  # of a variance that is left of a reading when others are known
SLOW = 10.0  # time scales of the motion in which a slow torque forgets itself
LONGEST_PART = 0.5  # of a row, in times of the fastest mode
LANES = 8  # residuals whitened side by side
HUBER = 4.0  # innovations beyond so many deviations count linearly


@dataclass(frozen=True, kw_only=True)
class Noise:
    """Densities of the unknown inputs and deviations of the readings.

    Attributes
    ----------
    inputs : (4,) array
        Standard deviations of torque at the gear, at the load, and of the voltage, each over
        `Scale.time_s`, and of a torque at the gear that changes slowly (`SLOW`).
    readings : (p,) array
        Standard deviation of one reading.
    """

    inputs: NDArray
    readings: NDArray


@dataclass(frozen=True, kw_only=True)
class Scale:
    """Typical magnitudes of one recording on its machine.

    Attributes
    ----------
    torque_Nm : (2,) array
        At the gear's output and at the load.
    voltage_V, speed_rad_per_s, angle_rad, time_s : float
        Angle and speed at the output; the time is their quotient.
    """

    torque_Nm: NDArray
    voltage_V: float
    speed_rad_per_s: float
    angle_rad: float
    time_s: float


class LinearErrors(NamedTuple):
    """A (modes, d, d), Q (modes, d, d), mode (n,), C (p, d), start (d,) of standard deviations.

    After the machine's states comes a slow torque at the gear, where there is a wheel; the last
    states are constants of the readings.
    """

    A: NDArray
    Q: NDArray
    mode: NDArray
    C: NDArray
    states: tuple[int, ...]
    constants: NDArray  # (p,) index of each reading's constant, -1: none
    unit: NDArray  # (4, modes, d, d): Q of an unknown input of size one
    slow: int  # index of the slow torque, -1: none


def linear_errors(
    plant: mp.Plant,
    stiffness: float,
    channels: Sequence[str],
    load_angle: NDArray,
    row_s: float,
    noise: Noise,
    time_s: float,
) -> LinearErrors:
    """The errors' machine on the rows of one recording.

    Parameters
    ----------
    load_angle : (n,) array
        By which gravity's stiffness changes along the rows.
    """
    states = moving_states(plant)
    n, p = len(states), len(channels)
    constants = np.full(p, -1)
    later = [j for j, name in enumerate(channels) if j > 0 and name != "current_A"]
    slow = n if k.WW in states else -1
    constants[later] = n + (slow >= 0) + np.arange(len(later))
    d = n + (slow >= 0) + len(later)
    slope = np.cos(load_angle + plant.gravity_offset)
    mode = np.clip(
        np.round((slope + 1.0) * 0.5 * (GRAVITY_LEVELS - 1)), 0, GRAVITY_LEVELS - 1
    ).astype(np.int64)
    contact = load_angle > plant.contact_angle
    mode = mode + GRAVITY_LEVELS * contact
    A, unit = np.zeros((2 * GRAVITY_LEVELS, d, d)), np.zeros((4, 2 * GRAVITY_LEVELS, d, d))
    densities = [_inputs(plant, states, size, time_s, d) for size in np.eye(3)]
    densities.append(np.zeros((d, d)))
    if slow >= 0:  # of the size in the long run
        densities[3][slow, slow] = 2.0 / (SLOW * time_s)
    for j in np.unique(mode):
        level = -1.0 + 2.0 * (j % GRAVITY_LEVELS) / (GRAVITY_LEVELS - 1)
        full = linear_plant(
            plant, tangent=stiffness, gravity_stiffness=plant.gravity * level,
            in_contact=bool(j >= GRAVITY_LEVELS),
        ).A  # fmt: skip
        if plant.structure == mp.RIGID_FREE:
            full = one_body(full)
        M = np.zeros((d, d))
        M[:n, :n] = full[np.ix_(states, states)]
        if slow >= 0:
            M[states.index(k.WW), slow] = 1.0 / _wheel(plant)
            M[slow, slow] = -1.0 / (SLOW * time_s)
        for m, density in enumerate(densities):
            A[j], unit[m, j] = discretised(M, density, row_s)
    C = np.array([_reading(plant, stiffness, name, states, d) for name in channels])
    for j in later:
        C[j, constants[j]] = 1.0
    Q = np.tensordot(noise.inputs**2, unit, axes=1)
    return LinearErrors(A, Q, mode, C, tuple(states), constants, unit, slow)


def with_density(errors: LinearErrors, noise: Noise) -> LinearErrors:
    """The errors' machine under other unknown inputs."""
    return errors._replace(Q=np.tensordot(noise.inputs**2, errors.unit, axes=1))


def _reading(plant: mp.Plant, stiffness: float, name: str, states: Sequence[int], d: int):
    """What a column reads of the states; a velocity reads the one of its angle."""
    velocity = {"motor_velocity_rad_per_s": (k.WW, plant.gear_ratio),
                "load_velocity_rad_per_s": (k.WL, 1.0)}.get(name)  # fmt: skip
    if velocity is None:
        return reading_row(plant, stiffness, name, list(states), d)
    state, factor = velocity
    if state == k.WL and plant.structure == mp.RIGID_FREE:
        state = k.WW
    row = np.zeros(d)
    if state in states:
        row[states.index(state)] = factor
    return row


def _wheel(plant: mp.Plant) -> float:
    """Inertia at the gear [kg m2], that of the load with it where nothing bends between."""
    whole = plant.inertia + (plant.load_inertia if plant.structure == mp.RIGID_FREE else 0.0)
    return max(whole, 1e-300)


def _inputs(plant: mp.Plant, states: Sequence[int], size: NDArray, time_s: float, d: int):
    """(d, d) density of what the unknown inputs do to the states."""
    density = np.zeros((d, d))
    wheel = _wheel(plant)
    entries = [(k.WW, size[0] / wheel)]
    if k.WL in states:
        entries.append((k.WL, size[1] / plant.load_inertia))
    elif k.WW in states and plant.structure == mp.RIGID_FREE:
        entries[0] = (k.WW, float(np.hypot(size[0], size[1])) / wheel)
    if k.IM in states:
        entries.append((k.IM, size[2] / plant.inductance))
    elif plant.drive in (mp.DUTY, mp.VOLTAGE) and plant.resistance > 0.0:
        torque = size[2] * plant.torque_per_ampere / plant.resistance
        entries[0] = (k.WW, float(np.hypot(entries[0][1], torque / wheel)))
    for state, rate in entries:
        if state in states:
            density[states.index(state), states.index(state)] = rate**2 * time_s
    return density


def discretised(M: NDArray, density: NDArray, h: float) -> tuple[NDArray, NDArray]:
    """Transition and added covariance over a row (Van Loan, IEEE TAC 23 (1978) 395)."""
    # of a stiff machine over short times, doubled: over a whole row the exponential of -M overflows
    rate = float(np.max(np.abs(np.linalg.eigvals(M)), initial=0.0))
    halvings = max(0, int(np.ceil(np.log2(max(rate * h / LONGEST_PART, 1.0)))))
    d, part = len(M), h / 2**halvings
    wide = np.zeros((2 * d, 2 * d))
    wide[:d, :d], wide[:d, d:], wide[d:, d:] = -M, density, M.T
    E = expm(wide * part)
    A = E[d:, d:].T
    Q = A @ E[:d, d:]
    for _ in range(halvings):
        A, Q = A @ A, A @ Q @ A.T + Q
    return A, 0.5 * (Q + Q.T)


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
            settled = change <= 1e-10 * size
    return gain, root


def innovations(A, mode, C, gain, root, begins, residual) -> NDArray:
    """Whitened innovations (m, n, p) of residuals (m, n, p), on threads."""
    residual = np.ascontiguousarray(residual)
    out, m = np.empty_like(residual), len(residual)
    lanes = LANES if m > 2 else 1
    kernel = _side_by_side if m > 2 else _one_by_one

    def run(begin: int, end: int) -> None:
        own = (A, mode, C, gain, root, begins, residual, out)
        kernel(*own, lanes * begin, min(lanes * end, m))

    share_out(run, -(-m // lanes))
    return out


def _whitening(lanes: int):
    """The kernel of `innovations`, with so many residuals side by side in each instruction."""

    @njit(cache=True, nogil=True, error_model="numpy")
    def kernel(A, mode, C, gain, root, begins, residual, out, begin, end):
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
def smoothed(A, Q, mode, C, R, start, begins, residual):
    """Rauch-Tung-Striebel estimates (n, d) of the errors' states and their variances (n, d)."""
    n, p, d = mode.size, C.shape[0], C.shape[1]
    CT = np.ascontiguousarray(C.T)
    xp, Pp = np.zeros((n, d)), np.zeros((n, d, d))
    xf, Pf = np.zeros((n, d)), np.zeros((n, d, d))
    x, P = np.zeros(d), np.diag(start[0])
    for t in range(n):
        xp[t], Pp[t] = x, P
        PC = P @ CT
        S = C @ PC
        for i in range(p):
            S[i, i] += R[i]
        K = PC @ np.linalg.inv(S)
        x = x + K @ (residual[t] - C @ x)
        P = P - K @ np.ascontiguousarray(PC.T)
        P = 0.5 * (P + P.T)
        xf[t], Pf[t] = x, P
        a = np.ascontiguousarray(A[mode[t]])
        x = a @ x
        P = a @ P @ np.ascontiguousarray(a.T) + Q[mode[t]]
        P = 0.5 * (P + P.T)
    var = np.zeros((n, d))
    x, P = xf[n - 1].copy(), Pf[n - 1].copy()
    xf[n - 1], var[n - 1] = x, np.diag(P)
    for t in range(n - 2, -1, -1):
        a = np.ascontiguousarray(A[mode[t]])
        scale = np.sqrt(np.diag(Pp[t + 1]) + 1e-300)
        M = Pp[t + 1] / np.outer(scale, scale)
        for i in range(d):
            M[i, i] += 1e-12
        G = np.linalg.solve(M, (a @ Pf[t]) / scale.reshape(-1, 1))
        G = G / scale.reshape(-1, 1)
        gain = np.ascontiguousarray(G.T)
        x = xf[t] + gain @ (x - xp[t + 1])
        P = Pf[t] + gain @ (P - Pp[t + 1]) @ G
        P = 0.5 * (P + P.T)
        xf[t] = x
        var[t] = np.diag(P)
    return xf, var


def huber_squares(e: NDArray) -> NDArray:
    """Squares that grow linearly beyond `HUBER` (pseudo-Huber)."""
    return 2.0 * HUBER**2 * (np.sqrt(1.0 + (e / HUBER) ** 2) - 1.0)


def huber_weights(e: NDArray) -> NDArray:
    """Weights of the squares for reweighted least squares."""
    return 1.0 / np.sqrt(1.0 + (e / HUBER) ** 2)
