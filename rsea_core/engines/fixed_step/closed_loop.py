"""Closed loops by the fast engine, judged while they run; compiled."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

import rsea_core.engines.event_driven.states as k
import rsea_core.engines.fixed_step.body_moves as s
import rsea_core.engines.fixed_step.control_sample as judge
import rsea_core.engines.fixed_step.rows as rows
import rsea_core.engines.fixed_step.step_inputs as p
from rsea_core.engines.fixed_step.compile_kernel import DONE
from rsea_core.numeric.source_version import SOURCE_VERSION

PER_ROW = 11  # numbers of sensors by row: noise and truth of three, rates of two, errors of three


class Scratch(NamedTuple):
    """Memory that one thread's loops work in, owned by the caller (see `step_rows.unowned`)."""

    on: NDArray
    carried: NDArray
    none: NDArray
    unkept: NDArray
    signals: NDArray
    answers: NDArray
    commands: NDArray
    loop: NDArray
    limits: NDArray


def scratch(n: int, loop: list[int], limits: list[float]) -> Scratch:
    """Memory for loops of n rows; loop, limits: as `step_judge` names them, up to what it fills."""
    loop, limits = [*loop], [*limits, *[0.0] * (judge.N_LIMITS - len(limits))]
    loop += [0] * (judge.N_LOOP - len(loop))
    if loop[judge.WIDTH] > 0:
        limits += [0.0] * (3 * loop[judge.WIDTH] + PER_ROW * n)
    return Scratch(
        on=np.zeros(p.N_SWITCHES, np.int64),
        carried=np.zeros(p.N_CARRIED),
        none=np.zeros(0),
        unkept=np.zeros((0, s.N_STEP_STATES)),
        signals=np.zeros(k.N_SIGNALS),
        answers=np.zeros(judge.N_ANSWERS),
        commands=np.zeros(n),
        loop=np.array(loop, np.int64),
        limits=np.array(limits),
    )


def _cached(version):
    def run_loops(
        plain, full, plants, springs, ends, fx, time, steps, controller, parameters, states,
        references, seed, starts, metrics, out, status, sensors, work, begin, end,
    ):  # fmt: skip
        on, carried, none = rows.unowned(work.on), rows.unowned(work.carried), work.none
        loop, limits = rows.unowned(work.loop), rows.unowned(work.limits)
        answers, n = rows.unowned(work.answers), time.size
        for j in range(begin, end):
            np.random.seed((seed + j) % 4294967296 + version * 0)
            model = j if plants.shape[0] > 1 else 0
            spring = springs[(ends[model - 1] if model > 0 else 0) : ends[model]]
            kept = out[j] if out.shape[0] > 0 else out[0:0].reshape(0, p.N_CHANNELS + 1)
            reference = rows.unowned(references[j if references.shape[0] > 1 else 0])
            found, y = rows.unowned(metrics[j]), rows.unowned(starts[j])
            rows.prepare(p.as_plant(plants[model]), spring, fx[model], y, on, carried)
            rows.on_the_given_motion(on, none, none, none, none, 0, y)
            if sensors.shape[0] > 0:
                for m in range(sensors.shape[1]):
                    limits[judge.N_LIMITS + m] = sensors[model, m]
            holds = judge.prepare(loop, limits, reference, answers, found)
            status[j] = (plain if on[p.PLAIN] != 0 else full)(
                rows.unowned(plants[model]), rows.unowned(spring), rows.unowned(fx[model]), on,
                rows.unowned(time), rows.unowned(steps), rows.unowned(work.commands), none, none,
                none, none, none, none, 0, n - 1, carried, y, rows.unowned(kept),
                rows.unowned(work.unkept), controller, loop, limits, rows.unowned(parameters[j]),
                rows.unowned(states[j]), reference, rows.unowned(work.signals), answers, found,
            )  # fmt: skip
            if status[j] == DONE:
                judge.finish(found, n - loop[judge.FIRST], holds and limits[judge.HEIGHT] != 0.0)
            else:
                found[:] = np.nan

    return njit(cache=True, nogil=True, error_model="numpy")(run_loops)


run_loops = _cached(SOURCE_VERSION)
"""Runs begin..end - 1 of a batch, each by its own parameters, state and random numbers.

sensors (models or 0, 3 width + 3 n): numbers and noise of what stands before the controller.
"""
