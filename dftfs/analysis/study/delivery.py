"""What a shop and a customer get of a spring, in one zip: files, drawing, certificate, measuring.

The certificate's curve is that of 3D elements, as in a study, with the plane-stress stiffness at
rest beside it: a wide strip is stiffer than plane stress has it. Lives are those of the notch at
the operating torque either way, fully reversed.
"""

import io
import tempfile
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from dftfs.analysis.strength.checks import Check
from dftfs.analysis.strength.fatigue_lives import rated_line
from dftfs.analysis.strength.fkm import (
    ALLOWED_DAMAGE,
    SURFACE_OF_PROCESS,
    SURVIVAL,
    fatigue_strength,
    gradients_per_mm,
    life_text,
)
from dftfs.analysis.structure.stability_checks import (
    ends_at_torque_rad,
    stability_at,
    stability_checks,
)
from dftfs.analysis.study.drawing_tolerance import DrawingTolerance
from dftfs.analysis.study.measuring_sheet import measuring_sheet
from dftfs.analysis.study.run import beyond_for, design_hash, errors_of_stress, study_checks
from dftfs.analysis.torsion.curve_file import curve_csv
from dftfs.analysis.torsion.result import SIGN, StiffnessResult
from dftfs.cad.drawing_sheet import Sheet, ShopData
from dftfs.design import SpringDesign, design_toml
from dftfs.errors import DesignError
from dftfs.process import Process

_STATES_BEYOND = 3  # from the first contact to the operating torque
_TIME = (2000, 1, 1, 0, 0, 0)  # of every entry: the same content is the same zip


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """What is stated of a part: lines (name, value), the checks, the curve behind them.

    The checks are a study's, and at the operating torque whether the spring stays in its plane.
    """

    design: SpringDesign
    lines: tuple[tuple[str, str], ...]
    checks: tuple[Check, ...]
    curve: StiffnessResult


def certificate(
    design: SpringDesign,
    result: StiffnessResult,
    process: Process,
    tolerance: DrawingTolerance,
    *,
    plane_Nm_per_rad: float,
    stress_errors: Mapping[str, float],
) -> Certificate:
    """Stiffness, first contact, stress, life and mass of a design, with their models."""
    lines = [
        ("design", f"{design.name}, hash {design_hash(design)}"),
        (
            "material",
            f"{design.material.name}, E {design.material.youngs_modulus_Pa / 1e9:.4g} GPa",
        ),
        ("process", f"{process.name}: {process.description}"),
        ("mass", f"{1e3 * design.mass_kg:.1f} g"),
        (f"stiffness at rest, {result.model}", f"{result.stiffness_Nm_per_rad:.3f} Nm/rad"),
        ("stiffness at rest, 2D plane stress", f"{plane_Nm_per_rad:.3f} Nm/rad"),
        ("by the drawing's tolerances", tolerance.line()),
    ]
    for direction, onset in result.contact_onset.items():
        state = result.snapshots[direction] if onset is None else onset
        touch = f"{abs(state.torque_Nm):.2f} Nm at {abs(state.deflection_rad):.4f} rad"
        if onset is None:  # nobody looked further
            touch = f"none up to {touch}"
        lines.append((f"first contact, {direction}", touch))
    lines += _life(design, result, process)
    return Certificate(
        design=design,
        lines=tuple(lines),
        checks=(*study_checks(design, result, stress_errors), *_stays_in_plane(design, result)),
        curve=result,
    )


def _stays_in_plane(design: SpringDesign, result: StiffnessResult) -> tuple[Check, ...]:
    torque = design.requirements.operating_torque_Nm
    if torque is None:
        return ()
    paths = stability_at(design, ends_at_torque_rad(result, torque))
    return stability_checks(paths, torque)


def _life(design: SpringDesign, result: StiffnessResult, process: Process) -> list[tuple[str, str]]:
    torque = design.requirements.operating_torque_Nm
    if torque is None:
        return []
    stress = max(result.stress_at_torque_Pa(sign * torque) for sign in SIGN.values())
    lines = [(f"largest stress at {torque:g} Nm, {result.model}", f"{stress / 1e6:.0f} MPa")]
    yields = design.material.yield_strength_Pa
    if yields is not None and stress > yields:
        return [*lines, ("life", "none stated: the notch yields at the operating torque")]
    surface = SURFACE_OF_PROCESS.get(process.name, "as-cut")
    gradient = gradients_per_mm(design.spiral.thickness_m, design.spiral.fillet_radius_m)[1]
    try:
        line, _ = rated_line(design.material, gradient_per_mm=gradient, surface=surface)
        strength = fatigue_strength(design.material)
    except DesignError as error:
        return [*lines, ("life", str(error))]
    cycles = ALLOWED_DAMAGE * line.cycles(stress)
    return [
        *lines,
        (
            f"life at +-{torque:g} Nm, {100 * SURVIVAL:g} % survival",
            f"{life_text(cycles, strength)} to a damage of {ALLOWED_DAMAGE:g} ({surface};"
            f" {strength.note})",
        ),
    ]


def solved_for_delivery(
    design: SpringDesign, on_progress=lambda message: None
) -> tuple[StiffnessResult, float, dict[str, float]]:
    """The 3D curve both ways to first contact or, with contact, to the operating torque.

    Beside it the plane-stress stiffness at rest, and the error of the stress by region.

    Raises
    ------
    SolveError, MeshError
        From a mesh or a solve.
    """
    from dftfs.analysis.torsion.problem import meshed_problem
    from dftfs.analysis.torsion.solve import solve_torsion

    planar = meshed_problem(design, dimension=2)
    plane = solve_torsion(planar, states_per_direction=6, on_progress=on_progress)
    near = {name: abs(shot.deflection_rad) for name, shot in plane.snapshots.items()}
    result = solve_torsion(
        meshed_problem(design, dimension=3),
        states_per_direction=6,
        expected_onset_rad=near,
        beyond=beyond_for(plane, design.requirements.operating_torque_Nm, 1.0),
        states_beyond=_STATES_BEYOND,
        on_progress=on_progress,
    )
    return result, plane.stiffness_Nm_per_rad, errors_of_stress(planar, plane, on_progress)


def packed(files: dict[str, bytes]) -> bytes:
    """A zip of files by name, the same bytes for the same content."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files):
            archive.writestr(zipfile.ZipInfo(name, date_time=_TIME), files[name])
    return stream.getvalue()


def part_files(
    design: SpringDesign,
    result: StiffnessResult,
    tolerance: DrawingTolerance,
    shop: ShopData,
    sheet: Sheet,
) -> dict[str, bytes]:
    """CAD files, drawing, design, curve and measuring sheet, by their names in the zip.

    Raises
    ------
    CadError
        If a file read back is not the part.
    """
    from dftfs.cad.drawing import write_drawing
    from dftfs.cad.export import export_design
    from dftfs.cad.step_tolerances import StepTolerances

    stated = StepTolerances(width_tolerance_m=tolerance.width_m, profile_m=tolerance.profile_m)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        made = export_design(
            design, folder, author=shop.author, tolerances=stated, formats=("step", "dxf")
        )
        drawn = write_drawing(
            design, folder, design_hash=design_hash(design), shop=shop, sheet=sheet
        )
        paths = (*made.files.values(), drawn.dxf, drawn.svg)
        files = {path.name: path.read_bytes() for path in paths}
    files["design.toml"] = design_toml(design).encode()
    files["curve.csv"] = curve_csv(design, result, "deliver").encode()
    files["measuring-sheet.csv"] = measuring_sheet(
        design, tolerance, result.stiffness_Nm_per_rad
    ).encode()
    return files
