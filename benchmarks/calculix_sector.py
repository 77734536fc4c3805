"""The mesh of `benchmarks/calculix.py`, and the same question asked of one sector of it.

Each function is one process: the mesher's memory is freed at its end.
"""

from pathlib import Path

import numpy as np
from calculix_deck import save_model

from dftfs.analysis.meshing.blocks import MeshSizing
from dftfs.analysis.meshing.sector_mesh import full_mesh, solid_mesh
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.ring_fields import bare_model
from dftfs.design import load_design
from dftfs.fem.newton import solve_path
from dftfs.fem.recover import recover_stress

SIZING = MeshSizing(fillet=4, growth=0.6, along=1.0, ring=0.8)


def torsion_problem() -> TorsionProblem:
    """The design ``ref``, one layer through half the width."""
    return TorsionProblem(design=load_design("ref"), sizing=SIZING)


def make_mesh(folder: Path) -> None:
    """The whole ring of both arms and the full width, into ``model.npz``."""
    problem = torsion_problem()
    design = problem.design
    levels_m = np.array([0.0, design.width_m / 2, design.width_m])
    ring = full_mesh(solid_mesh(problem.sector, levels_m), design.n_arms)
    save_model(folder / "model.npz", bare_model(ring, design.material))


def solve_sector(folder: Path, name: str, deflections_rad: list[float]) -> None:
    """Mesh and solve one sector, half its width; torques and the peak stress to ``name``.npz."""
    problem = torsion_problem()
    static = problem.static_problem()
    path = solve_path(static, deflections_rad)
    stress = recover_stress(static, path.states[-1].displacement_m)
    np.savez(
        folder / f"{name}.npz",
        torque_Nm=[problem.copies * path.at(t).drive_force for t in deflections_rad],
        point_peak_Pa=stress.point_von_mises_Pa.max(),
        unknowns=problem.mesh.nodes.size,
    )
