"""Columns of laws that follow the measured motion, through the linear machine.

A torque on the wheel that is periodic in the motor's angle makes a replay diverge from the
recording; no small amplitude in a replay shows it. Fed with the *measured* angle it is a known
signal at a port, and its innovations follow exactly from the linear machine.
"""

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg import expm

import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
from rsea_core.engines.linear.linearise import linear_plant
from rsea_core.identify.fitting.problem import PreparedRecording, machine_of
from rsea_core.identify.smoothing.error_model import moving_states, one_body, reading_row
from rsea_core.numeric.threads import share_out


def torque_columns(
    prepared: PreparedRecording, stiffness: float, signals: NDArray, port: str
) -> NDArray:
    """Innovations (m, blocks, channels) that torques (m, rows) on a body would cause.

    The torque of row k acts until row k + 1.

    Parameters
    ----------
    port : "G" or "L"
        On the wheel or on the load.
    """
    plant = machine_of(prepared.base)
    linear = linear_plant(
        plant, tangent=stiffness, gravity_stiffness=plant.gravity, in_contact=False
    )
    states = moving_states(plant)
    d = len(states)
    A = np.array(linear.A)[np.ix_(states, states)]
    on, inertia = (k.WW, plant.inertia) if port == "G" else (k.WL, plant.load_inertia)
    if plant.structure == mp.RIGID_FREE:
        A = one_body(linear.A)[np.ix_(states, states)]
        on, inertia = k.WW, plant.inertia + plant.load_inertia
    if on not in states:  # a body that is held, as the wheel of a locked rig without a spring
        return prepared.whitener(np.zeros((len(signals), signals.shape[1], len(prepared.channels))))
    input_gain = np.zeros(d)
    input_gain[states.index(on)] = 1.0 / inertia
    block = np.zeros((d + 1, d + 1))
    block[:d, :d], block[:d, d] = A, input_gain
    power = expm(block * prepared.recording.sample_time_s)
    C = np.array([reading_row(plant, stiffness, name, states, d) for name in prepared.channels])
    out = np.empty((len(signals), signals.shape[1], len(prepared.channels)))
    begins = np.zeros(signals.shape[1], bool)
    if prepared.windows is not None:
        begins[prepared.windows.rows[:, 0]] = True
    given = np.ascontiguousarray(signals), power[:d, :d].copy(), power[:d, d].copy(), C, begins

    def run(begin: int, end: int) -> None:
        _respond(*given, out, begin, end)

    share_out(run, len(signals))
    return prepared.whitener(out)


def periodic_columns(angle: NDArray, cycles: Sequence[int]) -> NDArray:
    """Sine and cosine (2 m, rows) of multiples of an angle."""
    columns = []
    for c in cycles:
        columns += [np.sin(c * angle), np.cos(c * angle)]
    return np.array(columns)


@njit(cache=True, nogil=True, error_model="numpy")
def _respond(signals, A, input_gain, C, begins, out, begin, end):
    n = signals.shape[1]
    d, p = A.shape[0], C.shape[0]
    for j in range(begin, end):
        x, z = np.zeros(d), np.zeros(d)
        for t in range(n):
            if begins[t]:
                x[:] = 0.0
            for i in range(p):
                s = 0.0
                for a in range(d):
                    s += C[i, a] * x[a]
                out[j, t, i] = s
            for a in range(d):
                s = input_gain[a] * signals[j, t]
                for b in range(d):
                    s += A[a, b] * x[b]
                z[a] = s
            for a in range(d):
                x[a] = z[a]
