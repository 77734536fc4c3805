"""`dftfs study`: from spring parameters to one HTML report."""

import argparse
import shlex
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

from dftfs.cli.common import add_author, add_design, add_output, emit, progress, read_design
from dftfs.cli.output import add_pdf, default_folder, prepared, print_page
from dftfs.cli.spring_options import (
    add_friction,
    add_inertia,
    add_mesh,
    check_friction,
    check_inertia,
    loop_end,
    mesh_of,
)

if TYPE_CHECKING:  # what the work needs is imported by it: `--help` needs none of it
    from dftfs.analysis.study.result import StudyResult


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_design(parser)
    parser.add_argument(
        "--scenario", type=Path, metavar="TOML",
        help="actuator scenario that uses the spring (default: 5 Nm at 1 Hz, locked output)",
    )  # fmt: skip
    add_mesh(parser)
    add_friction(parser)
    add_inertia(parser)
    add_author(parser)
    add_pdf(parser)
    add_output(parser, folder=True)


def run(arguments: argparse.Namespace) -> int:
    """Run every stage, write the report; exit status 1 if a stated requirement fails."""
    from dftfs.analysis.study.run import StudyOptions, run_study
    from dftfs.analysis.torsion.curve_file import curve_csv
    from dftfs.files import refuse_existing, to_json, write_text
    from dftfs.report.study.render import write_report
    from rsea_core.scenarios.scenario import Scenario

    design, say = read_design(arguments), progress()
    check_friction(arguments)
    check_inertia(arguments)
    mesh = mesh_of(arguments, design)
    default = resources.files("dftfs") / "examples" / "torque-1hz.toml"
    scenario = Scenario.from_toml(arguments.scenario or Path(str(default)))
    folder = prepared(arguments, arguments.out or default_folder(arguments, f"study-{design.name}"))
    report, record, curve = (folder / n for n in ("report.html", "study.json", "curve.csv"))
    refuse_existing([report, record, curve], force=arguments.force)
    study = run_study(
        design, scenario, folder, command=_command(arguments), overwrite=arguments.force,
        options=StudyOptions(
            contact_friction=arguments.contact_friction,
            loop_end=lambda free: loop_end(arguments, free),
            load_inertia_kg_m2=arguments.load_inertia,
            hub_inertia_kg_m2=arguments.hub_inertia,
            mesh=mesh,
            author=arguments.author,
        ),
        on_progress=say,
    )  # fmt: skip
    say("report")
    write_report(study, report)
    print_page(arguments, report)
    write_text(curve, curve_csv(design, study.solid, study.provenance.command))
    result = _record(study, {"report": report, "curve": curve})
    write_text(record, to_json(result))
    emit(result, _text(study, report), as_json=arguments.json)
    return 1 if any(check.passed is False for check in study.judged) else 0


def _command(arguments: argparse.Namespace) -> str:
    changes = [word for change in arguments.changes for word in ("--set", change)]
    options = "contact_friction loop_rad load_inertia hub_inertia size layers author"
    for option in options.split():
        if getattr(arguments, option) not in (None, ""):
            changes += [f"--{option.replace('_', '-')}={getattr(arguments, option)}"]
    return shlex.join(["dftfs", "study", arguments.design, *changes])


def _record(study: "StudyResult", written: dict[str, Path]) -> dict:
    from dftfs.analysis.torsion.result import verification_record

    solid = verification_record(
        study.design.name, study.design.material.name, study.solid, study.mesh_error,
        wall_s=sum(study.provenance.wall_s.values()),
    )  # fmt: skip
    paths = {**written, **study.export.files}
    return {
        **solid,
        "stiffness_uncertainty_Nm_per_rad": study.stiffness_uncertainty_Nm_per_rad,
        "stiffness_2d_Nm_per_rad": study.planar.stiffness_Nm_per_rad,
        "stiffness_rod_Nm_per_rad": study.rod.stiffness_Nm_per_rad,
        "eq_2_1_Nm_per_rad": study.eq_2_1_Nm_per_rad,
        "lateral_stiffness_N_per_m": study.lateral_stiffness_N_per_m,
        "mass_kg": study.design.mass_kg,
        "actuator": {"metrics": study.actuator.metrics, "limits": study.actuator.limits},
        "structure": None if study.structure is None else study.structure.record,
        "checks": study.judged,
        "friction_loop": None if study.friction_loop is None else study.friction_loop.record,
        "provenance": study.provenance,
        "paths": paths,
    }


def _text(study: "StudyResult", report: Path) -> str:
    from dftfs.analysis.strength.friction_loop import loop_checks
    from dftfs.analysis.structure.result import structure_lines

    solid, spread = study.solid, study.stiffness_uncertainty_Nm_per_rad
    lines = [
        f"{study.design.name}: K = {solid.stiffness_Nm_per_rad:.3f} +- {spread:.3f} Nm/rad"
        f" (3D; mesh {study.mesh_error.verdict})"
    ]
    lines += [check.line() for check in study.checks]
    if study.structure is not None:
        lines += structure_lines(study.structure, study.design.requirements.operating_torque_Nm)
    if study.friction_loop is not None:
        lines += [check.line() for check in loop_checks(study.friction_loop)]
    return "\n".join([*lines, study.actuator.limits.sentence, f"report: {report}"])
