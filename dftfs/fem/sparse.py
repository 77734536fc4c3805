"""Products and iterations with symmetric matrices kept as their upper triangle (CSR)."""

from collections.abc import Callable

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True)
def symmetric_product(indptr, indices, data, x):
    """A x for a symmetric matrix given by its upper triangle, the diagonal first in every row."""
    y = np.zeros(x.shape[0])
    for row in range(x.shape[0]):
        begin = indptr[row]
        own = x[row]
        total = data[begin] * own
        for at in range(begin + 1, indptr[row + 1]):
            total += data[at] * x[indices[at]]
            y[indices[at]] += data[at] * own
        y[row] += total
    return y


def preconditioned_cg(
    multiply: Callable[[NDArray], NDArray],
    precondition: Callable[[NDArray], NDArray],
    right: NDArray[np.float64],
    *,
    tolerance: float,
    max_iterations: int = 6,
) -> NDArray[np.float64] | None:
    """Conjugate gradients from the factors of a neighbouring matrix.

    Stops when the error in the energy norm is below ``tolerance`` of the solution's; None if
    that takes more than ``max_iterations`` (the factors are too far off) or the matrix is
    indefinite.

    Source: Saad, Iterative Methods for Sparse Linear Systems (2003), algorithm 9.1.
    """
    x = precondition(right)
    residual = right - multiply(x)
    z = precondition(residual)
    energy = dot(right, x)
    p, rz = z, dot(residual, z)
    for _ in range(max_iterations):
        if abs(rz) <= tolerance**2 * energy:
            return x + z
        product = multiply(p)
        curvature = dot(p, product)
        if not curvature > 0:
            return None
        x = x + rz / curvature * p
        residual = residual - rz / curvature * product
        z = precondition(residual)
        previous, rz = rz, dot(residual, z)
        p = z + rz / previous * p
    return None


def dot(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Inner product of two arrays, summed in one fixed order on one thread (BLAS is not)."""
    return float((a * b).sum())


def norm(a: NDArray[np.float64]) -> float:
    """Euclidean norm of an array of any shape."""
    return float(np.sqrt((a * a).sum()))
