"""`dftfs design`: closed forms, rod model, gaps and contact of a design, in milliseconds."""

import argparse

from dftfs.analysis.study.closed_form_design import ClosedFormDesign, closed_form_design
from dftfs.cli.common import add_design, add_output, emit, read_design, table
from dftfs.design import SpringDesign


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_design(parser)
    add_output(parser, folder=False)


def run(arguments: argparse.Namespace) -> int:
    """Print the closed-form design; exit status 1 if a stated requirement fails."""
    design = read_design(arguments)
    found = closed_form_design(design)
    record = {
        "design": design.name,
        "material": design.material.name,
        "stiffness_Nm_per_rad": found.stiffness_Nm_per_rad,
        "eq_2_1_Nm_per_rad": found.eq_2_1_Nm_per_rad,
        "min_clearance_m": found.min_clearance_m,
        "min_coil_gap_m": found.min_coil_gap_m,
        "contact_onset": found.contact_onset,
        "arm_length_m": found.arm_length_m,
        "free_arm_length_m": found.free_arm_length_m,
        "mass_kg": found.mass_kg,
        "closed_forms": found.closed_forms,
        "checks": found.checks,
    }
    emit(record, _text(design, found), as_json=arguments.json)
    return 1 if any(check.passed is False for check in found.checks) else 0


def _text(design: SpringDesign, found: ClosedFormDesign) -> str:
    lines = [
        f"{design.name}: {design.n_arms} arms, {design.spiral.turns:g} turns,"
        f" {design.material.name}",
        f"K = {found.stiffness_Nm_per_rad:.3f} Nm/rad (rod model); eq. 2.1 corrected"
        f" {found.eq_2_1_Nm_per_rad:.3f} Nm/rad",
        f"arm {found.arm_length_m * 1e3:.2f} mm, free {found.free_arm_length_m * 1e3:.2f} mm;"
        f" smallest gap between coils {found.min_coil_gap_m * 1e3:.3f} mm, anywhere"
        f" {found.min_clearance_m * 1e3:.3f} mm; mass {found.mass_kg * 1e3:.1f} g",
    ]
    for direction, touch in found.contact_onset.items():
        where = f"{touch.torque_Nm:+.2f} Nm at {touch.deflection_rad:+.4f} rad" if touch else "none"
        lines.append(f"first contact, {direction}: {where}")
    rows = [
        [form.equation, form.quantity, form.unit, _number(form.as_printed), _number(form.corrected)]
        for form in found.closed_forms
    ]
    lines.append(table(["eq.", "quantity", "unit", "as printed", "corrected"], rows))
    lines += [check.line() for check in found.checks]
    return "\n".join(lines)


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.5g}"
