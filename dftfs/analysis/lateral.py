"""How softly the spring alone holds the rim sideways: why a bearing is mandatory."""

import numpy as np
from numpy.typing import NDArray

from dftfs.analysis.meshing import full_mesh
from dftfs.analysis.torsion_problem import TorsionProblem
from dftfs.fem.constraints import Drive, clamped
from dftfs.fem.newton import linear_tangent
from dftfs.fem.problem import StaticProblem


def lateral_stiffness(problem: TorsionProblem, *, direction_rad: float = 0.0) -> float:
    """Force over displacement (N/m) when the rim is shifted without turning, at rest.

    Plane stress on the whole ring, bore clamped. From three arms on the value is the same in
    every direction; with one or two it is not, and ``direction_rad`` chooses.

    Raises
    ------
    SolveError
        If the linear solve fails.
    """
    ring = full_mesh(problem.sector, problem.design.n_arms)
    rim = ring.boundary_nodes("rim_outer")
    shift = np.broadcast_to([np.cos(direction_rad), np.sin(direction_rad)], (len(rim), 2))

    def motion(t: float) -> tuple[NDArray, NDArray, NDArray]:
        return t * shift, np.array(shift), np.zeros_like(shift)

    material = problem.design.material
    return linear_tangent(
        StaticProblem(
            mesh=ring,
            youngs_modulus_Pa=material.youngs_modulus_Pa,
            poisson_ratio=material.poisson_ratio,
            thickness_m=problem.design.width_m,
            supports=(clamped(ring.boundary_nodes("bore")),),
            drive=Drive(nodes=rim, motion=motion, components=(0, 1)),
        )
    )


def softest_lateral_stiffness(problem: TorsionProblem) -> float:
    """Smallest lateral stiffness (N/m) over all directions.

    The in-plane stiffness is a symmetric 2 x 2 matrix; three directions determine it.
    """
    x, y, diagonal = (
        lateral_stiffness(problem, direction_rad=a) for a in (0, np.pi / 2, np.pi / 4)
    )
    coupling = diagonal - (x + y) / 2
    return float(np.linalg.eigvalsh([[x, coupling], [coupling, y]])[0])
