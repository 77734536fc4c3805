"""The fast engine: one compiled fixed-step kernel for every effect, switched by its numbers.

A step of length h, of second order with its events:

    positions go half a step with the speeds so far; position torques are taken there
    current      exact exponential under the mean speed of the step, its mean acts on the wheel
    each body    J (w+ - w) = h (push - drag (w+ + w)/2 - dry friction), solved in closed form
                 with the stop inside the step (`step_laws`): a stuck body has speed zero
    positions    go on with the mean of both speeds, spring memory follows the deflection

Laws of the speed (Stribeck, arctangent, quadratic drag, damping between bodies) are evaluated
at the step's mean speed as the acceleration of the last step foresees it, which is of second
order; where that does not say enough (the first step, play, links, the losses of a rigid worm),
at the mean speed of a first pass. The precise engine (`integrator`) is the oracle; the error
of this one is measured by `benchmarks/step_halving.py`.

The kernel runs over the rows of a recording, so that a machine's numbers and states stay in
registers from row to row. It is called through its address (`cfunc`): numba compiles what a
function calls anew into every caller, and this kernel takes most of the time to compile. A
closed loop runs inside it for the same reason: entering it anew for every row took longer than
the row.
"""

import functools

from numba import cfunc, float64, int64, types

import rsea_core.engines.event_driven.states as k
from rsea_core.engines.fixed_step.kernel import DONE, kernel
from rsea_core.numeric.source_version import SOURCE_VERSION

__all__ = ("DONE", "engine")

A, T, N = float64[::1], float64[:, ::1], int64[::1]
CONTROLLER = types.FunctionType(k.CONTROLLER)
SIGNATURE = int64(
    A, T, A, N, A, N, A, A, A, A, A, A, A, int64, int64, A, A, T, T,
    CONTROLLER, N, A, A, A, T, A, A, A,
)  # fmt: skip


@functools.cache
def engine(full: bool):
    """The compiled kernel with every effect, or the one for plain machines (`p.PLAIN`).

    advance(plant, spring, fx, on, time, steps, command, supply, enabled, load_angle, load_rate,
    wheel_angle, wheel_rate, first, last, kept, y, out, states, controller, loop, limits,
    parameters, memory_of_it, reference, signals, answers, metrics) runs rows first..last from the
    state y at row first; the answer is DONE or the row whose state is no number.

    plant : (22,) array, the fields of `kernel.Plant`; spring, fx : as `step_numbers.Numbers`
    on : (N_SWITCHES,) array that `step_parts.find_switches` fills
    time .. wheel_rate : (n,) arrays or, but the first three, (0,): `step_rows.Columns`
    kept : (N_CARRIED,) array of what goes from call to call beside the state
    y : (N_STEP_STATES,) array, the state at row first, then that at row last
    out : (last - first + 1 or 0, N_CHANNELS or more) array, filled; in a loop with the command
        as last column
    states : (last - first + 1, N_STEP_STATES) array to be filled, or one without rows
    controller .. metrics : of a closed loop, whose commands fill `command`; without rows of
        `reference` there is none. See `step_judge.closed_loop`.
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
