"""Coulomb friction at contact points: state between increments, forces, dissipation.

Sticking is elastic (traction per slip is the penalty of the contact, times `stick_ratio`), slip
obeys Coulomb's law by return mapping at every converged state. Within one solve the friction
bound, mu times the pressure, is held, so that friction has a potential and its tangent is
symmetric; `update_bounds` takes the bounds from the pressures found, until both agree: the
converged state obeys Coulomb's law itself, without the unsymmetric part that the derivative of
the bound would add to the tangent.

Source: Simo & Laursen, Algorithmic symmetrization of Coulomb frictional problems using augmented
Lagrangians, Comput. Methods Appl. Mech. Engng 108 (1993) 133; Wriggers, Computational Contact
Mechanics (2006), 5.2 (return mapping), 10.5.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dftfs.fem.contact_integration import Geometry, PairTarget
from dftfs.fem.friction_kernel import (
    Anchors,
    Slip,
    integrate_friction_forces,
    integrate_friction_tangent,
    move_anchors,
)
from dftfs.fem.integration import Sums

_SHARES = 0.1, 2.0  # least and most of the bounds' error that is corrected at once


@dataclass(frozen=True, kw_only=True, eq=False)
class FrictionState:
    """Friction at one converged state.

    Parameters
    ----------
    anchor : (s, p) int array
        Master facet (of all copies) that a slave point sticks to, -1 where none.
    where : (s, p, dim - 1) array
        The material point of it.
    limit_Pa, traction_Pa : (s, p) array
        Coulomb's limit and the traction, per reference area.
    stored_J, dissipated_J : float
        Elastic energy of the sticking; heat of all slips since the first state.
    """

    anchor: NDArray[np.int64]
    where: NDArray[np.float64]
    limit_Pa: NDArray[np.float64]
    traction_Pa: NDArray[np.float64]
    stored_J: float
    dissipated_J: float

    @property
    def sliding(self) -> float:
        """Share of the friction force at its limit, 0 where nothing touches."""
        total = self.traction_Pa.sum()
        at_limit = self.traction_Pa >= (1 - 1e-9) * self.limit_Pa
        return float(self.traction_Pa[at_limit].sum() / total) if total > 0 else 0.0


class Friction:
    """The state of friction of a `contact.ContactBody`, moved on by `commit` only."""

    def __init__(
        self, coefficient: float, stick_Pa_per_m: float, area: NDArray[np.float64], dim: int
    ) -> None:
        self._coefficient, self._stick, self._area = coefficient, stick_Pa_per_m, area
        self._axes = tuple(range(dim))
        self.state = FrictionState(
            anchor=np.full(area.shape, -1, dtype=np.int64),
            where=np.zeros((*area.shape, dim - 1)),
            limit_Pa=np.zeros(area.shape),
            traction_Pa=np.zeros(area.shape),
            stored_J=0.0,
            dissipated_J=0.0,
        )
        self.limit_Pa = self.state.limit_Pa
        self._wrong, self._share = self.limit_Pa, 1.0

    @property
    def active(self) -> NDArray[np.bool_]:
        """(s, p) points that may have a friction force."""
        return (self.state.anchor >= 0) & (self.limit_Pa > 0)

    def add_forces(self, geometry: Geometry, force: NDArray[np.float64]) -> None:
        """Add friction forces (n, dim)."""
        integrate_friction_forces(geometry, self._anchors(), force, self._axes)

    def add_tangent(self, geometry: Geometry, pairs: PairTarget, sums: Sums) -> None:
        """Add forces, the tangent at the present bounds, and its product with a direction."""
        integrate_friction_tangent(geometry, self._anchors(), pairs, sums, self._axes)

    def _anchors(self) -> Anchors:
        return Anchors(self._stick, self.state.anchor, self.state.where, self.limit_Pa)

    def update_bounds(self, pressure_Pa: NDArray[np.float64], *, first: bool = False) -> float:
        """Move the bounds towards mu times pressures (s, p); returns their relative error before.

        By Aitken's relaxation: pressure depends on friction, and plain repetition takes three
        times as many solves. ``first`` starts the relaxation anew.
        """
        wrong = np.where(self.state.anchor >= 0, self._coefficient * pressure_Pa - self.limit_Pa, 0)
        share = 1.0
        if not first:
            turned = wrong - self._wrong
            scale = float((turned * turned).sum())
            if scale > 0:
                share = -self._share * float((self._wrong * turned).sum()) / scale
            share = float(np.clip(share, _SHARES[0], _SHARES[1]))
        self._wrong, self._share = wrong, share
        self.limit_Pa = np.maximum(self.limit_Pa + share * wrong, 0.0)
        change = float((self._area * np.abs(wrong)).sum())
        total = self._coefficient * float((self._area * pressure_Pa).sum())
        if change == 0.0:
            return 0.0
        return change / total if total > 0 else np.inf

    def set_bounds(self, pressure_Pa: NDArray[np.float64]) -> None:
        """Set the state's bounds to mu times these pressures (s, p)."""
        self.restore(replace(self.state, limit_Pa=self._coefficient * pressure_Pa))

    def commit(
        self, geometry: Geometry, found: NDArray[np.int64], foot: NDArray[np.float64]
    ) -> FrictionState:
        """Accept a converged state: anchors follow the slip, whose heat is added up."""
        slip = Slip(np.zeros_like(foot), np.zeros(found.shape), np.zeros(found.shape))
        stored = move_anchors(
            geometry, self._anchors(), self.state.limit_Pa, found, foot, slip, self._axes
        )
        self.state = FrictionState(
            anchor=found.copy(),
            where=slip.where,
            limit_Pa=self.limit_Pa,
            traction_Pa=slip.traction,
            stored_J=stored,
            dissipated_J=self.state.dissipated_J + float(slip.heat.sum()),
        )
        return self.state

    def restore(self, state: FrictionState) -> None:
        """Continue from a state."""
        self.state, self.limit_Pa = state, state.limit_Pa
