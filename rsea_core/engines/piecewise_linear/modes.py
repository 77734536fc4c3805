"""The compiled exact propagator: matrix exponentials of every mode, and located events.

With the `kernel.Mode` and the spring's region fixed, a piecewise linear machine is

    z' = A z + b command + c + e g(t)        z = (i, theta_w, w_w, theta_l, w_l)

where g is the only thing that is not linear: gravity, or the given motion of a held load. Its
time series to second order enters the exponential integral exactly, so that one step of the
row's length needs one product with a (5, 10) matrix,

    z(h) = exp(A h) z + phi (b command + c) + phi_0 g + phi_1 g' + phi_2 g''

The matrices are made when a mode is first met, for h, h/2, h/4 ... down to where a Taylor series
of the state converges at once (spectral radius of A h below `SMALL`); an event within a step is
reached by halving, then located on that series to 1e-14 of the row. A, b, c and e are read off
`kernel.derivative` itself (differences of an affine function are exact), so the physics is
written down once. What a joint that sticks does is a row of zeros: it does not move at all.

The error is gravity's alone: its third derivative times h^4/24 a step: 4e-8 Nm rms on bench B1 at
1 ms, at most 2e-6 Nm with the light pendulum of the bench preset.

Source: Moler & Van Loan, SIAM Review 45 (2003) 3-49 (scaling and squaring, augmented integrals);
Hochbruck & Ostermann, Exponential integrators, Acta Numerica 19 (2010) 209-286.
"""

import numpy as np
from numba import njit

import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
from rsea_core.engines.event_driven.equations import derivative
from rsea_core.machine.spring_table import UPPER

N = 5  # states that move; the kernel may have more, which then do not act
TERMS = 15  # of the Taylor series: SMALL^15 / 15! is 2e-17
SMALL = 0.5
LEVELS = 26  # halvings of a row: modes up to 3e7 times as fast as the row is long
# columns of a step's matrix, after the states
COMMAND, CONSTANT, FORCE, FORCE_RATE, FORCE_CURVE = range(N, N + 5)
COLUMNS = N + 5
LANES = 8  # rows of a step's matrix, padded to the width of vector registers


@njit(error_model="numpy")
def index_of(mode, region, regions):
    contact = 1 if mode.contact else 0
    pulse = 1 if mode.pulse else 0
    driven = 1 if mode.torque_sign > 0 else 0
    joints = (mode.wheel + 1) * 3 + mode.load + 1
    signs = (joints * 2 + driven) * 2 + contact
    return ((signs * 3 + mode.limited + 1) * 2 + pulse) * regions + region


@njit(error_model="numpy")
def _read_system(plant, spring, fx, mode, region, system):
    """Fill A, b, c, e of a mode from the kernel's derivative, which is affine but for gravity.

    It is read where gravity is zero, at theta_l = -offset and half a turn on from there.
    """
    line = np.zeros((1, spring.shape[1]))
    line[0] = spring[region]
    line[0, UPPER] = np.inf
    y, slopes = np.zeros(k.N_Y), np.zeros((1, k.N_SLOPES))
    base, rest = np.zeros(N), -plant.gravity_offset
    test = min(1.0, 0.5 * plant.current_limit) if plant.drive == mp.CURRENT else 1.0
    held = plant.structure == mp.ELASTIC_HELD or plant.structure == mp.RIGID_HELD
    for column in range(-1, FORCE + 1):
        y[:] = 0.0
        y[k.TL] = rest
        command, moved, scale = 0.0, 0.0, 1.0
        if column == k.TL:
            scale = 1.0 / np.pi
            y[k.TL] += np.pi
        elif column >= 0 and column < N:
            y[column] = 1.0
        elif column == COMMAND:
            command, scale = test, 1.0 / test
        elif column == FORCE and held:
            moved = 1.0
        elif column == FORCE:
            if plant.gravity == 0.0:
                continue
            y[k.TL] += 0.5 * np.pi
            scale = -1.0 / plant.gravity
        now = k.with_motion(mode, moved, 0.0, mode.row_time)
        derivative(plant, line, fx, now, command, k.Stage(0.0, 0), y, slopes)
        for m in range(N):
            value = slopes[0, m]
            if column == -1:
                base[m] = value
            elif column == CONSTANT:
                system[column, m] = base[m] - rest * system[k.TL, m]
            elif column == FORCE and not held:
                value -= base[m] + 0.5 * np.pi * system[k.TL, m]
                system[column, m] = scale * value
            else:
                system[column, m] = scale * (value - base[m])


@njit(error_model="numpy")
def _times(system, vector, into):
    """into = A vector."""
    for m in range(N):
        into[m] = 0.0
    for n in range(N):
        for m in range(N):
            into[m] += system[n, m] * vector[n]


@njit(error_model="numpy")
def _levels(system, row_s):
    """Halvings after which the spectral radius of A h is below SMALL, by ||(A h)^16||^(1/16)."""
    power = np.zeros((N, N))
    for n in range(N):
        for m in range(N):
            power[m, n] = system[n, m] * row_s
    scale = 0.0
    for _ in range(4):
        largest = np.abs(power).max()
        if largest == 0.0:
            return 1
        power = (power / largest) @ (power / largest)
        scale = 2.0 * (scale + np.log2(largest))
    largest = np.abs(power).sum(axis=0).max()
    if largest == 0.0:
        return 1
    radius = (scale + np.log2(largest)) / 16.0
    return max(int(np.ceil(radius - np.log2(SMALL))), 0) + 1


@njit(error_model="numpy")
def make_mode(plant, spring, fx, mode, region, row_s, ready, systems, steps, index):
    """Fill the matrices of a mode; False where it is too fast for the row."""
    system = systems[index]
    system[:] = 0.0
    _read_system(plant, spring, fx, mode, region, system)
    levels = _levels(system, row_s)
    if levels > LEVELS:
        return False
    h = row_s / 2.0 ** (levels - 1)
    finest = steps[index, levels - 1]
    finest[:] = 0.0
    # column j starts its series h^(d + 1) / (d + 1)! (or 1 for a state) and goes on with A h
    term, following = np.zeros(N), np.zeros(N)
    for column in range(COLUMNS):
        term[:] = 0.0
        order = 0
        if column < N:
            term[column] = 1.0
        elif column <= FORCE:
            term[:] = system[column, :N] * h
            order = 1
        else:
            order = 2 + column - FORCE_RATE
            term[:] = system[FORCE, :N] * h**order / (2.0 if order == 2 else 6.0)
        for _ in range(TERMS):
            for m in range(N):
                finest[column, m] += term[m]
            order += 1
            _times(system, term, following)
            for m in range(N):
                term[m] = following[m] * h / order
    for level in range(levels - 2, -1, -1):
        _double(steps[index, level + 1], steps[index, level], h)
        h *= 2.0
    ready[index] = levels
    return True


@njit(error_model="numpy")
def _double(half, whole, h):
    """The matrices of a step twice as long as that of `half`, which is h long."""
    whole[:] = 0.0
    for column in range(COLUMNS):
        for n in range(N):
            for m in range(N):
                whole[column, m] += half[n, m] * half[column, n]
        if column >= N:
            for m in range(N):
                whole[column, m] += half[column, m]
    for m in range(N):
        whole[FORCE_RATE, m] += h * half[FORCE, m]
        whole[FORCE_CURVE, m] += h * half[FORCE_RATE, m] + 0.5 * h * h * half[FORCE, m]


@njit(error_model="numpy")
def force_at(plant, mode, systems, index, command, at, z, force):
    """g and its first two time derivatives at a state `at` seconds into the row."""
    if plant.structure == mp.ELASTIC_HELD or plant.structure == mp.RIGID_HELD:
        force[0], force[1], force[2] = mode.acceleration + mode.jerk * at, mode.jerk, 0.0
        return
    if plant.gravity == 0.0:
        force[0] = force[1] = force[2] = 0.0
        return
    angle = z[k.TL] + plant.gravity_offset
    sine, cosine = np.sin(angle), np.cos(angle)
    force[0] = -plant.gravity * sine
    force[1] = -plant.gravity * cosine * z[k.WL]
    acceleration = systems[index, COMMAND, k.WL] * command
    acceleration += systems[index, CONSTANT, k.WL] + systems[index, FORCE, k.WL] * force[0]
    for n in range(N):
        acceleration += systems[index, n, k.WL] * z[n]
    force[2] = -plant.gravity * (cosine * acceleration - sine * z[k.WL] * z[k.WL])


@njit(error_model="numpy")
def apply_step(steps, index, level, command, force, z, out):
    """out = the state a step later."""
    for m in range(LANES):
        out[m] = steps[index, level, COMMAND, m] * command + steps[index, level, CONSTANT, m]
    for n in range(N):
        for m in range(LANES):
            out[m] += steps[index, level, n, m] * z[n]
    for n in range(3):
        for m in range(LANES):
            out[m] += steps[index, level, FORCE + n, m] * force[n]


@njit(error_model="numpy")
def taylor_series(system, command, force, z, series):
    """The state's Taylor coefficients in time, (TERMS + 1, LANES)."""
    term = np.zeros(N)
    for m in range(N):
        series[0, m] = z[m]
    for j in range(TERMS):
        _times(system, series[j], term)
        for m in range(N):
            if j == 0:
                term[m] += system[COMMAND, m] * command + system[CONSTANT, m]
                term[m] += system[FORCE, m] * force[0]
            elif j == 1:
                term[m] += system[FORCE, m] * force[1]
            elif j == 2:
                term[m] += 0.5 * system[FORCE, m] * force[2]
            series[j + 1, m] = term[m] / (j + 1)


@njit(error_model="numpy")
def series_at(series, time, out):
    """The state by its series."""
    for m in range(N):
        value = series[TERMS, m]
        for j in range(TERMS - 1, -1, -1):
            value = value * time + series[j, m]
        out[m] = value
