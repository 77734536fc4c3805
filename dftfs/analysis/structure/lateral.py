"""How softly the spring alone holds the rim sideways: why a bearing is mandatory."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dftfs.analysis.meshing.sector_mesh import full_mesh
from dftfs.analysis.structure.linear_spring import on_all_arms
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.errors import DesignError
from dftfs.fem.constraints import Drive, clamped
from dftfs.fem.linear_model import condensed, reduction, rigid_motions, tangent_matrix
from dftfs.fem.newton import linear_tangent, solve_path
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


@dataclass(frozen=True, kw_only=True)
class LateralState:
    """How a turned rim is held sideways, before the coils touch.

    ``softest_N_per_m`` and ``stiffest_N_per_m`` are over all directions in the plane, the rim held
    at its angle; ``force_N`` is what the spring presses sideways on the bearing of a centred rim
    (none from two arms on), and a rim off its centre adds the stiffness times the offset.
    """

    deflection_rad: float
    softest_N_per_m: float
    stiffest_N_per_m: float
    force_N: float


def lateral_curve(
    problem: TorsionProblem, deflections_rad: Sequence[float]
) -> tuple[LateralState, ...]:
    """Lateral stiffness and force against the angle, ascending; plane stress, no contact.

    Parameters
    ----------
    problem : TorsionProblem
        Planar, with the boundary ``bearing``.
    deflections_rad : sequence of float
        Signed; rest is added.

    Raises
    ------
    DesignError
        If the problem is not planar or free of its bearing.
    SolveError
        If an increment has no equilibrium.
    """
    if problem.dimension != 2 or problem.boundary != "bearing":
        raise DesignError("lateral stiffness against angle is of the planar problem in a bearing")
    static = problem.static_problem()
    states = []
    for sign in (+1, -1):
        goals = sorted((float(d) for d in deflections_rad if sign * d > 0), key=abs)
        if goals:
            path = solve_path(static, goals)
            states += [path.at(goal) for goal in goals]
    states = sorted((solve_path(static, [0.0]).states[0], *states), key=lambda state: state.t)
    ring = full_mesh(problem.sector, problem.design.n_arms)
    rim = ring.boundary_nodes("rim_outer")
    held = np.zeros(ring.nodes.shape, dtype=bool)
    held[ring.boundary_nodes("bore")] = True
    shifts = rigid_motions(ring, rim, ("x", "y"))
    parts = reduction(ring, held=held, tied=[rim], interfaces=[shifts])
    material, found = problem.design.material, []
    for state in states:
        nodes = problem.sector.nodes
        tangent = tangent_matrix(
            ring,
            youngs_modulus_Pa=material.youngs_modulus_Pa,
            poisson_ratio=material.poisson_ratio,
            thickness_m=problem.design.width_m,
            displacement_m=on_all_arms(
                nodes, ring.nodes, state.displacement_m, problem.design.n_arms
            ),
        )
        low, high = np.linalg.eigvalsh(condensed(tangent, parts))
        own = state.reaction_N[problem.mesh.boundary_nodes("rim_outer")].sum(axis=0)
        found.append(
            LateralState(
                deflection_rad=state.t,
                softest_N_per_m=float(low),
                stiffest_N_per_m=float(high),
                force_N=float(np.hypot(*own)) if problem.design.n_arms == 1 else 0.0,
            )
        )
    return tuple(found)
