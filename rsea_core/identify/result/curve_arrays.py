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
from rsea_core.machine.spring_table import table_torque


@njit(cache=True, error_model="numpy")
def dead_time_volts(fx, plant, currents):
    """Volts (n,) that the dead time of a bridge takes."""
    return np.array([e.dead_time_volts(fx, plant, i) for i in currents])


@njit(cache=True, error_model="numpy")
def acting_commands(fx, commands):
    """Duties (n,) that act."""
    return np.array([e.acting_command(fx, u) for u in commands])


@njit(cache=True, error_model="numpy")
def gear_friction(fx, speeds):
    """Dry and smooth friction (n,) of motor and gear at wheel speeds, without viscous damping."""
    found = np.empty(speeds.size)
    for j, w in enumerate(speeds):
        dry = np.sign(w) * e.gear_coulomb(fx, 1 if w > 0 else -1, w) if w != 0.0 else 0.0
        found[j] = dry + e.gear_smooth_friction(fx, w)
    return found


@njit(cache=True, error_model="numpy")
def carried_friction(fx, torques):
    """Friction (n,) of a gear that turns forward under torques."""
    return np.array([e.gear_friction(fx, 1, 1.0, t, 1.0 if t > 0 else -1.0) for t in torques])


@njit(cache=True, error_model="numpy")
def wheel_torques(fx, angles):
    """Torques (n,) of the motor's angle on the wheel."""
    return np.array([e.wheel_torque(fx, w) for w in angles])


@njit(cache=True, error_model="numpy")
def spring_torques(regions, bends):
    """Torques (n,) of a spring table."""
    return np.array([table_torque(regions, bend) for bend in bends])


@njit(cache=True, error_model="numpy")
def ascending(fx, bends):
    """Torques (n,) of the spring's memory along growing deflections, after a turn at the first.

    No time passes: branches that relax have none to.
    """
    y = np.zeros(N_STEP_STATES)
    gains = np.zeros(N_GAINS)
    found = np.empty(bends.size)
    for way in np.diff(np.concatenate((np.zeros(1), bends, bends[::-1]))):
        t.remember(fx, y, way, gains)
    last = bends[0]
    for j, bend in enumerate(bends):
        t.remember(fx, y, bend - last, gains)
        found[j], last = t.remembered_torque(fx, y), bend
    return found


@njit(cache=True, error_model="numpy")
def load_friction(fx, speeds):
    """Dry friction (n,) of the load's joint."""
    return np.array([np.sign(w) * e.load_coulomb(fx, w) for w in speeds])


@njit(cache=True, error_model="numpy")
def load_torques(fx, angles, speeds):
    """Torques and drags (2, n) of terms on the load at angles and speeds (n,)."""
    found = np.empty((2, angles.size))
    for j in range(angles.size):
        found[0, j], found[1, j] = e.load_torque(fx, angles[j], speeds[j], 0.0)[:2]
    return found


@njit(cache=True, error_model="numpy")
def pulses(fx, times, step):
    """Torques (n,) of a push on the load over steps that begin at times (n,)."""
    return fx[e.PULSE] * np.array([pulse_share(fx, t, step) for t in times])


@njit(cache=True, error_model="numpy")
def contact_torques(fx, stiffness, depths):
    """Torques (n,) of a nonlinear contact at rest."""
    return np.array([e.contact_torque(fx, stiffness, z, 0.0)[0] for z in depths])
