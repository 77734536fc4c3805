"""A design judged in milliseconds: closed forms, rod model, gaps and contact, no mesh."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from dftfs.analysis.strength.checks import Check, contact_checks, stiffness_check
from dftfs.analysis.torsion.result import UNWINDING, WINDING
from dftfs.design import SpringDesign
from dftfs.spring.clearance import measure_clearance, sample_coil_gap
from dftfs.spring.closed_forms import ClosedForm, ClosedFormInput, closed_forms, stiffness_eq_2_1
from dftfs.spring.outline import coil_gap
from dftfs.spring.rod import RodCurve, rod_curve, slit_neck_m
from dftfs.spring.rod_contact import Contact, Onset, contact_onset

_STATES = 12


@dataclass(frozen=True, kw_only=True)
class ClosedFormDesign:
    """What is known of a design without finite elements.

    ``stiffness_Nm_per_rad`` is the rod's tangent at rest, ``eq_2_1_Nm_per_rad`` the corrected
    strip formula with the true arc length and all arms, ``min_clearance_m`` the smallest gap of
    facing edges at rest (slit included), ``min_coil_gap_m`` that between neighbouring coils.
    """

    stiffness_Nm_per_rad: float
    eq_2_1_Nm_per_rad: float
    min_clearance_m: float
    min_coil_gap_m: float
    contact_onset: Mapping[str, Contact | None]
    arm_length_m: float
    free_arm_length_m: float
    mass_kg: float
    closed_forms: tuple[ClosedForm, ...]
    rod: RodCurve
    checks: tuple[Check, ...]


def closed_form_design(design: SpringDesign) -> ClosedFormDesign:
    """Closed forms and rod model of a design, up to first contact in both directions.

    Raises
    ------
    SolveError
        If the rod has no equilibrium on the way to the contact.
    """
    outline, material = design.outline, design.material
    elastic = (design.width_m, material.youngs_modulus_Pa, material.poisson_ratio)
    onset = contact_onset(outline, *elastic, wide=True)
    touches = {WINDING: onset.winding, UNWINDING: onset.unwinding}
    rod = rod_curve(outline, *elastic, _deflections(onset), wide=True)
    samples = sample_coil_gap(outline, 2e-3 * outline.parameters.outer_radius_m)
    gap = measure_clearance(
        samples.floor_m, samples.ceiling_m, deepest_m=design.spiral.thickness_m / 2
    )
    return ClosedFormDesign(
        stiffness_Nm_per_rad=rod.stiffness_Nm_per_rad,
        eq_2_1_Nm_per_rad=stiffness_eq_2_1(
            material.youngs_modulus_Pa,
            design.spiral.thickness_m,
            design.width_m,
            outline.arm_length_m,
            n_arms=design.n_arms,
        ),
        min_clearance_m=gap.smallest_m,
        min_coil_gap_m=_coil_gap(design),
        contact_onset=touches,
        arm_length_m=outline.arm_length_m,
        free_arm_length_m=outline.free_arm_length_m,
        mass_kg=design.mass_kg,
        closed_forms=_closed_forms(design),
        rod=rod,
        checks=_checks(design, rod, touches),
    )


def _deflections(onset: Onset) -> np.ndarray:
    """Evenly spaced states from contact to contact, through rest."""
    low = onset.unwinding.deflection_rad if onset.unwinding else -onset.limit_rad
    high = onset.winding.deflection_rad if onset.winding else onset.limit_rad
    return np.concatenate([np.linspace(low, 0, _STATES)[:-1], np.linspace(0, high, _STATES)])


def _coil_gap(design: SpringDesign) -> float:
    line = design.spiral.centreline
    theta = np.arange(line.start + design.spiral.pitch_rad, line.end, 0.02)
    return float(np.min(coil_gap(design.spiral, theta))) if theta.size else float("inf")


def _closed_forms(design: SpringDesign) -> tuple[ClosedForm, ...]:
    p, asked = design.spiral, design.requirements
    torque = asked.operating_torque_Nm or asked.contact_free_torque_Nm or 1.0
    return closed_forms(
        ClosedFormInput(
            youngs_modulus_Pa=design.material.youngs_modulus_Pa,
            thickness_m=p.thickness_m,
            width_m=design.width_m,
            inner_radius_m=p.inner_radius_m,
            outer_radius_m=p.outer_radius_m,
            turns=p.turns,
            n_arms=design.n_arms,
            arc_length_m=design.outline.arm_length_m,
            gap_m=max(min(_coil_gap(design), p.outer_radius_m), 1e-6),
            torque_Nm=torque,
        )
    )


def _checks(design: SpringDesign, rod: RodCurve, touches: Mapping) -> tuple[Check, ...]:
    asked = design.requirements
    onset_Nm = {name: abs(t.torque_Nm) if t else None for name, t in touches.items()}
    ends = {WINDING: float(np.max(rod.torque_Nm)), UNWINDING: float(-np.min(rod.torque_Nm))}
    return (
        *stiffness_check(asked, rod.stiffness_Nm_per_rad, "rod model"),
        *contact_checks(asked, onset_Nm, ends, "rod model"),
        _neck_check(design),
    )


def _neck_check(design: SpringDesign) -> Check:
    """Advice, not a requirement: a thin neck between slit and tip carries the whole arm."""
    neck, thickness = slit_neck_m(design.outline), design.spiral.thickness_m
    return Check(
        name="neck between slit and tip",
        value=neck * 1e3,
        unit="mm",
        limit=f"at least the strip's {thickness * 1e3:g} mm (advice)",
        passed=True if neck >= thickness else None,
        note="" if neck >= thickness else "the neck carries the whole arm: check the stress there",
    )
