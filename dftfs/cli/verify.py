"""`dftfs verify`: the finite-element curve of a design, its stress, contact and mesh error."""

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from dftfs.analysis.strength.fatigue import LoadBlock
from dftfs.analysis.strength.fatigue_lives import FatigueLife, fatigue_lives
from dftfs.analysis.strength.friction_loop import friction_loop, loop_checks
from dftfs.analysis.strength.mesh_series import mesh_series
from dftfs.analysis.strength.strength_checks import strength_checks
from dftfs.analysis.strength.yield_and_set import permanent_set
from dftfs.analysis.structure.result import structural_result, structure_lines
from dftfs.analysis.torsion.curve_file import curve_csv
from dftfs.analysis.torsion.mesh_error import stiffness_error
from dftfs.analysis.torsion.problem import meshed_problem
from dftfs.analysis.torsion.result import StiffnessResult, verification_record
from dftfs.analysis.torsion.solve import solve_torsion
from dftfs.cli.common import emit, progress, read_design
from dftfs.cli.output import output_folder, write_result
from dftfs.cli.spring_options import loop_end, mesh_of
from dftfs.cli.verify_options import add_arguments, spectrum_of
from dftfs.cli.verify_text import text_of
from dftfs.design import SpringDesign
from dftfs.files import refuse_existing, to_json, write_bytes, write_text

__all__ = ["add_arguments", "run"]

_SERIES_NM = 10.0  # where torque and stress get their error bars without an operating torque


def run(arguments: argparse.Namespace) -> int:
    """Solve, print the curve, write it where a folder is given."""
    design, say, begun = read_design(arguments), progress(), time.perf_counter()
    spectrum = spectrum_of(arguments, design)  # refused before anything is solved
    planar = meshed_problem(
        design, mesh_of(arguments, design), dimension=2, boundary=arguments.boundary
    )
    paths = _paths(arguments, design.name, haigh=bool(spectrum))
    chosen = planar if arguments.plane else replace(planar, dimension=3)
    say(f"{design.name}: plane stress up to the first contact, both directions")
    options = {"states_per_direction": arguments.states, "on_progress": say}
    last = {"extra_deflections_rad": tuple(arguments.at_rad), "beyond": arguments.beyond}
    result = solve_torsion(planar, **options, **(last if arguments.plane else {}))
    if not arguments.plane:
        ends = {name: abs(shot.deflection_rad) for name, shot in result.snapshots.items()}
        result = solve_torsion(chosen, expected_onset_rad=ends, **options, **last)
    turn = loop_end(arguments, result)
    loop = None
    if turn is not None:
        loop = friction_loop(planar, result, arguments.contact_friction, turn, on_progress=say)
    structure = None
    if arguments.structure:
        structure = structural_result(
            design,
            result,
            load_inertia_kg_m2=arguments.load_inertia,
            hub_inertia_kg_m2=arguments.hub_inertia,
            layers=2,
            always_stability=True,
            on_progress=say,
        )
    error = None if arguments.no_mesh_error else stiffness_error(chosen, on_progress=say)
    asked = design.requirements.operating_torque_Nm
    series = () if error is None else mesh_series(chosen, asked or _SERIES_NM, on_progress=say)
    checks = strength_checks(
        design,
        result,
        spectrum=spectrum,
        surface=arguments.surface,
        survival=arguments.survival_percent / 100,
        overloads=[permanent_set(planar, angle) for angle in arguments.overload_rad],
    )
    record = verification_record(
        design.name, design.material.name, result, error, wall_s=time.perf_counter() - begun
    ) | {"strength": checks, "mesh_series": series}
    if loop is not None:
        record["strength"] = (*checks, *loop_checks(loop))
        record["friction_loop"] = loop.record
    if structure is not None:
        record["structure"] = structure.record
    if spectrum:
        record["fatigue"] = _fatigue(arguments, design, result, spectrum, paths.get("haigh"))
    if paths:
        write_text(paths["json"], to_json(record))
        write_text(paths["curve"], curve_csv(design, result, f"verify {arguments.design}"))
    text = "\n".join([text_of(record), *(structure_lines(structure, asked) if structure else ())])
    if paths:
        write_result(arguments, paths["page"], f"Finite elements of {design.name}", text)
    emit(record, text, as_json=arguments.json)
    return 0


def _paths(arguments: argparse.Namespace, name: str, *, haigh: bool) -> dict[str, Path]:
    folder = output_folder(arguments, f"verify-{name}")
    if folder is None:
        return {}
    paths = {
        "json": folder / f"verify-{name}.json",
        "curve": folder / f"curve-{name}.csv",
        "page": folder / f"verify-{name}.html",
    }
    if haigh:
        paths["haigh"] = folder / f"haigh-{name}.png"
    refuse_existing(list(paths.values()), force=arguments.force)
    return paths


def _fatigue(
    arguments: argparse.Namespace,
    design: SpringDesign,
    result: StiffnessResult,
    spectrum: Sequence[LoadBlock],
    path: Path | None,
) -> tuple[FatigueLife, ...]:
    """Lives of every place, and their Haigh diagram where a file is wanted."""
    survival = arguments.survival_percent / 100
    lives = fatigue_lives(design, result, spectrum, arguments.surface, survival)
    if path is not None:
        from dftfs.report.figures.haigh import haigh_figure

        ultimate = design.material.ultimate_strength_Pa or 0.0
        strength = design.material.yield_strength_Pa
        write_bytes(path, haigh_figure(lives, ultimate, strength, survival).png)
    return lives
