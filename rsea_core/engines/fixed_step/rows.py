"""Jobs of the fixed-step engine: start states, runs of windows, states along a motion; compiled.

A job is a window of one recording run by one set of numbers from one start state. Jobs are
independent and each writes its own rows, so that results do not depend on the threads.
"""

from typing import NamedTuple

import numpy as np
from numba import cfunc, njit
from numpy.typing import NDArray

import rsea_core.effects.layout as e
import rsea_core.engines.event_driven.states as k
import rsea_core.engines.fixed_step.layout as at
import rsea_core.engines.fixed_step.step_torques as t
import rsea_core.machine.plant as mp
from rsea_core.engines.fixed_step.body_steps import clip
from rsea_core.engines.fixed_step.winding import warm_up
from rsea_core.numeric.source_version import SOURCE_VERSION
from rsea_core.numeric.unowned import unowned

SWING_STEP, MOST_SWING_STEPS = 0.2, 64  # rad of a link's swing, of one row


class Kernels(NamedTuple):
    """The compiled kernels, `kernel.engine`."""

    plain: object
    full: object


class Jobs(NamedTuple):
    """Windows to be run."""

    rows: NDArray  # (n, 4) of int: model, first row, last row, row of `Record.out` for the first
    starts: NDArray  # (n, N_STEP_STATES), overwritten
    status: NDArray  # (n,) of int, filled


class Path(NamedTuple):
    """A given motion."""

    time: NDArray  # (n,)
    motion: NDArray  # (n, 5) current, gear angle and speed, load angle and speed
    kept: NDArray  # (w,) rows whose states are kept, increasing


@njit(error_model="numpy")
def start_state(plant, fx, gear, load, y):
    """A machine at rest without current and with relaxed branches, brought there once."""
    for m in range(at.N_STEP_STATES):
        y[m] = 0.0
    y[at.GEAR], y[at.LOAD], y[at.LINK] = gear, load, load
    half = 0.5 * fx[e.BACKLASH]
    y[at.OUTPUT] = min(max(load, gear - half), gear + half) if half > 0.0 else gear
    y[at.WINDING_RISE], y[at.CASE_RISE] = fx[e.START_WINDING], fx[e.START_CASE]
    deflection = t.deflection_of(fx, plant.gear_ratio, y[at.OUTPUT], load)
    pieces, gains = 200, np.zeros(at.N_GAINS)
    t.branch_gains(fx, 1.0, gains)
    for _ in range(pieces):
        t.remember(fx, y, deflection / pieces, gains)
    y[at.BRANCH : at.BRANCH + e.N_BRANCHES] = 0.0


@njit(error_model="numpy")
def resting_joint(plant, fx, y):
    """Torque between the two sides of a rigid machine that starts without command."""
    hanging = y[at.LOAD] + plant.gravity_offset
    load = plant.load_torque - plant.gravity * np.sin(hanging)
    hold = fx[e.GEAR_FORWARD] + fx[e.LOAD_COULOMB]
    if fx[e.LOAD_DRY] != 0.0:
        hold += t.load_port(fx, hanging, 0.0)
    if abs(load) <= hold or plant.structure == mp.RIGID_HELD:
        return -load
    inertia = plant.load_inertia * e.inertia_factor(fx, y[at.LOAD])[0]
    return inertia * load / (plant.inertia + inertia) - load


@njit(error_model="numpy")
def model_of(models, j, on):
    """The arrays of one of several models, with switches (N_FEATURES,) to be filled."""
    first = models.ends[j - 1] if j > 0 else 0
    spring = models.springs[first : models.ends[j]]
    return at.ModelArrays(models.plants[j], spring, models.fx[j], on)


@njit(error_model="numpy")
def prepare(model, y, carried):
    """What the kernel needs before its first call for a start state: switches, what it carries."""
    plant = at.as_plant(model.plant)
    at.find_features(plant, model.spring, model.fx, model.on)
    carried[at.LATEST], carried[at.JOINT] = -1.0, resting_joint(plant, model.fx, y)
    carried[at.GEAR_ACCELERATION] = carried[at.LOAD_ACCELERATION] = np.nan


@njit(error_model="numpy")
def to_given_motion(on, columns, row, y):
    """Put the bodies whose motion is given where they are at a row."""
    if on[at.LOAD_GIVEN] != 0 and columns.load_angle.size > 0:
        y[at.LOAD], y[at.LOAD_SPEED] = columns.load_angle[row], columns.load_speed[row]
    if on[at.GEAR_GIVEN] != 0:
        y[at.GEAR], y[at.GEAR_SPEED] = y[at.LOAD], y[at.LOAD_SPEED]
        if columns.gear_angle.size > 0:
            y[at.GEAR], y[at.GEAR_SPEED] = columns.gear_angle[row], columns.gear_speed[row]


@cfunc(k.CONTROLLER, cache=True)
def no_controller(parameters, state, signals, command):
    """The controller of an open loop, which is never called."""


def _cached(version):
    def run_jobs(kernels, models, columns, jobs, record, controller, begin, end):
        on, carried = np.zeros(at.N_FEATURES + version * 0, np.int64), np.zeros(at.N_CARRIED)
        none, never, unfollowed = np.zeros(0), np.zeros(0, np.int64), np.zeros((0, 3))
        no_loop = at.Loop(never, none, none, none, unfollowed, none, none, none)
        for j in range(begin, end):
            of, first, last, row = jobs.rows[j]
            rows, y = last - first + 1, jobs.starts[j]
            kept = record.states[row : row + rows] if record.states.shape[0] > 0 else record.states
            model = model_of(models, of, on)
            prepare(model, y, carried)
            to_given_motion(on, columns, first, y)
            jobs.status[j] = (kernels.plain if on[at.PLAIN] != 0 else kernels.full)(
                model, columns, first, last, at.Carried(y, carried),
                at.Record(record.out[row : row + rows], kept), controller, no_loop,
            )  # fmt: skip

    return njit(cache=True, nogil=True, error_model="numpy")(run_jobs)


run_jobs = _cached(SOURCE_VERSION)
"""run_jobs(kernels, models, columns, jobs, record, controller, begin, end), compiled: jobs
begin..end - 1.

kernels : `Kernels`; models : `layout.Models`; columns : `layout.Columns`; jobs : `Jobs`; record :
`layout.Record` of all jobs; controller : `no_controller`.
"""


@njit(error_model="numpy", cache=True)
def starts_at_rest(plants, fx, motor_angle, load_angle, starts):
    """Start states (n, N_STEP_STATES) at rest for each model."""
    for j in range(starts.shape[0]):
        plant = at.as_plant(plants[j])
        start_state(plant, fx[j], motor_angle / plant.gear_ratio, load_angle, starts[j])


@njit(error_model="numpy", cache=True, nogil=True)
def warm(models, path, starts, states, begin, end):
    """Internal states of models begin..end - 1 along a given motion.

    models : `layout.Models`
    path : `Path`
    starts : (m, N_STEP_STATES) array, overwritten
    states : (m, w, N_STEP_STATES) array, filled
    """
    for j in range(begin, end):
        _warm(
            unowned(models.plants[j]), unowned(models.fx[j]), unowned(path),
            unowned(starts[j]), unowned(states[j]),
        )  # fmt: skip


@njit(error_model="numpy")
def _swing(fx, y, load, speed, h):
    """Move the outer part of a flexible link while the load goes from (load, speed) to that of y.

    Implicit midpoint in steps of a share of its swing: no row is too long for it.
    """
    stiffness, damping = fx[e.LINK_STIFFNESS] / fx[e.LINK_INERTIA], fx[e.LINK_DAMPING]
    damping /= fx[e.LINK_INERTIA]
    steps = min(int(h * np.sqrt(stiffness) / SWING_STEP) + 1, MOST_SWING_STEPS)
    d = h / steps
    for j in range(steps):
        part = (j + 0.5) / steps
        base = load + part * (y[at.LOAD] - load)
        base_speed = speed + part * (y[at.LOAD_SPEED] - speed)
        old = y[at.LINK_SPEED]
        torque = stiffness * (base - y[at.LINK]) + damping * base_speed
        mean = (old + 0.5 * d * torque) / (1.0 + 0.5 * d * damping + 0.25 * d * d * stiffness)
        y[at.LINK] += d * mean
        y[at.LINK_SPEED] = 2.0 * mean - old


@njit(error_model="numpy")
def _warm(plant_numbers, fx, path, y, states):
    time, motion, rows = path
    plant = at.as_plant(plant_numbers)
    half = 0.5 * fx[e.BACKLASH]
    thermal, deflection = fx[e.WINDING_CAPACITY] > 0.0, 0.0
    memory = np.zeros(at.N_GAINS)
    gains = unowned(memory)
    kept = 0
    for row in range(rows[-1] + 1):
        for m in range(motion.shape[1]):  # a slice would count references
            y[at.CURRENT + m] = motion[row, m]
        gear, load = y[at.GEAR], y[at.LOAD]
        if half > 0.0:
            near = y[at.OUTPUT] if row > 0 else load
            y[at.OUTPUT] = min(max(near, gear - half), gear + half)
            touching = abs(gear - y[at.OUTPUT]) >= half
            y[at.OUTPUT_SPEED] = y[at.GEAR_SPEED] if touching else y[at.LOAD_SPEED]
        else:
            y[at.OUTPUT], y[at.OUTPUT_SPEED] = gear, y[at.GEAR_SPEED]
        if row > 0 and fx[e.LINK_STIFFNESS] > 0.0 and fx[e.LINK_INERTIA] > 0.0:
            _swing(fx, y, motion[row - 1, 3], motion[row - 1, 4], time[row] - time[row - 1])
        else:
            y[at.LINK], y[at.LINK_SPEED] = load, y[at.LOAD_SPEED]
        now = t.deflection_of(fx, plant.gear_ratio, y[at.OUTPUT], load)
        if row > 0:
            h = time[row] - time[row - 1]
            t.branch_gains(fx, h, gains)
            t.remember(fx, y, now - deflection, gains)
            moved, swung = gear - motion[row - 1, 1], load - motion[row - 1, 3]
            y[at.GEAR_DEFLECTION] = clip(y[at.GEAR_DEFLECTION] + moved, fx[e.GEAR_PRESLIDING])
            y[at.LOAD_DEFLECTION] = clip(y[at.LOAD_DEFLECTION] + swung, fx[e.LOAD_PRESLIDING])
            if thermal:
                resistance = plant.resistance * (1.0 + fx[e.RESISTANCE_RISE] * y[at.WINDING_RISE])
                warm_up(fx, y, resistance * motion[row - 1, 0] ** 2, h)
        deflection = now
        if row == rows[kept]:
            for m in range(at.N_STEP_STATES):
                states[kept, m] = y[m]
            kept += 1
    memory[0] = 0.0  # kept until here: `gains` does not
