"""One solved sector as the whole ring: the mesh for other programs, and fields on it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dftfs.analysis.meshing.sector_mesh import full_mesh
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.errors import DesignError
from dftfs.fem.deck import Model
from dftfs.fem.mesh import TaggedMesh, matched_cut_nodes, rotation_about_z
from dftfs.fem.newton import solve_path
from dftfs.fem.path_state import PathState
from dftfs.fem.recover import recover_stress
from dftfs.material import Material
from dftfs.spring.clearance import CEILING, FLOOR

HALVES = 2  # the mid-plane is a mirror: half of the width is solved, the torque is twice its own


@dataclass(frozen=True, kw_only=True, eq=False)
class RingStep:
    """The whole ring at one deflection: torque of the spring, smallest gap, fields at the nodes.

    displacement_m : (n, dim). von_mises_Pa : (n,). Of the ring of `ring_of`.
    """

    deflection_rad: float
    torque_Nm: float
    clearance_m: float
    displacement_m: NDArray
    von_mises_Pa: NDArray


def ring_of(problem: TorsionProblem) -> TaggedMesh:
    """All arms of the solved mesh (in 3D half of the width, the mid-plane at z = 0)."""
    return full_mesh(problem.mesh, problem.design.n_arms)


def ring_model(problem: TorsionProblem, ring: TaggedMesh) -> Model:
    """The ring as `dftfs.fem.deck` states it, with the coils' facing surfaces by name."""
    named = {
        name: np.concatenate([ring.facets(part) for part in parts if part in ring.boundaries])
        for name, parts in (("FLOOR", FLOOR), ("CEILING", CEILING))
    }
    named["NOTCH"] = ring.facets("notch_fillet")
    named["SLIT"] = ring.facets("slit_fillet")
    return bare_model(ring, problem.design.material, mirror=ring.facets("bottom"), surfaces=named)


def bare_model(ring: TaggedMesh, material: Material, **more) -> Model:
    """A ring between bore and outer rim, of a material; ``more``: other fields of the model."""
    return Model(
        nodes_m=ring.nodes,
        cells=ring.cells,
        bore=ring.facets("bore"),
        rim=ring.facets("rim_outer"),
        youngs_modulus_Pa=material.youngs_modulus_Pa,
        poisson_ratio=material.poisson_ratio,
        **more,
    )


def ring_steps(
    problem: TorsionProblem, deflections_rad: list[float], *, solver: str = "auto"
) -> list[RingStep]:
    """Our own answer at each deflection, coils free to pass through each other.

    Raises
    ------
    DesignError
        If the problem is no sector in its bearing.
    SolveError
        If a deflection cannot be reached.
    """
    if problem.boundary != "bearing":
        raise DesignError(f"boundary = {problem.boundary!r}: fields of the ring need 'bearing'")
    static = problem.static_problem()
    path = solve_path(static, deflections_rad, solver=solver)
    return [_step(problem, static, path.at(t)) for t in deflections_rad]


def _step(problem: TorsionProblem, static, state: PathState) -> RingStep:
    planar = problem.on_sector(state.displacement_m)[:, :2]
    return RingStep(
        deflection_rad=state.t,
        torque_Nm=problem.copies * state.drive_force,
        clearance_m=problem.coil_gap.clearance(planar).smallest_m,
        displacement_m=on_ring(problem, state.displacement_m),
        von_mises_Pa=on_ring(problem, recover_stress(static, state.displacement_m).von_mises_Pa),
    )


def on_ring(problem: TorsionProblem, nodal: NDArray) -> NDArray:
    """Nodal values of the sector at the ring's nodes: (n,) copied, (n, dim) turned with the arm.

    In the numbering of `dftfs.fem.mesh.replicated`.
    """
    mesh, arms = problem.mesh, problem.design.n_arms
    if arms == 1:
        return nodal
    _, high = matched_cut_nodes(mesh, arms, cut_low="cut_low", cut_high="cut_high")
    own = nodal[np.setdiff1d(np.arange(len(mesh.nodes)), high)]
    if own.ndim == 1:
        return np.tile(own, arms)
    turns = [rotation_about_z(2 * np.pi * k / arms, mesh.dim) for k in range(arms)]
    return np.concatenate([own @ turn.T for turn in turns])
