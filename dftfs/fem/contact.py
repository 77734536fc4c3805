"""Contact between facet sets of a mesh, one of them possibly turned.

Points of a slave surface (Gauss points of its facets) may not enter a master surface. The master
may be a turned copy of facets of the same mesh: in a cyclic sector, the neighbour that a coil
touches. Pressure follows a smoothed penalty, a potential per reference area; augmentation (Uzawa)
takes the penetration out where it is asked for.

Source: Laursen, Computational Contact and Impact Mechanics (2002); Wriggers, Computational
Contact Mechanics (2006); Simo & Laursen, Comput. Struct. 42 (1992) 97 (augmentation).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_diag, coo_array, csr_array

from dftfs.errors import SolveError
from dftfs.fem.assembly import ElasticBody
from dftfs.fem.contact_integration import (
    Geometry,
    PairTarget,
    Pressing,
    integrate_contact_forces,
    integrate_contact_tangent,
)
from dftfs.fem.contact_search import Feet, Search, detect
from dftfs.fem.elements import facet_table
from dftfs.fem.friction import Friction, FrictionState
from dftfs.fem.integration import Sums
from dftfs.fem.mesh import TaggedMesh

_CURVED = 50.0  # of the deepest penetration: see `contact_integration.Geometry`
_COUPLED_WITHIN = 4.0  # smoothing lengths: facets this near are given their place in the matrix


@dataclass(frozen=True, kw_only=True)
class ContactLaw:
    """How a surface resists penetration.

    Parameters
    ----------
    stiffness_Pa_per_m : float
        Pressure per penetration (1 N/mm^3 is 1e9).
    smoothing_m : float
        Gap below which pressure sets in; below minus it the law is linear.
    reach_m, deepest_m : float
        Largest gap and penetration at which a master facet counts as the one that is faced.
    points_per_direction : int
        Gauss points of a slave facet.
    augmentations : int
        Corrections of the pressure after each converged state (0: plain penalty).
    friction_coefficient : float
        Of Coulomb's law, see `friction`; 0 slides freely.
    stick_ratio : float
        Traction per elastic slip of a sticking point over ``stiffness_Pa_per_m``.

    Raises
    ------
    SolveError
        If a number is out of range.
    """

    stiffness_Pa_per_m: float
    smoothing_m: float
    reach_m: float
    deepest_m: float
    points_per_direction: int = 3
    augmentations: int = 0
    friction_coefficient: float = 0.0
    stick_ratio: float = 1.0

    def __post_init__(self) -> None:
        for name in ("stiffness_Pa_per_m", "smoothing_m", "reach_m", "deepest_m"):
            if not getattr(self, name) > 0:
                raise SolveError(f"contact: {name}={getattr(self, name)} must be above 0")
        if not 0 <= self.friction_coefficient < np.inf or not self.stick_ratio > 0:
            raise SolveError(
                f"contact: friction_coefficient={self.friction_coefficient} must be 0 or more and"
                f" stick_ratio={self.stick_ratio} above 0"
            )
        if self.points_per_direction < 1 or self.augmentations < 0:
            raise SolveError(
                f"contact: points_per_direction={self.points_per_direction} must be 1 or more and"
                f" augmentations={self.augmentations} 0 or more"
            )


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactSurfaces:
    """Facets whose points are kept out (slave) of facets that keep them out (master).

    Parameters
    ----------
    slave, master : (k, 3) or (k, 8) int array
        Facets as `TaggedMesh` stores them: outside to the right, or counter-clockwise seen.
    turns : tuple of (dim, dim) arrays
        Copies of the master that may be met, each turned by this rotation about the origin.
    law : ContactLaw
    """

    slave: NDArray[np.int32]
    master: NDArray[np.int32]
    turns: tuple[NDArray[np.float64], ...]
    law: ContactLaw

    def __post_init__(self) -> None:
        if not len(self.slave) or not len(self.master) or not self.turns:
            raise SolveError("contact: slave, master and turns must not be empty")


@dataclass(frozen=True, kw_only=True, eq=False)
class Touch:
    """Where the slave's points stand against the master.

    Parameters
    ----------
    found : (s, p) int array
        Master facet (of all copies) that a point faces, -1 where none.
    where : (s, p, dim - 1) array
        Its closest point.
    gap_m : (s, p) array
        Infinite where nothing is faced, negative inside.
    pressure_Pa : (s, p) array
        Per reference area.
    """

    found: NDArray[np.int64]
    where: NDArray[np.float64]
    gap_m: NDArray[np.float64]
    pressure_Pa: NDArray[np.float64]

    @property
    def penetration_m(self) -> float:
        """The deepest penetration, 0 where there is none."""
        return max(0.0, -float(self.gap_m.min()))


class ContactBody:
    """The surfaces of a mesh, ready to be evaluated again and again.

    The multiplier of every slave point is kept between states (zero without augmentation).
    """

    def __init__(self, mesh: TaggedMesh, surfaces: ContactSurfaces, thickness_m: float) -> None:
        self.law, self._nodes = surfaces.law, mesh.nodes
        self._axes = tuple(range(mesh.dim))
        self._turns = np.stack(surfaces.turns)
        self._slave = np.ascontiguousarray(surfaces.slave)
        copies, count = len(self._turns), len(surfaces.master)
        self._master = np.tile(surfaces.master, (copies, 1))
        self._turn = np.repeat(np.arange(copies), count)
        table = facet_table(mesh.dim, self.law.points_per_direction)
        self._shapes = np.ascontiguousarray(table.values)
        tangents = np.einsum("fni,qjn->fqji", mesh.nodes[self._slave], table.gradients)
        if mesh.dim == 2:
            area = np.linalg.norm(tangents[:, :, 0], axis=-1) * thickness_m
        else:
            area = np.linalg.norm(np.cross(tangents[:, :, 0], tangents[:, :, 1]), axis=-1)
        self._area = area * table.weights
        self._apart = ~self._same_place()
        self._search = Search(
            shapes=self._shapes,
            gradients=np.ascontiguousarray(table.gradients),
            apart=self._apart,
            reach=self.law.reach_m,
            deepest=self.law.deepest_m,
        )
        adjacency = _sharing_a_node(surfaces.master)
        self._adjacency = block_diag([adjacency] * copies, format="csr")
        self._place = np.full(self._apart.shape, -1, dtype=np.int32)
        self._multiplier = np.zeros(self._area.shape)
        self.friction: Friction | None = None
        if self.law.friction_coefficient > 0:
            stick = self.law.stick_ratio * self.law.stiffness_Pa_per_m
            self.friction = Friction(
                self.law.friction_coefficient, stick, self._area, len(self._axes)
            )
        self._seen: NDArray | None = None  # the very array u that was searched last
        self._touch: Touch | None = None

    @property
    def multiplier_Pa(self) -> NDArray[np.float64]:
        """(s, p) pressures that the surfaces keep where their gap is zero (Uzawa)."""
        return self._multiplier

    @multiplier_Pa.setter
    def multiplier_Pa(self, pressure: NDArray[np.float64]) -> None:
        self._multiplier, self._seen = pressure, None

    def augment(self, u: NDArray[np.float64]) -> None:
        """Take the pressures at ``u`` as the multipliers (Uzawa)."""
        self.multiplier_Pa = self.touch(u).pressure_Pa

    def touch(self, u: NDArray[np.float64]) -> Touch:
        """Where the points of the slave stand at displacements ``u`` (n, dim)."""
        if self._seen is u:
            return self._touch
        slave, master = self._positions(u)
        s, p, d = len(slave), len(self._shapes), len(self._axes) - 1
        feet = Feet(np.empty((s, p), np.int64), np.zeros((s, p, d)), np.empty((s, p)))
        detect(slave, master, self._search, feet, self._axes)
        self._seen, self._touch = (
            u,
            Touch(
                found=feet.found,
                where=feet.where,
                gap_m=feet.gap,
                pressure_Pa=self._pressure(feet.gap),
            ),
        )
        return self._touch

    def add_forces(self, u: NDArray[np.float64], force: NDArray[np.float64]) -> tuple[float, Touch]:
        """Add nodal contact forces to internal ones (n, dim); returns contact energy and touch."""
        touch, geometry = self.touch(u), self._geometry(u)
        pressing = Pressing(touch.found, touch.where, self.multiplier_Pa)
        energy = integrate_contact_forces(geometry, pressing, force, self._axes)
        if self.friction is not None:
            self.friction.add_forces(geometry, force)
        return energy, touch

    def add_tangent(
        self,
        body: ElasticBody,
        u: NDArray[np.float64],
        direction: NDArray[np.float64],
        force: NDArray[np.float64],
        product: NDArray[np.float64],
    ) -> tuple[float, Touch]:
        """Add forces, K ``direction`` and K; every pair in touch must have its place."""
        touch, geometry = self.touch(u), self._geometry(u)
        pressing = Pressing(touch.found, touch.where, self.multiplier_Pa)
        pairs = PairTarget(body.target, body.pattern.extra_offset, self._place, direction)
        sums = Sums(force, product, body.stiffness)
        energy = integrate_contact_tangent(geometry, pressing, pairs, sums, self._axes)
        if self.friction is not None:
            self.friction.add_tangent(geometry, pairs, sums)
        return energy, touch

    def commit(self, u: NDArray[np.float64]) -> FrictionState | None:
        """Accept ``u`` as a state; friction there (None without any)."""
        if self.friction is None:
            return None
        touch = self.touch(u)
        return self.friction.commit(self._geometry(u), touch.found, touch.where)

    def restore(self, u: NDArray[np.float64], state: FrictionState | None) -> None:
        """Continue from a state; one that knew no friction starts without any slip."""
        if self.friction is None:
            return
        if state is not None:
            self.friction.restore(state)
        else:
            self.commit(u)
            self.friction.set_bounds(self.touch(u).pressure_Pa)

    def new_couples(self, u: NDArray[np.float64]) -> NDArray[np.int32] | None:
        """Groups of coupled nodes (k, r) if a pair in touch at ``u`` has no place in the matrix.

        None if all have theirs. Pairs that once touched keep their places.
        """
        touch = self.touch(u)
        gap = touch.gap_m - self.multiplier_Pa / self.law.stiffness_Pa_per_m
        pressed = (touch.found >= 0) & (gap < self.law.smoothing_m)
        s, p = np.nonzero(pressed)
        held = (np.zeros(0, dtype=int),) * 2
        if self.friction is not None:
            a, b = np.nonzero(self.friction.active)
            held = a, self.friction.state.anchor[a, b]
        pulled = np.any(self._place[held] < 0)
        if not pulled and not np.any(self._place[s, touch.found[s, p]] < 0):
            return None
        s, p = np.nonzero((touch.found >= 0) & (gap < _COUPLED_WITHIN * self.law.smoothing_m))
        rows, columns = (np.append(*pair) for pair in zip((s, touch.found[s, p]), held))
        near = coo_array((np.ones(len(rows)), (rows, columns)), shape=self._place.shape)
        wanted = (self._place >= 0) | ((near.tocsr() @ self._adjacency).toarray() > 0)
        pairs = np.argwhere(wanted & self._apart)
        self._place[:] = -1
        self._place[pairs[:, 0], pairs[:, 1]] = np.arange(len(pairs))
        return np.hstack([self._slave[pairs[:, 0]], self._master[pairs[:, 1]]])

    def _positions(self, u: NDArray[np.float64]) -> tuple[NDArray, NDArray]:
        now = self._nodes + u
        turned = np.einsum("mij,mqj->mqi", self._turns[self._turn], now[self._master])
        return now[self._slave], turned

    def _geometry(self, u: NDArray[np.float64]) -> Geometry:
        slave_m, master_m = self._positions(u)
        return Geometry(
            slave=self._slave,
            master=self._master,
            turn=self._turn,
            turns=self._turns,
            slave_m=slave_m,
            master_m=master_m,
            shapes=self._shapes,
            area=self._area,
            stiffness=self.law.stiffness_Pa_per_m,
            smoothing=self.law.smoothing_m,
            curved_to=self.law.deepest_m / _CURVED,
        )

    def _pressure(self, gap: NDArray[np.float64]) -> NDArray[np.float64]:
        k, d = self.law.stiffness_Pa_per_m, self.law.smoothing_m
        shifted = gap - self.multiplier_Pa / k
        return np.where(
            shifted <= -d, -k * shifted, k * np.clip(d - shifted, 0, 2 * d) ** 2 / (4 * d)
        )

    def _same_place(self) -> NDArray[np.bool_]:
        """(s, m): facets that share a node, so that the one is the other's continuation."""
        turned = ~np.all(np.isclose(self._turns, np.eye(len(self._axes))), axis=(1, 2))
        shared = _incidence(self._slave, len(self._nodes)) @ (
            _incidence(self._master, len(self._nodes)).T
        )
        return (shared.toarray() > 0) & ~turned[self._turn]


def _incidence(facets: NDArray[np.int32], n_nodes: int) -> csr_array:
    rows = np.arange(0, facets.size + 1, facets.shape[1])
    return csr_array((np.ones(facets.size), facets.ravel(), rows), shape=(len(facets), n_nodes))


def _sharing_a_node(facets: NDArray[np.int32]) -> csr_array:
    """(m, m) which facets are neighbours, each its own."""
    table = _incidence(facets, int(facets.max()) + 1)
    return table @ table.T
