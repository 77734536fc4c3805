"""The torsion problem: a design, its mesh, and its boundary condition by name.

`bearing`: bore clamped, rim turned rigidly about the fixed axis, torque as the reaction conjugate
to the angle. One cyclic sector stands for the spring, and in 3D one half of the width (the
mid-plane is a mirror): exactly the answer of the whole mesh. `free-centre`: the turning rim also
finds its own place in the plane, so that no force acts on it; the whole ring is solved. From two
arms on both give the same curve.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from dftfs.analysis.meshing.blocks import MeshSizing
from dftfs.analysis.meshing.coil_gap_mesh import CoilGapMesh
from dftfs.analysis.meshing.sector_mesh import full_mesh, sector_mesh, solid_mesh
from dftfs.design import MeshChoice, SpringDesign
from dftfs.errors import DesignError
from dftfs.fem.constraints import clamped, cyclic_symmetry, rigid_rotation
from dftfs.fem.contact import ContactLaw, ContactSurfaces
from dftfs.fem.mesh import TaggedMesh, rotation_about_z
from dftfs.fem.problem import StaticProblem
from dftfs.spring.clearance import CEILING, FLOOR

BOUNDARIES = ("bearing", "free-centre")
_SMOOTHING = 1 / 1500  # of the strip's thickness: some 5 micrometres
_CURL = 1.3  # decay lengths of the curl that one element spans: K within 0.2 % at w / t = 10
_REACH = 0.1  # of the strip's thickness: gaps beyond it are far from contact


@dataclass(frozen=True, kw_only=True)
class TorsionProblem:
    """A design, a mesh of it, and how the curve is solved.

    Parameters
    ----------
    design : SpringDesign
    dimension : int
        3 (hex20) or 2 (quad8, plane stress; the fast model).
    sizing : MeshSizing
    layers : int or None
        Elements through half the width (3D); `least_layers` without it.
    boundary : str
        ``bearing`` or ``free-centre``.

    Raises
    ------
    DesignError
        If the dimension or the layers are out of range.
    """

    design: SpringDesign
    dimension: int = 3
    sizing: MeshSizing = field(default_factory=MeshSizing)
    layers: int | None = None
    boundary: str = "bearing"

    def __post_init__(self) -> None:
        if self.dimension not in (2, 3):
            raise DesignError(f"dimension = {self.dimension} must be 2 or 3")
        if self.layers is None:
            object.__setattr__(self, "layers", least_layers(self.design))
        if self.layers < 1:
            raise DesignError(f"layers = {self.layers} must be 1 or more")
        if self.boundary not in BOUNDARIES:
            raise DesignError(
                f"boundary = {self.boundary!r} is unknown; known are {', '.join(BOUNDARIES)}"
            )

    @property
    def model(self) -> str:
        """Name of the model in tables and plots."""
        return "3D hex20" if self.dimension == 3 else "2D plane stress quad8"

    @cached_property
    def sector(self) -> TaggedMesh:
        """Planar mesh of one sector."""
        return sector_mesh(self.design.outline, self.sizing)

    @cached_property
    def _planar(self) -> TaggedMesh:
        whole = self.boundary == "free-centre"
        return full_mesh(self.sector, self.design.n_arms) if whole else self.sector

    @cached_property
    def mesh(self) -> TaggedMesh:
        """The mesh that is solved on: sector or ring, in 3D its upper half."""
        if self.dimension == 2:
            return self._planar
        return solid_mesh(self._planar, np.linspace(0, self.design.width_m / 2, self.layers + 1))

    @property
    def copies(self) -> int:
        """How many times the solved part fits into the spring."""
        around = self.design.n_arms if self.boundary == "bearing" else 1
        return around * (2 if self.dimension == 3 else 1)

    @cached_property
    def _sector_nodes(self) -> NDArray:
        """Where the sector's planar nodes stand among the nodes of the mesh's lowest plane."""
        return cKDTree(self._planar.nodes).query(self.sector.nodes)[1]

    def on_sector(self, nodal: NDArray) -> NDArray:
        """Nodal values (n, ...) of the mesh at the planar nodes of arm 0's sector."""
        return nodal[self._sector_nodes]

    @cached_property
    def coil_gap(self) -> CoilGapMesh:
        """Facing edges of the mid-plane."""
        return CoilGapMesh(sector=self.sector, parameters=self.design.spiral)

    @cached_property
    def contact(self) -> ContactSurfaces:
        """What may touch: the ceiling of a coil gap its floor, of this arm or of a neighbour.

        A coil of the sector meets copies of the sector's own edges, turned by the pitch. The
        ceiling is the slave: it has the tip, whose small facets must find the wide ones of the
        coil. The penalty is E over the strip's thickness: as stiff as the strip is through it.
        """
        mesh, design = self.mesh, self.design
        thickness = design.spiral.thickness_m
        copies = design.n_arms if self.boundary == "bearing" else 1
        floor, ceiling = (
            np.concatenate([mesh.boundaries[name] for name in names if name in mesh.boundaries])
            for names in (FLOOR, CEILING)
        )
        return ContactSurfaces(
            slave=ceiling,
            master=floor,
            turns=tuple(rotation_about_z(2 * np.pi * k / copies, mesh.dim) for k in range(copies)),
            law=ContactLaw(
                stiffness_Pa_per_m=design.material.youngs_modulus_Pa / thickness,
                smoothing_m=_SMOOTHING * thickness,
                reach_m=_REACH * thickness,
                deepest_m=thickness / 2,
            ),
        )

    def static_problem(self, *, contact: bool = False) -> StaticProblem:
        """The engine's problem: bore clamped, rim turned, cuts tied, mid-plane mirrored.

        Without ``contact`` the coils may pass through each other.
        """
        mesh, material = self.mesh, self.design.material
        bore, rim = mesh.boundary_nodes("bore"), mesh.boundary_nodes("rim_outer")
        supports = [clamped(bore)]
        cyclic = self.boundary == "bearing" and self.design.n_arms > 1
        if self.dimension == 3:
            mirror = np.setdiff1d(mesh.boundary_nodes("bottom"), np.union1d(bore, rim))
            supports.append(clamped(mirror, components=(2,)))
        return StaticProblem(
            mesh=mesh,
            youngs_modulus_Pa=material.youngs_modulus_Pa,
            poisson_ratio=material.poisson_ratio,
            thickness_m=self.design.width_m if self.dimension == 2 else None,
            supports=tuple(supports),
            drive=rigid_rotation(mesh, rim, free_translation=self.boundary == "free-centre"),
            cyclic=cyclic_symmetry(mesh, self.design.n_arms) if cyclic else None,
            contact=self.contact if contact else None,
        )


def least_layers(design: SpringDesign) -> int:
    """Elements through half the width that follow how a strip curls across it, 1 or more.

    The curl decays over sqrt(R t) / (3 (1 - nu^2))^(1/4) from the edges inwards
    (`dftfs.spring.section.wide_strip_factor`); R is taken in the middle of the arm. With one
    element a strip 30 mm wide and 1 mm thick is 2 % too stiff.
    """
    p, nu = design.spiral, design.material.poisson_ratio
    line = p.centreline
    middle = (line.start + line.end) / 2
    thickness = float(p.thickness_at(middle))
    decay = np.sqrt(thickness / abs(float(line.curvature(middle)))) / (3 * (1 - nu**2)) ** 0.25
    return max(1, int(np.ceil(design.width_m / 2 / (_CURL * decay))))


def meshed_problem(
    design: SpringDesign,
    mesh: MeshChoice | None = None,
    *,
    dimension: int,
    boundary: str = "bearing",
) -> TorsionProblem:
    """A design's problem on the mesh that is chosen, by default as the design's file asks.

    A wide strip has `least_layers` elements through half the width where fewer are chosen.
    """
    chosen = mesh or design.mesh
    return TorsionProblem(
        design=design,
        dimension=dimension,
        sizing=MeshSizing() if chosen.size == 1 else MeshSizing().finer(1 / chosen.size),
        layers=max(chosen.layers, least_layers(design)) if dimension == 3 else chosen.layers,
        boundary=boundary,
    )
