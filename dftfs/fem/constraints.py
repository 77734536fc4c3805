"""What holds and moves the nodes, and the map from free unknowns to nodal displacements.

Every constraint here is affine, ``u = A q + g(t)``: supports drop columns of A, a driven
boundary gives g(t), a cyclic cut copies its partner's rows turned by R, and a boundary that may
translate shares one carrier node. A is never formed: nodes point to the carrier of their
unknowns, and assembly uses that table.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from dftfs.errors import SolveError
from dftfs.fem.mesh import TaggedMesh, matched_cut_nodes, rotation_about_z

Motion = Callable[[float], tuple[NDArray, NDArray, NDArray]]


@dataclass(frozen=True, kw_only=True, eq=False)
class Support:
    """Nodes held at zero displacement in the given directions (0, 1, 2 for x, y, z)."""

    nodes: NDArray[np.int32]
    components: tuple[int, ...]

    def __post_init__(self) -> None:
        _freeze(self, "nodes")


@dataclass(frozen=True, kw_only=True, eq=False)
class Drive:
    """Nodes whose displacement follows a scalar parameter t.

    Parameters
    ----------
    nodes : (k,) int array
    motion : function of t
        Returns g(t), g'(t), g''(t), each (k, dim), in m.
    components : tuple of int
        Driven directions; the others stay free.
    free_translation : bool
        Add one common, unknown in-plane translation to all driven nodes (no net force then).
    """

    nodes: NDArray[np.int32]
    motion: Motion
    components: tuple[int, ...]
    free_translation: bool = False

    def __post_init__(self) -> None:
        _freeze(self, "nodes")


@dataclass(frozen=True, kw_only=True, eq=False)
class CyclicSymmetry:
    """Slave nodes move like their masters, turned: ``u_slave = rotation @ u_master``."""

    slave_nodes: NDArray[np.int32]
    master_nodes: NDArray[np.int32]
    rotation: NDArray[np.float64]

    def __post_init__(self) -> None:
        _freeze(self, "slave_nodes", "master_nodes", "rotation")


def clamped(nodes: NDArray, components: tuple[int, ...] = (0, 1, 2)) -> Support:
    """Hold nodes; ``components=(2,)`` on the mid-plane is a mirror symmetry in z."""
    return Support(nodes=np.unique(nodes), components=tuple(components))


def rigid_rotation(
    mesh: TaggedMesh,
    nodes: NDArray,
    *,
    centre_m: tuple[float, float] = (0.0, 0.0),
    axial_fixed: bool = True,
    free_translation: bool = False,
) -> Drive:
    """Rotate nodes rigidly by t rad about the z axis through ``centre_m``.

    The reaction conjugate to t is then the torque about that axis in Nm. With
    ``free_translation`` the body of driven nodes finds its own centre (a pure moment).
    """
    nodes = np.unique(nodes)
    arm = np.zeros((len(nodes), mesh.dim))
    arm[:, :2] = mesh.nodes[nodes, :2] - np.asarray(centre_m)
    quarter = np.zeros_like(arm)
    quarter[:, 0], quarter[:, 1] = -arm[:, 1], arm[:, 0]

    def motion(t: float) -> tuple[NDArray, NDArray, NDArray]:
        s, c = np.sin(t), np.cos(t)
        versine = 2 * np.sin(t / 2) ** 2  # 1 - cos t without cancellation
        return s * quarter - versine * arm, c * quarter - s * arm, -s * quarter - c * arm

    in_plane = (0, 1) if mesh.dim == 2 or not axial_fixed else (0, 1, 2)
    return Drive(nodes=nodes, motion=motion, components=in_plane, free_translation=free_translation)


def cyclic_symmetry(
    mesh: TaggedMesh, n_sectors: int, *, cut_low: str = "cut_low", cut_high: str = "cut_high"
) -> CyclicSymmetry:
    """Tie ``cut_high`` to ``cut_low`` so that one sector answers for the whole ring."""
    low, high = matched_cut_nodes(mesh, n_sectors, cut_low=cut_low, cut_high=cut_high)
    rotation = rotation_about_z(2 * np.pi / n_sectors, mesh.dim)
    return CyclicSymmetry(slave_nodes=high, master_nodes=low, rotation=rotation)


@dataclass(frozen=True, kw_only=True, eq=False)
class DofMap:
    """The affine map ``u = A q + g`` between free unknowns q and nodal displacements u.

    Parameters
    ----------
    carrier : (n,) int32 array
        The node that carries a node's unknowns: itself, its cyclic master, or the extra node of
        a common translation (number n).
    turned : (n,) bool array
        Whether the node's displacement is its carrier's turned by ``rotation``.
    rotation : (dim, dim) array
    dof : (n_carriers, dim) int32 array
        Number of the free unknown, -1 where there is none.
    prescribed : (n, dim) bool array
        Where a support or a drive acts.
    """

    carrier: NDArray[np.int32]
    turned: NDArray[np.bool_]
    rotation: NDArray[np.float64]
    dof: NDArray[np.int32]
    prescribed: NDArray[np.bool_]
    n_free: int = field(init=False)

    def __post_init__(self) -> None:
        _freeze(self, "carrier", "turned", "rotation", "dof", "prescribed")
        object.__setattr__(self, "n_free", int(self.dof.max()) + 1)

    def restrict(self, nodal: NDArray[np.float64]) -> NDArray[np.float64]:
        """A^T applied to nodal values (n, dim): generalised forces (n_free,)."""
        n = len(self.carrier)
        total = np.zeros(self.dof.shape)
        moved = np.flatnonzero(self.carrier != np.arange(n))
        total[:n] = nodal
        total[moved] = 0.0
        share = np.where(self.turned[moved, None], nodal[moved] @ self.rotation, nodal[moved])
        np.add.at(total, self.carrier[moved], share)
        free = self.dof >= 0
        result = np.empty(self.n_free)
        result[self.dof[free]] = total[free]
        return result

    def satisfied(self, field: NDArray[np.float64], given: NDArray[np.float64]) -> NDArray:
        """The field A q + ``given`` that agrees with ``field`` (n, dim) where unknowns are carried.

        Extrapolation multiplies round-off by some twenty a step: left alone, a slave would drift
        from its master until the two sides of a cut came apart.
        """
        n_carriers = len(self.dof)
        speaker = np.zeros(n_carriers, dtype=np.int64)
        own = np.flatnonzero(~self.turned)[::-1]
        speaker[self.carrier[own]] = own  # a node that moves as its carrier does
        free = self.dof >= 0
        values = np.empty(self.n_free)
        values[self.dof[free]] = (field - given)[speaker][free]
        return self.expand(values) + given

    def expand(self, free_values: NDArray[np.float64]) -> NDArray[np.float64]:
        """A applied to free values (n_free,): nodal displacements (n, dim) without g."""
        carried = np.where(self.dof >= 0, free_values[self.dof], 0.0)[self.carrier]
        carried[self.turned] = carried[self.turned] @ self.rotation.T
        return carried


def dof_map(
    mesh: TaggedMesh,
    supports: tuple[Support, ...],
    drive: Drive | None,
    cyclic: CyclicSymmetry | None,
) -> DofMap:
    """Number the free unknowns of a mesh under its constraints.

    Raises
    ------
    SolveError
        If constraints contradict each other or leave nothing free.
    """
    n, dim = mesh.nodes.shape
    held = np.zeros((n + 1, dim), dtype=bool)
    for support in supports:
        _check_nodes("support", support.nodes, n)
        held[np.ix_(support.nodes, [c for c in support.components if c < dim])] = True
    carrier = np.arange(n, dtype=np.int32)
    turned = np.zeros(n, dtype=bool)
    rotation = np.eye(dim)
    shared = drive is not None and drive.free_translation
    if drive is not None:
        _check_nodes("drive", drive.nodes, n)
        if held[np.ix_(drive.nodes, drive.components)].any():
            raise SolveError("a driven node is also held by a support in a driven direction")
        held[np.ix_(drive.nodes, drive.components)] = True
    if shared:
        if cyclic is not None:
            raise SolveError("free_translation has no meaning in a cyclic sector: it is zero there")
        if set(range(dim)) - set(drive.components):
            raise SolveError("free_translation needs every direction of the drive to be driven")
        carrier[drive.nodes] = n
    prescribed = held[:n].copy()
    held[n] = [not shared or c > 1 for c in range(dim)]
    if cyclic is not None:
        rotation = np.asarray(cyclic.rotation, dtype=float)
        _check_cyclic(cyclic, held, n)
        carrier[cyclic.slave_nodes] = cyclic.master_nodes
        turned[cyclic.slave_nodes] = True
    carries = np.zeros(n + 1, dtype=bool)
    carries[carrier] = True
    free = carries[:, None] & ~held
    if not free.any():
        raise SolveError("every displacement is held or driven: nothing to solve for")
    dof = np.full((n + 1, dim), -1, dtype=np.int32)
    dof[free] = np.arange(np.count_nonzero(free))
    return DofMap(carrier=carrier, turned=turned, rotation=rotation, dof=dof, prescribed=prescribed)


def _freeze(owner: object, *names: str) -> None:
    """Replace array fields of a frozen dataclass by read-only copies."""
    for name in names:
        array = np.array(getattr(owner, name))
        array.setflags(write=False)
        object.__setattr__(owner, name, array)


def _check_nodes(what: str, nodes: NDArray, n: int) -> None:
    if not len(nodes) or nodes.min() < 0 or nodes.max() >= n:
        raise SolveError(f"{what}: needs node numbers in 0..{n - 1}, got {len(nodes)} of them")


def _check_cyclic(cyclic: CyclicSymmetry, held: NDArray, n: int) -> None:
    slave, master = cyclic.slave_nodes, cyclic.master_nodes
    _check_nodes("cyclic slave", slave, n)
    _check_nodes("cyclic master", master, n)
    if len(slave) != len(master) or np.intersect1d(slave, master).size:
        raise SolveError("cyclic: slaves and masters must be partners, none of them both")
    differ = (held[slave] != held[master]).any(axis=1)
    if differ.any():
        k = int(differ.argmax())
        raise SolveError(
            f"cyclic: node {slave[k]} and its master {master[k]} are not held in the same"
            " directions"
        )
    mixes = np.abs(cyclic.rotation) > 1e-14
    if ((held[master].astype(int) @ mixes.T > 0) & ~held[master]).any():
        raise SolveError(
            "cyclic: a node at the cut is held in some of the directions that it turns"
        )
