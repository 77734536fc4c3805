"""Bodies in contact that several test files share."""

import numpy as np
from numpy.typing import NDArray

from dftfs.fem.constraints import Drive
from dftfs.fem.contact import ContactLaw, ContactSurfaces
from dftfs.fem.mesh import TaggedMesh, extruded
from tests.cases.fem import mapped_mesh, side_by_side

E_PA = 70e9


def law(**changes) -> ContactLaw:
    values = {"stiffness_Pa_per_m": 1e15, "smoothing_m": 1e-8, "reach_m": 1e-3, "deepest_m": 1e-3}
    return ContactLaw(**(values | changes))


def surfaces(mesh: TaggedMesh, slave: str, master: str, **changes) -> ContactSurfaces:
    return ContactSurfaces(
        slave=mesh.facets(slave),
        master=mesh.facets(master),
        turns=(np.eye(mesh.dim),),
        law=law(**changes),
    )


def pushed(mesh: TaggedMesh, boundary: str, direction: tuple[float, ...]) -> Drive:
    """Nodes of a boundary moved by t along a direction, free across it."""
    nodes, direction = mesh.boundary_nodes(boundary), np.array(direction)
    shift = np.tile(direction, (len(nodes), 1))
    axes = tuple(np.flatnonzero(direction).tolist())
    return Drive(nodes=nodes, motion=lambda t: (t * shift, shift, 0 * shift), components=axes)


def two_blocks(dim: int) -> TaggedMesh:
    """A block on a wider one, surfaces curved so that the feet feel the facets' curvature."""

    def lower(s, t):
        return 0.1 * s - 0.02, 0.04 * t - 0.04 + 0.01 * (s - 0.5) ** 2 * t

    def upper(s, t):
        return 0.05 * s + 0.003, 0.04 * t + 0.004 * (s - 0.4) ** 2 * (1 - t)

    mesh = side_by_side(low=mapped_mesh(3, 1, lower), up=mapped_mesh(2, 1, upper))
    return mesh if dim == 2 else extruded(mesh, np.array([0.0, 0.02, 0.05]))


def cylinder_on_flat(radius_m: float, half_m: float, depth_m: float, finer: int = 1) -> TaggedMesh:
    """A cylinder's lowest part (``up``) on a block (``low``), graded towards their contact."""

    def graded(s):  # fine in the middle
        x = 2 * s - 1
        return half_m * (0.06 * x + 0.94 * x**5)

    def deep(t):  # fine at the surface, from 0 to depth
        return depth_m * (0.03 * t + 0.97 * t**4)

    def over(height, floor):
        return floor + (depth_m - floor) * height / depth_m

    low = mapped_mesh(44 * finer, 10, lambda s, t: (graded(s), -deep(1 - t)))
    up = mapped_mesh(
        48 * finer, 10, lambda s, t: (graded(s), over(deep(t), sagitta(radius_m, graded(s))))
    )
    return side_by_side(low=low, up=up)


def sagitta(radius_m: float, x: NDArray) -> NDArray:
    """Height of a circle over its lowest point."""
    return radius_m - np.sqrt(radius_m**2 - x**2)
