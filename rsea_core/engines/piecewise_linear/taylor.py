"""The state as a Taylor series in time within a step, on which an event is located; compiled."""

import numpy as np
from numba import njit

import rsea_core.engines.event_driven.states as k
import rsea_core.engines.piecewise_linear.modes as pm

LARGEST_REST = 1e-13  # rad: last term of the load's Taylor series


@njit(error_model="numpy")
def taylor_series(machine, modes, work, slot, command):
    """The state's Taylor coefficients in time from y on, into work.series (TERMS + 1, lanes)."""
    system, series, gravity_sines = modes.systems[slot], work.series, work.gravity_sines
    states, gravity, held = machine.states, machine.plant.gravity, pm.is_held(machine.plant)
    n = states.size
    for j in range(n):
        series[0, j] = work.y[states[j]]
    angle = work.y[k.TL] + machine.plant.gravity_offset
    gravity_sines[0, 0], gravity_sines[1, 0] = np.sin(angle), np.cos(angle)
    inverse = 1.0  # of the order
    for order in range(pm.TERMS):
        pm.apply_system(system, n, series[order], work.moved)
        force = work.force[order] if held and order < 2 else 0.0
        if not held and gravity != 0.0:
            if order > 0:
                sine = cosine = 0.0
                for i in range(1, order + 1):
                    turn = i * series[i, k.TL]
                    sine += turn * gravity_sines[1, order - i]
                    cosine -= turn * gravity_sines[0, order - i]
                gravity_sines[0, order] = sine * inverse
                gravity_sines[1, order] = cosine * inverse
            force = -gravity * gravity_sines[0, order]
        given = 1.0 if order == 0 else 0.0
        inverse = 1.0 / (order + 1)
        for j in range(n):
            value = work.moved[j] + system[pm.FORCE, j] * force
            value += given * (system[pm.COMMAND, j] * command + system[pm.CONSTANT, j])
            series[order + 1, j] = value * inverse


@njit(error_model="numpy")
def length_of_series(machine, work, length):
    """How far the Taylor series holds, at most `length`: gravity's own does not end."""
    if machine.plant.gravity == 0.0 or pm.is_held(machine.plant):
        return length
    last = abs(work.series[pm.TERMS, k.TL])
    while last * length**pm.TERMS > LARGEST_REST:
        length *= 0.5
    return length


@njit(error_model="numpy")
def series_at(machine, work, time, out):
    """The state by its series goes to out."""
    series, states = work.series, machine.states
    out[:] = work.y
    for j in range(states.size):
        value = series[pm.TERMS, j]
        for order in range(pm.TERMS - 1, -1, -1):
            value = value * time + series[order, j]
        out[states[j]] = value
