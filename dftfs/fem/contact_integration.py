"""The loop over the points of a slave surface: contact forces, energy and tangent."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from dftfs.fem.facets import interpolated, workspace
from dftfs.fem.gap_variations import SlavePoint, pressure_of, variations
from dftfs.fem.integration import Target, carriers_of, scatter, turn_blocks


class Geometry(NamedTuple):
    """Both surfaces at one displacement field.

    Parameters
    ----------
    slave (s, q), master (m, q) : node numbers of facets, the master's for every copy
    turn (m,), turns (k, D, D) : which rotation makes a master facet's copy
    slave_m (s, q, D), master_m (m, q, D) : positions
    shapes (p, q), area (s, p) : slave shape functions and reference areas of its points
    stiffness, smoothing : float, see `contact.ContactLaw`
    curved_to : float
        Penetration beyond which the tangent leaves the change of the normal out: the pressure
        of an iterate so deep is no real one, and times a corner's curvature it would make the
        matrix indefinite where the remaining part is a plain quadratic well.
    """

    slave: NDArray[np.int32]
    master: NDArray[np.int32]
    turn: NDArray[np.int64]
    turns: NDArray[np.float64]
    slave_m: NDArray[np.float64]
    master_m: NDArray[np.float64]
    shapes: NDArray[np.float64]
    area: NDArray[np.float64]
    stiffness: float
    smoothing: float
    curved_to: float


class Pressing(NamedTuple):
    """Where slave points press.

    Parameters
    ----------
    found (s, p) : master facet that a point faces, -1 where none
    where (s, p, D - 1) : its closest point
    multiplier (s, p) : pressure at a gap of zero, Pa
    """

    found: NDArray[np.int64]
    where: NDArray[np.float64]
    multiplier: NDArray[np.float64]


class PairTarget(NamedTuple):
    """Where the tangent of a pair of facets goes, and what it is multiplied with.

    Parameters
    ----------
    target : integration.Target
    offset (k, r (r + 1) / 2) : as `integration.scatter` takes it, one row a pair
    place (s, m) : row of ``offset`` of a pair of slave and master facet
    direction (n, D) : nodal values that the tangent is multiplied with
    """

    target: Target
    offset: NDArray[np.int32]
    place: NDArray[np.int32]
    direction: NDArray[np.float64]


@njit(cache=True)
def add_pair(values, factor, slave, master, field):
    """Add factor times values (2 q D,) over a pair's nodes to a nodal field (n, D)."""
    D = field.shape[1]
    q = slave.shape[0]
    for a in range(q):
        for i in range(D):
            field[slave[a], i] += factor * values[a * D + i]
            field[master[a], i] += factor * values[(q + a) * D + i]


@njit(cache=True)
def add_contact_block(block, geometry, s, m, pairs, sums, axes):
    """Add the symmetric tangent of facets s and m to the matrix, times direction to the product.

    block (P D, P D) over the slave's nodes, then the master's.
    """
    D = len(axes)
    slave, master = geometry.slave[s], geometry.master[m]
    q = slave.shape[0]
    P = 2 * q
    K, half, product = np.empty(P * D * D * P), np.empty(D * D), np.empty(P * D)
    nodes, carrier = np.empty(P, dtype=np.int32), np.empty(P, dtype=np.int32)
    turned = np.empty(P, dtype=np.bool_)
    nodes[:q], nodes[q:] = slave, master
    for a in range(P * D):
        product[a] = 0.0
        for b in range(P * D):
            product[a] += block[a, b] * pairs.direction[nodes[b // D], b % D]
    add_pair(product, 1.0, slave, master, sums.product)
    carriers_of(nodes, pairs.target, carrier, turned)
    for a in range(P):
        for i in range(D):
            for k in range(D):
                for b in range(a, P):
                    K[((a * D + i) * D + k) * P + b] = block[a * D + i, b * D + k]
    if turned.any():
        turn_blocks(K, turned, pairs.target.rotation, half, axes)
    scatter(K, carrier, pairs.offset[pairs.place[s, m]], pairs.target, sums.data, axes)


@njit(cache=True)
def integrate_contact_forces(geometry, pressing, force, axes):
    """Add contact forces (n, D) in N; returns the energy in J."""
    q = geometry.slave.shape[1]
    first, second = np.empty(2 * q * len(axes)), np.empty((0, 0))
    work, x, xi = workspace(axes), np.empty(len(axes)), np.empty(len(axes) - 1)
    energy = 0.0
    for s in range(pressing.found.shape[0]):
        for p in range(pressing.found.shape[1]):
            m = pressing.found[s, p]
            if m < 0:
                continue
            shifted = _shifted_gap(geometry, pressing, s, p, (x, xi), work, (first, second), axes)
            pressure, _, density = pressure_of(shifted, geometry.stiffness, geometry.smoothing)
            if pressure == 0.0:
                continue
            energy += geometry.area[s, p] * density
            factor = -geometry.area[s, p] * pressure
            add_pair(first, factor, geometry.slave[s], geometry.master[m], force)
    return energy


@njit(cache=True)
def _shifted_gap(geometry, pressing, s, p, at, work, derivatives, axes):
    """Gap of a point less what its multiplier stands for; fills the gap's derivatives."""
    x, xi = at
    m = pressing.found[s, p]
    interpolated(geometry.shapes[p], geometry.slave_m[s], x)
    xi[:] = pressing.where[s, p]
    point = SlavePoint(x, geometry.shapes[p], geometry.turns[geometry.turn[m]])
    gap = variations(point, geometry.master_m[m], xi, work, derivatives, axes)
    return gap - pressing.multiplier[s, p] / geometry.stiffness


@njit(cache=True)
def integrate_contact_tangent(geometry, pressing, pairs, sums, axes):
    """`integrate_contact_forces`, with the tangent added to data and product of ``sums``."""
    size = 2 * geometry.slave.shape[1] * len(axes)
    first, second = np.empty(size), np.empty((size, size))
    work, x, xi = workspace(axes), np.empty(len(axes)), np.empty(len(axes) - 1)
    energy = 0.0
    for s in range(pressing.found.shape[0]):
        for p in range(pressing.found.shape[1]):
            m = pressing.found[s, p]
            if m < 0:
                continue
            shifted = _shifted_gap(geometry, pressing, s, p, (x, xi), work, (first, second), axes)
            pressure, slope, density = pressure_of(shifted, geometry.stiffness, geometry.smoothing)
            if pressure == 0.0:
                continue
            area = geometry.area[s, p]
            curved = pressure if shifted > -geometry.curved_to else 0.0
            energy += area * density
            slave, master = geometry.slave[s], geometry.master[m]
            add_pair(first, -area * pressure, slave, master, sums.force)
            for a in range(size):
                for b in range(size):
                    second[a, b] = area * (slope * first[a] * first[b] - curved * second[a, b])
            add_contact_block(second, geometry, s, m, pairs, sums, axes)
    return energy
