"""The torsion problem: a design's torque-angle curve by finite elements, up to first contact.

`bearing` boundary condition: bore clamped, rim turned rigidly about the fixed axis, torque as the
reaction conjugate to the angle. One cyclic sector stands for the spring, and in 3D one half of
the width (the mid-plane is a mirror): exactly the answer of the whole mesh. After Capytaine's
problem -> solve -> result.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from dftfs.analysis.blocks import MeshSizing
from dftfs.analysis.meshing import sector_mesh, solid_mesh
from dftfs.analysis.results import (
    SIGN,
    ContactOnset,
    FieldSnapshot,
    MeshSummary,
    StiffnessResult,
    hermite,
)
from dftfs.analysis.void_mesh import VoidMesh
from dftfs.design import SpringDesign
from dftfs.errors import DesignError, SolveError
from dftfs.fem.constraints import clamped, cyclic_symmetry, rigid_rotation
from dftfs.fem.mesh import TaggedMesh
from dftfs.fem.newton import PathState, solve_path
from dftfs.fem.problem import StaticProblem
from dftfs.fem.quality import mesh_quality
from dftfs.fem.recover import recover_stress
from dftfs.spring.edges import rotate

Progress = Callable[[str], None]
_BEYOND = 1.02  # one state past the expected contact, so that the gap's zero is bracketed
_FIRST_LOOK_STEP_RAD = 0.03
_FARTHEST_RAD = 1.5


@dataclass(frozen=True, kw_only=True)
class TorsionProblem:
    """A design, a mesh of it, and how the curve is walked.

    Parameters
    ----------
    design : SpringDesign
    dimension : int
        3 (hex20) or 2 (quad8, plane stress; the fast model).
    sizing : MeshSizing
    layers : int
        Elements through half the width (3D).

    Raises
    ------
    DesignError
        If the dimension or the layers are out of range.
    """

    design: SpringDesign
    dimension: int = 3
    sizing: MeshSizing = field(default_factory=MeshSizing)
    layers: int = 1

    def __post_init__(self) -> None:
        if self.dimension not in (2, 3):
            raise DesignError(f"dimension = {self.dimension} must be 2 or 3")
        if self.layers < 1:
            raise DesignError(f"layers = {self.layers} must be 1 or more")

    @property
    def model(self) -> str:
        """Name of the model in tables and plots."""
        return "3D hex20" if self.dimension == 3 else "2D plane stress quad8"

    @cached_property
    def sector(self) -> TaggedMesh:
        """Planar mesh of one sector."""
        return sector_mesh(self.design.outline, self.sizing)

    @cached_property
    def mesh(self) -> TaggedMesh:
        """The mesh that is solved on: the sector, or its upper half in 3D."""
        if self.dimension == 2:
            return self.sector
        return solid_mesh(self.sector, np.linspace(0, self.design.width_m / 2, self.layers + 1))

    @property
    def copies(self) -> int:
        """How many times the solved part fits into the spring."""
        return self.design.n_arms * (2 if self.dimension == 3 else 1)

    @cached_property
    def void(self) -> VoidMesh:
        """Facing edges of the mid-plane."""
        return VoidMesh(sector=self.sector, parameters=self.design.spiral)

    def static_problem(self) -> StaticProblem:
        """The engine's problem: bore clamped, rim turned, cuts tied, mid-plane mirrored."""
        mesh, material = self.mesh, self.design.material
        bore, rim = mesh.boundary_nodes("bore"), mesh.boundary_nodes("rim_outer")
        supports = [clamped(bore)]
        if self.dimension == 3:
            mirror = np.setdiff1d(mesh.boundary_nodes("bottom"), np.union1d(bore, rim))
            supports.append(clamped(mirror, components=(2,)))
        return StaticProblem(
            mesh=mesh,
            youngs_modulus_Pa=material.youngs_modulus_Pa,
            poisson_ratio=material.poisson_ratio,
            thickness_m=self.design.width_m if self.dimension == 2 else None,
            supports=tuple(supports),
            drive=rigid_rotation(mesh, rim),
            cyclic=cyclic_symmetry(mesh, self.design.n_arms) if self.design.n_arms > 1 else None,
        )


def solve_torsion(
    problem: TorsionProblem,
    *,
    states_per_direction: int = 8,
    extra_deflections_rad: Sequence[float] = (),
    expected_onset_rad: dict[str, float] | None = None,
    solver: str = "auto",
    on_progress: Progress = lambda message: None,
) -> StiffnessResult:
    """Walk both directions to the first contact.

    Parameters
    ----------
    states_per_direction : int
        Evenly spaced states up to the contact.
    extra_deflections_rad : sequence of float
        Further deflections (signed) to hit exactly; those beyond the contact are refused.
    expected_onset_rad : mapping of direction to a positive deflection, optional
        Where contact is expected (from a faster model); found by a first walk where absent.

    Raises
    ------
    SolveError
        If an increment has no equilibrium, or no contact is found up to 1.5 rad.
    DesignError
        If an extra deflection lies beyond the first contact.
    """
    begun = time.perf_counter()
    static = problem.static_problem()
    walks = {}
    for direction, sign in SIGN.items():
        expected = (expected_onset_rad or {}).get(direction)
        if expected is None:
            expected = _first_look(problem, static, sign, solver)
        extra = [abs(d) for d in extra_deflections_rad if d * sign > 0]
        walk = _walk(problem, static, sign, expected, states_per_direction, extra, solver)
        onset = walk.onset
        on_progress(
            f"{problem.model}, {direction}: {len(walk.states)} states, first contact at"
            f" {onset.deflection_rad:+.4f} rad, {onset.torque_Nm:+.3f} Nm"
        )
        late = [d for d in extra if d > abs(onset.deflection_rad)]
        if late:
            raise DesignError(
                f"deflection {sign * max(late):+.4g} rad lies beyond the first contact {direction}"
                f" at {onset.deflection_rad:+.4g} rad, where this curve ends"
            )
        walks[direction] = walk
    return _assemble(problem, walks, time.perf_counter() - begun)


@dataclass(frozen=True, kw_only=True)
class _Walk:
    """Contact-free states of one direction, without the state at rest, and the onset."""

    rest: PathState
    states: tuple[PathState, ...]
    clearance_m: tuple[float, ...]
    rest_clearance_m: float
    onset: ContactOnset
    solver: str


def _first_look(problem: TorsionProblem, static: StaticProblem, sign: float, solver: str) -> float:
    """Where contact roughly is: wide steps until the gap has gone, then its zero."""
    gaps = [(0.0, problem.void.clearance().smallest_m)]

    def touched(state: PathState) -> bool:
        gaps.append((abs(state.t), _gap(problem, state)[0]))
        return gaps[-1][1] <= 0

    targets = sign * np.arange(_FIRST_LOOK_STEP_RAD, _FARTHEST_RAD, _FIRST_LOOK_STEP_RAD)
    path = solve_path(static, targets, solver=solver, step_callback=touched)
    if not path.stopped:
        raise SolveError(
            f"no contact of the coils up to {sign * _FARTHEST_RAD:+.2f} rad: the spring is softer"
            " than this analysis is made for; give the deflections explicitly"
        )
    deflection, gap = np.array(gaps[-4:]).T
    return float(np.interp(0.0, gap[::-1], deflection[::-1]))


def _gap(problem: TorsionProblem, state: PathState) -> tuple[float, NDArray]:
    planar = state.displacement_m[: len(problem.sector.nodes), :2]
    clearance = problem.void.clearance(planar)
    return clearance.smallest_m, clearance.at_m


def _walk(
    problem: TorsionProblem,
    static: StaticProblem,
    sign: float,
    expected: float,
    count: int,
    extra: list[float],
    solver: str,
) -> _Walk:
    even = np.linspace(0, expected, count + 1)[1:]
    inside = [d for d in extra if d < expected * _BEYOND]
    targets = sign * np.unique([*even, *inside, _BEYOND * expected])
    states: list[PathState] = []
    gaps: list[float] = []
    places: list[NDArray] = []
    goals = {float(t) for t in targets}

    def keep(state: PathState) -> bool:
        if state.t in goals:
            gap, at = _gap(problem, state)
            states.append(state)
            gaps.append(gap)
            places.append(at)
            return gap <= 0
        return False

    further = [sign * expected * (1.05 + 0.03 * k) for k in range(20)]
    goals |= {float(t) for t in further}
    path = solve_path(static, [*targets, *further], solver=solver, step_callback=keep)
    if not path.stopped:
        raise SolveError(
            f"no contact found near the expected {sign * expected:+.4f} rad; last gap"
            f" {gaps[-1] * 1e3:.3f} mm"
        )
    rest, rest_gap = path.states[0], problem.void.clearance().smallest_m
    return _Walk(
        rest=rest,
        states=tuple(states[:-1]),
        clearance_m=tuple(gaps[:-1]),
        rest_clearance_m=rest_gap,
        onset=_onset(problem, [rest, *states], [rest_gap, *gaps], places[-1]),
        solver=path.solver,
    )


def _onset(
    problem: TorsionProblem, states: list[PathState], gaps: list[float], at: NDArray
) -> ContactOnset:
    """Zero of the gap by inverse quadratic interpolation; torque there by Hermite."""
    (g0, g1, g2), (t0, t1, t2) = gaps[-3:], [s.t for s in states[-3:]]
    zero = (
        t0 * g1 * g2 / ((g0 - g1) * (g0 - g2))
        + t1 * g0 * g2 / ((g1 - g0) * (g1 - g2))
        + t2 * g0 * g1 / ((g2 - g0) * (g2 - g1))
    )
    if not min(t1, t2) <= zero <= max(t1, t2):
        zero = t1 + (t2 - t1) * g1 / (g1 - g2)
    pair = sorted(states[-2:], key=lambda s: s.t)
    t, force, slope = (
        np.array([getattr(s, name) for s in pair])
        for name in ("t", "drive_force", "drive_stiffness")
    )
    torque = problem.copies * float(hermite(zero, t, force, slope))
    return ContactOnset(
        deflection_rad=float(zero), torque_Nm=torque, at_m=(float(at[0]), float(at[1]))
    )


def _assemble(problem: TorsionProblem, walks: dict[str, _Walk], wall_s: float) -> StiffnessResult:
    wind, unwind = walks["winding"], walks["unwinding"]
    states = [*unwind.states[::-1], wind.rest, *wind.states]
    gaps = [*unwind.clearance_m[::-1], wind.rest_clearance_m, *wind.clearance_m]
    stresses = [recover_stress(problem.static_problem(), s.displacement_m) for s in states]
    copies, mesh = problem.copies, problem.mesh
    snapshots = {
        direction: _snapshot(problem, walk.states[-1], stresses[0 if sign < 0 else -1])
        for (direction, sign), walk in zip(SIGN.items(), (wind, unwind))
    }
    symmetry = f"1 of {problem.design.n_arms} sectors" + (
        ", half the width" if problem.dimension == 3 else ""
    )
    return StiffnessResult(
        model=problem.model,
        stiffness_Nm_per_rad=copies * wind.rest.drive_stiffness,
        deflection_rad=np.array([s.t for s in states]),
        torque_Nm=copies * np.array([s.drive_force for s in states]),
        tangent_Nm_per_rad=copies * np.array([s.drive_stiffness for s in states]),
        peak_von_mises_Pa=np.array([float(np.max(s.von_mises_Pa)) for s in stresses]),
        min_clearance_m=np.array(gaps),
        strain_energy_J=copies * np.array([s.energy_J for s in states]),
        contact_onset={direction: walk.onset for direction, walk in walks.items()},
        ended_by={
            direction: f"first contact of the coils at {walk.onset.deflection_rad:+.4f} rad"
            for direction, walk in walks.items()
        },
        mesh=MeshSummary(
            dimension=problem.dimension,
            nodes=len(mesh.nodes),
            elements=len(mesh.cells),
            unknowns=int(mesh.nodes.size),
            min_corner_sine=mesh_quality(problem.sector).min_scaled_jacobian,
            symmetry=symmetry,
            solver=wind.solver,
        ),
        snapshots=snapshots,
        wall_s=wall_s,
    )


def _snapshot(problem: TorsionProblem, state: PathState, stress) -> FieldSnapshot:
    """The mid-plane of all sectors: the solved one and its turned copies."""
    sector, n = problem.sector, problem.design.n_arms
    count = len(sector.nodes)
    displacement = state.displacement_m[:count, :2]
    von_mises = stress.von_mises_Pa[:count]
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
