"""A design's torque-angle curve by finite elements, both directions, to first contact or beyond.

After Capytaine's problem -> solve -> result.
"""

import time
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from dftfs.analysis.meshing.planar_mesh import corner_quality
from dftfs.analysis.torsion.contact_path import (
    ContactPath,
    continued_in_contact,
    estimated_onset,
    path_to_contact,
)
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.regions import REGIONS, regional_peaks_Pa
from dftfs.analysis.torsion.result import (
    SIGN,
    FieldSnapshot,
    MeshSummary,
    StepFields,
    StiffnessResult,
)
from dftfs.errors import DesignError
from dftfs.fem.newton import PathState
from dftfs.fem.recover import recover_stress
from dftfs.spring.edges import rotate

Progress = Callable[[str], None]
LARGEST_BEYOND = 3.0


def solve_torsion(
    problem: TorsionProblem,
    *,
    states_per_direction: int = 8,
    beyond: float = 1.0,
    states_beyond: int = 5,
    extra_deflections_rad: Sequence[float] = (),
    expected_onset_rad: dict[str, float] | None = None,
    solver: str = "auto",
    on_progress: Progress = lambda message: None,
) -> StiffnessResult:
    """Solve both directions up to the first contact, and beyond it with contact.

    Parameters
    ----------
    states_per_direction : int
        Evenly spaced states up to the contact.
    beyond : float
        Where a direction ends, over the deflection of its first contact; 1 is the contact itself.
    states_beyond : int
        Evenly spaced states from the contact to there.
    extra_deflections_rad : sequence of float
        Further deflections (signed) to hit exactly; those beyond the curve's end are refused.
    expected_onset_rad : mapping of direction to a positive deflection, optional
        Where contact is expected (from a faster model); estimated where absent.

    Raises
    ------
    SolveError
        If an increment has no equilibrium.
    DesignError
        If an extra deflection lies beyond the curve's end, or an argument is out of range.
    """
    _require(states_per_direction, beyond, extra_deflections_rad)
    begun = time.perf_counter()
    static = problem.static_problem()
    paths = {}
    for direction, sign in SIGN.items():
        expected = (expected_onset_rad or {}).get(direction)
        if expected is None:
            expected = estimated_onset(problem, static, sign, solver)
        extra = [abs(d) for d in extra_deflections_rad if d * sign > 0]
        found = path_to_contact(
            problem, static, sign, expected, states_per_direction, extra, solver
        )
        if found.onset and beyond > 1:
            end = beyond * found.onset.deflection_rad
            found = continued_in_contact(problem, found, end, states_beyond, extra)
        on_progress(_summary(problem, direction, found))
        last = found.states[-1].t
        late = [d for d in extra if d > abs(last)]
        if late:
            raise DesignError(
                f"deflection {sign * max(late):+.4g} rad is past {last:+.4g} rad, where the curve"
                f" {direction} ends ({found.end}); {sign * 0.9 * abs(last):+.2g} would work"
            )
        paths[direction] = found
    return _assemble(problem, paths, time.perf_counter() - begun)


def _require(states: int, beyond: float, deflections_rad: Sequence[float]) -> None:
    if states < 1:
        raise DesignError(f"states = {states} per direction must be 1 or more")
    if not 1 <= beyond <= LARGEST_BEYOND:
        raise DesignError(
            f"beyond = {beyond} must be 1 to {LARGEST_BEYOND} times the first contact"
        )
    if not np.all(np.isfinite(deflections_rad)):
        raise DesignError(f"deflections {list(deflections_rad)} rad must be numbers")


def _summary(problem: TorsionProblem, direction: str, found: ContactPath) -> str:
    count, last, copies = len(found.states), found.states[-1], problem.copies
    text = f"{problem.model}, {direction}: {count} states"
    if found.onset is None:
        return f"{text}, no contact up to {last.t:+.4f} rad, {copies * last.drive_force:+.3f} Nm"
    touch = found.onset
    text += f", first contact {touch.deflection_rad:+.4f} rad, {touch.torque_Nm:+.3f} Nm"
    if touch.stiffening is None:
        return text
    return f"{text}, tangent x {touch.stiffening:.3f} beyond, up to {last.t:+.4f} rad"


def _assemble(
    problem: TorsionProblem, paths: dict[str, ContactPath], wall_s: float
) -> StiffnessResult:
    wind, unwind = paths["winding"], paths["unwinding"]
    states = [*unwind.states[::-1], wind.rest, *wind.states]
    gaps = [*unwind.clearance_m[::-1], wind.rest_clearance_m, *wind.clearance_m]
    stresses = [recover_stress(problem.static_problem(), s.displacement_m) for s in states]
    peaks, principal = (
        [regional_peaks_Pa(problem, values, s.touch) for values, s in zip(kind, states)]
        for kind in zip(*((stress.von_mises_Pa, stress.principal_Pa) for stress in stresses))
    )
    copies, mesh = problem.copies, problem.mesh
    snapshots = {
        direction: _snapshot(problem, path.states[path.touch]) for direction, path in paths.items()
    }
    sector = f"1 of {problem.design.n_arms} sectors" if problem.boundary == "bearing" else "ring"
    symmetry = sector + (", half the width" if problem.dimension == 3 else "")
    return StiffnessResult(
        model=problem.model,
        stiffness_Nm_per_rad=copies * wind.rest.drive_stiffness,
        deflection_rad=np.array([s.t for s in states]),
        torque_Nm=copies * np.array([s.drive_force for s in states]),
        tangent_Nm_per_rad=copies * np.array([s.drive_stiffness for s in states]),
        peak_von_mises_Pa=np.array([float(np.max(s.von_mises_Pa)) for s in stresses]),
        min_clearance_m=np.array(gaps),
        strain_energy_J=copies * np.array([s.energy_J for s in states]),
        contact_onset={direction: path.onset for direction, path in paths.items()},
        ended_by={direction: path.end for direction, path in paths.items()},
        mesh=MeshSummary(
            dimension=problem.dimension,
            nodes=len(mesh.nodes),
            elements=len(mesh.cells),
            unknowns=int(mesh.nodes.size),
            min_corner_sine=float(
                np.min(corner_quality(problem.sector.nodes[problem.sector.cells[:, :4]]))
            ),
            symmetry=symmetry,
            solver=wind.solver,
        ),
        snapshots=snapshots,
        wall_s=wall_s,
        regional_peak_Pa={r: np.array([peak[r] for peak in peaks]) for r in REGIONS},
        regional_principal_Pa={r: np.array([peak[r] for peak in principal]) for r in REGIONS},
        fields=_fields(problem, states, [stress.von_mises_Pa for stress in stresses]),
    )


def _fields(
    problem: TorsionProblem, states: Sequence[PathState], stresses_Pa: Sequence[NDArray]
) -> StepFields:
    moved = [problem.on_sector(state.displacement_m)[:, :2] for state in states]
    return StepFields(
        copies=problem.design.n_arms,
        nodes_m=problem.sector.nodes,
        cells=problem.sector.cells,
        displacement_m=np.array(moved, dtype=np.float32),
        von_mises_Pa=np.array([problem.on_sector(s) for s in stresses_Pa], dtype=np.float32),
    )


def _snapshot(problem: TorsionProblem, state: PathState) -> FieldSnapshot:
    """The mid-plane of all sectors: the solved one and its turned copies."""
    sector, n = problem.sector, problem.design.n_arms
    stress = recover_stress(problem.static_problem(), state.displacement_m)
    count = len(sector.nodes)
    displacement = problem.on_sector(state.displacement_m)[:, :2]
    von_mises = problem.on_sector(stress.von_mises_Pa)
    angles = 2 * np.pi * np.arange(n) / n
    peak = int(np.argmax(von_mises))
    return FieldSnapshot(
        deflection_rad=state.t,
        torque_Nm=problem.copies * state.drive_force,
        nodes_m=np.concatenate([rotate(sector.nodes, a) for a in angles]),
        cells=np.concatenate([sector.cells + k * count for k in range(n)]),
        displacement_m=np.concatenate([rotate(displacement, a) for a in angles]),
        von_mises_Pa=np.tile(von_mises, n),
        peak_at_m=(float(sector.nodes[peak, 0]), float(sector.nodes[peak, 1])),
    )
