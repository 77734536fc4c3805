"""What effects of the spring have in common."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rsea_core.effects.curve import EffectCurve
from rsea_core.effects.slots import block
from rsea_core.effects.variant import TrialMachine, Values
from rsea_core.machine.spring_table import table_torque

KNEE = block("knee", 4)


NEEDS_SPRING = "needs a spring between wheel and load"


@njit(cache=True, error_model="numpy")
def _spring_torques(regions, deflections):
    """Torques (n,) of a spring table."""
    return np.array([table_torque(regions, d) for d in deflections])


def _drawn(d: TrialMachine, v: Values, x: NDArray) -> NDArray:
    return _spring_torques(d.regions, x)


def draw_spring() -> EffectCurve:
    """The elastic law with its change."""
    return EffectCurve(
        title="Torque of the spring", x_label="deflection (rad)", y_label="torque (Nm)",
        over="deflection", evaluate=_drawn,
    )  # fmt: skip
