"""The loop over the points of a slave surface: contact forces, energy and tangent."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from dftfs.fem.contact_kernel import pressure_of, variations, workspace
from dftfs.fem.integration import scatter, turn_blocks


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


@njit(cache=True)
def position(shape, nodes, x):
    """Interpolate nodal values (q, D) into x (D,)."""
    for i in range(nodes.shape[1]):
        x[i] = 0.0
        for a in range(nodes.shape[0]):
            x[i] += shape[a] * nodes[a, i]


@njit(cache=True)
def add_nodal(values, factor, slave, master, field, D):
    """Add factor times values over a pair's nodes to a nodal field (n, D)."""
    q = slave.shape[0]
    for a in range(q):
        for i in range(D):
            field[slave[a], i] += factor * values[a * D + i]
            field[master[a], i] += factor * values[(q + a) * D + i]


@njit(cache=True)
def add_contact_block(block, slave, master, target, offset, direction, product, data, pull, axes):
    """Add a pair's symmetric tangent to the sparse matrix, its product with direction to nodes.

    block (P D, P D) over the slave's nodes, then the master's; offset: of the pair's node pairs.
    """
    D = len(axes)
    q = slave.shape[0]
    P = 2 * q
    K, half = np.empty(P * D * D * P), np.empty(D * D)
    nodes, carrier = np.empty(P, dtype=np.int32), np.empty(P, dtype=np.int32)
    turned = np.empty(P, dtype=np.bool_)
    nodes[:q], nodes[q:] = slave, master
    for a in range(P * D):
        pull[a] = 0.0
        for b in range(P * D):
            pull[a] += block[a, b] * direction[nodes[b // D], b % D]
    add_nodal(pull, 1.0, slave, master, product, D)
    for a in range(P):
        carrier[a], turned[a] = target.carrier[nodes[a]], target.turned[nodes[a]]
        for i in range(D):
            for k in range(D):
                for b in range(a, P):
                    K[((a * D + i) * D + k) * P + b] = block[a * D + i, b * D + k]
    if turned.any():
        turn_blocks(K, turned, target.rotation, half, axes)
    scatter(K, carrier, offset, target, data, axes)


@njit(cache=True)
def integrate_contact_forces(geometry, found, where, multiplier, force, axes):
    """Add contact forces (n, D) in N; returns the energy in J."""
    D = len(axes)
    q = geometry.slave.shape[1]
    first, second = np.empty(2 * q * D), np.empty((2 * q * D, 2 * q * D))
    work, x, xi = workspace(axes), np.empty(D), np.empty(D - 1)
    energy = 0.0
    for s in range(found.shape[0]):
        for p in range(found.shape[1]):
            m = found[s, p]
            if m < 0:
                continue
            position(geometry.shapes[p], geometry.slave_m[s], x)
            xi[:] = where[s, p]
            shape, rotation = geometry.shapes[p], geometry.turns[geometry.turn[m]]
            gap = variations(
                x, geometry.master_m[m], xi, shape, rotation, work, first, second, False, axes
            )
            shifted = gap - multiplier[s, p] / geometry.stiffness
            pressure, _, density = pressure_of(shifted, geometry.stiffness, geometry.smoothing)
            if pressure == 0.0:
                continue
            energy += geometry.area[s, p] * density
            factor = -geometry.area[s, p] * pressure
            add_nodal(first, factor, geometry.slave[s], geometry.master[m], force, D)
    return energy


@njit(cache=True)
def integrate_contact_tangent(
    geometry,
    found,
    where,
    multiplier,
    place,
    target,
    offset,
    direction,
    force,
    product,
    data,
    axes,
):
    """`integrate_contact_forces`, with the tangent added to ``data`` and to ``product``."""
    D = len(axes)
    q = geometry.slave.shape[1]
    size = 2 * q * D
    first, second = np.empty(size), np.empty((size, size))
    work, x, xi = workspace(axes), np.empty(D), np.empty(D - 1)
    pull = np.empty(size)
    energy = 0.0
    for s in range(found.shape[0]):
        for p in range(found.shape[1]):
            m = found[s, p]
            if m < 0:
                continue
            position(geometry.shapes[p], geometry.slave_m[s], x)
            xi[:] = where[s, p]
            shape, rotation = geometry.shapes[p], geometry.turns[geometry.turn[m]]
            gap = variations(
                x, geometry.master_m[m], xi, shape, rotation, work, first, second, True, axes
            )
            shifted = gap - multiplier[s, p] / geometry.stiffness
            pressure, slope, density = pressure_of(shifted, geometry.stiffness, geometry.smoothing)
            if pressure == 0.0:
                continue
            area = geometry.area[s, p]
            bent = pressure if shifted > -geometry.curved_to else 0.0
            energy += area * density
            add_nodal(first, -area * pressure, geometry.slave[s], geometry.master[m], force, D)
            for a in range(size):
                for b in range(size):
                    second[a, b] = area * (slope * first[a] * first[b] - bent * second[a, b])
            add_contact_block(
                second, geometry.slave[s], geometry.master[m], target, offset[place[s, m]],
                direction, product, data, pull, axes,
            )  # fmt: skip
    return energy
