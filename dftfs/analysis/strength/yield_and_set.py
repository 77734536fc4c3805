"""Strength of a spring from its curve: first yield by place, permanent set.

Stresses are elastic and nominal up to first yield; beyond it `permanent_set` solves the
elastic-plastic body. Contact stress is kept apart: it is a local bearing pressure.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.regions import ARM, CONTACT, HUB_NOTCH, REGIONS, RIM_SLIT, region_masks
from dftfs.analysis.torsion.result import SIGN, StiffnessResult
from dftfs.errors import DesignError
from dftfs.fem.elements import gauss_table
from dftfs.fem.mesh import jacobian_determinants
from dftfs.fem.newton import PathState, solve_path
from dftfs.fem.plasticity import Hardening
from dftfs.material import Material

STRUCTURAL = (HUB_NOTCH, RIM_SLIT, ARM)
_STEPS, _UNLOADING = 8, 4
_UNIFORM_STRAIN = 0.05


@dataclass(frozen=True, kw_only=True)
class FirstYield:
    """Where and at which torque (signed) a direction first reaches the yield strength.

    ``extrapolated``: beyond the computed curve, in proportion to its last state.
    """

    torque_Nm: float
    region: str
    extrapolated: bool


def first_yield(
    result: StiffnessResult, yield_strength_Pa: float, direction: str, regions=STRUCTURAL
) -> FirstYield | None:
    """The region that yields first and its torque; None where none has any stress.

    Stress over torque is taken straight between the curve's states.
    """
    sign = SIGN[direction]
    found = []
    last = float(np.max(sign * result.torque_Nm))
    for region in regions:
        grid = np.linspace(0, last, 400)[1:]
        stress = np.array([result.stress_at_torque_Pa(sign * t, region) for t in grid])
        over = np.flatnonzero(stress >= yield_strength_Pa)
        if over.size:
            k = over[0]
            before = (grid[k - 1], stress[k - 1]) if k else (0.0, 0.0)
            share = (yield_strength_Pa - before[1]) / (stress[k] - before[1])
            found.append((before[0] + share * (grid[k] - before[0]), region, False))
        elif stress[-1] > 0:
            found.append((last * yield_strength_Pa / stress[-1], region, True))
    if not found:
        return None
    torque, region, beyond = min(found)
    return FirstYield(torque_Nm=sign * torque, region=region, extrapolated=beyond)


def require_angles(name: str, angles_rad: Sequence[float]) -> None:
    """DesignError unless every angle is a number within one turn and not 0."""
    for angle in angles_rad:
        if not (0 < abs(angle) <= 2 * np.pi):
            raise DesignError(f"{name} = {angle} must be between -6.28 and 6.28 rad and not 0")


@dataclass(frozen=True, kw_only=True)
class PermanentSet:
    """What an overload leaves behind.

    ``strain`` is the largest equivalent plastic strain, ``region`` and ``at_m`` (undeformed,
    arm 0) where; ``yielded`` the share of the volume that has yielded.
    """

    overload_rad: float
    overload_Nm: float
    set_rad: float
    strain: float
    region: str
    at_m: tuple[float, float]
    yielded: float


def assumed_hardening(material: Material) -> Hardening:
    """Straight from yield to ultimate strength over 5 % plastic strain; perfect without one.

    An assumption: data sheets give two strengths, no curve. The set after a small overload hardly
    depends on it.

    Raises
    ------
    DesignError
        If the material has no yield strength.
    """
    if material.yield_strength_Pa is None:
        raise DesignError(f"{material.name} has no yield strength: {material.no_strengths}")
    ultimate = material.ultimate_strength_Pa or material.yield_strength_Pa
    slope = (ultimate - material.yield_strength_Pa) / _UNIFORM_STRAIN
    return Hardening(yield_strength_Pa=material.yield_strength_Pa, hardening_Pa=slope)


def permanent_set(
    problem: TorsionProblem, overload_rad: float, hardening: Hardening | None = None
) -> PermanentSet:
    """Load to a deflection (signed), with contact, and back to zero torque, elastic-plastic.

    Raises
    ------
    SolveError
        If an increment has no equilibrium.
    """
    hardening = hardening or assumed_hardening(problem.design.material)
    static = replace(problem.static_problem(contact=True), hardening=hardening)
    loading = solve_path(static, np.linspace(0, overload_rad, _STEPS + 1)[1:])
    loaded = loading.states[-1]
    stiffness = loading.states[0].drive_stiffness
    states: tuple[PathState, ...] = loading.states
    goal = overload_rad
    for _ in range(_UNLOADING):
        # along the elastic line, softer beyond a knee: a secant's zero, never past it by much
        goal -= states[-1].drive_force / stiffness
        states = (*states, *solve_path(static, [goal], start=states[-1:]).states[1:])
        if abs(states[-1].drive_force) < 1e-6 * abs(loaded.drive_force):
            break
        stiffness = states[-1].drive_stiffness
    left = states[-1]
    strain = left.history[..., 6]
    cell = int(strain.max(axis=1).argmax())
    nodes = problem.mesh.cells[cell]
    mesh = problem.mesh
    volume = jacobian_determinants(mesh) * gauss_table(mesh.kind.name, 3).weights
    centre = problem.mesh.nodes[nodes].mean(axis=0)
    masks = region_masks(problem)
    region = max(REGIONS, key=lambda r: int(masks[r][nodes].sum()) if r != CONTACT else -1)
    return PermanentSet(
        overload_rad=overload_rad,
        overload_Nm=problem.copies * loaded.drive_force,
        set_rad=left.t,
        strain=float(strain.max()),
        region=region,
        at_m=(float(centre[0]), float(centre[1])),
        yielded=float((volume * (strain > 0)).sum() / volume.sum()),
    )
