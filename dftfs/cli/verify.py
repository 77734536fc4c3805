"""`dftfs verify`: the finite-element curve of a design, its stress, contact and mesh error."""

import argparse
import time
from dataclasses import replace
from pathlib import Path

from dftfs.analysis.strength.friction_loop import friction_loop, loop_checks
from dftfs.analysis.strength.mesh_series import mesh_series
from dftfs.analysis.strength.strength_checks import strength_checks
from dftfs.analysis.strength.yield_and_set import permanent_set
from dftfs.analysis.structure.result import structural_result, structure_lines
from dftfs.analysis.torsion.mesh_error import stiffness_error
from dftfs.analysis.torsion.problem import TorsionProblem
from dftfs.analysis.torsion.result import verification_record
from dftfs.analysis.torsion.solve import solve_torsion
from dftfs.cli.common import emit, progress, read_design
from dftfs.cli.output import output_folder
from dftfs.cli.spring_options import loop_end
from dftfs.cli.verify_options import add_arguments, spectrum_of
from dftfs.cli.verify_text import text_of
from dftfs.files import refuse_existing, to_json, write_text

__all__ = ["add_arguments", "run"]

_SERIES_NM = 10.0  # where torque and stress get their error bars without an operating torque


def run(arguments: argparse.Namespace) -> int:
    """Solve, print the curve, write it where a folder is given."""
    design, say, begun = read_design(arguments), progress(), time.perf_counter()
    paths: list[Path] = []
    spectrum = spectrum_of(arguments, design)  # refused before anything is solved
    folder = output_folder(arguments, f"verify-{design.name}")
    if folder is not None:
        paths = [folder / f"verify-{design.name}.json"]
        refuse_existing(paths, force=arguments.force)
    planar = TorsionProblem(design=design, dimension=2, boundary=arguments.boundary)
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
    torque = design.requirements.operating_torque_Nm or _SERIES_NM
    series = () if arguments.no_mesh_error else mesh_series(chosen, torque, on_progress=say)
    checks = strength_checks(
        design,
        result,
        spectrum=spectrum,
        surface=arguments.surface,
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
    for path in paths:
        write_text(path, to_json(record))
    text = text_of(record)
    if structure is not None:
        text = "\n".join([text, *structure_lines(structure)])
    emit(record, text, as_json=arguments.json)
    return 0
