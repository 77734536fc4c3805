"""A torque on the load that depends on where it is, by a smooth table."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter
from rsea_core.effects.hooks import hook
from rsea_core.effects.slots import block, slots
from rsea_core.errors import TermError
from rsea_core.numeric.uniform_spline import steepest, uniform_spline

N_POSITIONS = 32  # nodes of the torque
POSITION_FIRST, POSITION_STEP = slots("position_first", "position_step")
POSITION_TORQUE = block("position_torque", N_POSITIONS)


@hook("load_torque")
def position_torque(fx, angle, speed, torque):
    """A smooth table over the load's angle, zero two nodes outside."""
    if fx[POSITION_STEP] != 0.0:
        u = (angle - fx[POSITION_FIRST]) / fx[POSITION_STEP]
        torque += uniform_spline(fx, POSITION_TORQUE, N_POSITIONS, u)
    return torque


@njit(error_model="numpy")
def position_stiffness(fx):
    """Bound of the slope of the position torque [Nm/rad]."""
    if fx[POSITION_STEP] == 0.0:
        return 0.0
    return steepest(fx, POSITION_TORQUE, N_POSITIONS) / fx[POSITION_STEP]


NODES, MOST_Nm = 32, 1e3


@dataclass(frozen=True, kw_only=True)
class LoadPositionTorque(Term):
    """A torque over the load's angle: cables, magnets, detents, whatever no formula has.

    A uniform cubic B-spline over nodes from `first_rad` to `last_rad`, zero from two nodes outside
    on. It is conservative: what it takes on the way up it gives back.

    Attributes
    ----------
    node_Nm : (32,) array
        The spline's coefficients: at a node the torque is a sixth of the neighbours' and two
        thirds of its own.

    Raises
    ------
    TermError
        If a parameter is outside its bounds, there are not 32 nodes or their angles do not rise.

    Source
    ------
    de Boor, A Practical Guide to Splines (1978), chapter IX.
    """

    effect: ClassVar[str] = "load-position-torque"
    law: ClassVar[str] = "spline"
    port: ClassVar[Port] = Port.LOAD

    first_rad: float = parameter(
        unit="rad",
        bounds=(-100.0, 100.0),
        source="the lowest angle of the load that was recorded",
        meaning="Load angle of the first node.",
    )
    last_rad: float = parameter(
        unit="rad",
        bounds=(-100.0, 100.0),
        source="the highest angle of the load that was recorded",
        meaning="Load angle of the last node.",
    )
    node_Nm: ArrayLike

    def __post_init__(self):
        super().__post_init__()
        try:
            nodes = np.array(self.node_Nm, dtype=float)
        except (TypeError, ValueError):
            raise TermError(f"{self.effect}: node_Nm must be {NODES} numbers") from None
        if nodes.shape != (NODES,) or not np.all(np.abs(nodes) <= MOST_Nm):
            raise TermError(f"{self.effect}: node_Nm must be {NODES} numbers within {MOST_Nm:g} Nm")
        if not self.last_rad > self.first_rad:
            raise TermError(
                f"{self.effect}: last_rad = {self.last_rad} must be above first_rad ="
                f" {self.first_rad}"
            )
        nodes.flags.writeable = False
        object.__setattr__(self, "node_Nm", nodes)

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """The largest node."""
        return {"peak_Nm": float(np.abs(self.node_Nm).max())}

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """First node, distance of the nodes, their torques."""
        found = {
            "position_first": self.first_rad,
            "position_step": (self.last_rad - self.first_rad) / (NODES - 1),
        }
        return found | {f"position_torque_{j}": v for j, v in enumerate(self.node_Nm, start=1)}

    def equation(self) -> str:
        return (
            f"+tau_p(theta_l) on the load, a spline of {NODES} nodes from {self.first_rad:g}"
            f" to {self.last_rad:g} rad, at most {np.abs(self.node_Nm).max():g} Nm"
        )
