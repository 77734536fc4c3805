"""An elastic body whose surfaces may touch: one answer to forces and tangent for both."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dftfs.fem.assembly import STATUS_OK, ElasticBody, Evaluation
from dftfs.fem.contact import ContactBody, Touch


@dataclass(frozen=True, kw_only=True, eq=False)
class TouchingEvaluation(Evaluation):
    """Forces and energy of body and contact together.

    Parameters
    ----------
    touch : Touch
    contact_energy_J : float
        What the penalty holds of ``energy_J``.
    """

    touch: Touch
    contact_energy_J: float


class ContactingBody:
    """Body and surfaces behind the interface of `ElasticBody`.

    The pattern of the matrix grows when facets meet that have no place in it yet.
    """

    def __init__(self, body: ElasticBody, contact: ContactBody) -> None:
        self._body, self.contact = body, contact
        self.before_growth: Callable[[], None] = lambda: None  # called while the old pattern lives

    @property
    def pattern(self):
        """Of the matrix; another object after it has grown."""
        return self._body.pattern

    @property
    def stiffness(self) -> NDArray[np.float64]:
        """Values of the matrix that `tangent` has left."""
        return self._body.stiffness

    def forces(self, u: NDArray[np.float64]) -> Evaluation:
        """Internal and contact forces at displacements ``u`` (n, dim) in m."""
        evaluation = self._body.forces(u)
        if evaluation.status != STATUS_OK:
            return evaluation
        energy, touch = self.contact.add_forces(u, evaluation.force_N)
        return _joined(evaluation, energy, touch)

    def tangent(
        self, u: NDArray[np.float64], direction: NDArray[np.float64]
    ) -> tuple[Evaluation, NDArray[np.float64]]:
        """Forces, K in ``stiffness``, and the nodal product K ``direction``."""
        couples = self.contact.new_couples(u)
        if couples is not None:
            self.before_growth()
            self._body.couple(couples)
        evaluation, product = self._body.tangent(u, direction)
        if evaluation.status != STATUS_OK:
            return evaluation, product
        energy, touch = self.contact.add_tangent(
            self._body, u, direction, evaluation.force_N, product
        )
        return _joined(evaluation, energy, touch), product

    def commit(self, u: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Accept ``u`` as a state; the body's history there."""
        return self._body.commit(u)

    def restore(self, history: NDArray[np.float64] | None) -> None:
        """Go on from a state's history."""
        self._body.restore(history)

    def multiply(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """``stiffness`` times a vector of free values (n_free,)."""
        return self._body.multiply(x)


def _joined(evaluation: Evaluation, energy: float, touch: Touch) -> TouchingEvaluation:
    return TouchingEvaluation(
        force_N=evaluation.force_N,
        energy_J=evaluation.energy_J + energy,
        det_F_min=evaluation.det_F_min,
        status=evaluation.status,
        cell=evaluation.cell,
        touch=touch,
        contact_energy_J=energy,
    )
