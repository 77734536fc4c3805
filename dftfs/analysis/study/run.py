"""The study of one design: closed forms, CAD, finite elements, actuator, one after the other."""

import hashlib
import multiprocessing
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from platform import python_version

from dftfs import __version__
from dftfs.analysis.jobs.worker_pool import METHOD, follow_parent
from dftfs.analysis.strength.checks import Check, contact_checks, stiffness_check, yield_check
from dftfs.analysis.strength.friction_loop import FrictionLoop, friction_loop
from dftfs.analysis.strength.mesh_series import stress_errors
from dftfs.analysis.strength.yield_and_set import STRUCTURAL
from dftfs.analysis.structure.lateral import softest_lateral_stiffness
from dftfs.analysis.structure.result import StructureResult, structural_result
from dftfs.analysis.study.actuator import Scenario, run_with_spring
from dftfs.analysis.study.closed_form_design import closed_form_design
from dftfs.analysis.study.result import Provenance, StudyResult
from dftfs.analysis.torsion.mesh_error import stiffness_error
from dftfs.analysis.torsion.problem import TorsionProblem, meshed_problem
from dftfs.analysis.torsion.result import SIGN, StiffnessResult
from dftfs.analysis.torsion.solve import LARGEST_BEYOND, solve_torsion
from dftfs.cad.export import export_design
from dftfs.cad.mesh import tessellate
from dftfs.design import MeshChoice, SpringDesign
from dftfs.errors import SolveError
from dftfs.files import to_json

_PACKAGES = ("numpy", "scipy", "numba", "scikit-fem", "gmsh", "cadquery", "pypardiso")
_RENDER_TOLERANCE_MM = 0.05
_STATES_BEYOND = 3
_REACHES = 1.02  # of the deflection at which a torque past the contact is reached at the latest
_FREE = 0.9  # of the first contact's torque: where the mesh series of the stress is compared
_BEYOND = 1.3  # of the first contact's deflection: as far as the knees are shown


@dataclass(frozen=True, kw_only=True)
class StudyOptions:
    """What a study does beyond the design itself.

    Parameters
    ----------
    contact_friction : float or None
        Coulomb's coefficient between the coils; adds a friction loop.
    loop_end : function of the plane-stress result
        Where that loop turns back (signed rad).
    load_inertia_kg_m2, hub_inertia_kg_m2 : float or None
        What turns with rim and bore, for natural frequencies with it.
    mesh : MeshChoice or None
        Instead of the design's own.
    author : str
        Whom the STEP file names.
    """

    contact_friction: float | None = None
    loop_end: Callable[[StiffnessResult], float] = lambda free: 0.0
    load_inertia_kg_m2: float | None = None
    hub_inertia_kg_m2: float | None = None
    mesh: MeshChoice | None = None
    author: str = ""


def run_study(
    design: SpringDesign,
    scenario: Scenario,
    out_dir: Path,
    *,
    command: str,
    overwrite: bool = False,
    options: StudyOptions = StudyOptions(),
    on_progress: Callable[[str], None] = lambda message: None,
) -> StudyResult:
    """Closed forms and rod, CAD files into ``out_dir``, finite elements, mesh error, actuator.

    ``command``, how the study was asked for, is kept in the provenance.

    Raises
    ------
    DftfsError
        From the stage that failed, in one line.
    """
    stage = _Stages(on_progress)
    with stage("closed forms and rod model"):
        simple = closed_form_design(design)
    with stage("CAD: STEP, STL, DXF, read back and checked"):
        export = export_design(design, out_dir, author=options.author, overwrite=overwrite)
        vertices, triangles = tessellate(design.outline, design.width_m, _RENDER_TOLERANCE_MM)
    planar_problem = meshed_problem(design, options.mesh, dimension=2)
    solid_problem = meshed_problem(design, options.mesh, dimension=3)
    planar, solid, structure = _finite_elements(planar_problem, solid_problem, options, stage)
    with stage("mesh series"):
        error = stiffness_error(solid_problem, on_progress=on_progress)
        stress_errors = errors_of_stress(planar_problem, planar, on_progress)
    with stage("lateral stiffness"):
        lateral = softest_lateral_stiffness(planar_problem)
    loop = None
    if options.contact_friction is not None:
        with stage("friction loop, plane stress"):
            loop = _loop(planar_problem, planar, options, on_progress)
    with stage("actuator with this spring"):
        actuator = run_with_spring(scenario, solid, f"{design.name}, {solid.model}")
    return StudyResult(
        design=design,
        checks=study_checks(design, solid, stress_errors),
        closed_forms=simple.closed_forms,
        eq_2_1_Nm_per_rad=simple.eq_2_1_Nm_per_rad,
        rod=simple.rod,
        rod_onset=simple.contact_onset,
        planar=planar,
        solid=solid,
        mesh_error=error,
        stiffness_uncertainty_Nm_per_rad=error.relative_error * solid.stiffness_Nm_per_rad,
        lateral_stiffness_N_per_m=lateral,
        sector=planar_problem.sector,
        export=export,
        solid_vertices_m=vertices,
        solid_triangles=triangles,
        actuator=actuator,
        provenance=_provenance(design, solid, command, stage.wall_s),
        friction_loop=loop,
        structure=structure,
    )


def _loop(
    problem: TorsionProblem, free: StiffnessResult, options: StudyOptions, say: Callable
) -> FrictionLoop:
    end = options.loop_end(free)
    return friction_loop(problem, free, options.contact_friction, end, on_progress=say)


class _Stages:
    """Announces each stage of a study and keeps its wall time."""

    def __init__(self, on_progress: Callable[[str], None]) -> None:
        self.on_progress = on_progress
        self.wall_s: dict[str, float] = {}

    @contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        self.on_progress(name)
        begun = time.perf_counter()
        yield
        self.wall_s[name] = time.perf_counter() - begun


def _finite_elements(
    planar_problem: TorsionProblem,
    solid_problem: TorsionProblem,
    options: StudyOptions,
    stage: _Stages,
) -> tuple[StiffnessResult, StiffnessResult, StructureResult]:
    """The curve in plane stress and in 3D, and beside the latter the structure's figures."""
    past = {"beyond": _BEYOND, "states_beyond": _STATES_BEYOND, "on_progress": stage.on_progress}
    with stage("plane-stress finite elements, both directions, past first contact"):
        planar = solve_torsion(planar_problem, **past)
    task = partial(
        structural_result,
        planar_problem.design,
        planar,
        load_inertia_kg_m2=options.load_inertia_kg_m2,
        hub_inertia_kg_m2=options.hub_inertia_kg_m2,
    )
    with (
        _in_another_process(task) as structural,
        stage("3D finite elements, both directions, past first contact"),
    ):
        last = {name: abs(snap.deflection_rad) for name, snap in planar.snapshots.items()}
        asked = planar_problem.design.requirements.operating_torque_Nm
        past["beyond"] = beyond_for(planar, asked, _BEYOND)
        solid = solve_torsion(solid_problem, expected_onset_rad=last, **past)
    with stage("six directions, vibration, stability: time left to wait"):
        structure = structural()
    return planar, solid, structure


@contextmanager
def _in_another_process(task: Callable[[], StructureResult]) -> Iterator[Callable]:
    """Start a task on another core; what is yielded waits for it and returns its result.

    Raises
    ------
    SolveError
        If the process dies.
    """
    context = multiprocessing.get_context(METHOD)
    with ProcessPoolExecutor(1, mp_context=context, initializer=follow_parent) as pool:
        future = pool.submit(task)

        def result() -> StructureResult:
            try:
                return future.result()
            except BrokenProcessPool:
                raise SolveError("structure: its process died; out of memory?") from None

        yield result


def beyond_for(free: StiffnessResult, torque_Nm: float | None, least: float) -> float:
    """How far a curve must go, over its first contact, to reach a torque past the contact.

    ``free`` knows the first contacts. Coils in contact are stiffer, so that the torque is reached
    before the proportional deflection; at least ``least``, at most what a curve may have.
    """
    touches = [abs(touch.torque_Nm) for touch in free.contact_onset.values() if touch]
    needed = [_REACHES * (torque_Nm or 0.0) / touch for touch in touches]
    return min(LARGEST_BEYOND, max([least, *needed]))


def errors_of_stress(
    planar: TorsionProblem, free: StiffnessResult, say: Callable[[str], None]
) -> dict[str, float]:
    """Error of the stress by region for the check against yield; none where nothing is judged."""
    design = planar.design
    torque = design.requirements.operating_torque_Nm
    if torque is None or design.material.yield_strength_Pa is None:
        return {}
    touches = [abs(touch.torque_Nm) for touch in free.contact_onset.values() if touch]
    return stress_errors(
        planar, min([torque, *(_FREE * each for each in touches)]), on_progress=say
    )


def study_checks(
    design: SpringDesign, solid: StiffnessResult, stress_errors: Mapping[str, float] | None = None
) -> tuple[Check, ...]:
    """The design's requirements judged on the 3D result, stress with the error of its region."""
    asked, material = design.requirements, design.material
    onsets = {
        name: None if onset is None else abs(onset.torque_Nm)
        for name, onset in solid.contact_onset.items()
    }
    reached = {name: abs(snapshot.torque_Nm) for name, snapshot in solid.snapshots.items()}
    torque = asked.operating_torque_Nm or 1.0
    stress = {
        name: solid.stress_at_torque_Pa(sign * torque) / torque for name, sign in SIGN.items()
    }
    worst = max(STRUCTURAL, key=lambda region: _largest_Pa(solid, torque, region))
    return (
        *stiffness_check(asked, solid.stiffness_Nm_per_rad, solid.model),
        *contact_checks(asked, onsets, reached, solid.model),
        *yield_check(
            asked,
            stress_per_torque=stress,
            model=solid.model,
            bar=(stress_errors or {}).get(worst, 0.0),
            reached_Nm=solid.reached_Nm(),
            material=material,
        ),
    )


def _largest_Pa(solid: StiffnessResult, torque_Nm: float, region: str) -> float:
    if region not in solid.regional_peak_Pa:
        return 0.0
    return max(solid.stress_at_torque_Pa(sign * torque_Nm, region) for sign in SIGN.values())


def design_hash(design: SpringDesign) -> str:
    """Twelve hexadecimal digits of the content of a design: same numbers, same hash."""
    content = {"spiral": design.spiral, "width_m": design.width_m, "material": design.material}
    return hashlib.sha256(to_json(content).encode()).hexdigest()[:12]


def _provenance(
    design: SpringDesign, solid: StiffnessResult, command: str, wall: dict[str, float]
) -> Provenance:
    versions = {"dftfs": __version__, "python": python_version()}
    for package in _PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            versions[package] = "not installed"
    return Provenance(
        design_hash=design_hash(design),
        versions=versions,
        made_utc=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        command=command,
        solver=solid.mesh.solver,
        wall_s=wall,
    )
