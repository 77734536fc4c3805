"""What is kept of a state of equilibrium."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dftfs.fem.contact import Touch
from dftfs.fem.friction import FrictionState


@dataclass(frozen=True, kw_only=True, eq=False)
class PathState:
    """A state of equilibrium.

    Parameters
    ----------
    t : float
        The parameter (rad for a rotation).
    displacement_m, rate_m : (n, dim) array
        u and du/dt.
    reaction_N : (n, dim) array
        Internal forces less dead loads: zero at free nodes, reactions elsewhere.
    drive_force, drive_stiffness : float
        Reaction conjugate to t and its derivative in t: Nm and Nm/rad for a rotation.
    energy_J : float
        Strain energy, and that of the contact's penalty.
    iterations, factorisations : int
        Corrections and factorisations spent on this state.
    residual : float
        Norm of the free residual over that of reactions and loads (the largest so far).
    det_F_min : float
    negative_pivots : int
        Of the last tangent factored on the way here: above 0, the equilibrium is unstable.
    touch : Touch or None
        Where the surfaces of a problem with contact stand.
    contact_energy_J : float
        What the contact's penalty holds of ``energy_J``.
    history : (m, q, 7) array or None
        What has yielded at every integration point, see `plasticity`; None of an elastic body.
    friction : FrictionState or None
        Of a contact that has friction.
    """

    t: float
    displacement_m: NDArray[np.float64]
    rate_m: NDArray[np.float64]
    reaction_N: NDArray[np.float64]
    drive_force: float
    drive_stiffness: float
    energy_J: float
    iterations: int
    factorisations: int
    residual: float
    det_F_min: float
    negative_pivots: int
    touch: Touch | None = None
    contact_energy_J: float = 0.0
    history: NDArray[np.float64] | None = None
    friction: FrictionState | None = None

    @property
    def pressed(self) -> bool:
        """Whether surfaces are in contact."""
        return self.contact_energy_J > 0
