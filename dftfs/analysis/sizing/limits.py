"""Limits of a sizing: what is asked and found, and in which order they must be kept."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dftfs.analysis.sizing.task import SizingTask
from dftfs.analysis.strength.fatigue_lives import rated_line
from dftfs.analysis.strength.fkm import ALLOWED_DAMAGE, gradients_per_mm
from dftfs.material import Material
from dftfs.spring.parameters import SpiralParameters
from dftfs.spring.rod import ArmRod, lateral_stiffness_N_per_m

# what a candidate must keep first: a limit counts only where all of the stages before are kept
STAGES = ("built", "made", "contact", "stress", "life", "rest")


@dataclass(frozen=True, kw_only=True)
class Limit:
    """One limit: what is asked and found, and by how much of it the design is inside (>= 0).

    ``margin`` is relative to what is asked, so that limits of any unit compare.
    """

    name: str
    asked: float
    found: float
    unit: str
    margin: float
    stage: str = "made"


def staged_violation(limits: Sequence[Limit], without: Sequence[str] = ()) -> float:
    """0 inside all limits, else the first broken stage's place from the last plus what it breaks.

    A stage's shortfalls are relative, summed and mapped to 0..1: a candidate that breaks an early
    stage never ranks before one that breaks a later one, however little it breaks.

    Parameters
    ----------
    without : stages that are left out.
    """
    for rank, stage in enumerate(STAGES):
        broken = sum(-limit.margin for limit in limits if limit.stage == stage and limit.margin < 0)
        if stage not in without and broken > 0:
            return len(STAGES) - 1 - rank + broken / (1 + broken)
    return 0.0


def at_most(name: str, asked: float, found: float, unit: str, *, stage: str = "made") -> Limit:
    """A limit from above."""
    margin = (asked - found) / asked
    return Limit(name=name, asked=asked, found=found, unit=unit, margin=margin, stage=stage)


def at_least(name: str, asked: float, found: float, unit: str, *, stage: str = "made") -> Limit:
    """A limit from below."""
    margin = min((found - asked) / asked, 10.0)
    return Limit(name=name, asked=asked, found=found, unit=unit, margin=margin, stage=stage)


STRESS_RESERVE = 1.05  # on the rod's stress


def strength_limits(
    task: SizingTask, p: SpiralParameters, material: Material, arm_Pa: float, notch_Pa: float
) -> tuple[Limit, ...]:
    """Yield at the operating torque and, where a life is asked, the amplitude that it leaves.

    The load of a life is the operating torque in either direction in turn, the allowed damage
    FKM's (`dftfs.analysis.strength.fkm`); the arm and its root have different stress gradients.
    """
    asked = material.yield_strength_Pa / task.min_safety_factor_yield
    name, worst = f"stress at {task.operating_torque_Nm:g} Nm", max(arm_Pa, notch_Pa)
    found = [at_most(name, asked / 1e6, STRESS_RESERVE * worst / 1e6, "MPa", stage="stress")]
    if task.life_cycles is not None:
        allowed = allowed_amplitudes_Pa(task, p, material)
        found += [
            at_most(
                f"amplitude in the {place} for {task.life_cycles:.3g} cycles",
                amplitude / 1e6,
                STRESS_RESERVE * stress / 1e6,
                "MPa",
                stage="life",
            )
            for place, amplitude, stress in zip(("arm", "root"), allowed, (arm_Pa, notch_Pa))
        ]
    return tuple(found)


def allowed_amplitudes_Pa(
    task: SizingTask, p: SpiralParameters, material: Material
) -> tuple[float, ...]:
    """Fully reversed amplitude of the arm and of its root that survives the asked cycles (Pa)."""
    cycles = (task.life_cycles or 1.0) / ALLOWED_DAMAGE
    return tuple(
        rated_line(
            material, gradient_per_mm=gradient, surface=task.surface, survival=task.survival
        )[0].amplitude_Pa(cycles)
        for gradient in gradients_per_mm(p.thickness_range_m[1], p.fillet_radius_m)
    )


def other_limits(
    task: SizingTask, arm: ArmRod, width: float, mass: float, density_kg_per_m3: float
) -> tuple[Limit, ...]:
    """Limits of the last stage, where the task states them; the rod has a width of its own."""
    found, p = [], arm.outline.parameters
    if task.min_lateral_N_per_m is not None:
        asked, stiffness = task.min_lateral_N_per_m, lateral_stiffness_N_per_m(arm)
        stiffness *= width / arm.width_m
        found.append(
            at_least("lateral stiffness", 1e-3 * asked, 1e-3 * stiffness, "N/mm", stage="rest")
        )
    if task.max_inertia_kg_m2 is not None:
        inertia = arm.outline.polar_moment_m4 * width * density_kg_per_m3
        asked = 1e6 * task.max_inertia_kg_m2
        found.append(at_most("inertia", asked, 1e6 * inertia, "kg mm2", stage="rest"))
    if task.max_mass_kg is not None:
        found.append(at_most("mass", 1e3 * task.max_mass_kg, 1e3 * mass, "g", stage="rest"))
    if task.max_scatter is not None:
        scatter = stiffness_scatter(task.process.edge_tolerance_at_m(width), p, width)
        name = "scatter of K, 2 standard deviations"
        found.append(at_most(name, 100 * task.max_scatter, 100 * scatter, "%", stage="rest"))
    return tuple(found)


STIFFNESS = "stiffness off target"
RANGE = "difference of both contact-free torques"


def range_limit(task: SizingTask, torques_Nm: Sequence[float]) -> Limit:
    """How far the torques before contact of both directions differ, over the larger."""
    low, high = sorted(torques_Nm)
    found, asked = 100 * (1 - low / high), 100 * (task.equal_range or 1.0)
    return at_most(RANGE, asked, found, "%", stage="rest")


def stiffness_scatter(edge_m: float, p: SpiralParameters, width_m: float) -> float:
    """Relative scatter of K by a process' edge tolerance, for a slope of 3 over the thickness.

    Thickness and kerf scatter by the edge tolerance (kerf moves both edges), the width by 0.1 mm,
    the modulus by 2 %; `dftfs.analysis.study.tolerance` has the same causes with computed slopes.
    """
    thin = p.thickness_range_m[0]
    return float(
        np.hypot(np.hypot(3 * edge_m / thin, 6 * edge_m / thin), np.hypot(1e-4 / width_m, 0.02))
    )
