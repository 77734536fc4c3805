"""The whole spring as a linear body: every arm, half the width, one of two mirror classes.

A small motion splits exactly into one that the mid-plane mirrors (in the plane: rim along x, y and
about the axis) and one that it reverses (out of the plane: rim along the axis and tilted). Each is
solved on the upper half of the ring with its own condition on the mid-plane.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from dftfs.analysis.meshing.blocks import MeshSizing
from dftfs.analysis.meshing.sector_mesh import full_mesh, sector_mesh, solid_mesh
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.design import SpringDesign
from dftfs.fem.linear_model import Reduction, mass_matrix, reduction, rigid_motions, tangent_matrix
from dftfs.fem.mesh import TaggedMesh, rotation_about_z

IN_PLANE, OUT_OF_PLANE = "in the plane", "out of the plane"
MOTIONS = {IN_PLANE: ("x", "y", "rz"), OUT_OF_PLANE: ("z", "rx", "ry")}
_HELD = {IN_PLANE: (2,), OUT_OF_PLANE: (0, 1)}  # on the mid-plane
HALVES = 2
_COARSER = 1.5  # than the default mesh: these numbers are asked for to a percent, not to 0.02


def structural_sizing() -> MeshSizing:
    """The default mesh's arms with coarser roots and rings."""
    return MeshSizing(along=0.8, fillet=4.0, growth=0.35 * _COARSER, ring=0.5 * _COARSER)


def on_all_arms(
    sector_m: NDArray[np.float64],
    ring_m: NDArray[np.float64],
    displacement_m: NDArray[np.float64],
    n_arms: int,
) -> NDArray[np.float64]:
    """A sector's displacement (n, dim) turned onto the nodes (m, dim) of the ring."""
    whole, tree = np.empty_like(ring_m), cKDTree(ring_m)
    for k in range(n_arms):
        turn = rotation_about_z(2 * np.pi * k / n_arms, ring_m.shape[1])
        whole[tree.query(sector_m @ turn.T)[1]] = displacement_m @ turn.T
    return whole


@dataclass(frozen=True, kw_only=True)
class WholeSpring:
    """A design as a linear body.

    Parameters
    ----------
    design : SpringDesign
    sizing : MeshSizing
    layers : int
        Elements through half the width.
    """

    design: SpringDesign
    sizing: MeshSizing = field(default_factory=structural_sizing)
    layers: int = 2

    @cached_property
    def sector(self) -> TaggedMesh:
        """Planar mesh of one arm's sector."""
        return sector_mesh(self.design.outline, self.sizing)

    @cached_property
    def mesh(self) -> TaggedMesh:
        """All arms, the upper half of the width; ``bottom`` is the mid-plane."""
        levels_m = np.linspace(0, self.design.width_m / 2, self.layers + 1)
        return solid_mesh(full_mesh(self.sector, self.design.n_arms), levels_m)

    @cached_property
    def torsion(self) -> TorsionProblem:
        """The torsion of this very mesh: one sector of it, turned."""
        problem = TorsionProblem(
            design=self.design, dimension=3, sizing=self.sizing, layers=self.layers
        )
        problem.__dict__["sector"] = self.sector  # meshed once
        return problem

    def spread(self, displacement_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """A displacement of ``torsion``'s sector (n, 3) on all arms."""
        nodes = self.torsion.mesh.nodes
        return on_all_arms(nodes, self.mesh.nodes, displacement_m, self.design.n_arms)

    def tangent(self, displacement_m: NDArray | None = None) -> csr_array:
        """Tangent of the half without supports, at rest or displaced."""
        material = self.design.material
        return tangent_matrix(
            self.mesh,
            youngs_modulus_Pa=material.youngs_modulus_Pa,
            poisson_ratio=material.poisson_ratio,
            displacement_m=displacement_m,
        )

    @cached_property
    def at_rest(self) -> csr_array:
        """Stiffness of the half without supports."""
        return self.tangent()

    @property
    def inertia_kg_m2(self) -> float:
        """Of the whole spring about its axis."""
        everything = np.arange(len(self.mesh.nodes))
        turning = rigid_motions(self.mesh, everything, ("rz",))
        return HALVES * float((turning.T @ (self.mass @ turning)).toarray()[0, 0])

    @cached_property
    def mass(self) -> csr_array:
        """Consistent mass of the half."""
        return mass_matrix(self.mesh, density_kg_per_m3=self.design.material.density_kg_per_m3)

    def reduction(
        self, parity: str, *, rim: Sequence[str] = (), hub: Sequence[str] = ()
    ) -> Reduction:
        """Unknowns of one mirror class, rim and bore rigid, each free to do the motions named."""
        mesh = self.mesh
        held = np.zeros(mesh.nodes.shape, dtype=bool)
        held[np.ix_(mesh.boundary_nodes("bottom"), _HELD[parity])] = True
        ends = {name: mesh.boundary_nodes(name) for name in ("rim_outer", "bore")}
        moving = (("rim_outer", rim), ("bore", hub))
        return reduction(
            mesh,
            held=held,
            tied=tuple(ends.values()),
            interfaces=[rigid_motions(mesh, ends[name], how) for name, how in moving if how],
        )
