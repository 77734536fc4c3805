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

from dftfs.analysis.sizing.task import SEARCHED, SizingTask
from dftfs.analysis.torsion.result import UNWINDING, WINDING
from dftfs.design import SpringDesign
from dftfs.errors import DesignError, SolveError
from dftfs.spring.clearance import sample_coil_gap
from dftfs.spring.notch import root_stress
from dftfs.spring.outline import SpringOutline, build_outline, coil_gap
from dftfs.spring.parameters import SpiralParameters
from dftfs.spring.planar_rod import RodState, twist_rod, twist_stiffness
from dftfs.spring.rod import ArmRod, arm_rod, slit_neck_m
from dftfs.spring.rod_contact import state_clearance
from dftfs.spring.section import curved_strip_stress

_UNIT_WIDTH_m = 1e-2
_SPACING = 1 / 36  # of the outer radius: chords a hundredth of a millimetre off, fast enough
_CONTACT_RESERVE = 1.02  # on the asked torque, for the error of the rod and the coarse edges
_STRESS_RESERVE = 1.05
_NECK_OF_FIT = 0.2  # of the thickness: the root lengths were not fitted below


@dataclass(frozen=True, kw_only=True)
class Limit:
    """One limit: what is asked and found, and by how much of it the design is inside (>= 0)."""

    name: str
    asked: float
    found: float
    unit: str
    margin: float


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A candidate and how it stands. The numbers after ``limits`` are None where none was found.

    index : number of each searched dimension's value in its grid. violation : 0 inside all limits,
    else larger the further away. travel_rad : deflection at the asked torque without contact, or
    the asked one where coils touch before.
    """

    index: tuple[int, ...]
    values_mm: tuple[tuple[str, float], ...]
    violation: float
    limits: tuple[Limit, ...]
    width_mm: float | None = None
    stiffness_Nm_per_rad: float | None = None
    mass_kg: float | None = None
    stress_Pa: float | None = None
    gap_left_m: float | None = None
    why: str = ""

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
        return self.objective(name) if self.feasible else 1e10 * (1 + self.violation)


def assess(task: SizingTask, index: Sequence[int]) -> Candidate:
    """Judge the candidate at these numbers of the searched grids."""
    index = tuple(int(k) for k in index)
    values = {grid.name: grid.value(k) for grid, k in zip(task.searched, index)}
    return assess_values(task, values, index=index, whole=False)


def assess_values(
    task: SizingTask,
    values_mm: dict[str, float],
    *,
    index: tuple[int, ...] = (),
    width_mm: float | None = None,
    whole: bool = True,
) -> Candidate:
    """Judge dimensions that need not lie on the grids; the width is chosen unless given.

    Candidates that cannot be built come back with a violation above 2 and the reason in ``why``.
    Without ``whole`` a candidate whose shape breaks a limit is not loaded: that is most of the
    time, and its violation, above 1, ranks it behind all that were.
    """
    known = {"index": index, "values_mm": tuple((name, values_mm[name]) for name in SEARCHED)}
    try:
        spiral = task.spiral(values_mm)
        gap = _coil_gap(spiral)
        if gap <= task.process.gap_m / 2:
            missing = (task.process.gap_m - gap) / spiral.thickness_m
            return Candidate(**known, violation=2 + missing, limits=(), why="coils too close")
        outline = build_outline(spiral)
        arm = arm_rod(
            outline,
            _UNIT_WIDTH_m,
            task.material.youngs_modulus_Pa,
            task.material.poisson_ratio,
        )
        per_width = spiral.n_arms * twist_stiffness(arm.rod) / _UNIT_WIDTH_m
        width = _width(task, per_width) if width_mm is None else width_mm * 1e-3
        return _judged(task, outline, arm, per_width * width, width, gap, known, whole)
    except (DesignError, SolveError) as error:
        return Candidate(**known, violation=3.0, limits=(), why=" ".join(str(error).split()))


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
    mass = outline.area_m2 * width * task.material.density_kg_per_m3
    known |= {
        "width_mm": round(width * 1e3, 9),
        "stiffness_Nm_per_rad": stiffness,
        "mass_kg": float(mass),
    }
    shape = _shape_limits(task, outline, width, stiffness, coil)
    broken = float(sum(-limit.margin for limit in shape if limit.margin < 0))
    if broken and not whole:
        why = min(shape, key=lambda limit: limit.margin).name
        return Candidate(**known, violation=1 + broken, limits=shape, why=why)
    gaps, stress = _loaded(task, outline, arm, stiffness, width / _UNIT_WIDTH_m)
    limits = (
        *shape,
        *(
            _at_least(f"gap at {task.contact_free_torque_Nm:g} Nm, {way}", 0.0, 1e3 * gap, "mm", 1)
            for way, gap in gaps.items()
        ),
        _at_most(
            f"stress at {task.operating_torque_Nm:g} Nm",
            task.material.yield_strength_Pa / task.min_safety_factor_yield / 1e6,
            _STRESS_RESERVE * stress / 1e6,
            "MPa",
        ),
    )
    violation = float(sum(-limit.margin for limit in limits if limit.margin < 0))
    return Candidate(
        **known,
        violation=violation,
        limits=limits,
        stress_Pa=stress,
        gap_left_m=min(gaps.values()),
        why="" if violation == 0 else min(limits, key=lambda limit: limit.margin).name,
    )


def _shape_limits(
    task: SizingTask, outline: SpringOutline, width: float, stiffness: float, coil: float
) -> tuple[Limit, ...]:
    p, made = outline.parameters, task.process
    neck = max(made.smallest_wall_m(width), _NECK_OF_FIT * p.thickness_m)
    gap = made.smallest_gap_m(width)
    thinnest = min(
        p.thickness_m, p.rim_outer_radius_m - p.rim_inner_radius_m, p.hub_radius_m - p.bore_radius_m
    )
    off = abs(stiffness / task.stiffness_Nm_per_rad - 1)
    return (
        _at_most("stiffness off target", 100 * task.stiffness_tolerance, 100 * off, "%"),
        _at_most("envelope", 1e3 * task.envelope_m, 2e3 * p.rim_outer_radius_m, "mm"),
        _at_least("smallest gap between coils", 1e3 * gap, 1e3 * coil, "mm"),
        _at_least("slit's width at its end", 1e3 * gap, 2e3 * p.fillet_radius_m, "mm"),
        _at_least("thinnest wall", 1e3 * made.smallest_wall_m(width), 1e3 * thinnest, "mm"),
        _at_least("neck between slit and tip", 1e3 * neck, 1e3 * slit_neck_m(outline), "mm"),
        _at_least(
            "inside radius",
            1e3 * made.smallest_inside_radius_m(width),
            1e3 * p.fillet_radius_m,
            "mm",
        ),
    )


def _loaded(
    task: SizingTask, outline: SpringOutline, arm: ArmRod, stiffness: float, share: float
) -> tuple[dict[str, float], float]:
    """Gap (m) at the asked contact-free torque per direction, and the peak stress (Pa).

    The angle of the asked torque is its share of the stiffness, corrected once by the torque found.
    """
    asked = _CONTACT_RESERVE * task.contact_free_torque_Nm
    samples = sample_coil_gap(outline, _SPACING * outline.parameters.outer_radius_m)
    gaps, stress = {}, 0.0
    arms = outline.parameters.n_arms
    for way, sign in ((WINDING, 1.0), (UNWINDING, -1.0)):
        angle = sign * asked / stiffness
        guess = twist_rod(arm.rod, angle)
        angle *= asked / abs(arms * share * guess.end_torque_Nm)
        state = twist_rod(arm.rod, angle, guess)
        gap = state_clearance(arm, samples, state).smallest_m
        if gap > 0:  # edges that have passed through each other whole are not seen as a gap
            half = twist_rod(arm.rod, angle / 2)
            gap = min(gap, state_clearance(arm, samples, half).smallest_m)
        gaps[way] = gap
        # the stress does not know the width: at the same angle torque and section both carry it
        torque = abs(arms * share * state.end_torque_Nm)
        stress = max(stress, _peak(arm, state) * task.operating_torque_Nm / torque)
    return gaps, stress


def _peak(arm: ArmRod, state: RodState) -> float:
    """Largest stress in an arm, notches included (as `dftfs.spring.notch.peak_stress`)."""
    p = arm.outline.parameters
    moment = state.bending_moment_Nm[2:-2]
    radius = 1 / p.centreline.curvature(arm.section_theta)
    faces = curved_strip_stress(-moment, p.thickness_at(arm.section_theta), arm.width_m, radius)
    notch = float(root_stress(p, arm.width_m, moment[[0, -1]]))
    return float(max(np.max(np.abs(faces[0])), np.max(np.abs(faces[1])), notch))


def _at_most(name: str, asked: float, found: float, unit: str) -> Limit:
    return Limit(name=name, asked=asked, found=found, unit=unit, margin=(asked - found) / asked)


def _at_least(
    name: str, asked: float, found: float, unit: str, scale: float | None = None
) -> Limit:
    margin = (found - asked) / (asked if scale is None else scale)
    return Limit(name=name, asked=asked, found=found, unit=unit, margin=min(margin, 10.0))


def as_design(task: SizingTask, candidate: Candidate, name: str) -> SpringDesign:
    """The candidate as a design of the task."""
    return task.design(
        task.spiral(dict(candidate.values_mm)), (candidate.width_mm or 0.0) * 1e-3, name
    )
