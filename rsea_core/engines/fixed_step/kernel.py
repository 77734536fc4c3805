"""The fixed-step engine: one compiled kernel for every effect, switched by its numbers.

A step of length h, of second order with its events:

    positions go half a step with the speeds so far; torques of positions are taken there
    current      exact exponential under the mean speed of the step, its mean acts on the gear
    each body    J (w+ - w) = h (torque - damping (w+ + w)/2 - dry friction), solved in closed form
                 with the stop inside the step (`body_steps`): a stuck body has speed zero
    positions    go on with the mean of both speeds, spring memory follows the deflection

Laws of the speed (Stribeck, arctangent, quadratic drag, damping between bodies) are evaluated
at the step's mean speed as the acceleration of the last step foresees it, which is of second
order; where that does not say enough (the first step, backlash, links, the losses of a rigid
worm), at the mean speed of a first pass. The event-driven engine is the oracle; the error of this
one is measured by `benchmarks/step_halving.py`.

The kernel runs over the rows of a recording, so that a machine's numbers and states stay in
registers from row to row: its stages (`stages`) are inlined by LLVM. It is called through its
address (`cfunc`): numba compiles what a function calls anew into every caller, and this kernel
takes most of the time to compile. A closed loop runs inside it for the same reason: entering it
anew for every row took longer than the row.
"""

import functools
from typing import NamedTuple

import numpy as np
from numba import cfunc, float64, int64, njit, types

import rsea_core.engines.event_driven.states as k
import rsea_core.engines.fixed_step.closed_loop as cl
import rsea_core.engines.fixed_step.layout as at
import rsea_core.engines.fixed_step.stages as s
import rsea_core.engines.fixed_step.step_inputs as i
import rsea_core.engines.fixed_step.step_torques as t
import rsea_core.engines.fixed_step.winding as w
from rsea_core.effects.gear_transmission_error import angle_error
from rsea_core.numeric.source_version import SOURCE_VERSION
from rsea_core.numeric.unowned import unowned

HUGE = 1e100
A, T, N = float64[::1], float64[:, ::1], int64[::1]
MODEL = types.BaseTuple.from_types((A, T, A, N), at.ModelArrays)
COLUMNS = types.BaseTuple.from_types((A, N, A, A, A, A, A, A, A), at.Columns)
CARRIED = types.BaseTuple.from_types((A, A), at.Carried)
RECORD = types.BaseTuple.from_types((T, T), at.Record)
LOOP = types.BaseTuple.from_types((N, A, A, A, T, A, A, A), at.Loop)
CONTROLLER = types.FunctionType(k.CONTROLLER)
SIGNATURE = int64(MODEL, COLUMNS, int64, int64, CARRIED, RECORD, CONTROLLER, LOOP)


class State(NamedTuple):
    """What goes from row to row of a run beside the spring's memory and temperatures in `y`."""

    bodies: s.Bodies
    winding: w.Winding
    spring: t.Spring
    motions: tuple[i.Motion, i.Motion]  # of load and gear where they are given
    latest: int  # row whose command acts
    gains_of: float  # time that the gains of the Maxwell branches are of


@njit(error_model="numpy", forceinline=True)
def _readings(machine, fx, torque, current, bodies, case_rise):
    """What a row reads, `layout.CHANNELS`."""
    ratio, load, load_speed = machine.plant.gear_ratio, bodies.load, bodies.load_speed
    if machine.rigid and machine.transmission_error and not machine.load_given:
        error, slope = angle_error(fx, load, ratio)
        load, load_speed = load + error, (1.0 + slope) * load_speed
    return (
        bodies.gear * ratio,
        load,
        torque,
        current,
        case_rise,
        bodies.gear_speed * ratio,
        load_speed,
    )


@njit(error_model="numpy", forceinline=True)
def _keep(out, row, read):
    """Write readings into a row; one by one: a tuple by a changing index is a switch."""
    out[row, 0], out[row, 1], out[row, 2], out[row, 3] = read[0], read[1], read[2], read[3]
    out[row, 4], out[row, 5], out[row, 6] = read[4], read[5], read[6]


@njit(error_model="numpy", forceinline=True)
def _in_range(bodies, current, winding_rise, command):
    """Whether a state is made of numbers."""
    size = abs(current) + abs(bodies.gear) + abs(bodies.gear_speed) + abs(bodies.load)
    size += abs(bodies.load_speed)
    size += abs(winding_rise) + abs(command)
    return size < HUGE


@njit(error_model="numpy", forceinline=True)
def _through_row(machine, model, columns, kept, row, state):
    """The state after a row, which is cut where a late command begins to act."""
    fx, y, carried, steps = model.fx, kept.y, kept.more, columns.steps[row.index]
    bodies, winding, spring, motions, latest, gains_of = state
    offset = 0.0
    if machine.full:
        motions = i.given_motions(columns, row.index, row.length, motions)
    while offset < row.length:
        piece, offset, latest = i.piece_of(
            machine, fx, row, columns.time, columns.command, steps, offset, latest
        )
        winding = w.winding_in_piece(machine, fx, y, piece, winding)
        if machine.internal and w.rounded(piece.half) != gains_of:
            gains_of = w.rounded(piece.half)
            t.branch_gains(fx, gains_of, carried)
        heat = 0.0
        for step in range(piece.n):
            start = step * piece.h
            middle = s.middle_of(machine, piece, motions, bodies, start)
            spring = t.spring_in_middle(machine, fx, y, model.spring, carried, spring, middle)
            applied = t.applied_in_middle(machine, fx, piece, middle, bodies, start)
            factor, mean = applied.factor, middle.gear_mean
            winding = w.winding_in_step(machine, fx, piece, winding, factor, mean)
            if machine.servo:
                winding = w.goal_in_step(
                    machine, fx, piece, winding, bodies.gear, bodies.gear_speed
                )
            moved, current, mean_current = s.solve_step(
                machine, fx, piece, middle, spring, applied, winding, bodies
            )
            heat += mean_current * mean_current
            winding = w.with_current(winding, current)
            bodies = s.bodies_after(machine, piece, middle, moved, bodies)
            spring = t.spring_after(machine, fx, y, carried, spring, bodies)
        winding = w.winding_after(machine, fx, y, piece, winding, bodies.gear_speed, heat)
        if machine.full and offset < row.length:
            motions = i.later(motions[0], piece.length), i.later(motions[1], piece.length)
    return State(bodies, winding, spring, motions, latest, gains_of)


def kernel(full: bool, version: int):
    """The function to be compiled: with every effect, or for plain machines (`layout.PLAIN`)."""

    def advance(model, columns, first, last, kept, record, controller, loop):
        model, columns, loop = unowned(model), unowned(columns), unowned(loop)
        kept, (out, states), time = unowned(kept), unowned(record), columns.time
        y, carried, asked = kept.y, kept.more, 0.0 + version * 0.0
        machine = at.machine_of(model, full)
        bodies = s.bodies_of(machine, y, carried)
        winding = w.winding_of(machine, model.fx, y, y[at.CURRENT])
        spring = t.spring_of(machine, model.fx, bodies)
        motions = i.standing(bodies.load), i.standing(bodies.load)
        latest, row, status = int(carried[at.LATEST]), first, at.DONE
        state = State(bodies, winding, spring, motions, latest, -1.0)
        while True:
            bodies, winding, spring, motions, latest, gains_of = state
            spring = t.spring_in_row(machine, model.fx, y, model.spring, spring, bodies)
            current, fx, rise = winding.current, model.fx, y[at.CASE_RISE]
            read = _readings(machine, fx, spring.torque, current, bodies, rise)
            if out.shape[0] > 0:
                _keep(out, row - first, read)
            in_range = _in_range(bodies, winding.current, y[at.WINDING_RISE], asked)
            if not in_range and row > first:
                out[row - first :] = np.nan
                status = row
                break
            if loop.reference.shape[0] > 0:
                asked = cl.sample(machine.plant, row, time, read, asked, controller, loop)
                columns.command[row] = asked
                if out.shape[0] > 0:
                    out[row - first, at.N_CHANNELS] = asked
            if row == last or states.shape[0] > 0:
                s.keep_state(machine, bodies, winding.current, y)
                if states.shape[0] > 0:
                    states[row - first] = y[: at.N_STEP_STATES]
                if row == last:
                    break
            given = i.row_of(machine.plant, row, time, columns.supply, columns.enabled)
            state = State(bodies, winding, spring, motions, latest, gains_of)
            state = _through_row(machine, model, columns, kept, given, state)
            row += 1
        carried[at.LATEST], carried[at.JOINT] = latest, bodies.joint
        carried[at.GEAR_ACCELERATION] = bodies.gear_acceleration
        carried[at.LOAD_ACCELERATION] = bodies.load_acceleration
        return status

    return advance


@functools.cache
def engine(full: bool):
    """The compiled kernel with every effect, or the one for plain machines (`layout.PLAIN`).

    advance(model, columns, first, last, kept, record, controller, loop) runs rows first..last
    from the state at row first; the answer is DONE or the row whose state is no number.

    model, columns, kept, record, loop : the tuples of `layout`
        `model.on` is filled by `find_features`; `kept.y` is the state at row first, then that at
        row last; `record` has a row for each of first..last, or none; `out` in a loop has the
        command as last column. A loop's commands fill `columns.command`.
    controller : function of the signature `equations.CONTROLLER`
    """
    return _Kernel(cfunc(SIGNATURE, cache=True, error_model="numpy")(kernel(full, SOURCE_VERSION)))


class _Kernel:
    """A compiled kernel as an argument; numba finds a `cfunc`'s own type anew at every call."""

    _numba_type_ = types.FunctionType(SIGNATURE)

    def __init__(self, compiled):
        self._compiled = compiled  # kept alive

    def __wrapper_address__(self) -> int:
        return self._compiled.address

    def signature(self):
        return SIGNATURE
