"""First natural frequencies of a spring, its ends locked or turning with given inertia."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array

from dftfs.analysis.structure.linear_spring import HALVES, IN_PLANE, OUT_OF_PLANE, WholeSpring
from dftfs.errors import DesignError
from dftfs.fem.linear_model import lowest_modes

LOCKED = "rim and hub locked"
_SHIFT = -1e4  # 1/s^2, for a spring that can turn freely: far below any elastic mode


@dataclass(frozen=True, kw_only=True)
class Mode:
    """One natural vibration.

    ``turning`` is the share of its kinetic energy that rim and hub have in turning about the axis.
    """

    frequency_Hz: float
    parity: str
    turning: float


@dataclass(frozen=True, kw_only=True)
class ModeSet:
    """The lowest modes of one boundary condition, ascending; ``inertia`` says which."""

    boundary: str
    modes: tuple[Mode, ...]

    def lowest(self, parity: str) -> Mode | None:
        """The first mode of a mirror class."""
        return next((mode for mode in self.modes if mode.parity == parity), None)


def locked_modes(spring: WholeSpring, count: int = 3, *, solver: str = "auto") -> ModeSet:
    """The lowest ``count`` modes of each mirror class, bore and rim clamped.

    Raises
    ------
    SolveError
        If the iteration does not converge.
    """
    modes = []
    for parity in (IN_PLANE, OUT_OF_PLANE):
        transform = spring.reduction(parity).transform
        values, _, _ = lowest_modes(
            (transform.T @ spring.at_rest @ transform).tocsr(),
            (transform.T @ spring.mass @ transform).tocsr(),
            count,
            solver=solver,
        )
        modes += [_mode(value, parity, 0.0) for value in values]
    return ModeSet(boundary=LOCKED, modes=_ascending(modes))


def turning_modes(
    spring: WholeSpring,
    *,
    load_inertia_kg_m2: float = 0.0,
    hub_inertia_kg_m2: float | None = None,
    count: int = 3,
    solver: str = "auto",
) -> ModeSet:
    """The lowest in-plane modes of a rim that turns in its bearing.

    Parameters
    ----------
    load_inertia_kg_m2 : float
        Turns with the rim; 0 leaves the rim its own mass.
    hub_inertia_kg_m2 : float or None
        Turns with the bore; None locks the bore.

    Raises
    ------
    DesignError
        If an inertia is negative or no number.
    SolveError
        If the iteration does not converge.
    """
    require_inertia("load-inertia", load_inertia_kg_m2)
    free = int(hub_inertia_kg_m2 is not None)
    ends = [load_inertia_kg_m2]
    if free:
        require_inertia("hub-inertia", hub_inertia_kg_m2)
        ends.append(hub_inertia_kg_m2)
    parts = spring.reduction(IN_PLANE, rim=("rz",), hub=("rz",) if free else ())
    transform = parts.transform
    stiffness = (transform.T @ spring.at_rest @ transform).tocsr()
    mass = (transform.T @ spring.mass @ transform).tocsr()
    at = len(parts.free) + np.arange(len(ends))
    mass = (mass + coo_array((np.array(ends) / HALVES, (at, at)), shape=mass.shape)).tocsr()
    values, vectors, _ = lowest_modes(
        stiffness, mass, count + free, shift=_SHIFT if free else 0.0, solver=solver
    )
    turning = np.einsum("rk,rs,sk->k", vectors[at], mass[at][:, at].toarray(), vectors[at])
    modes = [
        _mode(value, IN_PLANE, share)
        for value, share in zip(values[free:], turning[free:])  # without the free turn
    ]
    load = f"with {load_inertia_kg_m2:g} kg m2" if load_inertia_kg_m2 else "without load"
    hub = "locked" if not free else f"{hub_inertia_kg_m2:g} kg m2"
    return ModeSet(
        boundary=f"rim turning {load}, hub {hub}",
        modes=_ascending(modes),
    )


def require_inertia(name: str, value: float) -> None:
    """DesignError unless an inertia is 0 or more."""
    if not 0 <= value < np.inf:
        raise DesignError(f"{name} = {value} kg m2 must be 0 or more")


def _mode(value: float, parity: str, turning: float) -> Mode:
    return Mode(
        frequency_Hz=float(np.sqrt(max(value, 0.0)) / (2 * np.pi)),
        parity=parity,
        turning=float(turning),
    )


def _ascending(modes: list[Mode]) -> tuple[Mode, ...]:
    return tuple(sorted(modes, key=lambda mode: mode.frequency_Hz))
