"""Where a solid's equilibrium will be, from plane stress on the mesh that it is extruded from.

Without a history of states Newton's method needs five to seven factorisations for a large turn,
or for the first contact; of a solid with half a million unknowns each takes as long as the whole
path in the plane. What the plane's states differ by is added to the solid's last state, the
thickness changes at the rate of that state. It is a start only: what is found is the solid's own
equilibrium.
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
    """Starts for the states of a solid at some deflections (rad), from another of them each.

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
