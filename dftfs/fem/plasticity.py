"""Elastic-plastic bodies: von Mises plasticity with isotropic hardening, strains small.

Framework: the Green-Lagrange strain is split additively, E = Ee + Ep, and the second
Piola-Kirchhoff stress S = lambda tr(Ee) I + 2 mu Ee obeys the yield function
|dev S| <= sqrt(2/3) sigma_y(a). Rotations may be large, strains only moderate: up to a few
percent S and the Cauchy stress (in the turned frame) are the same to that order, beyond that the
split itself is no longer right. Radial return, backward Euler, consistent tangent; in plane
stress the strain across is found by Newton's method at every point and condensed.

Source: Simo & Hughes, Computational Inelasticity (1998), 3.3 (radial return, box 3.2 tangent)
and 3.4 (plane stress); Green & Naghdi, Arch. Ration. Mech. Anal. 18 (1965) 251 (additive split).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from dftfs.errors import SolveError
from dftfs.fem.elasticity import (
    determinant,
    displacement_gradient,
    lame_constants,
    reference_gradients,
)
from dftfs.fem.integration import (
    add_nodal,
    carriers_of,
    gather,
    scatter,
    turn_blocks,
)

HISTORY = 7  # plastic strain 11 22 33 and engineering 12 23 13, then the equivalent strain
_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))
_PLANE = (0, 1, 3)
_ROOT = np.sqrt(2.0 / 3.0)


@dataclass(frozen=True, kw_only=True)
class Hardening:
    """Yield stress over the equivalent plastic strain a:

    sigma_y(a) = yield + hardening a + (saturation - yield) (1 - exp(-rate a)).

    Parameters
    ----------
    yield_strength_Pa : float
    hardening_Pa : float
        Linear part (0: perfectly plastic).
    saturation_Pa : float or None
        Where Voce's exponential part ends; None leaves it out.
    rate : float
        How fast it does.

    Raises
    ------
    SolveError
        If a number is out of range.
    """

    yield_strength_Pa: float
    hardening_Pa: float = 0.0
    saturation_Pa: float | None = None
    rate: float = 20.0

    def __post_init__(self) -> None:
        if not self.yield_strength_Pa > 0 or not self.hardening_Pa >= 0 or not self.rate > 0:
            raise SolveError(
                f"hardening: yield_strength_Pa={self.yield_strength_Pa} and rate={self.rate} must"
                f" be above 0, hardening_Pa={self.hardening_Pa} 0 or more"
            )
        if self.saturation_Pa is not None and self.saturation_Pa < self.yield_strength_Pa:
            raise SolveError(
                f"hardening: saturation_Pa={self.saturation_Pa} is below the yield strength"
                f" {self.yield_strength_Pa}"
            )


class PlasticLaw(NamedTuple):
    """`Hardening` and the elastic constants as compiled code reads them, all in Pa."""

    lam: float
    mu: float
    first: float
    slope: float
    more: float
    rate: float


def plastic_law(hardening: Hardening, youngs_modulus_Pa: float, poisson_ratio: float) -> PlasticLaw:
    """The law of a material; the elastic constants are those of a solid in plane stress too."""
    lam, mu = lame_constants(youngs_modulus_Pa, poisson_ratio, plane_stress=False)
    first, top = hardening.yield_strength_Pa, hardening.saturation_Pa
    more = 0.0 if top is None else top - first
    return PlasticLaw(
        lam=lam, mu=mu, first=first, slope=hardening.hardening_Pa, more=more, rate=hardening.rate
    )


@njit(cache=True)
def _yield_stress(law, a):
    gone = np.exp(-law.rate * a)
    stress = law.first + law.slope * a + law.more * (1 - gone)
    return stress, law.slope + law.more * law.rate * gone


@njit(cache=True)
def radial_return(E, old, law, S, C, new):
    """Stress S (6,), tangent C (6, 6) and history ``new`` at strain E (6,), engineering shears.

    Returns the elastic energy density.
    """
    trace = 0.0
    for i in range(3):
        trace += E[i] - old[i]
    norm = 0.0
    for i in range(6):
        elastic = E[i] - old[i]
        S[i] = 2 * law.mu * (elastic - trace / 3) if i < 3 else law.mu * elastic
        norm += S[i] ** 2 * (1.0 if i < 3 else 2.0)
        new[i] = old[i]
    norm = np.sqrt(norm)
    new[6] = old[6]
    limit, _ = _yield_stress(law, old[6])
    left, ratio, spent = 1.0, 0.0, 0.0
    if norm > _ROOT * limit:
        for _ in range(50):
            stress, slope = _yield_stress(law, old[6] + _ROOT * spent)
            excess = norm - 2 * law.mu * spent - _ROOT * stress
            spent += excess / (2 * law.mu + slope * 2.0 / 3.0)
            if abs(excess) < 1e-13 * norm:
                break
        _, slope = _yield_stress(law, old[6] + _ROOT * spent)
        left = 1 - 2 * law.mu * spent / norm
        ratio = 1 / (1 + slope / (3 * law.mu)) - (1 - left)
        new[6] = old[6] + _ROOT * spent
    for i in range(6):
        n_i = S[i] / norm if norm > 0 else 0.0
        for j in range(6):
            n_j = S[j] / norm if norm > 0 else 0.0
            C[i, j] = -2 * law.mu * ratio * n_i * n_j
    bulk = law.lam + 2 * law.mu / 3
    for i in range(3):
        for j in range(3):
            C[i, j] += bulk - 2 * law.mu * left / 3
        C[i, i] += 2 * law.mu * left
        C[i + 3, i + 3] += law.mu * left
    energy = 0.0
    for i in range(6):
        if norm > 0:
            new[i] += spent * S[i] / norm * (1.0 if i < 3 else 2.0)
        S[i] *= left
        if i < 3:
            S[i] += bulk * trace
        energy += 0.5 * S[i] * (E[i] - new[i])
    return energy


@njit(cache=True)
def _stress(E, old, law, S, C, new, planar):
    """`radial_return`; in plane stress with E33 such that S33 = 0, condensed from C."""
    if not planar:
        return radial_return(E, old, law, S, C, new)
    E[2] = old[2] - law.lam / (law.lam + 2 * law.mu) * (E[0] + E[1] - old[0] - old[1])
    energy = radial_return(E, old, law, S, C, new)
    for _ in range(50):
        if abs(S[2]) <= 1e-12 * law.first:
            break
        E[2] -= S[2] / C[2, 2]
        energy = radial_return(E, old, law, S, C, new)
    across = C[2, 2]
    for i in range(6):
        for j in range(6):
            if i != 2 and j != 2:
                C[i, j] -= C[i, 2] * C[2, j] / across
    return energy


@njit(cache=True)
def _green_lagrange(U, grad, F, E, axes):
    """Strain E (6,), engineering shears, and F, flat (D, D), at a point; returns det F."""
    D = len(axes)
    displacement_gradient(U, grad, F, axes)
    E[:] = 0.0
    for v in range(6 if D == 3 else 3):
        full = v if D == 3 else _PLANE[v]
        r, s = _PAIRS[full]
        square = 0.0
        for k in range(D):
            square += F[k * D + r] * F[k * D + s]
        value = 0.5 * (F[r * D + s] + F[s * D + r] + square)
        E[full] = value if r == s else 2 * value
    for i in range(D):
        F[i * D + i] += 1.0
    return determinant(F, axes)


@njit(cache=True)
def _strain_rows(F, grad, B, axes):
    """Variation of the strain components, B (V, D P), by the nodal displacements, flat (D, P)."""
    D = len(axes)
    P = 20 if D == 3 else 8
    for v in range(6 if D == 3 else 3):
        r, s = _PAIRS[v if D == 3 else _PLANE[v]]
        for i in range(D):
            for a in range(P):
                if r == s:
                    B[v, i * P + a] = F[i * D + r] * grad[r * P + a]
                else:
                    B[v, i * P + a] = (
                        F[i * D + r] * grad[s * P + a] + F[i * D + s] * grad[r * P + a]
                    )


@njit(cache=True)
def _add_blocks(K, grad, B, C, S, weight, CB, axes):
    """Add a point's blocks for the node pairs a <= b to K, flat (P, D, D, P); CB is scratch."""
    D = len(axes)
    P = 20 if D == 3 else 8
    V = 6 if D == 3 else 3
    for v in range(V):
        full_v = v if D == 3 else _PLANE[v]
        for m in range(P * D):
            total = 0.0
            for w in range(V):
                total += C[full_v, w if D == 3 else _PLANE[w]] * B[w, m]
            CB[v, m] = weight * total
    for a in range(P):
        for b in range(a, P):
            geometric = 0.0
            for v in range(V):
                full = v if D == 3 else _PLANE[v]
                r, s = _PAIRS[full]
                both = grad[r * P + a] * grad[s * P + b]
                if r != s:
                    both += grad[s * P + a] * grad[r * P + b]
                geometric += S[full] * both
            for i in range(D):
                for k in range(D):
                    total = weight * geometric if i == k else 0.0
                    for v in range(V):
                        total += B[v, i * P + a] * CB[v, k * P + b]
                    K[((a * D + i) * D + k) * P + b] += total


@njit(cache=True)
def _add_product(K, v, y, axes):
    """y += K v for one element whose K holds the pairs a <= b."""
    D = len(axes)
    P = 20 if D == 3 else 8
    for a in range(P):
        for i in range(D):
            for b in range(a, P):
                for k in range(D):
                    value = K[((a * D + i) * D + k) * P + b]
                    y[i * P + a] += value * v[k * P + b]
                    if b > a:
                        y[k * P + b] += value * v[i * P + a]


class Yielding(NamedTuple):
    """The law of a body and its histories (m, q, 7) before and after; the latter is filled."""

    law: PlasticLaw
    old: NDArray[np.float64]
    new: NDArray[np.float64]


@njit(cache=True)
def integrate_plastic(domain, target, yielding, u, direction, sums, tangent, axes):
    """Forces, energy and (with ``tangent``) the matrix of an elastic-plastic body.

    Parameters
    ----------
    u, direction : (n, dim) array
        Displacements in m; what the tangent is multiplied with.
    sums : integration.Sums
        Set, not added to; product and data only with ``tangent``.

    Returns energy, smallest and cell as `integration.integrate_forces`.
    """
    D = len(axes)
    P = 20 if D == 3 else 8
    V = 6 if D == 3 else 3
    X, U, f, grad = np.empty(D * P), np.empty(D * P), np.empty(D * P), np.empty(D * P)
    F, J, inverse = np.empty(D * D), np.empty(D * D), np.empty(D * D)
    E, S, C = np.empty(6), np.empty(6), np.empty((6, 6))
    B, CB, K = np.empty((V, P * D)), np.empty((V, P * D)), np.empty(P * D * D * P)
    carrier, turned = np.empty(P, dtype=np.int32), np.empty(P, dtype=np.bool_)
    sums.force[:] = 0.0
    sums.product[:] = 0.0
    if tangent:
        sums.data[:] = 0.0
    energy, smallest, cell = 0.0, np.inf, -1
    for e in range(domain.cells.shape[0]):
        nodes = domain.cells[e]
        gather(domain.nodes, nodes, X, axes)
        gather(u, nodes, U, axes)
        f[:] = 0.0
        K[:] = 0.0
        for q in range(domain.weights.shape[0]):
            volume = reference_gradients(X, domain.gradients[q], grad, J, inverse, axes)
            weight = domain.thickness * domain.weights[q] * volume
            det = _green_lagrange(U, grad, F, E, axes)
            if det < smallest:
                smallest = det
                cell = e
            before, after = yielding.old[e, q], yielding.new[e, q]
            energy += weight * _stress(E, before, yielding.law, S, C, after, D == 2)
            _strain_rows(F, grad, B, axes)
            for v in range(V):
                stress = weight * S[v if D == 3 else _PLANE[v]]
                for m in range(P * D):
                    f[m] += stress * B[v, m]
            if tangent:
                _add_blocks(K, grad, B, C, S, weight, CB, axes)
        add_nodal(f, nodes, sums.force, axes)
        if not tangent:
            continue
        gather(direction, nodes, U, axes)
        f[:] = 0.0
        _add_product(K, U, f, axes)
        add_nodal(f, nodes, sums.product, axes)
        carriers_of(nodes, target, carrier, turned)
        if turned.any():
            turn_blocks(K, turned, target.rotation, J, axes)
        scatter(K, carrier, target.offset[e], target, sums.data, axes)
    return energy, smallest, cell


def no_history(cells: NDArray[np.int32], points: int) -> NDArray[np.float64]:
    """(m, q, 7) zeros: a body that has not yielded yet."""
    return np.zeros((len(cells), points, HISTORY))
