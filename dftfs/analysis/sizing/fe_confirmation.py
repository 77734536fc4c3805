"""Finite elements of a sizing's winners: the first that keeps its limits there is the answer.

The curve is plane stress, the stiffness that is judged is that of 3D elements: the width of a strip
that is wide over its thickness stiffens it, which neither plane stress nor the search's rod knows.
The ratio of both stiffnesses is also applied to the torques of first contact, whose angles are the
plane model's. Stress over torque is left as plane stress has it.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dftfs.analysis.jobs.store import ContentStore
from dftfs.analysis.sizing.limits import (
    allowed_amplitudes_Pa,
    at_least,
    at_most,
    range_limit,
)
from dftfs.analysis.sizing.rod_candidate import Candidate, as_design
from dftfs.analysis.sizing.task import SizingTask
from dftfs.analysis.strength.checks import Check, contact_checks, stiffness_check, yield_check
from dftfs.analysis.structure.stability_checks import (
    NEARLY,
    may_tip,
    stability_at,
    stability_checks,
)
from dftfs.analysis.sweep.run import stress_at
from dftfs.analysis.torsion.batch_solve import SharedProblem, solve_shared
from dftfs.analysis.torsion.result import SIGN
from dftfs.design import SpringDesign

_STATES = 5


@dataclass(frozen=True, kw_only=True)
class Confirmed:
    """A candidate with what finite elements find.

    ``design`` has the width that its stiffness asks for, which may be steps of the grid beside
    the rod's choice. ``stiffness_3d_Nm_per_rad`` is None where plane stress alone refused it; else
    the checks judge it, and ``contact_Nm`` are plane stress's times the ratio of both stiffnesses.
    """

    candidate: Candidate
    design: SpringDesign
    stiffness_2d_Nm_per_rad: float
    contact_Nm: Mapping[str, float | None]
    stress_Pa: float
    checks: tuple[Check, ...]
    stiffness_3d_Nm_per_rad: float | None = None

    @property
    def accepted(self) -> bool:
        """Whether no limit is broken, the stiffness by 3D elements."""
        return self.stiffness_3d_Nm_per_rad is not None and self.kept

    @property
    def kept(self) -> bool:
        """Whether no limit is broken so far."""
        return not any(check.passed is False for check in self.checks)


def confirm(
    task: SizingTask,
    winners: Sequence[Candidate],
    *,
    most: int,
    store: ContentStore | None = None,
    on_progress: Callable[[str], None] = lambda message: None,
) -> tuple[Confirmed, ...]:
    """Judge winners in their order until one is accepted: 2D elements, then the 3D stiffness.

    Where 3D elements break a limit, the width is scaled once to the asked stiffness.

    Raises
    ------
    SolveError
        If a winner's mesh or solve fails.
    """
    tried: list[Confirmed] = []
    for rank, candidate in enumerate(winners[:most]):
        design = as_design(task, candidate, f"{task.name}-{rank + 1}")
        found = judge_2d(task, design, candidate, store)
        on_progress(f"2D elements of winner {rank + 1}: {_text(found)}")
        if found.kept:
            found = _judge_3d(task, found.design, candidate, store, on_progress)
            other = _rescaled(task, found)
            if not found.kept and other.width_m != found.design.width_m:
                found = _judge_3d(task, other, candidate, store, on_progress)
        if found.kept:
            found = replace(found, checks=(*found.checks, *_stays_in_plane(task, found)))
        tried.append(found)
        if found.accepted:
            break
    return tuple(tried)


def _stays_in_plane(task: SizingTask, found: Confirmed) -> tuple[Check, ...]:
    """Out-of-plane stability at the operating torque, its angle by the stiffness at rest."""
    stiffness = found.stiffness_3d_Nm_per_rad
    if stiffness is None or not may_tip(found.design):
        return ()
    ends = {}
    for name, sign in SIGN.items():
        free = found.contact_Nm[name]
        torque = min(task.operating_torque_Nm, np.inf if free is None else NEARLY * free)
        ends[name] = sign * torque / stiffness
    return stability_checks(stability_at(found.design, ends), task.operating_torque_Nm)


def _rescaled(task: SizingTask, found: Confirmed) -> SpringDesign:
    """The design with the width of the grid that the 3D stiffness asks for, in proportion."""
    solid = found.stiffness_3d_Nm_per_rad or found.stiffness_2d_Nm_per_rad
    grid = task.by_name["width_mm"]
    width_mm = 1e3 * found.design.width_m * task.stiffness_Nm_per_rad / solid
    return replace(found.design, width_m=grid.value(grid.nearest(width_mm)) * 1e-3)


def _judge_3d(
    task: SizingTask,
    design: SpringDesign,
    candidate: Candidate,
    store: ContentStore | None,
    on_progress: Callable[[str], None],
) -> Confirmed:
    """The plane-stress curve of a width with that width's 3D stiffness, and the task's checks."""
    solid = stiffness_3d(design)
    found = judge_2d(task, design, candidate, store, stiffness_3d_Nm_per_rad=solid)
    on_progress(
        f"3D elements, width {1e3 * design.width_m:g} mm: K = {solid:.3f} Nm/rad, {_text(found)}"
    )
    return found


def judge_2d(
    task: SizingTask,
    design: SpringDesign,
    candidate: Candidate,
    store: ContentStore | None,
    *,
    stiffness_3d_Nm_per_rad: float | None = None,
) -> Confirmed:
    """Curve of a design by plane-stress elements and the task's checks.

    The width is set anew by the plane-stress stiffness. With the 3D stiffness of the design's own
    width that is kept and judged, and torques and stresses at an angle are scaled to it.

    Raises
    ------
    SolveError
        If the mesh or the solve fails.
    """
    problem, curve = _plane_curve(design, store)
    if stiffness_3d_Nm_per_rad is None:
        design = _of_asked_width(task, design, problem, curve["stiffness_Nm_per_rad"])
    by_torque, by_stress = problem.factors(design)
    stiffness = by_torque * curve["stiffness_Nm_per_rad"]
    judged, over_plane, model = stiffness, 1.0, curve["model"]
    if stiffness_3d_Nm_per_rad is not None:
        judged, model = stiffness_3d_Nm_per_rad, "3D hex20"
        over_plane = judged / stiffness
    by_torque, by_stress = over_plane * by_torque, over_plane * by_stress
    torque = by_torque * np.array(curve["torque_Nm"])
    stress = by_stress * np.array(curve["peak_stress_Pa"])
    contact = {
        direction: None if touch is None else abs(by_torque * touch["torque_Nm"])
        for direction, touch in curve["contact_onset"].items()
    }
    asked = task.operating_torque_Nm
    worst = {direction: stress_at(asked, sign * torque, stress) for direction, sign in SIGN.items()}
    reached = {direction: float(np.max(sign * torque)) for direction, sign in SIGN.items()}
    needs = task.requirements
    return Confirmed(
        candidate=candidate,
        design=design,
        stiffness_2d_Nm_per_rad=stiffness,
        contact_Nm=contact,
        stress_Pa=max(worst.values()),
        stiffness_3d_Nm_per_rad=stiffness_3d_Nm_per_rad,
        checks=(
            *stiffness_check(needs, judged, model),
            *contact_checks(needs, contact, reached, curve["model"]),
            *yield_check(
                needs,
                stress_per_torque={direction: value / asked for direction, value in worst.items()},
                material=design.material,
                model=curve["model"],
            ),
            *_life_check(task, design, max(worst.values())),
            *_other_checks(task, design, contact),
        ),
    )


def _plane_curve(design: SpringDesign, store: ContentStore | None) -> tuple[SharedProblem, dict]:
    """The plane-stress curve per unit of modulus and width, and what its factors come from.

    Raises
    ------
    SolveError
        If the mesh or the solve fails.
    """
    from dftfs.errors import SolveError

    problem = SharedProblem.of(design, "2d", _STATES)
    solved = store.get(problem.key) if store is not None else None
    if solved is None:
        solved = solve_shared(problem.content())
        if store is not None:
            store.put(problem.key, solved)
    if "failure" in solved:
        raise SolveError(f"{design.name}: {solved['failure']}")
    return problem, solved["curve"]


def _of_asked_width(
    task: SizingTask, design: SpringDesign, problem: SharedProblem, shared_Nm_per_rad: float
) -> SpringDesign:
    """The design with the grid's width at which plane stress has the asked stiffness."""
    grid = task.by_name["width_mm"]
    per_width = problem.factors(design)[0] * shared_Nm_per_rad / design.width_m
    width_mm = grid.value(grid.nearest(1e3 * task.stiffness_Nm_per_rad / per_width))
    return replace(design, width_m=width_mm * 1e-3)


def _other_checks(
    task: SizingTask, design: SpringDesign, contact_Nm: Mapping[str, float | None]
) -> list[Check]:
    """Lateral stiffness by plane stress, both ranges, inertia: what the task asks of them."""
    limits = []
    if task.min_lateral_N_per_m is not None:
        from dftfs.analysis.structure.lateral import softest_lateral_stiffness
        from dftfs.analysis.torsion.problem import TorsionProblem

        found = softest_lateral_stiffness(TorsionProblem(design=design, dimension=2))
        asked = task.min_lateral_N_per_m
        limits.append(at_least("lateral stiffness", 1e-3 * asked, 1e-3 * found, "N/mm"))
    if task.max_inertia_kg_m2 is not None:
        found = design.outline.polar_moment_m4 * design.width_m * design.material.density_kg_per_m3
        limits.append(at_most("inertia", 1e6 * task.max_inertia_kg_m2, 1e6 * found, "kg mm2"))
    torques = [torque for torque in contact_Nm.values() if torque is not None]
    if task.equal_range is not None and len(torques) == len(contact_Nm):
        limits.append(range_limit(task, torques))
    return [
        Check(
            name=limit.name,
            value=limit.found,
            unit=limit.unit,
            limit=f"{'at least' if limit.unit == 'N/mm' else 'at most'} {limit.asked:.4g}",
            passed=limit.margin >= 0,
        )
        for limit in limits
    ]


def _life_check(task: SizingTask, design: SpringDesign, stress_Pa: float) -> list[Check]:
    """The spring's largest amplitude against the smaller of arm's and root's; nothing if unasked.

    The curve does not say where its largest stress lies: the smaller one is on the safe side.
    """
    if task.life_cycles is None:
        return []
    allowed = min(allowed_amplitudes_Pa(task, design.spiral, design.material))
    return [
        Check(
            name=f"amplitude at {task.operating_torque_Nm:g} Nm in either direction",
            value=stress_Pa / 1e6,
            unit="MPa",
            limit=f"at most {allowed / 1e6:.4g} MPa for {task.life_cycles:.3g} cycles at"
            f" {100 * task.survival:g} % survival",
            passed=bool(stress_Pa <= allowed),
        )
    ]


def stiffness_3d(design: SpringDesign) -> float:
    """Tangent stiffness at rest by hex20 elements, in Nm/rad."""
    from dftfs.analysis.torsion.problem import TorsionProblem
    from dftfs.fem.newton import linear_tangent

    problem = TorsionProblem(design=design, dimension=3)
    return problem.copies * linear_tangent(problem.static_problem())


def _text(found: Confirmed) -> str:
    broken = [check.name for check in found.checks if check.passed is False]
    return f"fails {', '.join(broken)}" if broken else "within every limit"
