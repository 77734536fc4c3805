"""Floor and ceiling of a gap between the coils, as the mesh has them: the gap of a deformed spring.

A sector's boundary carries half a gap on either side; the two halves, one turned by a pitch,
make coil gap 0 whole. Edges are sampled as the quadratic curves they are.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from dftfs.fem.mesh import TaggedMesh
from dftfs.spring.clearance import CEILING, FLOOR, Clearance, measure_clearance, trimmed_ends
from dftfs.spring.edges import rotate
from dftfs.spring.parameters import SpiralParameters

_PIECES = 6  # straight pieces a quadratic edge is sampled in: below a micrometre off
_AROUND_GAP = (*FLOOR, "slit_fillet", *CEILING, "notch_fillet")


@dataclass(frozen=True, kw_only=True)
class _Side:
    """Sampling of one polyline: points = weights @ nodes, some turned by a pitch."""

    weights: csr_array
    turned: NDArray[np.bool_]

    def points(self, nodes: NDArray, pitch_rad: float) -> NDArray:
        points = self.weights @ nodes
        points[self.turned] = rotate(points[self.turned], pitch_rad)
        return points


@dataclass(frozen=True, kw_only=True)
class CoilGapMesh:
    """Coil gap 0 of a planar sector mesh (or of the mid-plane of a solid one)."""

    sector: TaggedMesh
    parameters: SpiralParameters

    @cached_property
    def _sides(self) -> tuple[_Side, _Side]:
        names, edges, turned = self._walk()
        floor = np.isin(names, FLOOR)
        ceiling = np.isin(names, CEILING)
        radius = self.parameters.fillet_radius_m
        sides = []
        for chosen in (floor, ceiling):
            side = _sample(edges[chosen], turned[chosen], len(self.sector.nodes))
            rest = side.points(self.sector.nodes, self.parameters.pitch_rad)
            keep = trimmed_ends(rest, radius, start=True, end=True)
            sides.append(_Side(weights=side.weights[keep], turned=side.turned[keep]))
        return sides[0], sides[1]

    def _walk(self) -> tuple[NDArray, NDArray, NDArray]:
        """Edges (corner, middle, corner) of coil gap 0 from the hub round to the notch."""
        ahead: dict[int, tuple[str, int, int]] = {}
        for name in _AROUND_GAP:
            for i, j, mid in self.sector.boundaries.get(name, ()):
                ahead[int(i)] = (name, int(mid), int(j))
        ends = {j for _, _, j in ahead.values()}
        starts = [i for i in ahead if i not in ends]
        if not starts:  # one arm: a closed loop, opened where the hub follows the notch
            last = {j: i for i, (_, _, j) in ahead.items()}
            notch = "notch_fillet"
            starts = [i for i, e in ahead.items() if e[0] == "hub" and ahead[last[i]][0] == notch]
        chains = []
        for start in starts:
            chain, node = [], start
            while node in ahead and len(chain) < len(ahead):
                name, mid, end = ahead[node]
                chain.append((name, (node, mid, end)))
                node = end
            chains.append(chain)
        # the chain that begins on the hub is of the gap behind: turned, it completes this one
        low = next(chain for chain in chains if chain[0][0] == "hub")
        high = [edge for chain in chains if chain is not low for edge in chain]
        own_hub = [edge for edge in high if edge[0] == "hub"]
        rest = [edge for edge in high if edge[0] != "hub"]
        walk = [(*e, False) for e in own_hub] + [(*e, len(chains) > 1) for e in low]
        walk += [(*e, False) for e in rest]
        names, edges, turned = zip(*walk)
        return np.array(names), np.array(edges), np.array(turned)

    def polylines(self, displacement_m: NDArray | None = None) -> tuple[NDArray, NDArray]:
        """Floor and ceiling, (n, 2) and (m, 2), of the sector displaced by (nodes, 2)."""
        nodes = self.sector.nodes if displacement_m is None else self.sector.nodes + displacement_m
        pitch = self.parameters.pitch_rad
        floor, ceiling = self._sides
        return floor.points(nodes, pitch), ceiling.points(nodes, pitch)

    def clearance(self, displacement_m: NDArray | None = None) -> Clearance:
        """Gap between the facing edges, undeformed or displaced."""
        floor, ceiling = self.polylines(displacement_m)
        return measure_clearance(floor, ceiling, deepest_m=self.parameters.thickness_m / 2)


def _sample(edges: NDArray, turned: NDArray, n_nodes: int) -> _Side:
    s = np.linspace(0, 1, _PIECES + 1)[:-1]
    shape = np.stack([(1 - s) * (1 - 2 * s), 4 * s * (1 - s), s * (2 * s - 1)], axis=1)
    count = len(edges) * _PIECES
    rows = np.repeat(np.arange(count), 3)
    columns = np.repeat(edges[:, None, :], _PIECES, axis=1).ravel()
    values = np.tile(shape, (len(edges), 1)).ravel()
    rows, columns = np.append(rows, count), np.append(columns, edges[-1, 2])
    weights = csr_array((np.append(values, 1.0), (rows, columns)), shape=(count + 1, n_nodes))
    return _Side(weights=weights, turned=np.append(np.repeat(turned, _PIECES), turned[-1]))
