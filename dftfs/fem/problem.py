"""The question a static analysis answers."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dftfs.errors import SolveError
from dftfs.fem.constraints import CyclicSymmetry, Drive, Support
from dftfs.fem.contact import ContactSurfaces
from dftfs.fem.mesh import TaggedMesh
from dftfs.fem.plasticity import Hardening

DeadLoad = Callable[[float], tuple[NDArray, NDArray]]


@dataclass(frozen=True, kw_only=True, eq=False)
class StaticProblem:
    """An elastic body, its constraints and loads, all functions of one parameter t.

    Parameters
    ----------
    mesh : TaggedMesh
        Planar meshes are solved in plane stress.
    youngs_modulus_Pa, poisson_ratio : float
    thickness_m : float or None
        Of a planar mesh; None for solids.
    supports : tuple of Support
    drive : Drive or None
        Prescribed motion; its conjugate reaction is the result's ``drive_force``.
    dead_load_N : function of t or None
        Returns nodal forces (n, dim) in N that keep their direction, and their rate in t.
    cyclic : CyclicSymmetry or None
    contact : ContactSurfaces or None
        Surfaces that must not enter each other; None lets them pass.
    hardening : Hardening or None
        Of an elastic-plastic material; None is elastic.

    Raises
    ------
    SolveError
        If a number is out of range, or nothing drives the body.
    """

    mesh: TaggedMesh
    youngs_modulus_Pa: float
    poisson_ratio: float
    thickness_m: float | None = None
    supports: tuple[Support, ...] = ()
    drive: Drive | None = None
    dead_load_N: DeadLoad | None = None
    cyclic: CyclicSymmetry | None = None
    contact: ContactSurfaces | None = None
    hardening: Hardening | None = None

    def __post_init__(self) -> None:
        if not self.youngs_modulus_Pa > 0:
            raise SolveError(f"youngs_modulus_Pa={self.youngs_modulus_Pa} must be above 0")
        if not -1 < self.poisson_ratio < 0.5:
            raise SolveError(f"poisson_ratio={self.poisson_ratio} must be in (-1, 0.5)")
        planar = self.mesh.dim == 2
        if planar and not (self.thickness_m is not None and self.thickness_m > 0):
            raise SolveError(f"thickness_m={self.thickness_m} must be above 0 for a planar mesh")
        if not planar and self.thickness_m is not None:
            raise SolveError(f"thickness_m={self.thickness_m} has no meaning for a solid mesh")
        if self.drive is None and self.dead_load_N is None:
            raise SolveError("neither drive nor dead_load_N: nothing depends on t")

    def prescribed(self, t: float) -> tuple[NDArray, NDArray, NDArray]:
        """g, g' and g'' at t as nodal fields (n, dim), zero where nothing is driven."""
        fields = tuple(np.zeros(self.mesh.nodes.shape) for _ in range(3))
        if self.drive is not None:
            where = np.ix_(self.drive.nodes, self.drive.components)
            for nodal, values in zip(fields, self.drive.motion(t)):
                nodal[where] = values[:, list(self.drive.components)]
        return fields

    def load(self, t: float) -> tuple[NDArray, NDArray]:
        """Dead load and its rate at t, (n, dim) each."""
        if self.dead_load_N is None:
            nothing = np.zeros(self.mesh.nodes.shape)
            return nothing, nothing
        return self.dead_load_N(t)
