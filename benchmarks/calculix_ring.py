"""Our side of `benchmarks/calculix.py`: one process that solves the whole ring.

It reads the mesh from a file, as CalculiX does, and never loads a mesher.
"""

from pathlib import Path

import numpy as np
from calculix_deck import load_model, nodal_average

from dftfs.fem.constraints import clamped, rigid_rotation
from dftfs.fem.elements import gauss_table
from dftfs.fem.mesh import TaggedMesh
from dftfs.fem.newton import solve_path
from dftfs.fem.problem import StaticProblem
from dftfs.fem.recover import cauchy_stress, recover_stress

_COMPONENTS = ([0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2])  # xx, yy, zz, xy, xz, yz


def solve_ring(folder: Path, name: str, deflections_rad: list[float]) -> None:
    """Through the deflections; torques and the last state's stresses go to ``name``.npz."""
    model = load_model(folder / "model.npz")
    facets = {"bore": model.bore, "rim": model.rim}
    mesh = TaggedMesh(nodes=model.nodes_m, cells=model.cells, boundaries=facets)
    problem = StaticProblem(
        mesh=mesh,
        youngs_modulus_Pa=model.youngs_modulus_Pa,
        poisson_ratio=model.poisson_ratio,
        supports=(clamped(mesh.boundary_nodes("bore")),),
        drive=rigid_rotation(mesh, mesh.boundary_nodes("rim")),
    )
    path = solve_path(problem, deflections_rad)
    displacement = path.states[-1].displacement_m
    stress = cauchy_stress(problem, displacement)[..., *_COMPONENTS]
    table = gauss_table("hex20", 3)
    order = np.lexsort(table.points.round(9).T)  # CalculiX counts points along x first
    np.savez(
        folder / f"{name}.npz",
        torque_Nm=[path.at(t).drive_force for t in deflections_rad],
        point_stress_Pa=stress[:, order],
        nodal_stress_Pa=nodal_average(stress, np.linalg.pinv(table.values), mesh.cells),
        own_nodal_peak_Pa=recover_stress(problem, displacement).von_mises_Pa.max(),
        increments=len(path.states) - 1,
        corrections=sum(state.iterations for state in path.states[1:]),
        factorisations=sum(state.factorisations for state in path.states[1:]),
        solver=path.solver,
    )
