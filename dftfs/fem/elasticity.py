"""Total-Lagrangian elasticity in one compiled kernel, for solids and for plane stress.

Green-Lagrange strain E, second Piola-Kirchhoff stress S = lambda tr(E) I + 2 mu E (the Saint
Venant-Kirchhoff material of CalculiX's ``*ELASTIC`` under NLGEOM). Isotropy makes the tangent
cheap: with g_a = F grad N_a and b = F F^T, the block of nodes a, b is

    K_ab = int lambda g_a g_b^T + mu (grad N_a . grad N_b) b + mu g_b g_a^T
               + (grad N_a . S grad N_b) I  dV

Plane stress is the same with lambda replaced by 2 lambda mu / (lambda + 2 mu) in two dimensions
and the thickness as weight. Small arrays are flat and ``axes`` (a tuple whose length is the
dimension) makes their strides known at compile time: only then does LLVM vectorise the loops over
nodes, four times faster than with strides found at run time.

Source: Bonet & Wood, Nonlinear Continuum Mechanics for Finite Element Analysis (2008), 9.4.
"""

from numba import njit


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
def determinant(A, axes):
    """Determinant of a flat 2 x 2 or 3 x 3 matrix."""
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
    det = determinant(A, axes)
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
def reference_gradients(X, dN, grad, J, inverse, axes):
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
def displacement_gradient(U, grad, F, axes):
    """du_i / dX_j at a point, flat (D, D), from nodal displacements, flat (D, P)."""
    D = len(axes)
    P = 20 if D == 3 else 8
    for i in range(D):
        for j in range(D):
            total = 0.0
            for a in range(P):
                total += U[i * P + a] * grad[j * P + a]
            F[i * D + j] = total


@njit(cache=True)
def stress_at(U, grad, lam, mu, F, S, axes):
    """F and S at a point from nodal displacements; returns (energy density, det F)."""
    D = len(axes)
    displacement_gradient(U, grad, F, axes)
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
    return 0.5 * lam * trace * trace + mu * square, determinant(F, axes)


@njit(cache=True)
def add_force(f, grad, F, S, weight, axes):
    """Add a point's nodal forces, weight F S grad N, to f, flat (D, P)."""
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
def add_tangent(K, grad, F, S, lame, weight, row, axes):
    """Add a point's blocks for the node pairs a <= b to K, flat (P, D, D, P).

    ``lame`` is (lambda, mu) in Pa. ``row`` holds per node: g, weight lambda g, weight mu g,
    weight mu grad N, weight S grad N; then b = F F^T.
    """
    D = len(axes)
    P = 20 if D == 3 else 8
    lam, mu = lame
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
