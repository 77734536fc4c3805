"""What bolts or an elastic seat under hub and rim leave of a spring's torsional stiffness.

Plane stress, linear, the whole ring. A bolt holds the nodes below its washer (twice the hole wide)
through a spring of its own; a seat holds the bore's or the rim's edge by a stiffness per area. The
model that everything else uses holds both edges rigidly. Friction: a bolted joint keeps its place
up to preload times friction times bolts times the circle's radius (VDI 2230, one interface).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array

from dftfs.analysis.meshing.sector_mesh import full_mesh
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.design import SpringDesign
from dftfs.errors import DesignError
from dftfs.fem.linear_model import condensed, factored, reduction, rigid_motions, tangent_matrix
from dftfs.fem.mesh import TaggedMesh

_WASHER = 2.0  # its diameter over the hole's
_RIGID = 1e4  # times E and width: a bolt that does not give


@dataclass(frozen=True, kw_only=True)
class Bolts:
    """A circle of bolts. ``stiffness_N_per_m`` is one bolt's in shear; None is rigid.

    Raises
    ------
    DesignError
        If a number is out of range.
    """

    count: int
    hole_m: float
    circle_m: float
    stiffness_N_per_m: float | None = None

    def __post_init__(self) -> None:
        if not (1 <= self.count <= 200 and self.hole_m > 0 and self.circle_m > 0):
            raise DesignError("bolts: count, hole and circle must be above 0, e.g. 6 4.2 165")
        k = self.stiffness_N_per_m
        if k is not None and not (np.isfinite(k) and k > 0):
            raise DesignError(f"bolts: a stiffness of {k:g} N/m must be above 0, e.g. 1e8")

    def slip_Nm(self, preload_N: float, friction: float) -> float:
        """Torque at which the joint slips."""
        return self.count * preload_N * friction * self.circle_m / 2


@dataclass(frozen=True, kw_only=True)
class Seat:
    """An elastic seat along the whole edge, in N/m per m^2 of it."""

    stiffness_N_per_m3: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.stiffness_N_per_m3) and self.stiffness_N_per_m3 > 0):
            raise DesignError("a seat's stiffness must be above 0, e.g. 1000 N/mm3")


Mount = Bolts | Seat | None


@dataclass(frozen=True, kw_only=True)
class MountedStiffness:
    """Torsional stiffness with both edges rigid, and as mounted (Nm/rad)."""

    rigid_Nm_per_rad: float
    mounted_Nm_per_rad: float

    @property
    def change(self) -> float:
        """Relative change by the mounting, 0 or below."""
        return self.mounted_Nm_per_rad / self.rigid_Nm_per_rad - 1


def mounted_stiffness(design: SpringDesign, hub: Mount, rim: Mount) -> MountedStiffness:
    """Stiffness at rest with hub and rim mounted so; None holds the edge rigidly.

    Raises
    ------
    DesignError
        If no material lies below a bolt's washer.
    SolveError
        If a solve fails.
    """
    problem = TorsionProblem(design=design, dimension=2)
    ring = full_mesh(problem.sector, design.n_arms)
    material, width = design.material, design.width_m
    stiffness = tangent_matrix(
        ring,
        youngs_modulus_Pa=material.youngs_modulus_Pa,
        poisson_ratio=material.poisson_ratio,
        thickness_m=width,
    )
    stiff = _RIGID * material.youngs_modulus_Pa * width
    rigid = _stiffness(ring, stiffness, width, stiff, None, None)
    mounted = _stiffness(ring, stiffness, width, stiff, hub, rim)
    return MountedStiffness(rigid_Nm_per_rad=rigid, mounted_Nm_per_rad=mounted)


def _stiffness(
    ring: TaggedMesh, stiffness: csr_array, width_m: float, stiff: float, hub: Mount, rim: Mount
) -> float:
    """The rim's mount turns by one rad; what is held rigidly is tied, the rest by springs."""
    held = np.zeros(ring.nodes.shape, dtype=bool)
    tied: list[NDArray] = []
    turn = csr_array((ring.nodes.size, 1))
    springs, own = np.zeros(len(ring.nodes)), 0.0
    bore, outer = ring.boundary_nodes("bore"), ring.boundary_nodes("rim_outer")
    if hub is None:
        held[bore] = True
    else:
        springs += _springs(ring, "bore", hub, width_m, stiff)
    if rim is None:
        tied, turn = [outer], rigid_motions(ring, outer, ("rz",))
    else:
        at_rim = _springs(ring, "rim_outer", rim, width_m, stiff)
        springs += at_rim
        drive = rigid_motions(ring, np.flatnonzero(at_rim), ("rz",))
        # u = T q with the mount's turn as q's last: K, then springs between the two
        load = diags_array(np.repeat(at_rim, 2)) @ drive
        whole = (stiffness + diags_array(np.repeat(springs, 2))).tocsr()
        parts = reduction(ring, held=held, tied=[], interfaces=[])
        right = load.toarray()[:, 0]
        own = float(drive.toarray()[:, 0] @ right)
        return own - _energy(whole, parts.free, right)
    whole = (stiffness + diags_array(np.repeat(springs, 2))).tocsr()
    parts = reduction(ring, held=held, tied=tied, interfaces=[turn])
    return float(condensed(whole, parts)[0, 0])


def _energy(whole: csr_array, free: NDArray, right: NDArray) -> float:
    """right^T K^-1 right over the free unknowns."""
    solver = factored(whole[free][:, free])
    try:
        return float(right[free] @ solver.solve(right[free]))
    finally:
        solver.close()


def _springs(
    ring: TaggedMesh, edge: str, mount: Bolts | Seat, width_m: float, stiff: float
) -> NDArray:
    """Stiffness (N/m) of the spring at every node, (n,)."""
    found = np.zeros(len(ring.nodes))
    if isinstance(mount, Seat):
        facets = ring.facets(edge)
        length = np.linalg.norm(ring.nodes[facets[:, 1]] - ring.nodes[facets[:, 0]], axis=1)
        area = mount.stiffness_N_per_m3 * length * width_m
        for share, column in zip((1 / 6, 1 / 6, 2 / 3), facets.T):  # Simpson's rule on the edge
            np.add.at(found, column, share * area)
        return found
    each = stiff if mount.stiffness_N_per_m is None else mount.stiffness_N_per_m
    for angle in 2 * np.pi * np.arange(mount.count) / mount.count:
        centre = mount.circle_m / 2 * np.array([np.cos(angle), np.sin(angle)])
        below = np.linalg.norm(ring.nodes - centre, axis=1) <= _WASHER * mount.hole_m / 2
        if not below.any():
            raise DesignError(
                f"bolts: no material below the washer at {np.degrees(angle):.0f} degrees on"
                f" D {1e3 * mount.circle_m:g} mm; another circle or a larger hole would work"
            )
        found[below] += each / np.count_nonzero(below)
    return found
