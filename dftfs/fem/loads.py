"""Dead loads: nodal forces that keep their direction."""

import numpy as np
from numpy.typing import NDArray

from dftfs.errors import SolveError
from dftfs.fem.elements import face_table
from dftfs.fem.mesh import TaggedMesh
from dftfs.fem.problem import DeadLoad


def traction_forces(
    mesh: TaggedMesh, boundary: str, traction_Pa: NDArray, *, thickness_m: float = 1.0
) -> NDArray[np.float64]:
    """Nodal forces (n, dim) in N, consistent with a uniform traction on a boundary.

    The traction is per undeformed area; ``thickness_m`` is the third side of a planar mesh.
    """
    traction = np.asarray(traction_Pa, dtype=float)
    if traction.shape != (mesh.dim,):
        raise SolveError(f"traction_Pa needs {mesh.dim} components, got {traction.tolist()}")
    facets = mesh.facets(boundary)
    table = face_table(mesh.dim)
    tangents = np.einsum("fni,qjn->fqji", mesh.nodes[facets], table.gradients)
    if mesh.dim == 2:
        area = np.linalg.norm(tangents[:, :, 0], axis=-1) * thickness_m
    else:
        area = np.linalg.norm(np.cross(tangents[:, :, 0], tangents[:, :, 1]), axis=-1)
    share = np.einsum("fq,q,qn->fn", area, table.weights, table.values)
    forces = np.zeros(mesh.nodes.shape)
    np.add.at(forces, facets, share[:, :, None] * traction)
    return forces


def proportional(force_N: NDArray[np.float64]) -> DeadLoad:
    """The dead load t * force_N."""

    def load(t: float) -> tuple[NDArray, NDArray]:
        return t * force_N, force_N

    return load
