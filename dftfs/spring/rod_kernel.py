"""Kernels of the planar rod: its tables without dimensions, discrete energy, Newton's iteration.

Lengths are in units of the rod's length, forces in EI / length^2, so that one tolerance serves
all. Taken from felupe: energy, residual and tangent of an element stand in one place. The
derivation is in `dftfs.spring.planar_rod`.
"""

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgbsv

_BAND = 8  # two three-node elements never couple degrees of freedom further apart than this
_POINTS = np.array([-1.0, 1.0]) / np.sqrt(3.0)
_SHAPE = np.stack([_POINTS * (_POINTS - 1) / 2, 1 - _POINTS**2, _POINTS * (_POINTS + 1) / 2], 1)
_SLOPE = np.stack([_POINTS - 0.5, -2 * _POINTS, _POINTS + 0.5], 1)
_TOLERANCE = 1e-9  # last correction, over the rod's length or in rad; the error is its square
_MAX_ITERATIONS = 25
_LARGEST_CORRECTION = 10.0  # a correction beyond this many lengths or rad means divergence


@dataclass(frozen=True, kw_only=True)
class RodTables:
    """A rod without dimensions.

    length_m and force_unit_N restore them. start : (n, 3) unloaded degrees of freedom (position,
    rotation). sections : (n - 1,) arc lengths of the integration points. kernel : what the
    compiled functions take, per element and integration point: shape gradients, weights, angles,
    unloaded slope in the section's frame, stiffnesses EA, ES, EI, GA_s.
    """

    length_m: float
    force_unit_N: float
    start: NDArray
    sections: NDArray
    kernel: tuple[NDArray, ...]


def rod_tables(
    nodes_m: NDArray,
    angles_rad: NDArray,
    bending_Nm2: NDArray,
    axial_N: NDArray,
    shear_N: NDArray,
) -> RodTables:
    """Tables of a rod: nodes (n, 2), angles (n,), stiffnesses at the elements' nodes (m, 3)."""
    element = element_nodes(len(nodes_m))
    slope = np.einsum("gi,mik->mgk", _SLOPE, nodes_m[element])
    jacobian = np.linalg.norm(slope, axis=2)
    length, bending = float(np.sum(jacobian)), float(np.mean(bending_Nm2))
    force = bending / length**2
    weight = jacobian / length
    angle = angles_rad[element] @ _SHAPE.T
    stiffness = [
        values @ _SHAPE.T / unit
        for values, unit in ((axial_N, force), (bending_Nm2, bending), (shear_N, force))
    ]
    ends = np.concatenate([[0.0], np.cumsum(weight.sum(axis=1))])
    middle, half = (ends[1:] + ends[:-1]) / 2, np.diff(ends) / 2
    start = np.column_stack([nodes_m / length, np.zeros(len(nodes_m))])
    kernel = (
        _SLOPE[None] / weight[..., None],
        weight,
        angle,
        _in_section(slope / jacobian[..., None], angle),
        np.stack(stiffness, axis=-1),
    )
    for table in (start, *kernel):
        table.setflags(write=False)
    return RodTables(
        length_m=length,
        force_unit_N=force,
        start=start,
        sections=(middle[:, None] + half[:, None] * _POINTS).ravel(),
        kernel=kernel,
    )


def element_nodes(count: int) -> NDArray:
    """Node numbers of the elements of a rod with ``count`` nodes, shape (m, 3)."""
    return np.arange(0, count - 1, 2)[:, None] + np.arange(3)


def _in_section(vectors: NDArray, angle: NDArray) -> NDArray:
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([cosine * x + sine * y, -sine * x + cosine * y], axis=-1)


def evaluate(tables: RodTables, dofs: NDArray) -> tuple[float, NDArray, NDArray]:
    """Energy, its gradient (3 n,), and its second derivative in LAPACK's band storage."""
    return _assemble(*tables.kernel, dofs)


def section_forces(tables: RodTables, dofs: NDArray) -> NDArray:
    """Axial force, shear force and bending moment at the integration points, (n - 1, 3)."""
    return _section_forces(*tables.kernel, dofs)


def newton(
    tables: RodTables, dofs: NDArray, free: slice, load: NDArray, end: NDArray | None = None
) -> NDArray | None:
    """Equilibrium from a guess, or None if the iteration does not converge.

    ``free`` are the unknown degrees of freedom; ``end`` (3,) is where the last node is carried
    with the first correction, the rest of the rod following linearly.
    """
    dofs = dofs.copy()
    flat = dofs.reshape(-1)
    shift = np.zeros(3) if end is None else end - dofs[-1]
    for _ in range(_MAX_ITERATIONS):
        _, residual, band = evaluate(tables, dofs)
        rhs = load - residual
        if shift.any():
            rhs -= band_times(band, np.concatenate([np.zeros(flat.size - 3), shift]))
        step = band_solve(band[:, free], rhs[free])
        size = np.max(np.abs(step))
        if not size < _LARGEST_CORRECTION:
            return None
        flat[free] += step
        flat[-3:] += shift
        if max(size, np.max(np.abs(shift))) < _TOLERANCE:
            return dofs
        shift = np.zeros(3)
    return None


def band_solve(band: NDArray, rhs: NDArray) -> NDArray:
    """Solve with a tangent in band storage; all nan where it is singular."""
    # LAPACK's own call: scipy's solve_banded around it takes twice as long for so few unknowns
    factors = np.zeros((3 * _BAND + 1, band.shape[1]), order="F")
    factors[_BAND:] = band
    _, _, solution, error = dgbsv(_BAND, _BAND, factors, rhs, overwrite_ab=True)
    return np.full(rhs.shape, np.nan) if error else solution


@numba.njit(cache=True)
def band_times(band: NDArray, vector: NDArray) -> NDArray:
    """Product of a tangent in band storage with a vector."""
    out, size = np.zeros(vector.size), vector.size
    for offset in range(-_BAND, _BAND + 1):
        for row in range(max(0, offset), min(size, size + offset)):
            out[row] += band[_BAND + offset, row - offset] * vector[row - offset]
    return out


@numba.njit(cache=True)
def _strains(gradient, angle, unloaded, shape, dofs):
    """Axial, shear and bending strain, the slope's two parts in the section's frame, the frame."""
    slope_x = slope_y = turn = bend = 0.0
    for i in range(3):
        slope_x += gradient[i] * dofs[i, 0]
        slope_y += gradient[i] * dofs[i, 1]
        turn += shape[i] * dofs[i, 2]
        bend += gradient[i] * dofs[i, 2]
    cosine, sine = np.cos(angle + turn), np.sin(angle + turn)
    along = cosine * slope_x + sine * slope_y
    across = -sine * slope_x + cosine * slope_y
    return along - unloaded[0], across - unloaded[1], bend, along, across, cosine, sine


@numba.njit(cache=True)
def _section_forces(gradient, weight, angle, unloaded, stiffness, dofs):
    count = weight.shape[0]
    stress = np.empty((2 * count, 3))
    for m in range(count):
        for g in range(2):
            e, s, k, _, _, _, _ = _strains(
                gradient[m, g], angle[m, g], unloaded[m, g], _SHAPE[g], dofs[2 * m : 2 * m + 3]
            )
            ea, ei, ga = stiffness[m, g]
            stress[2 * m + g, 0] = ea * e
            stress[2 * m + g, 1] = ga * s
            stress[2 * m + g, 2] = ei * k
    return stress


@numba.njit(cache=True)
def _assemble(gradient, weight, angle, unloaded, stiffness, dofs):
    size = dofs.size
    residual, band, energy = np.zeros(size), np.zeros((2 * _BAND + 1, size)), 0.0
    b = np.zeros((3, 9))
    for m in range(weight.shape[0]):
        for g in range(2):
            slope, shape, w = gradient[m, g], _SHAPE[g], weight[m, g]
            e, s, k, along, across, cosine, sine = _strains(
                slope, angle[m, g], unloaded[m, g], shape, dofs[2 * m : 2 * m + 3]
            )
            ea, ei, ga = stiffness[m, g]
            normal, shear, moment = ea * e, ga * s, ei * k
            energy += w * (normal * e + shear * s + moment * k) / 2
            for i in range(3):
                d, n = slope[i], shape[i]
                b[0, 3 * i], b[0, 3 * i + 1], b[0, 3 * i + 2] = cosine * d, sine * d, across * n
                b[1, 3 * i], b[1, 3 * i + 1], b[1, 3 * i + 2] = -sine * d, cosine * d, -along * n
                b[2, 3 * i + 2] = d
            # second derivatives of the axial and shear strain: slope-rotation, rotation-rotation
            force_x = -normal * sine - shear * cosine
            force_y = normal * cosine - shear * sine
            turning = -normal * along - shear * across
            for p in range(9):
                residual[6 * m + p] += w * (normal * b[0, p] + shear * b[1, p] + moment * b[2, p])
                for q in range(9):
                    value = ea * b[0, p] * b[0, q] + ga * b[1, p] * b[1, q] + ei * b[2, p] * b[2, q]
                    i, j, x, y = p // 3, q // 3, p % 3, q % 3
                    if x == 2 and y == 2:
                        value += turning * shape[i] * shape[j]
                    elif y == 2:
                        value += (force_x if x == 0 else force_y) * slope[i] * shape[j]
                    elif x == 2:
                        value += (force_x if y == 0 else force_y) * slope[j] * shape[i]
                    band[_BAND + p - q, 6 * m + q] += w * value
    return energy, residual, band
