"""Start values for 3D equilibria from plane-stress solutions on the mesh that is extruded.

Without earlier states Newton's method needs five to seven factorisations for a large rotation or
for the first contact; with half a million unknowns each takes as long as the whole plane-stress
path. The difference of two plane-stress states is added to the last 3D state; displacements through
the thickness are extrapolated at their rate. Only the start of the iteration depends on this, not
the equilibrium.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.errors import SolveError
from dftfs.fem.newton import Guess, solve_path
from dftfs.fem.path_state import PathState


def planar_guess(
    problem: TorsionProblem, deflections: Sequence[float], *, contact: bool, solver: str
) -> Guess | None:
    """Start values for the 3D states at some deflections (rad), each from another of them.

    None for a problem in the plane, and where plane stress finds no equilibrium.
    """
    if problem.dimension == 2:
        return None
    plane = replace(problem, dimension=2)
    static = plane.static_problem(contact=contact)
    goals = [t for t in deflections if t != 0.0]
    try:
        path = solve_path(static, goals, solver=solver)
    except SolveError:
        return None
    below = cKDTree(plane.mesh.nodes).query(problem.mesh.nodes[:, :2])[1]
    known = {t: path.at(t).displacement_m for t in deflections}

    def guess(last: PathState, t: float) -> np.ndarray | None:
        if t not in known or last.t not in known:
            return None
        found = last.displacement_m + (t - last.t) * last.rate_m
        found[:, :2] = last.displacement_m[:, :2] + (known[t] - known[last.t])[below]
        return found

    return guess
