"""Rows of the fast engine: inputs held from row to row, readings, restarts; compiled.

A job is a window of one recording run by one set of numbers from one start state. Jobs are
independent and each writes its own rows, so that results do not depend on the threads.
"""

from typing import NamedTuple

import numpy as np
from numba import cfunc, njit
from numba.core import cgutils
from numba.extending import intrinsic
from numpy.typing import NDArray

import rsea_core.effects.layout as e
import rsea_core.engines.event_driven.states as k
import rsea_core.engines.fixed_step.body_moves as s
import rsea_core.engines.fixed_step.step_inputs as p
import rsea_core.machine.plant as mp
from rsea_core.numeric.source_version import SOURCE_VERSION


class Columns(NamedTuple):
    """What is known of every row; columns that a recording does not have are empty."""

    time: NDArray  # (n,)
    steps: NDArray  # (n,) steps within each row, the last unused
    command: NDArray  # (n,)
    supply: NDArray  # (n,) or (0,) measured supply [V]
    enabled: NDArray  # (n,) or (0,) 0 where the bridge is open
    load_angle: NDArray  # (n,) or (0,) of a given load
    load_speed: NDArray
    wheel_angle: NDArray  # (n,) or (0,) of a given wheel (a spring bench)
    wheel_speed: NDArray


@njit(error_model="numpy")
def start_state(plant, fx, wheel, load, y):
    """A machine at rest without current and with relaxed branches, brought there once."""
    for m in range(s.N_STEP_STATES):
        y[m] = 0.0
    y[s.WHEEL], y[s.LOAD], y[s.LINK] = wheel, load, load
    half = 0.5 * fx[e.BACKLASH]
    y[s.OUTPUT] = min(max(load, wheel - half), wheel + half) if half > 0.0 else wheel
    y[s.WINDING_RISE], y[s.CASE_RISE] = fx[e.START_WINDING], fx[e.START_CASE]
    deflection = p.deflection_of(fx, plant.gear_ratio, y[s.OUTPUT], load)
    pieces, gains = 200, np.zeros(s.N_GAINS)
    s.branch_gains(fx, 1.0, gains)
    for _ in range(pieces):
        s.remember(fx, y, deflection / pieces, gains)
    y[s.BRANCH : s.BRANCH + e.N_BRANCHES] = 0.0


@njit(error_model="numpy")
def resting_joint(plant, fx, y):
    """Torque between the two sides of a rigid machine that starts without command."""
    load = plant.load_torque - plant.gravity * np.sin(y[s.LOAD] + plant.gravity_offset)
    hold = fx[e.GEAR_FORWARD] + fx[e.LOAD_COULOMB]
    if abs(load) <= hold or plant.structure == mp.RIGID_HELD:
        return -load
    return plant.load_inertia * load / (plant.inertia + plant.load_inertia) - load


@intrinsic
def unowned(typing_context, array):
    """The same array without an owner, so that passing it on counts no references.

    The counting is atomic and takes as long as a step. Whoever calls keeps the memory alive.
    """

    def build(context, builder, signature, arguments):
        found = context.make_array(array)(context, builder, arguments[0])
        found.meminfo = cgutils.get_null_value(found.meminfo.type)
        found.parent = cgutils.get_null_value(found.parent.type)
        return found._getvalue()

    return array(array), build


@njit(error_model="numpy")
def prepare(plant, spring, fx, y, on, carried):
    """What the kernel needs before its first call for a start state: switches, what it carries."""
    p.find_switches(plant, spring, fx, on)
    carried[p.LATEST], carried[p.JOINT] = -1.0, resting_joint(plant, fx, y)
    carried[p.WHEEL_RATE] = carried[p.LOAD_RATE] = np.nan


@njit(error_model="numpy")
def on_the_given_motion(on, load_angle, load_rate, wheel_angle, wheel_rate, row, y):
    """Put the bodies whose motion is given where they are at a row."""
    if on[p.LOAD_GIVEN] != 0 and load_angle.size > 0:
        y[s.LOAD], y[s.LOAD_SPEED] = load_angle[row], load_rate[row]
    if on[p.WHEEL_GIVEN] != 0:
        y[s.WHEEL], y[s.WHEEL_SPEED] = y[s.LOAD], y[s.LOAD_SPEED]
        if wheel_angle.size > 0:
            y[s.WHEEL], y[s.WHEEL_SPEED] = wheel_angle[row], wheel_rate[row]


@cfunc(k.CONTROLLER, cache=True)
def no_controller(parameters, state, signals, command):
    """The controller of an open loop, which is never called."""


def _cached(version):
    def run_jobs(
        plain, full, plants, springs, ends, fx, columns, jobs, starts, out, states, status,
        controller, begin, end,
    ):  # fmt: skip
        on, carried = np.zeros(p.N_SWITCHES, np.int64), np.zeros(p.N_CARRIED)
        none, never, unfollowed = np.zeros(0), np.zeros(0, np.int64), np.zeros((0, 3))
        for j in range(begin, end):
            model, first, last, at = jobs[j]
            spring = springs[(ends[model - 1] if model > 0 else version * 0) : ends[model]]
            rows = last - first + 1
            kept = states[at : at + rows] if states.shape[0] > 0 else states
            prepare(p.as_plant(plants[model]), spring, fx[model], starts[j], on, carried)
            on_the_given_motion(
                on, columns.load_angle, columns.load_speed, columns.wheel_angle,
                columns.wheel_speed, first, starts[j],
            )  # fmt: skip
            status[j] = (plain if on[p.PLAIN] != 0 else full)(
                plants[model], spring, fx[model], on, columns.time, columns.steps,
                columns.command, columns.supply, columns.enabled, columns.load_angle,
                columns.load_speed, columns.wheel_angle, columns.wheel_speed, first, last,
                carried, starts[j], out[at : at + rows], kept, controller, never, none, none,
                none, unfollowed, none, none, none,
            )  # fmt: skip

    return njit(cache=True, nogil=True, error_model="numpy")(run_jobs)


run_jobs = _cached(SOURCE_VERSION)
"""run_jobs(plain, full, plants, springs, ends, fx, columns, jobs, starts, out, states, status,
controller, begin, end), compiled: jobs begin..end - 1.

plain, full: the kernels of `stepping.engine`; plants (m, plant numbers), springs (all
regions, 6) whose model j ends at row ends[j], fx (m, N_EFFECTS); jobs (n, 4) of model, first
row, last row, row of `out` where it writes; starts (n, N_STEP_STATES) overwritten, out (rows,
N_CHANNELS), states (rows or 0, N_STEP_STATES), status (n,); controller: `no_controller`.
"""


@njit(error_model="numpy", cache=True)
def starts_at_rest(plants, fx, motor_angle, load_angle, starts):
    """Start states (n, N_STEP_STATES) at rest for each model."""
    for j in range(starts.shape[0]):
        plant = p.as_plant(plants[j])
        start_state(plant, fx[j], motor_angle / plant.gear_ratio, load_angle, starts[j])


@njit(error_model="numpy", cache=True, nogil=True)
def warm(plants, fx, time, path, at, starts, states, begin, end):
    """Internal states of models begin..end - 1 along a given motion.

    plants (m, plant numbers), fx (m, N_EFFECTS)
    path : (n, 5) array of current, wheel angle and speed, load angle and speed
    at : (w,) array of the rows that are kept, increasing
    starts : (m, N_STEP_STATES) array, overwritten
    states : (m, w, N_STEP_STATES) array, filled
    """
    for j in range(begin, end):
        _warm(
            unowned(plants[j]), unowned(fx[j]), unowned(time), unowned(path), unowned(at),
            unowned(starts[j]), unowned(states[j]),
        )  # fmt: skip


@njit(error_model="numpy")
def _warm(plant_numbers, fx, time, path, at, y, states):
    plant = p.as_plant(plant_numbers)
    half = 0.5 * fx[e.BACKLASH]
    thermal, deflection = fx[e.WINDING_CAPACITY] > 0.0, 0.0
    memory = np.zeros(s.N_GAINS)
    gains = unowned(memory)
    kept = 0
    for row in range(at[-1] + 1):
        for m in range(path.shape[1]):  # a slice would count references
            y[s.CURRENT + m] = path[row, m]
        wheel, load = y[s.WHEEL], y[s.LOAD]
        if half > 0.0:
            near = y[s.OUTPUT] if row > 0 else load
            y[s.OUTPUT] = min(max(near, wheel - half), wheel + half)
            touching = abs(wheel - y[s.OUTPUT]) >= half
            y[s.OUTPUT_SPEED] = y[s.WHEEL_SPEED] if touching else y[s.LOAD_SPEED]
        else:
            y[s.OUTPUT], y[s.OUTPUT_SPEED] = wheel, y[s.WHEEL_SPEED]
        y[s.LINK], y[s.LINK_SPEED] = load, y[s.LOAD_SPEED]
        now = p.deflection_of(fx, plant.gear_ratio, y[s.OUTPUT], load)
        if row > 0:
            h = time[row] - time[row - 1]
            s.branch_gains(fx, h, gains)
            s.remember(fx, y, now - deflection, gains)
            moved, swung = wheel - path[row - 1, 1], load - path[row - 1, 3]
            y[s.GEAR_STRETCH] = s.clip(y[s.GEAR_STRETCH] + moved, fx[e.GEAR_PRESLIDING])
            y[s.LOAD_STRETCH] = s.clip(y[s.LOAD_STRETCH] + swung, fx[e.LOAD_PRESLIDING])
            if thermal:
                resistance = plant.resistance * (1.0 + fx[e.RESISTANCE_RISE] * y[s.WINDING_RISE])
                s.warm_up(fx, y, resistance * path[row - 1, 0] ** 2, h)
        deflection = now
        if row == at[kept]:
            for m in range(s.N_STEP_STATES):
                states[kept, m] = y[m]
            kept += 1
    memory[0] = 0.0  # kept until here: `gains` does not
