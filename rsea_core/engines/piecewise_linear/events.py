"""Located events of the exact engine: rows cut where the mode must change; compiled.

A step of the whole row, or of its halves, is taken by the matrices of `modes`. Where a switch has
acted by its end, or by its values at start, middle and end could have acted and gone back within
it, it is halved; at the finest level the switch is located on the Taylor series of the state. The
switches are those of the event-driven engine (`events`) and the ends of the spring's region.
"""

import numpy as np
from numba import njit

import rsea_core.effects.layout as e
import rsea_core.engines.event_driven.events as sw
import rsea_core.engines.event_driven.states as k
import rsea_core.engines.piecewise_linear.modes as pm
import rsea_core.engines.piecewise_linear.taylor as taylor
import rsea_core.machine.plant as mp
from rsea_core.machine.spring_table import UPPER

DONE, NOT_FINITE, TOO_MANY_EVENTS, TOO_STIFF, NOT_EVEN = range(5)
MAX_EVENTS_PER_ROW = 1000
EVENT_TOLERANCE = 1e-14  # of the row's length
PARABOLAS = 6  # through which a highest value is looked for
GRAZE = 1e-9  # of a value's range: less above zero is rounding
SLIVER = 1e-9  # of a row: pieces cut by a time are not shorter
# switches beyond those of the event-driven engine: the spring's region ends
UPPER_SWITCH, LOWER_SWITCH = k.N_EVENTS, k.N_EVENTS + 1


@njit(error_model="numpy", forceinline=True)
def _value(machine, mode, region, command, y, switch):
    """Negative while mode and region hold, above zero where this switch must change them."""
    plant, spring, fx = machine.plant, machine.spring, machine.fx
    if switch < UPPER_SWITCH:
        return sw.switch_value(plant, spring, fx, mode, command, 0.0, y, switch)
    deflection = (y[k.TB] if fx[e.BACKLASH] > 0.0 else y[k.TW]) - y[k.TL]
    if switch == UPPER_SWITCH:
        return deflection - spring[region, UPPER]
    return spring[region - 1, UPPER] - deflection if region > 0 else -1.0


@njit(error_model="numpy")
def _values(machine, mode, region, command, y, found):
    for j in range(machine.event_kinds.size):
        found[j] = _value(machine, mode, region, command, y, machine.event_kinds[j])


@njit(error_model="numpy", forceinline=True)
def _may_switch(values, first, last):
    """Whether a switch could act between the first and the last row of values.

    By a quarter of what its values differ it could have gone beyond them: a parabola by an eighth.
    """
    for j in range(values.shape[1]):
        low = high = values[first, j]
        for row in range(first + 1, last + 1):
            low, high = min(low, values[row, j]), max(high, values[row, j])
        if high + 0.25 * (high - low) > 0.0:
            return True
    return False


@njit(error_model="numpy", forceinline=True)
def _matrix_step(machine, modes, work, mode, region, slot, level, command):
    """Whether a step of a level by the matrices goes through without a switch; to work.trial."""
    smooth = pm.step(machine, modes, work, slot, level, command, work.trial)
    _values(machine, mode, region, command, work.trial, work.values[2])
    if not smooth:
        return False
    for j in range(machine.event_kinds.size):
        if work.values[2, j] > 0.0:
            return False
    pm.step(machine, modes, work, slot, level + 1, command, work.middle)
    _values(machine, mode, region, command, work.middle, work.values[1])
    return not _may_switch(work.values, 0, 2)


@njit(error_model="numpy")
def _value_at(machine, work, mode, region, command, switch, time):
    """A switch's value after some time of the series."""
    taylor.series_at(machine, work, time, work.middle)
    return _value(machine, mode, region, command, work.middle, switch)


@njit(error_model="numpy")
def _highest(machine, work, mode, region, command, switch, ends, length):
    """Time at which a value that is not above zero at both ends is above it, and that value.

    By parabolas through three points (Brent, Algorithms for Minimization without Derivatives, 1973,
    chapter 5). (-1, 0) where there is none, or none beyond rounding.
    """
    a, b, c = 0.0, 0.5 * length, length
    va, vc = ends
    vb = _value_at(machine, work, mode, region, command, switch, b)
    reach = max(va, vb, vc) - min(va, vb, vc)
    if max(va, vb, vc) + 0.25 * reach <= 0.0:
        return -1.0, 0.0
    for _ in range(PARABOLAS):
        if vb > GRAZE * reach:
            return b, vb
        left, right = (b - a) * (vb - vc), (b - c) * (vb - va)
        if not left - right > 0.0:  # not concave
            return -1.0, 0.0
        top = b - 0.5 * ((b - a) * left - (b - c) * right) / (left - right)
        if not (a < top < c) or top == b:
            return -1.0, 0.0
        v = _value_at(machine, work, mode, region, command, switch, top)
        if v > vb:
            a, va, c, vc = (a, va, b, vb) if top < b else (b, vb, c, vc)
            b, vb = top, v
        elif top < b:
            a, va = top, v
        else:
            c, vc = top, v
    return -1.0, 0.0


@njit(error_model="numpy")
def _locate(machine, work, mode, region, command, length, tolerance):
    """First switch within a step of the series: (switch or -1, its time); to work.trial."""
    first, taken, out = -1, length, work.trial
    for place in range(machine.event_kinds.size):
        switch = machine.event_kinds[place]
        taylor.series_at(machine, work, taken, out)
        at_high = _value(machine, mode, region, command, out, switch)
        at_low, until = work.values[0, place], taken
        if not at_high > 0.0:
            until, at_high = _highest(
                machine, work, mode, region, command, switch, (at_low, at_high), taken
            )
            if until < 0.0:
                continue
        low, high, last = 0.0, until, 0
        for iteration in range(200):
            if high - low <= tolerance:
                break
            middle = 0.5 * (low + high)
            if iteration % 4 != 3 and at_high > at_low:
                secant = high - at_high * (high - low) / (at_high - at_low)
                if low < secant < high:
                    middle = min(max(secant, low + 0.5 * tolerance), high - 0.5 * tolerance)
            taylor.series_at(machine, work, middle, out)
            value = _value(machine, mode, region, command, out, switch)
            if value > 0.0:
                high, at_high = middle, value
                at_low = 0.5 * at_low if last == 1 else at_low
                last = 1
            else:
                low, at_low = middle, value
                at_high = 0.5 * at_high if last == -1 else at_high
                last = -1
        first, taken = switch, high
    taylor.series_at(machine, work, taken, out)
    return first, taken


@njit(error_model="numpy")
def _switched(machine, mode, region, y, command, switch):
    """Mode and region after a switch."""
    if switch == UPPER_SWITCH:
        return mode, region + 1
    if switch == LOWER_SWITCH:
        return mode, region - 1
    plant, spring, fx = machine.plant, machine.spring, machine.fx
    return sw.switched(plant, spring, fx, mode, y, command, switch), region


@njit(error_model="numpy", forceinline=True)
def _count(machine, work, mode, taken):
    fx, times = machine.fx, work.times
    times[0] += taken if mode.limited != 0 else 0.0
    times[1] += taken if mode.contact else 0.0
    times[2] += taken if mode.wheel == 0 and fx[e.WHEEL_DRY] != 0.0 else 0.0
    times[3] += taken if mode.load == 0 and fx[e.LOAD_DRY] != 0.0 else 0.0


@njit(error_model="numpy", inline="always")
def _advance(machine, modes, work, mode, region, command, at, length):
    """Move y on by a piece of a row, `at` seconds into it: (mode, region, status)."""
    row_s, left, level, event_count, fresh, slot = modes.row_s, length, 0, 0, True, -1
    while left > 1e-15 * row_s:
        if fresh:
            slot = pm.slot_of(machine, modes, work, mode, region)
            if slot < 0:
                return mode, region, TOO_STIFF
            pm.force_at(machine, modes, work, mode, slot, command, at + length - left)
            _values(machine, mode, region, command, work.y, work.values[0])
            fresh = False
        finest = modes.levels[slot] - 2  # the last level is for the middles of these
        step = row_s / 2.0**level
        while step > left and level <= finest:
            level += 1
            step *= 0.5
        switch, taken = -1, step
        if level > finest or not _matrix_step(
            machine, modes, work, mode, region, slot, level, command
        ):
            if level < finest:
                level += 1
                continue
            taylor.taylor_series(machine, modes, work, slot, command)
            taken = taylor.length_of_series(machine, work, min(step, left))
            switch, taken = _locate(
                machine, work, mode, region, command, taken, EVENT_TOLERANCE * row_s
            )
        work.y[:] = work.trial
        left -= taken
        fresh = True
        _count(machine, work, mode, taken)
        work.fastest[0] = max(work.fastest[0], abs(work.y[k.WL]))
        if switch >= 0:
            mode, region = _switched(machine, mode, region, work.y, command, switch)
            level = 0
            event_count += 1
            if event_count > MAX_EVENTS_PER_ROW:
                return mode, region, TOO_MANY_EVENTS
    return mode, region, DONE


@njit(error_model="numpy", forceinline=True)
def _must_look(machine, mode, current):
    """Whether a new command can change the mode: something sticks, or the current is limited."""
    plant, fx = machine.plant, machine.fx
    looks = fx[e.WHEEL_DRY] != 0.0 and mode.wheel == 0
    looks = looks or (fx[e.LOAD_DRY] != 0.0 and mode.load == 0) or fx[e.INTERNAL_STATES] != 0.0
    if plant.current_limit < np.inf:
        at_limit = mode.limited != 0 or abs(current) >= plant.current_limit
        looks = looks or at_limit or plant.inductance == 0.0
    return looks or plant.drive == mp.CURRENT


@njit(error_model="numpy", inline="always")
def advance_piece(machine, modes, work, mode, region, command, at, end):
    """From `at` to `end` seconds into a row, cut where the disturbance begins or ends."""
    plant, spring, fx, slack = machine.plant, machine.spring, machine.fx, SLIVER * modes.row_s
    if _must_look(machine, mode, work.y[k.IM]):
        mode = sw.mode_at_start(plant, spring, fx, mode, command, work.y)
    acts, begin, status = command, mode.row_time, DONE
    if plant.drive == mp.CURRENT:  # the matrices are linear in what acts
        acts = min(max(command, -plant.current_limit), plant.current_limit)
    while at < end and status == DONE:
        now, until = begin + at + slack, end
        if fx[e.PULSE] != 0.0:
            if (fx[e.PULSE_START] <= now and now < fx[e.PULSE_END]) != mode.pulse:
                mode = sw.switched(plant, spring, fx, mode, work.y, acts, k.PULSE_SWITCH)
            for edge in (fx[e.PULSE_START] - begin, fx[e.PULSE_END] - begin):
                if at + slack < edge and edge < until - slack:
                    until = edge
        mode, region, status = _advance(machine, modes, work, mode, region, acts, at, until - at)
        at = until
    return mode, region, status


@njit(error_model="numpy")
def region_of(spring, deflection):
    """The region of the spring's table that a deflection is in."""
    region = 0
    while region < spring.shape[0] - 1 and deflection > spring[region, UPPER]:
        region += 1
    return region
