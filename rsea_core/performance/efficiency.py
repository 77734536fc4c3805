"""Efficiency of a simulated actuator as a ratio of energies, by direction of power flow.

The thesis' 2.38 divides powers of the motor alone, and its mean of such ratios is no energy
(errata D14): what counts is what the load gets of what the supply gives, and, on the way back,
what the supply gets of what the load gives.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import InputError
from rsea_core.machine.rig import MISMATCH_HINT
from rsea_core.simulation.trajectory import Trajectory

LARGEST_CONSTANT_RATIO = 1.02  # k_t / k_e above this creates energy worth mentioning


@dataclass(frozen=True, kw_only=True)
class CycleEfficiency:
    """Energies over a span of time, each split by the sign of its power.

    Attributes
    ----------
    from_s, to_s : float
    drawn_J, returned_J : float
        At the winding's terminals: taken from the supply, given back to it.
    delivered_J, absorbed_J : float
        At the output, tau_s w_l: given to the load, taken from it.
    shaft_delivered_J : float
        By the motor's torque before gear inertia and friction, where it drives.
    lost_J : float
        Turned into heat, as the trajectory's ledger has it.
    """

    from_s: float
    to_s: float
    drawn_J: float
    returned_J: float
    delivered_J: float
    absorbed_J: float
    shaft_delivered_J: float
    lost_J: float

    @property
    def forward(self) -> float | None:
        """Delivered to the load of what was drawn; None where nothing was drawn.

        Energy that swings between supply, inertia and load counts each time, so a swinging
        machine has a low one, and one whose load gives energy back may exceed 1.
        """
        return self.delivered_J / self.drawn_J if self.drawn_J > 0.0 else None

    @property
    def net(self) -> float | None:
        """Net output of net input; None unless both flow from supply to load."""
        given, got = self.drawn_J - self.returned_J, self.delivered_J - self.absorbed_J
        return got / given if given > 0.0 and got >= 0.0 else None

    @property
    def backward(self) -> float | None:
        """Net energy to the supply of net energy from the load; None unless both flow so."""
        given, got = self.absorbed_J - self.delivered_J, self.returned_J - self.drawn_J
        return got / given if given > 0.0 and got >= 0.0 else None

    @property
    def throughput(self) -> float | None:
        """All that came out at either side of all that went in: at most 1 over whole cycles."""
        entered = self.drawn_J + self.absorbed_J
        return (self.delivered_J + self.returned_J) / entered if entered > 0.0 else None

    @property
    def motor(self) -> float | None:
        """Of the motor alone, what the thesis' 2.38 means; None where nothing was drawn."""
        return self.shaft_delivered_J / self.drawn_J if self.drawn_J > 0.0 else None


def cycle_efficiency(
    trajectory: Trajectory, *, from_s: float = 0.0, to_s: float | None = None
) -> CycleEfficiency:
    """Energies of a trajectory between two of its rows; take whole cycles.

    Work is counted row by row: electrical energy as the ledger has it, the output's by the
    trapezoid of tau_s w_l. A row in which the power changes its sign counts by its sum.

    Raises
    ------
    InputError
        If fewer than 8 rows lie in the span, the machine is not driven electrically, or its
        k_t is more than 2 % above k_e, so that energy appears from nowhere.
    """
    rig = trajectory.model.rig
    if trajectory.command_name not in ("duty", "voltage_V"):
        raise InputError("efficiency needs a machine driven by duty or voltage_V")
    ratio = rig.torque_constant_Nm_per_A / rig.back_emf_constant_Vs_per_rad
    if ratio > LARGEST_CONSTANT_RATIO:
        raise InputError(
            f"k_t / k_e = {ratio:.4g} is above {LARGEST_CONSTANT_RATIO}: the motor creates energy,"
            f" so there is no efficiency to report ({MISMATCH_HINT})"
        )
    t = trajectory.time_s
    end = t[-1] if to_s is None else to_s
    rows = np.flatnonzero((t >= from_s) & (t <= end))
    if rows.size < 8:
        raise InputError(f"from_s = {from_s:g} s to {end:g} s holds {rows.size} rows, needs 8")
    energy = trajectory.energy
    electrical = np.diff(energy.supplied_J[rows])
    shaft = np.diff(
        (energy.supplied_J + energy.constant_mismatch_J - energy.joule_J - energy.magnetic_J)[rows]
    )
    power = (trajectory.torque_Nm * trajectory.load_velocity_rad_per_s)[rows]
    output = 0.5 * (power[1:] + power[:-1]) * np.diff(t[rows])
    lost = energy.lost_J()
    return CycleEfficiency(
        from_s=float(t[rows[0]]),
        to_s=float(t[rows[-1]]),
        drawn_J=_positive(electrical),
        returned_J=_positive(-electrical),
        delivered_J=_positive(output),
        absorbed_J=_positive(-output),
        shaft_delivered_J=_positive(shaft),
        lost_J=float(lost[rows[-1]] - lost[rows[0]]),
    )


def _positive(increments: NDArray) -> float:
    return float(increments[increments > 0.0].sum())
