"""The sparse tangent's pattern and its filling, made once per mesh and constraints.

Only the upper triangle is kept (PARDISO's symmetric format). Since a node's free unknowns are
numbered together, one integer per pair of an element's nodes says where its block goes: 0.8 kB
a hex20 element where a full scatter map takes 7 kB.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import csr_array

from dftfs.fem.constraints import DofMap
from dftfs.fem.elasticity import lame_constants
from dftfs.fem.elements import gauss_table
from dftfs.fem.integration import Domain, Target, integrate_forces, integrate_tangent
from dftfs.fem.mesh import TaggedMesh
from dftfs.fem.sparse import symmetric_product

STATUS_OK = 0
STATUS_INVERTED = 1


@dataclass(frozen=True, kw_only=True, eq=False)
class SymmetricPattern:
    """Sparsity of an upper triangle, and where each pair of element nodes adds to it.

    Parameters
    ----------
    indptr : (n_free + 1,) int32 array
    indices : (nnz,) int32 array
        Sorted columns, the diagonal first in every row.
    first : (n_carriers,) int32 array
        A carrier's first free unknown.
    offset : (m, p (p + 1) / 2) int32 array
        Start of the block of the node pair a <= b, see `integration.scatter`.
    extra_offset : (k, r (r + 1) / 2) int32 array
        The same for the coupled nodes that are no cells.
    """

    indptr: NDArray[np.int32]
    indices: NDArray[np.int32]
    first: NDArray[np.int32]
    offset: NDArray[np.int32]
    extra_offset: NDArray[np.int32]


@dataclass(frozen=True, kw_only=True, eq=False)
class Evaluation:
    """Internal forces at a displacement.

    Parameters
    ----------
    force_N : (n, dim) array
    energy_J : float
    det_F_min : float
    status : int
        STATUS_INVERTED if an element is inverted (det F <= 0) or a value is not finite.
    cell : int
        Where det F is smallest.
    """

    force_N: NDArray[np.float64]
    energy_J: float
    det_F_min: float
    status: int
    cell: int


@njit(cache=True)
def _expand_rows(indptr, neighbours, dof, count, rows, columns):
    """Columns of every free row from the carriers' upper adjacency; returns pair starts."""
    start = np.zeros(neighbours.shape[0], dtype=np.int32)
    position = 0
    for low in range(indptr.shape[0] - 1):
        width = 0
        for at in range(indptr[low], indptr[low + 1]):
            start[at] = width
            width += count[neighbours[at]]
        skipped = 0
        for i in range(dof.shape[1]):
            if dof[low, i] < 0:
                continue
            rows[dof[low, i]] = position
            seen = 0
            for at in range(indptr[low], indptr[low + 1]):
                high = neighbours[at]
                for k in range(dof.shape[1]):
                    if dof[high, k] < 0:
                        continue
                    if seen >= skipped:
                        columns[position] = dof[high, k]
                        position += 1
                    seen += 1
            skipped += 1
    rows[rows.shape[0] - 1] = position
    return start


@njit(cache=True)
def _pair_offsets(cells, carrier, indptr, neighbours, start, offset):
    for e in range(cells.shape[0]):
        pair = 0
        for a in range(cells.shape[1]):
            for b in range(a, cells.shape[1]):
                low, high = carrier[cells[e, a]], carrier[cells[e, b]]
                if low > high:
                    low, high = high, low
                left, right = indptr[low], indptr[low + 1]
                while right - left > 1:
                    middle = (left + right) // 2
                    if neighbours[middle] <= high:
                        left = middle
                    else:
                        right = middle
                offset[e, pair] = start[left]
                pair += 1


def symmetric_pattern(
    cells: NDArray[np.int32], dofs: DofMap, extra: NDArray[np.int32] | None = None
) -> SymmetricPattern:
    """Upper-triangle pattern of cells (m, p) under a map of unknowns.

    ``extra`` (k, r) are further groups of nodes that couple, as two facets in contact do.
    """
    extra = np.empty((0, 1), dtype=np.int32) if extra is None else extra
    n_carriers = len(dofs.dof)
    carried = np.concatenate([dofs.carrier[cells].ravel(), dofs.carrier[extra].ravel()])
    sizes = np.repeat([cells.shape[1], extra.shape[1]], [len(cells), len(extra)])
    touching = csr_array(
        (np.ones(carried.size, dtype=np.int8), carried, np.append(0, np.cumsum(sizes))),
        shape=(len(sizes), n_carriers),
    )
    graph = (touching.T @ touching).tocsr()
    graph.sort_indices()
    row = np.repeat(np.arange(n_carriers, dtype=np.int32), np.diff(graph.indptr))
    upper = graph.indices >= row
    neighbours = graph.indices[upper].astype(np.int32)
    node_indptr = np.zeros(n_carriers + 1, dtype=np.int32)
    np.cumsum(np.bincount(row[upper], minlength=n_carriers), out=node_indptr[1:])
    count = (dofs.dof >= 0).sum(axis=1).astype(np.int32)
    pairs = np.repeat(count, np.diff(node_indptr)).astype(np.int64) @ count[neighbours]
    own = (count.astype(np.int64) * (count - 1)).sum() // 2
    indptr = np.empty(dofs.n_free + 1, dtype=np.int32)
    indices = np.empty(int(pairs - own), dtype=np.int32)
    start = _expand_rows(node_indptr, neighbours, dofs.dof, count, indptr, indices)
    offsets = []
    for group in (cells, extra):
        width = group.shape[1]
        offset = np.empty((len(group), width * (width + 1) // 2), dtype=np.int32)
        _pair_offsets(group, dofs.carrier, node_indptr, neighbours, start, offset)
        offsets.append(offset)
    first = np.where(dofs.dof >= 0, dofs.dof, np.iinfo(np.int32).max).min(axis=1)
    return SymmetricPattern(
        indptr=indptr,
        indices=indices,
        first=first.astype(np.int32),
        offset=offsets[0],
        extra_offset=offsets[1],
    )


class ElasticBody:
    """A mesh with its material, ready to be integrated again and again.

    Parameters
    ----------
    thickness_m : float
        Of a plane-stress mesh; 1 for solids.
    """

    def __init__(
        self,
        mesh: TaggedMesh,
        dofs: DofMap,
        *,
        youngs_modulus_Pa: float,
        poisson_ratio: float,
        thickness_m: float,
    ) -> None:
        self._dim = mesh.dim
        self._axes = tuple(range(mesh.dim))
        self._dofs = dofs
        table = gauss_table(mesh.kind.name, 3)
        lam, mu = lame_constants(youngs_modulus_Pa, poisson_ratio, plane_stress=mesh.dim == 2)
        self._domain = Domain(
            nodes=mesh.nodes,
            cells=mesh.cells,
            gradients=table.gradients,
            weights=table.weights,
            lam=lam,
            mu=mu,
            thickness=thickness_m,
        )
        self.couple(None)

    def couple(self, nodes: NDArray[np.int32] | None) -> None:
        """Make the pattern anew with further groups of coupled nodes (k, r), zero-filled."""
        dofs = self._dofs
        self.pattern = self.stiffness = self.target = None  # not two of each at a time
        self.pattern = pattern = symmetric_pattern(self._domain.cells, dofs, nodes)
        self.stiffness = np.zeros(len(pattern.indices))
        self.target = Target(
            carrier=dofs.carrier,
            turned=dofs.turned,
            rotation=dofs.rotation,
            dof=dofs.dof,
            first=pattern.first,
            offset=pattern.offset,
            indptr=pattern.indptr,
        )

    def forces(self, u: NDArray[np.float64]) -> Evaluation:
        """Internal forces at displacements ``u`` (n, dim) in m."""
        force = np.empty_like(self._domain.nodes)
        found = integrate_forces(self._domain, _read_only(u), force, self._axes)
        return _evaluation(force, *found)

    def tangent(
        self, u: NDArray[np.float64], direction: NDArray[np.float64]
    ) -> tuple[Evaluation, NDArray[np.float64]]:
        """Internal forces, and K in ``stiffness``; also the nodal product K ``direction``."""
        force, product = np.empty_like(self._domain.nodes), np.empty_like(self._domain.nodes)
        found = integrate_tangent(
            self._domain,
            self.target,
            _read_only(u),
            _read_only(direction),
            force,
            product,
            self.stiffness,
            self._axes,
        )
        return _evaluation(force, *found), product

    def commit(self, u: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Accept ``u`` as a state; what a history would be (None: this body has none)."""
        return None

    def restore(self, history: NDArray[np.float64] | None) -> None:
        """Continue from a state's history: nothing to do without one."""

    def multiply(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        """``stiffness`` times a vector of free values (n_free,)."""
        return symmetric_product(self.pattern.indptr, self.pattern.indices, self.stiffness, x)


def _read_only(array: NDArray[np.float64]) -> NDArray[np.float64]:
    """One type for numba, which compiles read-only and writable arrays apart."""
    view = np.ascontiguousarray(array).view()
    view.setflags(write=False)
    return view


def _evaluation(
    force: NDArray[np.float64], energy: float, smallest: float, cell: int
) -> Evaluation:
    good = smallest > 0 and np.isfinite(energy)
    return Evaluation(
        force_N=force,
        energy_J=energy,
        det_F_min=smallest,
        status=STATUS_OK if good else STATUS_INVERTED,
        cell=cell,
    )
