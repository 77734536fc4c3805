"""Located events of the exact propagator: rows cut where the mode must change; compiled.

A step of the whole row, or of its halves, is taken by the matrices of `propagator_modes`. Where a
switch is over at its end it is halved, and at the finest level the switch is located on the Taylor
series of the state. The switches are the kernel's and the ends of the spring's region.
"""

import numpy as np
from numba import njit

import rsea_core.effects.layout as e
import rsea_core.engines.event_driven.events as sw
import rsea_core.engines.event_driven.states as k
import rsea_core.engines.piecewise_linear.modes as pm
import rsea_core.machine.plant as mp
from rsea_core.machine.spring_table import ANCHOR, C0, C1, UPPER

DONE, NOT_FINITE, TOO_MANY_SWITCHES, TOO_STIFF, NOT_EVEN = range(5)
MAX_SWITCHES_PER_ROW = 1000
EVENT_TOLERANCE = 1e-14  # of the row's length
# switches beyond the kernel's: the spring's region ends
UPPER_SWITCH, LOWER_SWITCH = k.N_SWITCHES, k.N_SWITCHES + 1


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
    if sw.switch_value(plant, spring, fx, mode, command, 0.0, z, k.CURRENT_SWITCH) > 0.0:
        return False
    if fx[e.WHEEL_DRY] != 0.0:
        if mode.wheel != 0:
            if mode.wheel * z[k.WW] < 0.0:
                return False
        elif sw.switch_value(plant, spring, fx, mode, command, 0.0, z, k.WHEEL_SWITCH) > 0.0:
            return False
        if fx[e.GEAR_DRIVE_LOSS] != 0.0 or fx[e.GEAR_BACKDRIVE_LOSS] != 0.0:
            torque = spring[region, C0]
            torque += spring[region, C1] * (z[k.TW] - z[k.TL] - spring[region, ANCHOR])
            if mode.torque_sign * torque < 0.0:
                return False
    if fx[e.LOAD_DRY] != 0.0:
        if mode.load != 0:
            return mode.load * z[k.WL] >= 0.0
        value = sw.switch_value(plant, spring, fx, mode, command, 0.0, z, k.LOAD_SWITCH)
        return not value > 0.0
    return True


@njit(error_model="numpy")
def _value(plant, spring, fx, mode, region, command, elastic, z, switch):
    if switch >= UPPER_SWITCH:
        if not elastic:
            return -1.0
        return _outside(spring, region, z)[switch - UPPER_SWITCH]
    if switch == k.PULSE_SWITCH:  # rows are cut there
        return -1.0
    return sw.switch_value(plant, spring, fx, mode, command, 0.0, z, switch)


@njit(error_model="numpy")
def _locate(plant, spring, fx, mode, region, command, elastic, series, length, tolerance, out):
    """First switch within a step: (switch or -1, its time); the state there goes to out."""
    first, taken = -1, length
    for switch in range(k.N_SWITCHES + 2):
        pm.series_at(series, taken, out)
        at_high = _value(plant, spring, fx, mode, region, command, elastic, out, switch)
        if not at_high > 0.0:
            continue
        pm.series_at(series, 0.0, out)
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
            pm.series_at(series, middle, out)
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
    pm.series_at(series, taken, out)
    return first, taken


@njit(error_model="numpy")
def _switched(plant, spring, fx, mode, region, z, command, switch):
    """Mode and region after a switch."""
    if switch == UPPER_SWITCH:
        return mode, region + 1
    if switch == LOWER_SWITCH:
        return mode, region - 1
    return sw.switched(plant, spring, fx, mode, z, command, switch), region


@njit(error_model="numpy")
def _advance(
    plant, spring, fx, mode, region, command, at, length, row_s, z, trial, force,
    series, ready, systems, steps, times,
):  # fmt: skip
    """Move the state on by a piece of a row, `at` seconds into it: (mode, region, status)."""
    regions = spring.shape[0]
    elastic = plant.structure == mp.ELASTIC_FREE or plant.structure == mp.ELASTIC_HELD
    left, level, switches = length, 0, 0
    while left > 1e-15 * row_s:
        index = pm.index_of(mode, region, regions)
        if ready[index] == 0:
            made = pm.make_mode(
                plant, spring, fx, mode, region, row_s, ready, systems, steps, index
            )
            if not made:
                return mode, region, TOO_STIFF
        finest = ready[index] - 1
        step = row_s / 2.0**level
        while step > left and level <= finest:
            level += 1
            step *= 0.5
        pm.force_at(plant, mode, systems, index, command, at + length - left, z, force)
        switch, taken, by_series = -1, step, level > finest
        if not by_series:
            pm.apply_step(steps, index, level, command, force, z, trial)
            if not _holds(plant, spring, fx, mode, region, command, elastic, trial):
                if level < finest:
                    level += 1
                    continue
                by_series = True
        if by_series:
            pm.taylor_series(systems[index], command, force, z, series)
            switch, taken = _locate(
                plant, spring, fx, mode, region, command, elastic, series, min(step, left),
                EVENT_TOLERANCE * row_s, trial,
            )  # fmt: skip
        for m in range(pm.N):
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


@njit(error_model="numpy")
def must_look(plant, wheel_dry, load_dry, mode, current):
    """Whether a new command can change the mode: something sticks, or the current is limited."""
    looks = (wheel_dry and mode.wheel == 0) or (load_dry and mode.load == 0)
    if plant.current_limit < np.inf:
        at_limit = mode.limited != 0 or abs(current) >= plant.current_limit
        looks = looks or at_limit or plant.inductance == 0.0
    return looks or plant.drive == mp.CURRENT


@njit(error_model="numpy")
def advance_row(
    plant, spring, fx, mode, region, command, begin, row_s, z, trial, force, series,
    ready, systems, steps, times,
):  # fmt: skip
    """One row from `begin` on, cut where the disturbance begins or ends."""
    slack, done = 1e-9 * row_s, 0.0
    if must_look(plant, fx[e.WHEEL_DRY] != 0.0, fx[e.LOAD_DRY] != 0.0, mode, z[k.IM]):
        mode = sw.mode_at_start(plant, spring, fx, mode, command, z)
    acts = command
    if plant.drive == mp.CURRENT:  # the matrices are linear in what acts
        acts = min(max(command, -plant.current_limit), plant.current_limit)
    while True:
        now, end = begin + done + slack, row_s
        if fx[e.PULSE] != 0.0:
            if (fx[e.PULSE_START] <= now and now < fx[e.PULSE_END]) != mode.pulse:
                mode = sw.switched(plant, spring, fx, mode, z, acts, k.PULSE_SWITCH)
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
def region_of(spring, deflection):
    region = 0
    while region < spring.shape[0] - 1 and deflection > spring[region, UPPER]:
        region += 1
    return region
