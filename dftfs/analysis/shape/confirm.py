"""Finite elements of a shape: what they find, and by how much the rod model is off."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dftfs.analysis.shape.optimise import Aim, Shape
from dftfs.analysis.shape.responses import DIRECTIONS, Correction
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.regions import ARM, HUB_NOTCH, RIM_SLIT, RINGS
from dftfs.analysis.torsion.result import SIGN, StiffnessResult
from dftfs.analysis.torsion.solve import solve_torsion
from dftfs.design import SpringDesign


@dataclass(frozen=True, kw_only=True)
class ConfirmedShape:
    """A design by finite elements.

    stress_Pa_per_Nm : region to the larger stress over torque of both directions at the angle of
    the aim, or at first contact where that comes earlier. contact_Nm : per direction, None
    without contact on the curve.
    """

    name: str
    model: str
    stiffness_Nm_per_rad: float
    mass_kg: float
    contact_Nm: Mapping[str, float | None]
    stress_Pa_per_Nm: Mapping[str, float]
    torque_at_yield_Nm: float

    @property
    def torque_per_mass(self) -> float:
        """Torque at yield per mass, in Nm/kg."""
        return self.torque_at_yield_Nm / self.mass_kg


def confirmed(design: SpringDesign, aim: Aim, *, dimension: int) -> ConfirmedShape:
    """Solve a design both ways to first contact by plane-stress (2) or solid (3) elements.

    Raises
    ------
    SolveError
        If the mesh or the solve fails.
    """
    found = solve_torsion(TorsionProblem(design=design, dimension=dimension))
    stress = _stress(found, aim.angle_rad)
    contact = {
        direction: None if touch is None else abs(touch.torque_Nm)
        for direction, touch in found.contact_onset.items()
    }
    return ConfirmedShape(
        name=design.name,
        model=found.model,
        stiffness_Nm_per_rad=found.stiffness_Nm_per_rad,
        mass_kg=design.mass_kg,
        contact_Nm=contact,
        stress_Pa_per_Nm=stress,
        torque_at_yield_Nm=design.material.yield_strength_Pa / max(stress.values()),
    )


def _stress(found: StiffnessResult, angle_rad: float) -> dict[str, float]:
    worst = dict.fromkeys((HUB_NOTCH, RIM_SLIT, ARM, RINGS), 0.0)
    for sign in SIGN.values():
        turn = sign * found.deflection_rad
        at = int(np.argmin(np.abs(turn - min(angle_rad, float(np.max(turn))))))
        torque = abs(float(found.torque_Nm[at]))
        for region in worst:
            worst[region] = max(worst[region], float(found.regional_peak_Pa[region][at]) / torque)
    return worst


def corrected(shape: Shape, by_elements: ConfirmedShape, aim: Aim, old: Correction) -> Correction:
    """The rod model's factors at which it gives what the elements found for this shape."""
    per_place = np.reshape(shape.stress_per_torque, (2, -1)).max(axis=0)
    stress = by_elements.stress_Pa_per_Nm
    contact = {}
    for direction, rod in zip(DIRECTIONS, shape.contact_Nm, strict=True):
        touched = by_elements.contact_Nm[direction]
        contact[direction] = old.contact[direction] * (1.0 if touched is None else touched / rod)
    return Correction(
        stiffness=old.stiffness * by_elements.stiffness_Nm_per_rad / aim.stiffness_Nm_per_rad,
        hub=old.hub * stress[HUB_NOTCH] / per_place[0],
        rim=old.rim * stress[RIM_SLIT] / per_place[-1],
        arm=old.arm * stress[ARM] / float(np.max(per_place[1:-1])),
        contact=contact,
    )
