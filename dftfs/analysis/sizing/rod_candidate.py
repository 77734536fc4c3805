"""One candidate of a sizing judged by the rod model, in some 20 ms, against every limit.

The width is not searched. Torque is proportional to it, so the planar shape gives the stiffness
per width, and the width follows from the asked stiffness. Worth knowing when reading the fronts:
a shape scaled as a whole, its width adjusted to keep the stiffness, keeps its mass, its stress at
a torque and its travel as well. The envelope and the bounds choose the size; the shape alone
(thickness and radii over the outer radius, turns) decides mass and strength.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dftfs.analysis.sizing.limits import (
    STAGES,
    STIFFNESS,
    Limit,
    at_least,
    at_most,
    other_limits,
    range_limit,
    staged_violation,
    strength_limits,
)
from dftfs.analysis.sizing.task import SizingTask
from dftfs.analysis.torsion.result import UNWINDING, WINDING
from dftfs.design import SpringDesign
from dftfs.errors import DesignError, SolveError
from dftfs.spring.clearance import sample_coil_gap
from dftfs.spring.notch import root_stress
from dftfs.spring.outline import SpringOutline, build_outline, coil_gap
from dftfs.spring.parameters import SpiralParameters
from dftfs.spring.planar_rod import RodState, twist_rod, twist_stiffness
from dftfs.spring.rod import ArmRod, arm_rod, slit_neck_m
from dftfs.spring.rod_contact import first_contact, state_clearance
from dftfs.spring.section import curved_strip_stress

_UNIT_WIDTH_m = 1e-2
_SPACING = 1 / 36  # of the outer radius: chords a hundredth of a millimetre off, fast enough
_CONTACT_RESERVE = 1.02  # on the asked torque, for the error of the rod and the coarse edges
_NECK_OF_FIT = 0.2  # of the thickness: the root lengths were not fitted below
INFEASIBLE = 1e10  # merit of what breaks a limit begins here
_FURTHEST = 2.0  # times the asked torque: contact is not looked for beyond
_EQUAL_UP_TO = 3.0  # times the asked torque: contact beyond it counts as there
_REACH = (1.0, 0.5, 0.25, 0.125)  # shares of the asked torque that are tried in turn


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A candidate and how it stands. The numbers after ``limits`` are None where none was found.

    index : number of each searched dimension's value in its grid. violation : 0 inside all limits,
    else `staged_violation`. gap_left_m : smallest gap at the asked torque, 2 % beyond.
    stresses_Pa : of the arm and of its root, winding then unwinding; stress_Pa is their largest.
    """

    index: tuple[int, ...]
    values_mm: tuple[tuple[str, float], ...]
    violation: float
    limits: tuple[Limit, ...]
    width_mm: float | None = None
    stiffness_Nm_per_rad: float | None = None
    mass_kg: float | None = None
    stress_Pa: float | None = None
    stresses_Pa: tuple[float, ...] = ()
    gap_left_m: float | None = None
    why: str = ""
    material: str = ""

    @property
    def feasible(self) -> bool:
        """Whether every limit is kept."""
        return self.violation == 0

    def objective(self, name: str) -> float:
        """What is minimised: mass, stress, or less gap left at the asked torque (travel)."""
        value = {"mass": self.mass_kg, "stress": self.stress_Pa, "travel": self.gap_left_m}[name]
        if value is None:
            return float("inf")
        return -value if name == "travel" else value

    def merit(self, name: str) -> float:
        """The objective where feasible, else something larger than any that is (Deb 2000)."""
        return self.objective(name) if self.feasible else INFEASIBLE * (1 + self.violation)


def assess(task: SizingTask, index: Sequence[int]) -> Candidate:
    """Judge the candidate at these numbers of the searched grids."""
    index = tuple(int(k) for k in index)
    values = {grid.name: grid.value(k) for grid, k in zip(task.searched, index)}
    return assess_values(task, values, index=index, whole=task.load_all)


def promising(task: SizingTask, index: Sequence[int]) -> bool:
    """Whether a candidate has its radii in order and its coils apart: a millisecond's look."""
    values = {grid.name: grid.value(int(k)) for grid, k in zip(task.searched, index)}
    try:
        return _coil_gap(task.spiral(values)) > task.process.gap_m
    except DesignError:
        return False


def assess_values(
    task: SizingTask,
    values_mm: dict[str, float],
    *,
    index: tuple[int, ...] = (),
    width_mm: float | None = None,
    whole: bool = True,
) -> Candidate:
    """Judge dimensions that need not lie on the grids; the width is chosen unless given.

    Candidates that cannot be built come back with the largest violation and the reason in ``why``.
    Without ``whole`` a candidate whose shape breaks a limit is not loaded: that is most of the
    time, and its violation ranks it behind all that were.
    """
    material = task.material_of(values_mm)
    known = {
        "index": index,
        "values_mm": tuple((k, v) for k, v in values_mm.items() if k != "material_number"),
        "material": material.name,
    }
    try:
        spiral = task.spiral(values_mm)
        gap = _coil_gap(spiral)
        if gap <= task.process.gap_m / 2:
            missing = (task.process.gap_m - gap) / spiral.thickness_m
            violation = len(STAGES) - 1 + missing / (1 + missing)
            return Candidate(**known, violation=violation, limits=(), why="coils too close")
        outline = build_outline(spiral, advise=False)
        arm = arm_rod(
            outline,
            _UNIT_WIDTH_m,
            material.youngs_modulus_Pa,
            material.poisson_ratio,
        )
        per_width = spiral.n_arms * twist_stiffness(arm.rod) / _UNIT_WIDTH_m
        width = _width(task, per_width) if width_mm is None else width_mm * 1e-3
        return _judged(task, outline, arm, per_width * width, width, gap, known, whole)
    except (DesignError, SolveError) as error:
        why = " ".join(str(error).split())
        return Candidate(**known, violation=float(len(STAGES)), limits=(), why=why)


def _coil_gap(spiral: SpiralParameters) -> float:
    line = spiral.centreline
    theta = np.arange(line.start + spiral.pitch_rad, line.end, 0.1)
    theta = np.append(theta, line.end)
    return float(np.min(coil_gap(spiral, theta))) if line.end > theta[0] else np.inf


def _width(task: SizingTask, per_width: float) -> float:
    grid = task.by_name["width_mm"]
    return grid.value(grid.nearest(1e3 * task.stiffness_Nm_per_rad / per_width)) * 1e-3


def _judged(
    task: SizingTask,
    outline: SpringOutline,
    arm: ArmRod,
    stiffness: float,
    width: float,
    coil: float,
    known: dict,
    whole: bool,
) -> Candidate:
    material = next(m for m in (*task.materials, task.material) if m.name == known["material"])
    mass = outline.area_m2 * width * material.density_kg_per_m3
    known |= {
        "width_mm": round(width * 1e3, 9),
        "stiffness_Nm_per_rad": stiffness,
        "mass_kg": float(mass),
    }
    shape = (
        *_shape_limits(task, outline, width, stiffness, coil),
        *other_limits(task, arm, width, float(mass), material.density_kg_per_m3),
    )
    violation = staged_violation(shape)
    if violation > 1 and not whole:  # the last stage, which comes after the load, is below 1
        return Candidate(**known, violation=violation, limits=shape, why=_worst(shape))
    torque, gaps, stresses = _loaded(task, outline, arm, stiffness, width / _UNIT_WIDTH_m)
    limits = (
        *shape,
        *(
            at_least(
                f"torque before contact, {direction}",
                task.contact_free_torque_Nm,
                share * task.contact_free_torque_Nm,
                "Nm",
                stage="contact",
            )
            for direction, share in torque.items()
        ),
        *strength_limits(
            task, outline.parameters, material, max(stresses[::2]), max(stresses[1::2])
        ),
    )
    if task.equal_range is not None and staged_violation(limits) < 1:  # only the rest is open
        limits += (_range(task, arm, stiffness, width / _UNIT_WIDTH_m),)
    violation = staged_violation(limits)
    return Candidate(
        **known,
        violation=violation,
        limits=limits,
        stress_Pa=max(stresses),
        stresses_Pa=stresses,
        gap_left_m=min(gaps.values()),
        why="" if violation == 0 else _worst(limits),
    )


def _worst(limits: Sequence[Limit]) -> str:
    """Name of the limit that is broken most, of the first broken stage."""
    broken = [limit for limit in limits if limit.margin < 0]
    return min(broken, key=lambda limit: (STAGES.index(limit.stage), limit.margin)).name


def _shape_limits(
    task: SizingTask, outline: SpringOutline, width: float, stiffness: float, coil: float
) -> tuple[Limit, ...]:
    p, made = outline.parameters, task.process
    neck = max(made.smallest_wall_m(width), _NECK_OF_FIT * p.thickness_m)
    gap = made.smallest_gap_m(width)
    thinnest = min(
        p.thickness_m,
        p.thickness_at_rim_m,
        p.rim_outer_radius_m - p.rim_inner_radius_m,
        p.hub_radius_m - p.bore_radius_m,
    )
    off = abs(stiffness / task.stiffness_Nm_per_rad - 1)
    allowed = task.stiffness_tolerance
    bore = (
        ()
        if task.min_bore_m is None
        else (at_least("bore", 1e3 * task.min_bore_m, 2e3 * p.bore_radius_m, "mm"),)
    )
    return (
        Limit(
            name=STIFFNESS,
            asked=100 * allowed,
            found=100 * off,
            unit="%",
            margin=allowed - off,
        ),
        at_most("envelope", 1e3 * task.envelope_m, 2e3 * p.rim_outer_radius_m, "mm"),
        at_least("smallest gap between coils", 1e3 * gap, 1e3 * coil, "mm"),
        at_least("slit's width at its end", 1e3 * gap, 2e3 * p.fillet_radius_m, "mm"),
        at_least("thinnest wall", 1e3 * made.smallest_wall_m(width), 1e3 * thinnest, "mm"),
        at_least("neck between slit and tip", 1e3 * neck, 1e3 * slit_neck_m(outline), "mm"),
        at_least(
            "inside radius",
            1e3 * made.smallest_inside_radius_m(width),
            1e3 * p.fillet_radius_m,
            "mm",
        ),
        *bore,
    )


def _loaded(
    task: SizingTask, outline: SpringOutline, arm: ArmRod, stiffness: float, share: float
) -> tuple[dict[str, float], dict[str, float], tuple[float, ...]]:
    """Torque at first contact over the asked one, gap (m) per direction, stresses (Pa).

    The angle of the asked torque is its share of the stiffness, corrected once by the torque found.
    The torque at contact is found between three gaps, at rest, half and the whole of the torque:
    exact where the coils touch at the asked torque, an estimate elsewhere.
    """
    asked = _CONTACT_RESERVE * task.contact_free_torque_Nm
    samples = sample_coil_gap(outline, _SPACING * outline.parameters.outer_radius_m)
    rest = state_clearance(arm, samples, twist_rod(arm.rod, 0.0)).smallest_m
    torques, gaps, stresses = {}, {}, ()
    arms = outline.parameters.n_arms
    for direction, sign in ((WINDING, 1.0), (UNWINDING, -1.0)):
        state, reach = _twisted(arm, sign * asked / stiffness, asked / (arms * share))
        half = twist_rod(arm.rod, state.rotation_rad[-1] / 2)
        half_gap, gap = (state_clearance(arm, samples, s).smallest_m for s in (half, state))
        torques[direction] = reach * _contact_share(rest, half_gap, gap)
        gaps[direction] = min(gap, half_gap)  # edges that have passed through each other: no gap
        # the stress does not know the width: at the same angle torque and section both carry it
        torque = abs(arms * share * state.end_torque_Nm)
        share_of_torque = task.operating_torque_Nm / torque
        stresses += tuple(share_of_torque * peak for peak in _peaks(arm, state))
    return torques, gaps, stresses


def _range(task: SizingTask, arm: ArmRod, stiffness: float, share: float) -> Limit:
    """Both contact-free torques, looked for up to some times the asked one."""
    angle = _EQUAL_UP_TO * task.contact_free_torque_Nm / stiffness
    p = arm.outline.parameters
    samples = sample_coil_gap(arm.outline, _SPACING * p.outer_radius_m)
    rest, found = twist_rod(arm.rod, 0.0), []
    for sign in (1.0, -1.0):
        touch = first_contact(arm, samples, rest, sign * angle)
        own = twist_rod(arm.rod, sign * angle).end_torque_Nm * p.n_arms
        found.append(share * abs(own if touch is None else touch.torque_Nm))
    return range_limit(task, found)


def _twisted(arm: ArmRod, angle: float, torque_Nm: float) -> tuple[RodState, float]:
    """State at the torque of one arm, or at the largest share of it that the rod can carry.

    Raises
    ------
    SolveError
        If the rod has no equilibrium at an eighth of the torque.
    """
    for reach in _REACH:
        try:
            guess = twist_rod(arm.rod, reach * angle)
            factor = reach * torque_Nm / abs(guess.end_torque_Nm)
            return twist_rod(arm.rod, reach * angle * factor, guess), reach
        except SolveError:
            if reach == _REACH[-1]:
                raise
    raise SolveError("the rod cannot be turned")


def _contact_share(rest: float, half: float, whole: float) -> float:
    """Where the gap is gone, over the angle of the last, by straight lines between three gaps."""
    if rest <= 0:
        return 0.0
    if half <= 0:
        return 0.5 * rest / (rest - half)
    if whole <= 0 or whole < half:
        return min(0.5 + 0.5 * half / (half - whole), _FURTHEST)
    return _FURTHEST


def _peaks(arm: ArmRod, state: RodState) -> tuple[float, float]:
    """Largest stress along an arm, and in its roots (as `dftfs.spring.notch.peak_stress`)."""
    p = arm.outline.parameters
    moment = state.bending_moment_Nm[2:-2]
    radius = 1 / p.centreline.curvature(arm.section_theta)
    faces = curved_strip_stress(-moment, p.thickness_at(arm.section_theta), arm.width_m, radius)
    notch = float(root_stress(p, arm.width_m, moment[[0, -1]]))
    return float(max(np.max(np.abs(faces[0])), np.max(np.abs(faces[1])))), notch


def as_design(task: SizingTask, candidate: Candidate, name: str) -> SpringDesign:
    """The candidate as a design of the task."""
    many = {material.name: material for material in (*task.materials, task.material)}
    return task.design(
        task.spiral(dict(candidate.values_mm)),
        (candidate.width_mm or 0.0) * 1e-3,
        name,
        many.get(candidate.material, task.material),
    )
