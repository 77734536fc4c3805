"""Linear mechanics of a meshed body about a state: matrices, rigid interfaces, condensation, modes.

A body's free displacements and the rigid motions of its interfaces (a clamped rim, a flange on a
bearing) are the unknowns q of ``u = T q``; stiffness and mass are T^T K T and T^T M T. K is the
tangent at a displacement field, so that a loaded body's modes and its stability come out alike.

Source: Bathe, Finite Element Procedures (1996), 4.2.4 (consistent mass), 8.2.4 (static
condensation), 11.6 (shift and invert); Lehoucq, Sorensen & Yang, ARPACK (1998).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, diags_array, hstack, triu
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh

from dftfs.errors import SolveError
from dftfs.fem.assembly import STATUS_OK, ElasticBody
from dftfs.fem.constraints import dof_map
from dftfs.fem.elements import gauss_table
from dftfs.fem.linear_solver import SymmetricSolver, make_solver
from dftfs.fem.mesh import TaggedMesh, jacobian_determinants

RIGID_MOTIONS = ("x", "y", "z", "rx", "ry", "rz")
_POINTS = 3  # Gauss points per direction
_START = 12345  # seed of Lanczos' first vector: the same input gives the same bits


def tangent_matrix(
    mesh: TaggedMesh,
    *,
    youngs_modulus_Pa: float,
    poisson_ratio: float,
    thickness_m: float = 1.0,
    displacement_m: NDArray[np.float64] | None = None,
) -> csr_array:
    """Tangent stiffness of the unsupported body, (n dim, n dim), unknowns node by node.

    Parameters
    ----------
    thickness_m : float
        Of a planar mesh; 1 for solids.
    displacement_m : (n, dim) array or None
        Where the tangent is taken; None at rest.

    Raises
    ------
    SolveError
        If the displacements invert an element.
    """
    body = ElasticBody(
        mesh,
        dof_map(mesh, (), None, None),
        youngs_modulus_Pa=youngs_modulus_Pa,
        poisson_ratio=poisson_ratio,
        thickness_m=thickness_m,
    )
    u = np.zeros_like(mesh.nodes) if displacement_m is None else displacement_m
    evaluation, _ = body.tangent(u, np.zeros_like(u))
    if evaluation.status != STATUS_OK:
        raise SolveError("no tangent: the displacements invert an element")
    n = mesh.nodes.size
    upper = csr_array((body.stiffness, body.pattern.indices, body.pattern.indptr), shape=(n, n))
    return (upper + triu(upper, 1).T).tocsr()


def mass_matrix(
    mesh: TaggedMesh, *, density_kg_per_m3: float, thickness_m: float = 1.0
) -> csr_array:
    """Consistent mass of the body, (n dim, n dim), in kg."""
    table = gauss_table(mesh.kind.name, _POINTS)
    weight = density_kg_per_m3 * thickness_m * jacobian_determinants(mesh) * table.weights
    local = np.einsum("mq,qa,qb->mab", weight, table.values, table.values, optimize=True)
    rows = np.repeat(mesh.cells, mesh.cells.shape[1], axis=1).ravel()
    columns = np.tile(mesh.cells, (1, mesh.cells.shape[1])).ravel()
    n, dim = mesh.nodes.shape
    nodal = coo_array((local.ravel(), (rows, columns)), shape=(n, n)).tocoo()
    blocks = [
        coo_array((nodal.data, (dim * nodal.row + i, dim * nodal.col + i)), (n * dim, n * dim))
        for i in range(dim)
    ]
    return sum(blocks[1:], blocks[0]).tocsr()


def rigid_motions(
    mesh: TaggedMesh, nodes: NDArray, names: Sequence[str], about_m: Sequence[float] = (0, 0, 0)
) -> csr_array:
    """Columns (n dim, r) of small rigid motions of some nodes, nothing elsewhere.

    ``names`` are of RIGID_MOTIONS: translations in m, rotations in rad about axes through
    ``about_m``. A planar mesh knows ``x``, ``y`` and ``rz``.
    """
    nodes = np.unique(nodes)
    place = np.zeros((len(nodes), 3))
    place[:, : mesh.dim] = mesh.nodes[nodes]
    place -= np.asarray(about_m, dtype=float)
    columns = []
    for name in names:
        axis = np.eye(3)["xyz".index(name[-1])]
        field = np.cross(axis, place) if name[0] == "r" else np.tile(axis, (len(nodes), 1))
        rows = (mesh.dim * nodes[:, None] + np.arange(mesh.dim)).ravel()
        values = field[:, : mesh.dim].ravel()
        columns.append(
            coo_array((values, (rows, np.zeros(len(rows), dtype=int))), shape=(mesh.nodes.size, 1))
        )
    return hstack(columns, format="csr")


@dataclass(frozen=True, kw_only=True, eq=False)
class Reduction:
    """The map u = T q: free displacements one by one, then the interfaces' motions.

    Parameters
    ----------
    free : (f,) int array
        Unknowns of the body (node by node) that move on their own.
    interfaces : (n dim, r) sparse array
        Columns of `rigid_motions`.
    """

    free: NDArray[np.int64]
    interfaces: csr_array

    @property
    def transform(self) -> csr_array:
        """T, (n dim, f + r)."""
        size = self.interfaces.shape[0]
        own = coo_array(
            (np.ones(len(self.free)), (self.free, np.arange(len(self.free)))),
            shape=(size, len(self.free)),
        )
        return hstack([own, self.interfaces], format="csr")


def reduction(
    mesh: TaggedMesh,
    *,
    held: NDArray[np.bool_],
    tied: Sequence[NDArray] = (),
    interfaces: Sequence[csr_array] = (),
) -> Reduction:
    """Free unknowns: neither held (n, dim) nor of nodes tied to an interface."""
    held = held.copy()
    for nodes in tied:
        held[np.unique(nodes)] = True
    columns = [*interfaces] or [csr_array((mesh.nodes.size, 0))]
    return Reduction(free=np.flatnonzero(~held.ravel()), interfaces=hstack(columns, format="csr"))


def condensed(stiffness: csr_array, parts: Reduction, *, solver: str = "auto") -> NDArray:
    """Stiffness (r, r) of the interfaces' motions, the rest in equilibrium.

    Raises
    ------
    SolveError
        If the rest can move freely.
    """
    columns = parts.interfaces
    products = (stiffness @ columns).tocsr()
    own = (columns.T @ products).toarray()
    right = products[parts.free].toarray()
    inner = stiffness[parts.free][:, parts.free]
    factors = factored(inner, solver)
    try:
        moved = np.stack([factors.solve(right[:, k]) for k in range(right.shape[1])], axis=1)
    finally:
        factors.close()
    found = own - right.T @ moved
    return (found + found.T) / 2


def lowest_modes(
    stiffness: csr_array,
    mass: csr_array,
    count: int,
    *,
    shift: float = 0.0,
    solver: str = "auto",
) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """Eigenvalues of K v = lambda M v next to a shift, by shift and invert.

    Parameters
    ----------
    shift : float
        In the unit of lambda (1/s^2). Below 0 for a body that can move freely.

    Returns
    -------
    values : (count,) array, ascending
    vectors : (n, count) array, normalised to unit modal mass
    below : int
        How many eigenvalues lie below the shift (negative pivots: Sylvester's law of inertia).

    Raises
    ------
    SolveError
        If the shifted matrix is singular or the iteration does not converge.
    """
    size = stiffness.shape[0]
    if not 0 < count < size:
        raise SolveError(f"modes: count = {count} must be 1 to {size - 1}")
    moved = stiffness - shift * mass if shift else stiffness
    factors = factored(moved, solver)
    start = np.random.default_rng(_START).standard_normal(size)
    inverse = LinearOperator((size, size), matvec=factors.solve, dtype=float)
    try:
        values, vectors = eigsh(
            stiffness, k=count, M=mass, sigma=shift, OPinv=inverse, v0=start, which="LM"
        )
        below = factors.negative_pivots
    except ArpackError as error:
        raise SolveError(f"modes: the iteration does not converge: {error}") from None
    finally:
        factors.close()
    order = np.argsort(values)
    return values[order], vectors[:, order], below


def factored(matrix: csr_array, solver: str = "auto") -> SymmetricSolver:
    """The factors of a symmetric matrix; the caller closes them.

    Raises
    ------
    SolveError
        If the matrix is singular.
    """
    upper = triu(matrix + diags_array(np.zeros(matrix.shape[0])), format="csr")
    upper.sort_indices()
    made = make_solver(upper.indptr.astype(np.int32), upper.indices.astype(np.int32), prefer=solver)
    if not made.factorise(np.ascontiguousarray(upper.data)):
        made.close()
        raise SolveError("the matrix is singular: a part of the body can move freely")
    return made
