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

from typing import NamedTuple

import numpy as np
from numba import njit

import rsea_core.effects as e
import rsea_core.kernel as k
from rsea_core.compiled import SOURCE_VERSION
from rsea_core.terms.table import ANCHOR, C0, C1, UPPER

DONE, NOT_FINITE, TOO_MANY_SWITCHES, TOO_STIFF, NOT_EVEN = range(5)
NEAR = 0.02  # rad: there the series of sine and cosine are exact to the last bit
UNEVEN = 1e-6  # of a row: by how much rows may differ in length
MAX_SWITCHES_PER_ROW = 1000
EVENT_TOLERANCE = 1e-14  # of the row's length
N = 5  # states that move; the kernel may have more, which then do not act
TERMS = 18  # of the Taylor series: SMALL^18 / 18! is 1e-21
SMALL = 0.5
LEVELS = 26  # halvings of a row: modes up to 3e7 times as fast as the row is long
# columns of a step's matrix, after the states
COMMAND, CONSTANT, FORCE, FORCE_RATE, FORCE_CURVE = range(N, N + 5)
COLUMNS = N + 5
LANES = 8  # rows of a step's matrix, padded to the width of vector registers
# rows of the log: states, tau_s, command, unsaturated, then times [s], written where `timed`
LOG_TORQUE, LOG_COMMAND, LOG_UNSATURATED, LOG_TIMES = range(N, N + 4)
N_LOG = LOG_TIMES + 4
LIMITED, CONTACT, WHEEL_STUCK, LOAD_STUCK = range(4)


class Grid(NamedTuple):
    """What is known of the rows before the run, but for the arrays."""

    start_s: float
    row_s: float
    rows_per_sample: int
    delay_samples: int
    command_limit: float


@njit(error_model="numpy")
def _index(mode, region, regions):
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
    y, slopes, power = np.zeros(k.N_STATES), np.zeros((1, k.N_STATES)), np.zeros(k.N_INTEGRALS)
    base, rest = np.zeros(N), -plant.gravity_offset
    test = min(1.0, 0.5 * plant.current_limit) if plant.drive == k.CURRENT else 1.0
    held = plant.structure == k.ELASTIC_HELD or plant.structure == k.RIGID_HELD
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
        k.derivative(plant, line, fx, now, command, 0.0, y, slopes, 0, power)
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
def _make(plant, spring, fx, mode, region, row_s, ready, systems, steps, index):
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
def _force(plant, mode, systems, index, command, at, z, force):
    """g and its first two time derivatives at a state `at` seconds into the row."""
    if plant.structure == k.ELASTIC_HELD or plant.structure == k.RIGID_HELD:
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
def _apply(steps, index, level, command, force, z, out):
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
def _series(system, command, force, z, series):
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
def _at(series, time, out):
    """The state by its series."""
    for m in range(N):
        value = series[TERMS, m]
        for j in range(TERMS - 1, -1, -1):
            value = value * time + series[j, m]
        out[m] = value


@njit(error_model="numpy", inline="always")
def _outside(spring, region, z):
    """How far the deflection is outside its region (upper end, lower end), negative inside."""
    deflection = z[k.TW] - z[k.TL]
    lower = spring[region - 1, UPPER] - deflection if region > 0 else -1.0
    return deflection - spring[region, UPPER], lower


@njit(error_model="numpy")
def _holds(plant, spring, fx, mode, region, command, elastic, z):
    """Whether no switch is over at this state."""
    if elastic:
        above, below = _outside(spring, region, z)
        if above > 0.0 or below > 0.0:
            return False
    if plant.contact_angle < np.inf and (z[k.TL] > plant.contact_angle) != mode.contact:
        return False
    if k.switch_value(plant, spring, fx, mode, command, 0.0, z, k.CURRENT_SWITCH) > 0.0:
        return False
    if fx[e.WHEEL_DRY] != 0.0:
        if mode.wheel != 0:
            if mode.wheel * z[k.WW] < 0.0:
                return False
        elif k.switch_value(plant, spring, fx, mode, command, 0.0, z, k.WHEEL_SWITCH) > 0.0:
            return False
        if fx[e.GEAR_DRIVE_LOSS] != 0.0 or fx[e.GEAR_BACKDRIVE_LOSS] != 0.0:
            torque = spring[region, C0]
            torque += spring[region, C1] * (z[k.TW] - z[k.TL] - spring[region, ANCHOR])
            if mode.torque_sign * torque < 0.0:
                return False
    if fx[e.LOAD_DRY] != 0.0:
        if mode.load != 0:
            return mode.load * z[k.WL] >= 0.0
        value = k.switch_value(plant, spring, fx, mode, command, 0.0, z, k.LOAD_SWITCH)
        return not value > 0.0
    return True


# switches beyond the kernel's: the spring's region ends
UPPER_SWITCH, LOWER_SWITCH = k.N_SWITCHES, k.N_SWITCHES + 1


@njit(error_model="numpy")
def _value(plant, spring, fx, mode, region, command, elastic, z, switch):
    if switch >= UPPER_SWITCH:
        if not elastic:
            return -1.0
        return _outside(spring, region, z)[switch - UPPER_SWITCH]
    if switch == k.PULSE_SWITCH:  # rows are cut there
        return -1.0
    return k.switch_value(plant, spring, fx, mode, command, 0.0, z, switch)


@njit(error_model="numpy")
def _locate(plant, spring, fx, mode, region, command, elastic, series, length, tolerance, out):
    """First switch within a step: (switch or -1, its time); the state there goes to out."""
    first, taken = -1, length
    for switch in range(k.N_SWITCHES + 2):
        _at(series, taken, out)
        at_high = _value(plant, spring, fx, mode, region, command, elastic, out, switch)
        if not at_high > 0.0:
            continue
        _at(series, 0.0, out)
        at_low = _value(plant, spring, fx, mode, region, command, elastic, out, switch)
        low, high, last = 0.0, taken, 0
        for iteration in range(200):
            if high - low <= tolerance:
                break
            middle = 0.5 * (low + high)
            if iteration % 4 != 3 and at_high > at_low:
                secant = high - at_high * (high - low) / (at_high - at_low)
                if low < secant < high:
                    middle = min(max(secant, low + 0.5 * tolerance), high - 0.5 * tolerance)
            _at(series, middle, out)
            value = _value(plant, spring, fx, mode, region, command, elastic, out, switch)
            if value > 0.0:
                high, at_high = middle, value
                at_low = 0.5 * at_low if last == 1 else at_low
                last = 1
            else:
                low, at_low = middle, value
                at_high = 0.5 * at_high if last == -1 else at_high
                last = -1
        first, taken = switch, high
    _at(series, taken, out)
    return first, taken


@njit(error_model="numpy")
def _switched(plant, spring, fx, mode, region, z, command, switch):
    """Mode and region after a switch."""
    if switch == UPPER_SWITCH:
        return mode, region + 1
    if switch == LOWER_SWITCH:
        return mode, region - 1
    return k.switched(plant, spring, fx, mode, z, command, switch), region


@njit(error_model="numpy")
def _advance(
    plant, spring, fx, mode, region, command, at, length, row_s, z, trial, force,
    series, ready, systems, steps, times,
):  # fmt: skip
    """Move the state on by a piece of a row, `at` seconds into it: (mode, region, status)."""
    regions = spring.shape[0]
    elastic = plant.structure == k.ELASTIC_FREE or plant.structure == k.ELASTIC_HELD
    left, level, switches = length, 0, 0
    while left > 1e-15 * row_s:
        index = _index(mode, region, regions)
        if ready[index] == 0:
            made = _make(plant, spring, fx, mode, region, row_s, ready, systems, steps, index)
            if not made:
                return mode, region, TOO_STIFF
        finest = ready[index] - 1
        step = row_s / 2.0**level
        while step > left and level <= finest:
            level += 1
            step *= 0.5
        _force(plant, mode, systems, index, command, at + length - left, z, force)
        switch, taken, by_series = -1, step, level > finest
        if not by_series:
            _apply(steps, index, level, command, force, z, trial)
            if not _holds(plant, spring, fx, mode, region, command, elastic, trial):
                if level < finest:
                    level += 1
                    continue
                by_series = True
        if by_series:
            _series(systems[index], command, force, z, series)
            switch, taken = _locate(
                plant, spring, fx, mode, region, command, elastic, series, min(step, left),
                EVENT_TOLERANCE * row_s, trial,
            )  # fmt: skip
        for m in range(N):
            z[m] = trial[m]
        left -= taken
        times[0] += taken if mode.limited != 0 else 0.0
        times[1] += taken if mode.contact else 0.0
        times[2] += taken if mode.wheel == 0 and fx[e.WHEEL_DRY] != 0.0 else 0.0
        times[3] += taken if mode.load == 0 and fx[e.LOAD_DRY] != 0.0 else 0.0
        if switch >= 0:
            mode, region = _switched(plant, spring, fx, mode, region, z, command, switch)
            level = 0
            switches += 1
            if switches > MAX_SWITCHES_PER_ROW:
                return mode, region, TOO_MANY_SWITCHES
    return mode, region, DONE


@njit(error_model="numpy", inline="always")
def _quantised(angle, count):
    return np.floor(angle / count) * count if count > 0.0 else angle


@njit(error_model="numpy")
def _joint_torque(plant, spring, fx, mode, command, z, y, slopes, power):
    """tau_s where it is no function of the angles: wheel and load are one body."""
    for m in range(N):
        y[m] = z[m]
    return k.derivative(plant, spring, fx, mode, command, 0.0, y, slopes, 0, power)


@njit(error_model="numpy")
def _given_motion(plant, mode, angle, speed, row, row_s, time, z):
    """The mode with a held load's motion of this row: the cubic between its readings."""
    before, after = speed[row], speed[row + 1]
    z[k.TL], z[k.WL] = angle[row], before
    if plant.structure == k.RIGID_HELD:
        z[k.WW] = before
    slope = (angle[row + 1] - angle[row]) / row_s
    acceleration = 2.0 * (3.0 * slope - 2.0 * before - after) / row_s
    return k.with_motion(mode, acceleration, 6.0 * (before + after - 2.0 * slope) / row_s**2, time)


@njit(error_model="numpy")
def _must_look(plant, wheel_dry, load_dry, mode, current):
    """Whether a new command can change the mode: something sticks, or the current is limited."""
    looks = (wheel_dry and mode.wheel == 0) or (load_dry and mode.load == 0)
    if plant.current_limit < np.inf:
        at_limit = mode.limited != 0 or abs(current) >= plant.current_limit
        looks = looks or at_limit or plant.inductance == 0.0
    return looks or plant.drive == k.CURRENT


@njit(error_model="numpy")
def _sum(steps, index, m, command, i, wheel, speed, load, load_speed, force, rate, curve):
    """One state after a step of the whole row."""
    given = steps[index, 0, COMMAND, m] * command + steps[index, 0, CONSTANT, m]
    forced = steps[index, 0, FORCE, m] * force + steps[index, 0, FORCE_RATE, m] * rate
    forced += steps[index, 0, FORCE_CURVE, m] * curve
    drive = steps[index, 0, k.IM, m] * i + steps[index, 0, k.WW, m] * speed
    angles = steps[index, 0, k.TW, m] * wheel + steps[index, 0, k.TL, m] * load
    return (drive + angles) + (steps[index, 0, k.WL, m] * load_speed + (given + forced))


@njit(error_model="numpy")
def _row(
    plant, spring, fx, mode, region, command, begin, row_s, z, trial, force, series,
    ready, systems, steps, times,
):  # fmt: skip
    """One row from `begin` on, cut where the disturbance begins or ends."""
    slack, done = 1e-9 * row_s, 0.0
    if _must_look(plant, fx[e.WHEEL_DRY] != 0.0, fx[e.LOAD_DRY] != 0.0, mode, z[k.IM]):
        mode = k.mode_at_start(plant, spring, fx, mode, command, z)
    acts = command
    if plant.drive == k.CURRENT:  # the matrices are linear in what acts
        acts = min(max(command, -plant.current_limit), plant.current_limit)
    while True:
        now, end = begin + done + slack, row_s
        if fx[e.PULSE] != 0.0:
            if (fx[e.PULSE_START] <= now and now < fx[e.PULSE_END]) != mode.pulse:
                mode = k.switched(plant, spring, fx, mode, z, acts, k.PULSE_SWITCH)
            for edge in (fx[e.PULSE_START] - begin, fx[e.PULSE_END] - begin):
                if done + slack < edge and edge < end - slack:
                    end = edge
        mode, region, status = _advance(
            plant, spring, fx, mode, region, acts, done, end - done, row_s, z, trial,
            force, series, ready, systems, steps, times,
        )  # fmt: skip
        if status != DONE or end >= row_s:
            return mode, region, status
        done = end


@njit(error_model="numpy")
def _region_of(spring, deflection):
    region = 0
    while region < spring.shape[0] - 1 and deflection > spring[region, UPPER]:
        region += 1
    return region


@njit(error_model="numpy")
def loop(
    plant, spring, fx, controller, parameters, state, grid, time, reference, angle,
    speed, start, timed, log,
):  # fmt: skip
    """Run the sampled loop; `log` (N_LOG, n) is filled. Returns (status, last row)."""
    rows, regions, row_s = reference.shape[0], spring.shape[0], grid.row_s
    n_modes = 3 * 3 * 2 * 2 * 3 * 2 * regions
    ready = np.zeros(n_modes, np.int64)  # levels of a mode, 0 where it has not been met
    systems = np.empty((n_modes, COLUMNS, LANES))  # A, b, c, e: time derivatives
    steps = np.empty((n_modes, LEVELS, COLUMNS, LANES))  # of lengths h/2^level, transposed
    z, trial, force_work = np.zeros(k.N_STATES), np.zeros(max(k.N_STATES, LANES)), np.zeros(3)
    series = np.zeros((TERMS + 1, LANES))
    y, slopes = np.zeros(k.N_STATES), np.zeros((1, k.N_STATES))
    power = np.zeros(k.N_INTEGRALS)
    signals, times = np.zeros(k.N_SIGNALS), np.zeros(4)
    answer, waiting, acting = np.zeros(k.N_COMMANDS), np.zeros(k.N_COMMANDS), np.zeros(k.N_COMMANDS)
    elastic = plant.structure == k.ELASTIC_FREE or plant.structure == k.ELASTIC_HELD
    algebraic = plant.inductance == 0.0 or plant.drive not in (k.DUTY, k.VOLTAGE)
    wheel_dry, load_dry = fx[e.WHEEL_DRY] != 0.0, fx[e.LOAD_DRY] != 0.0
    worm = fx[e.GEAR_DRIVE_LOSS] != 0.0 or fx[e.GEAR_BACKDRIVE_LOSS] != 0.0
    # what has to be looked at with care each row: a given motion, a pulse, a current that follows
    # its command at once
    limited = plant.current_limit < np.inf
    careful = angle.size > 0 or fx[e.PULSE] != 0.0 or (limited and algebraic)
    careful = careful or plant.structure == k.RIGID_HELD
    gravity, offset, ratio = plant.gravity, plant.gravity_offset, plant.gear_ratio
    motor_count, load_count = plant.motor_count, plant.load_count
    limit_A, edge, most = plant.current_limit, plant.contact_angle, grid.command_limit
    z[k.TW], z[k.TL] = start
    i, tw, ww, tl, wl = 0.0, start[0], 0.0, start[1], 0.0
    region = _region_of(spring, tw - tl)
    mode, command, until_sample = k.first_mode(plant, fx, z, grid.start_s), 0.0, 0
    about, sine_about, cosine_about = np.inf, 0.0, 1.0  # gravity's sine near an angle, by series
    index, known, sticks, lower, upper = 0, False, False, -np.inf, np.inf
    for row in range(rows):
        anchor, c0, c1 = spring[region, ANCHOR], spring[region, C0], spring[region, C1]
        torque = c0 + c1 * (tw - tl - anchor)
        if not elastic:
            torque = _joint_torque(plant, spring, fx, mode, command, z, y, slopes, power)
        motor_angle = tw * ratio
        signals[k.REFERENCE] = reference[row, 0]
        signals[k.REFERENCE_RATE] = reference[row, 1]
        signals[k.REFERENCE_ACCELERATION] = reference[row, 2]
        signals[k.READ_MOTOR_ANGLE] = _quantised(motor_angle, motor_count)
        signals[k.READ_LOAD_ANGLE] = _quantised(tl, load_count)
        signals[k.READ_CURRENT] = i
        signals[k.TRUE_MOTOR_ANGLE], signals[k.TRUE_LOAD_ANGLE] = motor_angle, tl
        signals[k.TRUE_TORQUE] = torque
        signals[k.TRUE_MOTOR_VELOCITY], signals[k.TRUE_LOAD_VELOCITY] = ww * ratio, wl
        if until_sample == 0:
            until_sample = grid.rows_per_sample
            controller(parameters, state, signals, answer)
            for m in range(k.N_COMMANDS):
                acting[m] = waiting[m] if grid.delay_samples == 1 else answer[m]
                waiting[m] = answer[m]
            acting[k.COMMAND] = min(max(acting[k.COMMAND], -most), most)
            command = e.acting_command(fx, acting[k.COMMAND])
        until_sample -= 1
        log[k.IM, row], log[k.TW, row], log[k.WW, row] = i, tw, ww
        log[k.TL, row], log[k.WL, row], log[LOG_TORQUE, row] = tl, wl, torque
        log[LOG_COMMAND, row], log[LOG_UNSATURATED, row] = acting[k.COMMAND], acting[k.UNSATURATED]
        for m in range(4):
            if timed[m]:  # memory that is not touched costs nothing
                log[LOG_TIMES + m, row] = times[m]
        if row + 1 == rows:
            break
        if not abs(time[row + 1] - time[row] - row_s) <= UNEVEN * row_s:
            return NOT_EVEN, row
        # a step of the whole row where nothing comes near a switch, else the careful way
        quick = known and abs(i) < limit_A
        if quick:
            force = rate = curve = 0.0
            if gravity != 0.0:
                turned = tl - about
                if not abs(turned) < NEAR:
                    about, turned = tl, 0.0
                    sine_about, cosine_about = np.sin(tl + offset), np.cos(tl + offset)
                square = turned * turned
                small = turned * (
                    1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0))
                )
                less = 0.5 * square * (1.0 - square / 12.0 * (1.0 - square / 30.0))
                sine = sine_about + (cosine_about * small - sine_about * less)
                cosine = cosine_about - (sine_about * small + cosine_about * less)
                force, rate = -gravity * sine, -gravity * cosine * wl
                acceleration = (
                    systems[index, k.TW, k.WL] * tw
                    + systems[index, k.TL, k.WL] * tl
                    + systems[index, k.WL, k.WL] * wl
                    + systems[index, k.IM, k.WL] * i
                    + systems[index, k.WW, k.WL] * ww
                    + systems[index, COMMAND, k.WL] * command
                    + systems[index, CONSTANT, k.WL]
                    + systems[index, FORCE, k.WL] * force
                )
                curve = -gravity * (cosine * acceleration - sine * wl * wl)
            i1 = _sum(steps, index, k.IM, command, i, tw, ww, tl, wl, force, rate, curve)
            tw1 = _sum(steps, index, k.TW, command, i, tw, ww, tl, wl, force, rate, curve)
            ww1 = _sum(steps, index, k.WW, command, i, tw, ww, tl, wl, force, rate, curve)
            tl1 = _sum(steps, index, k.TL, command, i, tw, ww, tl, wl, force, rate, curve)
            wl1 = _sum(steps, index, k.WL, command, i, tw, ww, tl, wl, force, rate, curve)
            quick = abs(i1) <= limit_A and (tl1 > edge) == mode.contact
            quick = quick and mode.wheel * ww1 >= 0.0 and mode.load * wl1 >= 0.0
            if elastic:
                quick = quick and lower <= tw1 - tl1 <= upper
            after = c0 + c1 * (tw1 - tl1 - anchor)
            if worm:
                quick = quick and mode.torque_sign * after >= 0.0
            if sticks:
                push = plant.torque_per_ampere * i1 - after
                way, sign = (1 if push > 0.0 else -1), (1 if after > 0.0 else -1)
                quick = quick and abs(push) <= e.gear_friction(fx, way, 0.0, after, sign)
        if quick:
            i, tw, ww, tl, wl = i1, tw1, ww1, tl1, wl1
            times[1] += row_s if mode.contact else 0.0
            times[2] += row_s if sticks else 0.0
            if algebraic or not elastic:
                z[k.IM], z[k.TW], z[k.WW], z[k.TL], z[k.WL] = i, tw, ww, tl, wl
        else:
            z[k.IM], z[k.TW], z[k.WW], z[k.TL], z[k.WL] = i, tw, ww, tl, wl
            begin = grid.start_s + row * row_s
            if angle.size > 0:
                mode = _given_motion(plant, mode, angle, speed, row, row_s, begin, z)
            mode, region, status = _row(
                plant, spring, fx, mode, region, command, begin, row_s, z, trial, force_work,
                series, ready, systems, steps, times,
            )  # fmt: skip
            if status != DONE:
                return status, row
            i, tw, ww, tl, wl = z[k.IM], z[k.TW], z[k.WW], z[k.TL], z[k.WL]
            index = _index(mode, region, regions)
            known = ready[index] != 0 and not careful and mode.limited == 0
            known = known and not (load_dry and mode.load == 0)
            sticks = wheel_dry and mode.wheel == 0
            known = known and not (sticks and (algebraic or not elastic))
            lower = spring[region - 1, UPPER] if region > 0 else -np.inf
            upper = spring[region, UPPER]
        if algebraic:
            i, _ = k.current_and_voltage(plant, fx, mode, command, z)
            z[k.IM] = i
        if not np.isfinite(ww + tl + i + wl):
            return NOT_FINITE, row
    return DONE, rows - 1


def _cached(version):
    def run(
        plant, spring, fx, controller, parameters, state, grid, time, reference, angle, speed,
        start, timed, log,
    ):  # fmt: skip
        if version < 0:
            return NOT_FINITE, 0
        return loop(
            plant, spring, fx, controller, parameters, state, grid, time, reference, angle,
            speed, start, timed, log,
        )  # fmt: skip

    return njit(cache=True, nogil=True, error_model="numpy")(run)


run = _cached(SOURCE_VERSION)
"""run(plant, spring, fx, controller, parameters, state, grid, time, reference, angle,
speed, start, timed, log) -> (status, last row)

Compiled. `time` is (n,), `reference` (n, 3), `angle` and `speed` (n,) a held load's motion or
(0,), `start` the wheel's and the load's angle, `timed` says which of the four times a log keeps.
"""
