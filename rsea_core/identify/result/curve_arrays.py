"""Laws of the engine over an array of speeds, angles or torques, for drawing them.

Compiled once and kept: called one by one from Python, the engine's laws are compiled anew by
every process.
"""

import numpy as np
from numba import njit

import rsea_core.effects.layout as e
import rsea_core.engines.fixed_step.step_torques as t
from rsea_core.engines.fixed_step.layout import N_GAINS, N_STEP_STATES
from rsea_core.engines.fixed_step.step_inputs import pulse_share


@njit(cache=True, error_model="numpy")
def ascending(fx, bends):
    """Torques (n,) of the spring's memory along growing deflections, after a turn at the first.

    No time passes: branches that relax have none to.
    """
    y = np.zeros(N_STEP_STATES)
    gains = np.zeros(N_GAINS)
    found = np.empty(bends.size)
    for change in np.diff(np.concatenate((np.zeros(1), bends, bends[::-1]))):
        t.remember(fx, y, change, gains)
    last = bends[0]
    for j, deflection in enumerate(bends):
        t.remember(fx, y, deflection - last, gains)
        found[j], last = t.remembered_torque(fx, y), deflection
    return found


@njit(cache=True, error_model="numpy")
def pulses(fx, times, step):
    """Torques (n,) of a push on the load over steps that begin at times (n,)."""
    return fx[e.PULSE] * np.array([pulse_share(fx, t, step) for t in times])
