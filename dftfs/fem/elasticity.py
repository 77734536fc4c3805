"""Total-Lagrangian elasticity in one compiled kernel, for solids and for plane stress.

Green-Lagrange strain E, second Piola-Kirchhoff stress S = lambda tr(E) I + 2 mu E (the Saint
Venant-Kirchhoff material of CalculiX's ``*ELASTIC`` under NLGEOM). Isotropy makes the tangent
cheap: with g_a = F grad N_a and b = F F^T, the block of nodes a, b is

    K_ab = int lambda g_a g_b^T + mu (grad N_a . grad N_b) b + mu g_b g_a^T
               + (grad N_a . S grad N_b) I  dV

Plane stress is the same with lambda replaced by 2 lambda mu / (lambda + 2 mu) in two dimensions
and the thickness as weight. No element matrix is stored: blocks go straight into the upper
triangle of the sparse matrix. Small arrays are flat and ``axes`` (a tuple whose length is the
dimension) makes their strides known at compile time: only then does LLVM vectorise the loops over
nodes, four times faster than with strides found at run time.

Source: Bonet & Wood, Nonlinear Continuum Mechanics for Finite Element Analysis (2008), 9.4.
"""

import numpy as np
from numba import njit

STATUS_OK = 0
STATUS_INVERTED = 1


def lame_constants(
    youngs_modulus_Pa: float, poisson_ratio: float, *, plane_stress: bool
) -> tuple[float, float]:
    """lambda and mu in Pa; with ``plane_stress`` the reduced lambda E nu / (1 - nu^2)."""
    shear = youngs_modulus_Pa / (2 * (1 + poisson_ratio))
    if plane_stress:
        return youngs_modulus_Pa * poisson_ratio / (1 - poisson_ratio**2), shear
    first = youngs_modulus_Pa * poisson_ratio / ((1 + poisson_ratio) * (1 - 2 * poisson_ratio))
    return first, shear


@njit(cache=True)
def _determinant(A, axes):
    if len(axes) == 2:
        return A[0] * A[3] - A[1] * A[2]
    return (
        A[0] * (A[4] * A[8] - A[5] * A[7])
        - A[1] * (A[3] * A[8] - A[5] * A[6])
        + A[2] * (A[3] * A[7] - A[4] * A[6])
    )


@njit(cache=True)
def _invert(A, inverse, axes):
    """Inverse of a flat 2 x 2 or 3 x 3 matrix; returns the determinant."""
    det = _determinant(A, axes)
    if len(axes) == 2:
        inverse[0], inverse[1] = A[3] / det, -A[1] / det
        inverse[2], inverse[3] = -A[2] / det, A[0] / det
        return det
    for i in range(3):
        for j in range(3):
            a, b, c, d = (j + 1) % 3, (j + 2) % 3, (i + 1) % 3, (i + 2) % 3
            inverse[3 * i + j] = (A[3 * a + c] * A[3 * b + d] - A[3 * a + d] * A[3 * b + c]) / det
    return det


@njit(cache=True)
def _gradients(X, dN, grad, J, inverse, axes):
    """Gradients of the shape functions in the reference configuration; returns det J."""
    D = len(axes)
    P = 20 if D == 3 else 8
    for i in range(D):
        for j in range(D):
            total = 0.0
            for a in range(P):
                total += X[i * P + a] * dN[j, a]
            J[i * D + j] = total
    det = _invert(J, inverse, axes)
    for i in range(D):
        for a in range(P):
            total = 0.0
            for j in range(D):
                total += inverse[j * D + i] * dN[j, a]
            grad[i * P + a] = total
    return det


@njit(cache=True)
def _stress(U, grad, lam, mu, F, S, axes):
    """F and S at a point from nodal displacements; returns (energy density, det F)."""
    D = len(axes)
    P = 20 if D == 3 else 8
    for i in range(D):
        for j in range(D):
            total = 0.0
            for a in range(P):
                total += U[i * P + a] * grad[j * P + a]
            F[i * D + j] = total
    # E from the displacement gradient: F^T F - I would cancel at small strain
    trace = 0.0
    square = 0.0
    for i in range(D):
        for j in range(D):
            product = 0.0
            for k in range(D):
                product += F[k * D + i] * F[k * D + j]
            strain = 0.5 * (F[i * D + j] + F[j * D + i] + product)
            S[i * D + j] = 2.0 * mu * strain
            square += strain * strain
            if i == j:
                trace += strain
    for i in range(D):
        S[i * D + i] += lam * trace
        F[i * D + i] += 1.0
    return 0.5 * lam * trace * trace + mu * square, _determinant(F, axes)


@njit(cache=True)
def _add_force(f, grad, F, S, weight, axes):
    D = len(axes)
    P = 20 if D == 3 else 8
    for i in range(D):
        for j in range(D):
            total = 0.0
            for k in range(D):
                total += F[i * D + k] * S[k * D + j]
            total *= weight
            for a in range(P):
                f[i * P + a] += total * grad[j * P + a]


@njit(cache=True)
def _add_tangent(K, grad, F, S, lam, mu, weight, row, axes):
    """Add a point's blocks for the node pairs a <= b to K, flat (P, D, D, P).

    ``row`` holds per node: g, weight lambda g, weight mu g, weight mu grad N, weight S grad N;
    then b = F F^T.
    """
    D = len(axes)
    P = 20 if D == 3 else 8
    G, L, M, Z, T, B = 0, D * P, 2 * D * P, 3 * D * P, 4 * D * P, 5 * D * P
    for i in range(D):
        for b in range(P):
            pushed = 0.0
            pulled = 0.0
            for j in range(D):
                pushed += F[i * D + j] * grad[j * P + b]
                pulled += S[i * D + j] * grad[j * P + b]
            row[G + i * P + b] = pushed
            row[L + i * P + b] = weight * lam * pushed
            row[M + i * P + b] = weight * mu * pushed
            row[Z + i * P + b] = weight * mu * grad[i * P + b]
            row[T + i * P + b] = weight * pulled
        for k in range(D):
            left = 0.0
            for j in range(D):
                left += F[i * D + j] * F[k * D + j]
            row[B + i * D + k] = left
    for a in range(P):
        for b in range(a, P):
            dot = 0.0
            geometric = 0.0
            for j in range(D):
                dot += row[Z + j * P + a] * grad[j * P + b]
                geometric += row[T + j * P + a] * grad[j * P + b]
            for i in range(D):
                for k in range(D):
                    block = (
                        row[L + i * P + a] * row[G + k * P + b]
                        + row[M + k * P + a] * row[G + i * P + b]
                        + row[B + i * D + k] * dot
                    )
                    if i == k:
                        block += geometric
                    K[((a * D + i) * D + k) * P + b] += block


@njit(cache=True)
def _turn_blocks(K, turned, rotation, half, axes):
    """K_ab -> R_a^T K_ab R_b for the nodes that are turned copies of their carriers."""
    D = len(axes)
    P = 20 if D == 3 else 8
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
def _scatter(K, carrier, dof, first, offset, indptr, data, axes):
    """Add an element's blocks to the upper triangle.

    ``offset[pair]`` is where the columns of the later carrier start in the first row of the
    earlier one; the rows below are one entry shorter each.
    """
    D = len(axes)
    P = 20 if D == 3 else 8
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
                row = dof[low, i]
                if row < 0:
                    continue
                start = indptr[row] + offset[pair] - (row - first[low]) - first[high]
                for k in range(D):
                    column = dof[high, k]
                    if column < row:
                        continue
                    at = ((a * D + i) * D + k) * P + b
                    mirror = ((a * D + k) * D + i) * P + b
                    if both:
                        data[start + column] += K[at] + K[mirror]
                    else:
                        data[start + column] += K[mirror] if swap else K[at]


@njit(cache=True)
def integrate(
    nodes, cells, dN, weights, lam, mu, thickness, u,
    force, tangent, direction, product, carrier, turned, rotation, dof, first, offset, indptr, data, axes,
):  # fmt: skip
    """Internal force, and on request the tangent and its product with a direction.

    Parameters
    ----------
    nodes (n, dim), cells (m, p), dN (q, dim, p), weights (q,) : the mesh and its rule
    lam, mu, thickness : float
        Constants in Pa; thickness in m (1 for solids).
    u : (n, dim) array
        Displacements in m.
    force : (n, dim) array
        Zeroed and filled with internal forces in N.
    tangent : bool
        Also fill ``data`` (upper triangle, see `_scatter`) and ``product`` = K ``direction``.
    axes : tuple of dim ints
        Its length is what counts.

    Returns
    -------
    energy : float
        Strain energy in J.
    smallest : float
        The smallest det F; not above 0 means that ``cell`` is turned inside out.
    cell : int
    """
    D = len(axes)
    P = 20 if D == 3 else 8
    X, U, V = np.empty(D * P), np.empty(D * P), np.empty(D * P)
    f, y, grad = np.empty(D * P), np.empty(D * P), np.empty(D * P)
    F, S, J, inverse = np.empty(D * D), np.empty(D * D), np.empty(D * D), np.empty(D * D)
    K, row = np.empty(P * D * D * P), np.empty(5 * D * P + D * D)
    local_carrier, local_turned = np.empty(P, dtype=np.int32), np.empty(P, dtype=np.bool_)
    force[:] = 0.0
    if tangent:
        data[:] = 0.0
        product[:] = 0.0
    energy = 0.0
    smallest = np.inf
    where = -1
    for e in range(cells.shape[0]):
        any_turned = False
        any_moving = False
        for a in range(P):
            node = cells[e, a]
            local_carrier[a] = carrier[node]
            local_turned[a] = turned[node]
            any_turned |= turned[node]
            for i in range(D):
                X[i * P + a] = nodes[node, i]
                U[i * P + a] = u[node, i]
                f[i * P + a] = 0.0
                if tangent:
                    V[i * P + a] = direction[node, i]
                    any_moving |= direction[node, i] != 0.0
        if tangent:
            K[:] = 0.0
        for q in range(weights.shape[0]):
            weight = thickness * weights[q] * _gradients(X, dN[q], grad, J, inverse, axes)
            density, det = _stress(U, grad, lam, mu, F, S, axes)
            energy += weight * density
            if det < smallest:
                smallest = det
                where = e
            _add_force(f, grad, F, S, weight, axes)
            if tangent:
                _add_tangent(K, grad, F, S, lam, mu, weight, row, axes)
        for a in range(P):
            for i in range(D):
                force[cells[e, a], i] += f[i * P + a]
        if not tangent:
            continue
        if any_moving:
            y[:] = 0.0
            _add_product(K, V, y, axes)
            for a in range(P):
                for i in range(D):
                    product[cells[e, a], i] += y[i * P + a]
        if any_turned:
            _turn_blocks(K, local_turned, rotation, J, axes)
        _scatter(K, local_carrier, dof, first, offset[e], indptr, data, axes)
    return energy, smallest, where
