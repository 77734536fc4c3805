"""A mesh of elastic-plastic material: the interface of `ElasticBody`, with a history."""

import numpy as np
from numpy.typing import NDArray

from dftfs.fem.assembly import STATUS_INVERTED, STATUS_OK, ElasticBody, Evaluation
from dftfs.fem.constraints import DofMap
from dftfs.fem.integration import Sums
from dftfs.fem.mesh import TaggedMesh
from dftfs.fem.plasticity import (
    Hardening,
    Yielding,
    integrate_plastic,
    no_history,
    plastic_law,
)


class PlasticBody(ElasticBody):
    """What has yielded so far is kept per integration point and moves on only with `commit`.

    Energies are elastic, of what is stored: work done in yielding is not in them.
    """

    def __init__(
        self,
        mesh: TaggedMesh,
        dofs: DofMap,
        *,
        youngs_modulus_Pa: float,
        poisson_ratio: float,
        thickness_m: float,
        hardening: Hardening,
    ) -> None:
        super().__init__(
            mesh,
            dofs,
            youngs_modulus_Pa=youngs_modulus_Pa,
            poisson_ratio=poisson_ratio,
            thickness_m=thickness_m,
        )
        self._law = plastic_law(hardening, youngs_modulus_Pa, poisson_ratio)
        self.history = no_history(mesh.cells, len(self._domain.weights))

    def forces(self, u: NDArray[np.float64]) -> Evaluation:
        """Internal forces at displacements ``u`` (n, dim) in m, from the committed history."""
        return self._integrated(u, np.zeros_like(u), tangent=False)[0]

    def tangent(
        self, u: NDArray[np.float64], direction: NDArray[np.float64]
    ) -> tuple[Evaluation, NDArray[np.float64]]:
        """Forces, the consistent tangent in ``stiffness``, and its product with ``direction``."""
        evaluation, product, _ = self._integrated(u, direction, tangent=True)
        return evaluation, product

    def commit(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Accept the yielding on the way to ``u``; returns the history (m, q, 7) there."""
        self.history = self._integrated(u, np.zeros_like(u), tangent=False)[2]
        self.history.setflags(write=False)
        return self.history

    def restore(self, history: NDArray[np.float64] | None) -> None:
        """Continue from a state's history; None keeps the present one."""
        if history is not None:
            self.history = history

    def _integrated(
        self, u: NDArray[np.float64], direction: NDArray[np.float64], *, tangent: bool
    ) -> tuple[Evaluation, NDArray[np.float64], NDArray[np.float64]]:
        force, product = np.empty_like(self._domain.nodes), np.empty_like(self._domain.nodes)
        new = np.empty_like(self.history)
        yielding = Yielding(self._law, np.array(self.history), new)
        sums = Sums(force, product, self.stiffness)
        energy, smallest, cell = integrate_plastic(
            self._domain, self.target, yielding, u, direction, sums, tangent, self._axes
        )
        good = smallest > 0 and np.isfinite(energy)
        evaluation = Evaluation(
            force_N=force,
            energy_J=energy,
            det_F_min=smallest,
            status=STATUS_OK if good else STATUS_INVERTED,
            cell=cell,
        )
        return evaluation, product, new
