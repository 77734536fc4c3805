"""What effects of the load have in common."""

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.curve import EffectCurve
from rsea_core.effects.hooks import summed
from rsea_core.effects.variant import TrialMachine, Values

HELD = ("locked", "imposed")  # loads that no torque moves


def _drawn(d: TrialMachine, v: Values, x: NDArray) -> NDArray:
    plant = d.machine_numbers
    more = summed("load_torque", d.fx, x, 0.0 * x)
    return more - plant.gravity * np.sin(x + plant.gravity_offset)


def draw_over_angle() -> EffectCurve:
    """All that pulls on the load where it is, gravity included."""
    return EffectCurve(
        title="Torque that pulls on the load where it is", x_label="load angle (rad)",
        y_label="torque (Nm)", over="load_angle", evaluate=_drawn,
    )  # fmt: skip
