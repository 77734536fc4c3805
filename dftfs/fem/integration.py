"""The loop over elements: forces, tangent and energy of a whole mesh.

No element matrix is stored: its blocks go straight into the upper triangle of the sparse matrix.
One thread, one order of summation: the same input gives the same bits.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from dftfs.fem.elasticity import add_force, add_tangent, reference_gradients, stress_at


class Domain(NamedTuple):
    """What is integrated over.

    Parameters
    ----------
    nodes : (n, dim) array, cells : (m, p) int32 array
    gradients : (q, dim, p) array, weights : (q,) array
        Shape functions and quadrature on the unit cell.
    lam, mu : float
        In Pa, see `elasticity.lame_constants`.
    thickness : float
        In m; 1 for solids.
    """

    nodes: NDArray[np.float64]
    cells: NDArray[np.int32]
    gradients: NDArray[np.float64]
    weights: NDArray[np.float64]
    lam: float
    mu: float
    thickness: float


class Target(NamedTuple):
    """Where an element's tangent goes: `constraints.DofMap` and `assembly.SymmetricPattern`."""

    carrier: NDArray[np.int32]
    turned: NDArray[np.bool_]
    rotation: NDArray[np.float64]
    dof: NDArray[np.int32]
    first: NDArray[np.int32]
    offset: NDArray[np.int32]
    indptr: NDArray[np.int32]


class Sums(NamedTuple):
    """What is added up over elements or pairs of facets.

    Parameters
    ----------
    force : (n, dim) array
        Nodal forces in N.
    product : (n, dim) array
        The tangent times a nodal direction.
    data : (nnz,) array
        Values of the sparse tangent.
    """

    force: NDArray[np.float64]
    product: NDArray[np.float64]
    data: NDArray[np.float64]


@njit(cache=True)
def integrate_forces(domain, u, force, axes):
    """Internal forces (n, dim) in N at displacements u (n, dim) in m.

    Returns
    -------
    energy : float
        Strain energy in J.
    smallest : float
        The smallest det F; not above 0 means that ``cell`` is inverted.
    cell : int
    """
    D = len(axes)
    P = 20 if D == 3 else 8
    X, U, f, grad = np.empty(D * P), np.empty(D * P), np.empty(D * P), np.empty(D * P)
    F, S, J, inverse = np.empty(D * D), np.empty(D * D), np.empty(D * D), np.empty(D * D)
    force[:] = 0.0
    energy = 0.0
    smallest = np.inf
    cell = -1
    for e in range(domain.cells.shape[0]):
        gather(domain.nodes, domain.cells[e], X, axes)
        gather(u, domain.cells[e], U, axes)
        f[:] = 0.0
        for q in range(domain.weights.shape[0]):
            volume = reference_gradients(X, domain.gradients[q], grad, J, inverse, axes)
            weight = domain.thickness * domain.weights[q] * volume
            density, det = stress_at(U, grad, domain.lam, domain.mu, F, S, axes)
            add_force(f, grad, F, S, weight, axes)
            energy += weight * density
            if det < smallest:
                smallest = det
                cell = e
        add_nodal(f, domain.cells[e], force, axes)
    return energy, smallest, cell


@njit(cache=True)
def integrate_tangent(domain, target, u, direction, force, product, data, axes):
    """`integrate_forces`, with the tangent K in ``data`` and ``product`` = K ``direction``."""
    D = len(axes)
    P = 20 if D == 3 else 8
    X, U, V = np.empty(D * P), np.empty(D * P), np.empty(D * P)
    f, y, grad = np.empty(D * P), np.empty(D * P), np.empty(D * P)
    F, S, J, inverse = np.empty(D * D), np.empty(D * D), np.empty(D * D), np.empty(D * D)
    K, row = np.empty(P * D * D * P), np.empty(5 * D * P + D * D)
    carrier, turned = np.empty(P, dtype=np.int32), np.empty(P, dtype=np.bool_)
    force[:] = 0.0
    data[:] = 0.0
    product[:] = 0.0
    energy = 0.0
    smallest = np.inf
    cell = -1
    for e in range(domain.cells.shape[0]):
        nodes = domain.cells[e]
        gather(domain.nodes, nodes, X, axes)
        gather(u, nodes, U, axes)
        f[:] = 0.0
        K[:] = 0.0
        for q in range(domain.weights.shape[0]):
            volume = reference_gradients(X, domain.gradients[q], grad, J, inverse, axes)
            weight = domain.thickness * domain.weights[q] * volume
            density, det = stress_at(U, grad, domain.lam, domain.mu, F, S, axes)
            add_force(f, grad, F, S, weight, axes)
            add_tangent(K, grad, F, S, (domain.lam, domain.mu), weight, row, axes)
            energy += weight * density
            if det < smallest:
                smallest = det
                cell = e
        add_nodal(f, nodes, force, axes)
        if gather(direction, nodes, V, axes):
            y[:] = 0.0
            _add_product(K, V, y, axes)
            add_nodal(y, nodes, product, axes)
        carriers_of(nodes, target, carrier, turned)
        if turned.any():
            turn_blocks(K, turned, target.rotation, J, axes)
        scatter(K, carrier, target.offset[e], target, data, axes)
    return energy, smallest, cell


@njit(cache=True)
def carriers_of(nodes, target, carrier, turned):
    """Carrier of every node (p,), and whether the node is a turned copy of it."""
    for a in range(nodes.shape[0]):
        carrier[a] = target.carrier[nodes[a]]
        turned[a] = target.turned[nodes[a]]


@njit(cache=True)
def gather(field, nodes, local, axes):
    """An element's values, flat (D, P); returns whether any is not zero."""
    P = nodes.shape[0]
    some = False
    for a in range(P):
        for i in range(len(axes)):
            value = field[nodes[a], i]
            local[i * P + a] = value
            some |= value != 0.0
    return some


@njit(cache=True)
def add_nodal(local, nodes, field, axes):
    """Add an element's values, flat (D, P), to a nodal field (n, D)."""
    P = nodes.shape[0]
    for a in range(P):
        for i in range(len(axes)):
            field[nodes[a], i] += local[i * P + a]


@njit(cache=True)
def turn_blocks(K, turned, rotation, half, axes):
    """K_ab -> R_a^T K_ab R_b for the nodes that are turned copies of their carriers."""
    D = len(axes)
    P = turned.shape[0]
    for a in range(P):
        for b in range(a, P):
            if turned[a]:
                for i in range(D):
                    for k in range(D):
                        half[i * D + k] = 0.0
                        for j in range(D):
                            half[i * D + k] += rotation[j, i] * K[((a * D + j) * D + k) * P + b]
                for m in range(D * D):
                    K[(a * D * D + m) * P + b] = half[m]
            if turned[b]:
                for i in range(D):
                    for k in range(D):
                        half[i * D + k] = 0.0
                        for j in range(D):
                            half[i * D + k] += K[((a * D + i) * D + j) * P + b] * rotation[j, k]
                for m in range(D * D):
                    K[(a * D * D + m) * P + b] = half[m]


@njit(cache=True)
def _add_product(K, v, y, axes):
    """y += K v for one element whose K holds the pairs a <= b."""
    D = len(axes)
    P = 20 if D == 3 else 8
    for a in range(P):
        for i in range(D):
            for k in range(D):
                at = ((a * D + i) * D + k) * P
                y[i * P + a] += K[at + a] * v[k * P + a]
                for b in range(a + 1, P):
                    y[i * P + a] += K[at + b] * v[k * P + b]
                    y[k * P + b] += K[at + b] * v[i * P + a]


@njit(cache=True)
def scatter(K, carrier, offset, target, data, axes):
    """Add an element's blocks, flat (P, D, D, P) with a <= b, to the upper triangle.

    ``offset[pair]`` is where the columns of the later carrier start in the first row of the
    earlier one; the rows below are one entry shorter each.
    """
    D = len(axes)
    P = carrier.shape[0]
    pair = -1
    for a in range(P):
        for b in range(a, P):
            pair += 1
            low, high = carrier[a], carrier[b]
            swap = low > high
            if swap:
                low, high = high, low
            both = low == high and a != b  # two nodes on one carrier: K_ab and K_ba meet
            for i in range(D):
                row = target.dof[low, i]
                if row < 0:
                    continue
                start = (
                    target.indptr[row]
                    + offset[pair]
                    - (row - target.first[low])
                    - target.first[high]
                )
                for k in range(D):
                    column = target.dof[high, k]
                    if column < row:
                        continue
                    at = ((a * D + i) * D + k) * P + b
                    mirror = ((a * D + k) * D + i) * P + b
                    if both:
                        data[start + column] += K[at] + K[mirror]
                    else:
                        data[start + column] += K[mirror] if swap else K[at]
