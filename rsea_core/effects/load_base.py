"""What effects of the load have in common."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

import rsea_core.effects.layout as e
from rsea_core.effects.curve import EffectCurve
from rsea_core.effects.variant import Draft, Values

HELD = ("locked", "imposed")  # loads that no torque moves


@njit(cache=True, error_model="numpy")
def load_torques(fx, angles, speeds):
    """Torques and drags (2, n) of effects on the load at angles and speeds (n,)."""
    found = np.empty((2, angles.size))
    for j in range(angles.size):
        found[0, j], found[1, j] = e.load_torque(fx, angles[j], speeds[j], 0.0)[:2]
    return found


def _drawn(d: Draft, v: Values, x: NDArray) -> NDArray:
    plant = d.machine_numbers
    more = load_torques(d.fx, x, 0.0 * x)[0]
    return more - plant.gravity * np.sin(x + plant.gravity_offset)


def draw_over_angle() -> EffectCurve:
    """All that pulls on the load where it is, gravity included."""
    return EffectCurve(
        title="Torque that pulls on the load where it is", x_label="load angle (rad)",
        y_label="torque (Nm)", over="load_angle", evaluate=_drawn,
    )  # fmt: skip
