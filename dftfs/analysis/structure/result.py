"""More than the torsional stiffness: six directions, vibration, stability, mass, energy."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from dftfs.analysis.strength.checks import Check
from dftfs.analysis.structure.buckling import Stability, stability
from dftfs.analysis.structure.lateral import LateralState, lateral_curve
from dftfs.analysis.structure.linear_spring import WholeSpring
from dftfs.analysis.structure.modes import ModeSet, locked_modes, turning_modes
from dftfs.analysis.structure.rim_stiffness import RimStiffness, rim_stiffness
from dftfs.analysis.structure.stability_checks import (
    NEARLY,
    ends_at_torque_rad,
    may_tip,
    stability_checks,
)
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.result import SIGN, StiffnessResult
from dftfs.design import SpringDesign
from dftfs.fem.linear_model import RIGID_MOTIONS

_UNBOUNDED_RAD = 0.5  # where stability is looked at if the coils never touch


@dataclass(frozen=True, kw_only=True)
class StructureResult:
    """Linear figures of the whole spring.

    ``stability`` maps a direction to its path and is empty for a strip that is wider than thick,
    unless asked for. ``energy_J`` is the strain energy at the first contact of each direction.
    """

    rim: RimStiffness
    lateral: tuple[LateralState, ...]
    modes: tuple[ModeSet, ...]
    stability: Mapping[str, Stability]
    mass_kg: float
    inertia_kg_m2: float
    energy_J: Mapping[str, float]

    @property
    def energy_per_mass_J_per_kg(self) -> dict[str, float]:
        """Strain energy at first contact over the part's mass, per direction."""
        return {name: float(energy / self.mass_kg) for name, energy in self.energy_J.items()}

    @property
    def record(self) -> dict:
        """Everything, with what follows from it."""
        rim = self.rim
        return {
            "rim_stiffness": {
                "order": RIGID_MOTIONS,
                "matrix": rim.matrix,
                "lateral_N_per_m": rim.lateral_N_per_m,
                "softest_direction_rad": rim.softest_direction_rad,
                "axial_N_per_m": rim.axial_N_per_m,
                "tilt_Nm_per_rad": rim.tilt_Nm_per_rad,
                "torsion_Nm_per_rad": rim.torsion_Nm_per_rad,
            },
            "lateral": self.lateral,
            "modes": self.modes,
            "stability": self.stability,
            "mass_kg": self.mass_kg,
            "inertia_kg_m2": self.inertia_kg_m2,
            "energy_at_contact_J": self.energy_J,
            "energy_per_mass_J_per_kg": self.energy_per_mass_J_per_kg,
        }


def structural_result(
    design: SpringDesign,
    free: StiffnessResult,
    *,
    load_inertia_kg_m2: float | None = None,
    hub_inertia_kg_m2: float | None = None,
    layers: int = 1,
    always_stability: bool = False,
    on_progress: Callable[[str], None] = lambda message: None,
) -> StructureResult:
    """All of it for one design.

    Parameters
    ----------
    free : StiffnessResult
        The curve, for where the coils touch and what energy is stored there.
    load_inertia_kg_m2, hub_inertia_kg_m2 : float or None
        What turns with the rim and with the bore; None: the rim alone, the bore locked.
    layers : int
        Elements through half the width; with 1 axial stiffness and tilt are some 1 % high.

    Raises
    ------
    DesignError
        If an inertia is negative.
    SolveError
        If a solve fails.
    """
    spring = WholeSpring(design=design, layers=layers)
    ends = {
        name: sign * NEARLY * abs(free.contact_onset[name].deflection_rad)
        if free.contact_onset.get(name)
        else sign * _UNBOUNDED_RAD
        for name, sign in SIGN.items()
    }
    on_progress("rim stiffness in six directions")
    rim = rim_stiffness(spring)
    on_progress("natural frequencies")
    modes = _modes(spring, load_inertia_kg_m2, hub_inertia_kg_m2)
    paths = {}
    if always_stability or may_tip(design):
        on_progress("out-of-plane stability")
        paths = {
            name: stability(spring, _states_rad(design, free, name, end))
            for name, end in ends.items()
        }
    on_progress("lateral stiffness against angle")
    plane = TorsionProblem(design=design, dimension=2, sizing=spring.sizing)
    around = [share * end for end in ends.values() for share in (0.5, 1.0)]
    return StructureResult(
        rim=rim,
        lateral=lateral_curve(plane, around),
        modes=modes,
        stability=paths,
        mass_kg=design.mass_kg,
        inertia_kg_m2=spring.inertia_kg_m2,
        energy_J=_energy_at_contact(free),
    )


def _states_rad(
    design: SpringDesign, free: StiffnessResult, name: str, end_rad: float
) -> list[float]:
    """Half of the way to the end, the end, and the operating torque's deflection."""
    found = {end_rad / 2, end_rad}
    asked = design.requirements.operating_torque_Nm
    if asked is not None:
        at = ends_at_torque_rad(free, asked)[name]
        if at / end_rad > 0.01 and abs(at / end_rad - 1) > 0.01:
            found.add(at)
    return sorted(found, key=abs)


def _modes(spring: WholeSpring, load: float | None, hub: float | None) -> tuple[ModeSet, ...]:
    """Locked ends, a free rim, and the ends' inertias (kg m2) where one is given."""
    found = [locked_modes(spring), turning_modes(spring)]
    if load is not None or hub is not None:
        found.append(turning_modes(spring, load_inertia_kg_m2=load or 0.0, hub_inertia_kg_m2=hub))
    return tuple(found)


def _energy_at_contact(free: StiffnessResult) -> dict[str, float]:
    """Strain energy in J at the first contact of each direction that has one."""
    found = {}
    for name, onset in free.contact_onset.items():
        if onset is not None:
            deflection = SIGN[name] * free.deflection_rad
            order = np.argsort(deflection)
            energy = free.strain_energy_J[order]
            found[name] = float(np.interp(abs(onset.deflection_rad), deflection[order], energy))
    return found


def structure_checks(result: StructureResult, torque_Nm: float | None = None) -> tuple[Check, ...]:
    """Stability judged in each direction up to a torque, to the path's end without one."""
    return stability_checks(result.stability, torque_Nm)


def structure_lines(result: StructureResult, torque_Nm: float | None = None) -> list[str]:
    """The figures as lines of text, for a terminal, judged up to a torque."""
    rim = result.rim
    low, high = (value / 1e3 for value in rim.lateral_N_per_m)
    lines = [
        f"rim against hub: lateral {low:.2f} to {high:.2f} N/mm, axial"
        f" {rim.axial_N_per_m / 1e3:.2f} N/mm, tilt {rim.tilt_Nm_per_rad[0]:.2f} to"
        f" {rim.tilt_Nm_per_rad[1]:.2f} Nm/rad, torsion {rim.torsion_Nm_per_rad:.3f} Nm/rad",
        f"mass {1e3 * result.mass_kg:.1f} g, inertia {1e6 * result.inertia_kg_m2:.1f} kg mm2",
    ]
    for found in result.modes:
        listed = ", ".join(f"{mode.frequency_Hz:.2f} ({mode.parity})" for mode in found.modes)
        lines.append(f"natural frequencies, {found.boundary}: {listed} Hz")
    for name, share in result.energy_per_mass_J_per_kg.items():
        lines.append(
            f"energy at first contact, {name}: {result.energy_J[name]:.3f} J, {share:.2f} J/kg"
        )
    return [*lines, *(check.line() for check in structure_checks(result, torque_Nm))]
