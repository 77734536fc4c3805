"""The matrices of a machine that is linear between events, made when a mode is first met; compiled.

With the `equations.Mode`, what is remembered (which stops slide, which flank is in mesh) and the
spring's region fixed, a piecewise linear machine is

    z' = A z + b command + c + e g(t)        z = the states that move, see `Machine.states`

where g is the only thing that is not linear: gravity's torque, or the given acceleration of a held
load. A step of length h is one product with a matrix,

    z(h) = exp(A h) z + phi (b command + c) + sum_k phi_k g_k        g(t) = sum_k g_k t^k / k!

A given acceleration is straight within a row. Gravity's g_0, g_1, g_2 are its derivatives at the
start; with these the end is predicted, and g_3, g_4 are such that g and its slope there are met.
What g_5 would add is foreseen from what g_3 and g_4 do; where it is above `GRAVITY_TOLERANCE` the
step is halved.

The matrices are made for h, h/2, h/4 ... down to where the state's Taylor series converges at once
(spectral radius of A h below `SMALL`), and for half of that, the middle of such a step. An event
within a step is located on that series, in which gravity is a series too (recurrences of sine and
cosine). A, b, c and e are read off `equations.derivative` itself (differences of an affine function
are exact), so the physics is written down once. A joint that sticks is a row of zeros.

Source: Moler & Van Loan, SIAM Review 45 (2003) 3-49 (scaling and squaring, augmented integrals);
Hochbruck & Ostermann, Exponential integrators, Acta Numerica 19 (2010) 209-286.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

import rsea_core.engines.event_driven.equations as eq
import rsea_core.engines.event_driven.internal_states as m
import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
from rsea_core.machine.spring_table import UPPER

TERMS = 15  # of the Taylor series: SMALL^15 / 15! is 2e-17
SMALL = 0.5
LEVELS = 27  # lengths of steps: modes up to 3e7 times as fast as the row is long
# columns of a step's matrix: what is given, g and its derivatives, then the states
COMMAND, CONSTANT, FORCE, RATE, CURVE, THIRD, FOURTH, STATES = range(8)
COLUMNS = STATES + k.N_STATES  # of the nominal five
LANE = 8  # rows of a step's matrix are padded to the width of vector registers
N_COEFFICIENTS = (COLUMNS + 2) * LANE + 2 * COLUMNS  # see `whole_row`
SLOTS = 512  # modes that are kept at a time
GRAVITY_TOLERANCE = 1e-12  # of the largest speed of the load so far, for a step
SMALLEST_SPEED = 1e-30  # rad/s


class Machine(NamedTuple):
    """A machine as the compiled engine reads it."""

    plant: mp.Plant
    spring: NDArray  # (r, 6) its straight lines, `SpringTable.regions`
    fx: NDArray  # (N_EFFECTS,)
    states: NDArray  # (n,) int64: places in y of what moves; the nominal five first
    event_kinds: NDArray  # int64: the events that this machine has, see `events`


class Modes(NamedTuple):
    """Room for the matrices of every mode, by `slot_of`."""

    row_s: float
    keys: NDArray  # (SLOTS,) int64, 0 where the slot is free
    levels: NDArray  # (SLOTS,) int64: lengths of steps, each half of the one before
    systems: NDArray  # (SLOTS, columns, lanes): b, c, e, A
    steps: NDArray  # (SLOTS, LEVELS, columns, lanes)


class Work(NamedTuple):
    """Memory of a run."""

    y: NDArray  # (N_Y,) the state with what it remembers
    middle: NDArray  # (N_Y,) the state within a trial step
    trial: NDArray  # (N_Y,) and at its end
    values: NDArray  # (3, events) how far they are from acting at a step's start, middle, end
    force: NDArray  # (3,) g and its first two derivatives at a step's start
    moved: NDArray  # (lanes,)
    series: NDArray  # (TERMS + 1, lanes)
    gravity_sines: NDArray  # (2, TERMS + 1) series of gravity's sine and cosine
    times: NDArray  # (4,) at the current limit, in contact, wheel and load held [s]
    fastest: NDArray  # (1,) largest speed of the load so far [rad/s]
    derivatives: NDArray  # (1, N_DERIVATIVES)
    signals: NDArray  # (N_SIGNALS,) what a controller reads
    acts: NDArray  # (3,) the last row whose command acts (-1 none), that command, the present row
    coefficients: NDArray  # (N_COEFFICIENTS,) of the present mode's rows, see `whole_row`
    commands: NDArray  # (3, N_COMMANDS) a controller's answer, the waiting and the acting one


def room(machine: Machine, row_s: float) -> tuple[Modes, Work]:
    """Room for any number of runs of one machine with rows of one length."""
    n = machine.states.size
    columns, lanes = STATES + n, LANE * ((n + LANE - 1) // LANE)
    keys, levels = np.zeros((2, SLOTS), np.int64)
    systems, steps = (np.empty((SLOTS, *most, columns, lanes)) for most in ((), (LEVELS,)))
    modes = Modes(row_s, keys, levels, systems, steps)
    states = (np.zeros(k.N_Y) for _ in range(3))
    shapes = ((3, machine.event_kinds.size), 3, lanes, (TERMS + 1, lanes), (2, TERMS + 1), 4, 1)
    shapes = (*shapes, (1, k.N_DERIVATIVES), k.N_SIGNALS, 3, N_COEFFICIENTS, (3, k.N_COMMANDS))
    work = Work(*states, *map(np.zeros, shapes))
    return modes, work


@njit(error_model="numpy", inline="always")
def is_held(plant):
    """Whether the load's motion is given."""
    return plant.structure == mp.ELASTIC_HELD or plant.structure == mp.RIGID_HELD


@njit(error_model="numpy", forceinline=True)
def _key_of(machine, mode, region, y):
    """A number above zero for all that chooses the matrices."""
    contact, pulse = 1 if mode.contact else 0, 1 if mode.pulse else 0
    driven = 1 if mode.torque_sign > 0 else 0
    key = ((region * 3 + mode.wheel + 1) * 3 + mode.load + 1) * 2 + driven
    key = ((key * 2 + contact) * 3 + mode.limited + 1) * 2 + pulse
    if machine.states.size > k.N_STATES:
        key = key * 5 + int(y[k.FLANK]) + 2
        for stop in range(m.N_STOPS):
            key = key * 3 + int(y[k.DIRECTION + stop]) + 1
        key = (key * 2 + (1 if y[k.GEAR_SIDE] > 0.0 else 0)) * 2 + int(y[k.RISEN])
    return key + 1


@njit(error_model="numpy", inline="always")
def slot_of(machine, modes, work, mode, region):
    """Where a mode's matrices are, made if it is new; -1 where it is too fast for the row."""
    key = _key_of(machine, mode, region, work.y)
    first = key % (SLOTS - 1)
    slot, met = first, 0
    while modes.keys[slot] != 0:
        if modes.keys[slot] == key:
            return slot
        slot, met = (slot + 1) % SLOTS, met + 1
        if met > SLOTS // 4:  # full: begin anew
            modes.keys[:] = 0
            slot = first
    if not _make(machine, modes, work, mode, region, slot):
        return -1
    modes.keys[slot] = key
    return slot


@njit(error_model="numpy")
def _read_system(machine, work, mode, region, system):
    """Fill b, c, e, A of a mode from `equations.derivative`, which is affine but for gravity.

    It is read where gravity is zero, at theta_l = -offset and half a turn on from there.
    """
    plant, fx, states, derivatives = machine.plant, machine.fx, machine.states, work.derivatives
    line = np.zeros((1, machine.spring.shape[1]))
    line[0] = machine.spring[region]
    line[0, UPPER] = np.inf
    n, rest, held = states.size, -plant.gravity_offset, is_held(plant)
    base, y = np.zeros(n), np.zeros(k.N_Y)
    test = min(1.0, 0.5 * plant.current_limit) if plant.drive == mp.CURRENT else 1.0
    for turn in range(n + 4):  # at rest, the states, the constant, command and force
        y[:] = work.y
        for j in range(n):
            y[states[j]] = 0.0
        y[k.TL] = rest
        column, command, moved, scale = turn - 1, 0.0, 0.0, 1.0
        if column == k.TL:
            scale = 1.0 / np.pi
            y[k.TL] += np.pi
        elif 0 <= column < n:
            y[states[column]] = 1.0
        elif column == n + COMMAND:
            command, scale = test, 1.0 / test
        elif column == n + FORCE and held:
            moved = 1.0
        elif column == n + FORCE:
            if plant.gravity == 0.0:
                continue
            y[k.TL] += 0.5 * np.pi
            scale = -1.0 / plant.gravity
        now = k.with_motion(mode, moved, 0.0, mode.row_time)
        eq.derivative(plant, line, fx, now, command, k.Stage(0.0, 0), y, derivatives)
        place = STATES + column if column < n else column - n
        for j in range(n):
            # the anchor of a stop does not move; powers stand in its place
            value = derivatives[0, states[j]] if states[j] < k.N_ALL_STATES else 0.0
            if column == -1:
                base[j] = value
            elif place == CONSTANT:
                system[CONSTANT, j] = base[j] - rest * system[STATES + k.TL, j]
            elif place == FORCE and not held:
                value -= base[j] + 0.5 * np.pi * system[STATES + k.TL, j]
                system[FORCE, j] = scale * value
            else:
                system[place, j] = scale * (value - base[j])


@njit(error_model="numpy")
def apply_system(system, n, vector, into):
    """into = A vector."""
    for j in range(n):
        value = 0.0
        for column in range(n):
            value += system[STATES + column, j] * vector[column]
        into[j] = value


@njit(error_model="numpy")
def _levels(machine, system, row_s):
    """Lengths of steps: the last but one has a spectral radius ||(A h)^16||^(1/16) below SMALL.

    Gravity's stiffness counts as if it were in A.
    """
    n = machine.states.size
    power = np.zeros((n, n))
    for column in range(n):
        for j in range(n):
            power[j, column] = system[STATES + column, j] * row_s
    swing, scale, largest = 0.0, 0.0, 1.0
    if not is_held(machine.plant):
        swing = row_s * np.sqrt(abs(machine.plant.gravity * system[FORCE, k.WL]))
    for _ in range(4):
        largest = np.abs(power).max()
        if largest == 0.0:
            break
        power = (power / largest) @ (power / largest)
        scale = 2.0 * (scale + np.log2(largest))
    largest = np.abs(power).sum(axis=0).max() if largest > 0.0 else 0.0
    radius = np.log2(swing) if swing > 0.0 else -np.inf
    if largest > 0.0:
        radius = max(radius, (scale + np.log2(largest)) / 16.0)
    if radius == -np.inf:
        return 2
    return max(int(np.ceil(radius - np.log2(SMALL))), 0) + 2


@njit(error_model="numpy")
def _make(machine, modes, work, mode, region, slot):
    """Fill the matrices of a mode; False where it is too fast for the row."""
    system, n = modes.systems[slot], machine.states.size
    system[:] = 0.0
    _read_system(machine, work, mode, region, system)
    levels = _levels(machine, system, modes.row_s)
    if levels > LEVELS:
        return False
    h = modes.row_s / 2.0 ** (levels - 1)
    finest = modes.steps[slot, levels - 1]
    finest[:] = 0.0
    # column j starts its series h^(d + 1) / (d + 1)! (or 1 for a state) and goes on with A h
    term, following = np.zeros(n), np.zeros(n)
    for column in range(STATES + n):
        order, start = 0, 1.0
        term[:] = 0.0
        if column >= STATES:
            term[column - STATES] = 1.0
        else:
            order = 1 + max(column - FORCE, 0)
            for d in range(1, order + 1):
                start *= h / d
            term[:] = system[min(column, FORCE), :n] * start
        for _ in range(TERMS):
            for j in range(n):
                finest[column, j] += term[j]
            order += 1
            apply_system(system, n, term, following)
            for j in range(n):
                term[j] = following[j] * h / order
    for level in range(levels - 2, -1, -1):
        _double(n, modes.steps[slot, level + 1], modes.steps[slot, level], h)
        h *= 2.0
    modes.levels[slot] = levels
    return True


@njit(error_model="numpy")
def _double(n, half, whole, h):
    """The matrices of a step twice as long as that of `half`, which is h long.

    In its second half g_k t^k / k! goes on as the sum over d of g_k h^d / d! t^(k - d) / (k - d)!.
    """
    whole[:] = 0.0
    for column in range(STATES + n):
        for inner in range(n):
            for j in range(n):
                whole[column, j] += half[STATES + inner, j] * half[column, inner]
        if column >= STATES:
            continue
        share = 1.0
        for d in range(max(column - FORCE, 0) + 1):
            for j in range(n):
                whole[column, j] += share * half[column - d, j]
            share *= h / (d + 1)


@njit(error_model="numpy", forceinline=True)
def force_at(machine, modes, work, mode, slot, command, at):
    """g and its first two derivatives at the state y, `at` seconds into the row."""
    plant, y, force = machine.plant, work.y, work.force
    force[0] = force[1] = force[2] = 0.0
    if is_held(plant):
        force[0], force[1] = mode.acceleration + mode.jerk * at, mode.jerk
        return
    if plant.gravity == 0.0:
        return
    angle, speed, systems = y[k.TL] + plant.gravity_offset, y[k.WL], modes.systems
    sine, cosine = plant.gravity * np.sin(angle), plant.gravity * np.cos(angle)
    acceleration = systems[slot, COMMAND, k.WL] * command
    acceleration += systems[slot, CONSTANT, k.WL] - systems[slot, FORCE, k.WL] * sine
    for j in range(machine.states.size):
        acceleration += systems[slot, STATES + j, k.WL] * y[machine.states[j]]
    force[0], force[1] = -sine, -cosine * speed
    force[2] = sine * speed * speed - cosine * acceleration


@njit(error_model="numpy", forceinline=True)
def step(machine, modes, work, slot, level, command, out):
    """The state after a step of a level from y goes to out; False where gravity bends too much."""
    states, steps, moved, force = machine.states, modes.steps, work.moved, work.force
    n, lanes, h = states.size, moved.size, modes.row_s / 2.0**level
    for j in range(lanes):
        moved[j] = steps[slot, level, COMMAND, j] * command + steps[slot, level, CONSTANT, j]
    for d in range(3):
        for j in range(lanes):
            moved[j] += steps[slot, level, FORCE + d, j] * force[d]
    for column in range(n):
        value = work.y[states[column]]
        for j in range(lanes):
            moved[j] += steps[slot, level, STATES + column, j] * value
    smooth, gravity = True, machine.plant.gravity
    if gravity != 0.0 and not is_held(machine.plant):
        angle = moved[k.TL] + machine.plant.gravity_offset
        missing, slope = missing_at_end(
            h, force[0], force[1], force[2], -gravity * np.sin(angle),
            -gravity * np.cos(angle) * moved[k.WL],
        )  # fmt: skip
        third, fourth = high_derivatives(hermite(h), missing, slope)
        missed = steps[slot, level, THIRD, k.TL] * third * gravity
        smooth = is_smooth(
            steps[slot, level, THIRD, k.WL] * third, steps[slot, level, FOURTH, k.WL] * fourth,
            steps[slot, level, FORCE, k.WL] * missed, work.fastest[0],
        )  # fmt: skip
        for j in range(n):
            moved[j] += steps[slot, level, THIRD, j] * third
            moved[j] += steps[slot, level, FOURTH, j] * fourth
    out[:] = work.y
    for j in range(n):
        out[states[j]] = moved[j]
    return smooth


@njit(error_model="numpy", forceinline=True)
def hermite(h):
    """Factors of `high_derivatives` for a step."""
    return 24.0 / h**3, 6.0 / h**2, 72.0 / h**4


@njit(error_model="numpy", forceinline=True)
def missing_at_end(h, force, rate, curve, end, end_rate):
    """What g_0, g_1, g_2 leave of g and of its slope at a step's end."""
    return end - (force + h * (rate + 0.5 * h * curve)), end_rate - (rate + h * curve)


@njit(error_model="numpy", forceinline=True)
def high_derivatives(factors, missing, slope):
    """Third and fourth derivative of g that add what is missing; factors: `hermite`."""
    by_value, by_slope, fourth_by_value = factors
    return by_value * missing - by_slope * slope, by_value * slope - fourth_by_value * missing


@njit(error_model="numpy", forceinline=True)
def is_smooth(third, fourth, missed, fastest):
    """Whether a step's gravity is good: what g_3, g_4 and the prediction's error add to a speed."""
    allowed = GRAVITY_TOLERANCE * fastest + SMALLEST_SPEED
    falls = abs(fourth) <= allowed or fourth * fourth <= allowed * abs(third)
    return falls and abs(missed) <= allowed
