"""Cauchy, von Mises and principal stress from displacements.

In every element the components are fitted in its own shape functions to the 3 x 3 (x 3)
integration points by least squares; the nodal value is the mean over the elements of each one's
von Mises stress (of averaged components it would cancel across a bend). Extrapolation from the
2 x 2 (x 2) points is rougher at notches: 243 to 253 MPa instead of 241 to 245 where the answer is
245.

Source: Hinton & Campbell, Int. J. Numer. Methods Eng. 8 (1974) 461 (local smoothing).
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from dftfs.errors import SolveError
from dftfs.fem.elasticity import lame_constants, reference_gradients, stress_at
from dftfs.fem.elements import gauss_table
from dftfs.fem.integration import Domain, gather
from dftfs.fem.mesh import TaggedMesh
from dftfs.fem.problem import StaticProblem


@dataclass(frozen=True, kw_only=True, eq=False)
class StressField:
    """Stresses of one displacement field.

    Parameters
    ----------
    von_mises_Pa : (n,) array
        At the nodes: mean over the elements of their extrapolated values.
    point_von_mises_Pa : (m, q) array
        At the 3 x 3 (x 3) integration points.
    principal_Pa : (n,) array
        Largest principal stress by magnitude at the nodes, without its sign; as ``von_mises_Pa``.
    """

    von_mises_Pa: NDArray[np.float64]
    point_von_mises_Pa: NDArray[np.float64]
    principal_Pa: NDArray[np.float64]


def recover_stress(problem: StaticProblem, displacement_m: NDArray[np.float64]) -> StressField:
    """Von Mises and principal stresses at nodes, von Mises stresses at integration points.

    Nodes on the two sides of a cyclic cut share their elements' values.

    Raises
    ------
    SolveError
        If ``displacement_m`` is not (n, dim).
    """
    mesh = problem.mesh
    stress = cauchy_stress(problem, displacement_m)
    fit = np.linalg.pinv(gauss_table(mesh.kind.name, 3).values)
    tensors = np.einsum("aq,eqij->eaij", fit, stress, optimize=True)
    owner = np.arange(len(mesh.nodes))
    if problem.cyclic is not None:
        owner[problem.cyclic.slave_nodes] = problem.cyclic.master_nodes
    nodes = owner[mesh.cells]
    count = np.bincount(nodes.ravel(), minlength=len(owner))

    def mean(local: NDArray[np.float64]) -> NDArray[np.float64]:
        total = np.bincount(nodes.ravel(), local.ravel(), minlength=len(owner))
        return _frozen(total[owner] / count[owner])

    return StressField(
        von_mises_Pa=mean(von_mises(tensors)),
        principal_Pa=mean(np.abs(np.linalg.eigvalsh(tensors)).max(axis=-1)),
        point_von_mises_Pa=_frozen(von_mises(stress)),
    )


def cauchy_stress(
    problem: StaticProblem, displacement_m: NDArray[np.float64], *, per_direction: int = 3
) -> NDArray[np.float64]:
    """Cauchy stress (m, q, dim, dim) in Pa at the Gauss points.

    sigma = F S F^T / det F; in plane stress det F includes the change of thickness that keeps
    the out-of-plane stress zero.
    """
    mesh = problem.mesh
    u = np.array(displacement_m, dtype=float, order="C")
    if u.shape != mesh.nodes.shape:
        raise SolveError(f"displacement_m has shape {u.shape}; the mesh needs {mesh.nodes.shape}")
    planar = mesh.dim == 2
    lam, mu = lame_constants(problem.youngs_modulus_Pa, problem.poisson_ratio, plane_stress=planar)
    table = gauss_table(mesh.kind.name, per_direction)
    stress = np.empty((len(mesh.cells), len(table.weights), mesh.dim, mesh.dim))
    thickness_ratio = problem.poisson_ratio / (1 - problem.poisson_ratio) if planar else 0.0
    domain = Domain(mesh.nodes, mesh.cells, table.gradients, table.weights, lam, mu, 1.0)
    _cauchy_of(domain, thickness_ratio, u, stress, tuple(range(mesh.dim)))
    return stress


def gauss_points_m(mesh: TaggedMesh, *, per_direction: int = 3) -> NDArray[np.float64]:
    """Reference positions (m, q, dim) of the Gauss points."""
    table = gauss_table(mesh.kind.name, per_direction)
    return np.einsum("qa,eai->eqi", table.values, mesh.nodes[mesh.cells], optimize=True)


def von_mises(stress: NDArray[np.float64]) -> NDArray[np.float64]:
    """Von Mises stress of tensors (..., 2, 2), out-of-plane stress zero, or (..., 3, 3)."""
    trace = np.trace(stress, axis1=-2, axis2=-1)
    square = np.einsum("...ij,...ij->...", stress, stress)
    return np.sqrt(np.maximum(1.5 * square - 0.5 * trace**2, 0.0))


def _frozen(array: NDArray) -> NDArray:
    array.setflags(write=False)
    return array


@njit(cache=True)
def _cauchy_of(domain, thickness_ratio, u, stress, axes):
    """Cauchy stress (m, q, D, D) at displacements u (n, D); thickness_ratio: nu / (1 - nu), 2D."""
    D = len(axes)
    P = 20 if D == 3 else 8
    X, U, grad = np.empty(D * P), np.empty(D * P), np.empty(D * P)
    F, S, J, inverse = np.empty(D * D), np.empty(D * D), np.empty(D * D), np.empty(D * D)
    for e in range(domain.cells.shape[0]):
        gather(domain.nodes, domain.cells[e], X, axes)
        gather(u, domain.cells[e], U, axes)
        for q in range(domain.weights.shape[0]):
            reference_gradients(X, domain.gradients[q], grad, J, inverse, axes)
            _, det = stress_at(U, grad, domain.lam, domain.mu, F, S, axes)
            if D == 2:
                strain = (S[0] + S[3]) / (2 * (domain.lam + domain.mu))  # trace, in the plane
                det *= np.sqrt(1 - 2 * thickness_ratio * strain)
            for i in range(D):
                for j in range(D):
                    total = 0.0
                    for k in range(D):
                        for m in range(D):
                            total += F[i * D + k] * S[k * D + m] * F[j * D + m]
                    stress[e, q, i, j] = total / det
