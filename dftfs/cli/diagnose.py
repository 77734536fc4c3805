"""`dftfs diagnose`: a case folder in, a diagnosis, its model and a report out."""

import argparse
from collections.abc import Callable
from pathlib import Path

from dftfs.cli.common import emit, progress, silent
from dftfs.design import load_design
from dftfs.errors import DftfsError
from dftfs.files import prepare_folder, refuse_existing, to_json, write_text
from dftfs.report.diagnosis_page import page_from
from dftfs.report.diagnosis_report import write_diagnosis_report
from rsea_core.case import Case, read_case
from rsea_core.csv_columns import write_columns
from rsea_core.curve_file import read_spring_curve
from rsea_core.identify.account import account
from rsea_core.identify.diagnose import diagnose
from rsea_core.identify.next_step import FILE as NEXT
from rsea_core.identify.next_step import as_entry, decisive_experiment
from rsea_core.identify.spring_account import spring_account
from rsea_core.identify.spring_next import next_loop
from rsea_core.identify.spring_outcome import diagnose_bench, is_spring_bench
from rsea_core.identify.steady_diagnosis import diagnose_map
from rsea_core.identify.steady_map import is_steady_map
from rsea_core.model_file import model_to_toml
from rsea_core.terms import SpringCurve

FILES = ("diagnosis.json", "model.toml", "report.html")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("case", type=Path, metavar="CASE", help="folder with a rig.toml")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for the files")
    parser.add_argument(
        "--fe",
        metavar="DESIGN",
        help="of a spring's bench: a design to solve, or a curve as CSV, to compare with",
    )
    speed = parser.add_mutually_exclusive_group()
    speed.add_argument("--quick", action="store_true", help="one effect, coarse steps")
    speed.add_argument("--thorough", action="store_true", help="finer steps, more starts")
    parser.add_argument("--json", action="store_true", help="print the diagnosis as JSON")
    parser.add_argument("--force", action="store_true", help="overwrite existing files")
    parser.add_argument("-v", "--verbose", action="store_true", help="say what is tried")


def run(arguments: argparse.Namespace) -> int:
    """Read, diagnose, write."""
    case = read_case(arguments.case)
    paths: dict[str, Path] = {}
    if arguments.out is not None:
        folder = prepare_folder(arguments.out)
        paths = {name: folder / name for name in FILES}
        refuse_existing(list(paths.values()), force=arguments.force)
    if is_spring_bench(case):
        return _bench(case, arguments, paths)
    if arguments.fe is not None:
        raise DftfsError(
            f"--fe {arguments.fe}: {case.name} is no spring's bench: that has torque_Nm against"
            " deflection, quasi-static or without anything that moves"
        )
    if is_steady_map(case):
        return _steady_map(arguments, case, paths)
    found = diagnose(
        case,
        quick=arguments.quick,
        thorough=arguments.thorough,
        say=progress() if arguments.verbose else silent,
    )
    experiment = decisive_experiment(found.outcome)
    document = found.document | {"next_experiment": as_entry(experiment)}
    if paths:
        write_text(paths["diagnosis.json"], to_json(document))
        write_text(paths["model.toml"], found.model.to_toml())
        command = f"dftfs diagnose {arguments.case}"
        shown = account(found, experiment=experiment, command=command)
        write_diagnosis_report(page_from(shown), paths["report.html"])
    if paths and experiment is not None:
        paths["next.csv"] = write_columns(folder / NEXT, experiment.columns)
        text = experiment.recording_toml(NEXT)
        paths["next.toml"] = write_text(folder / "next.toml", text)
    lines = [f"{document['verdict']}: {document['summary']}"]
    lines += [f"note: {finding}" for finding in document["findings"]]
    lines += [f"record next: {experiment.sentence}"] if experiment is not None else []
    lines += [str(path) for path in paths.values()]
    emit(document, "\n".join(lines), as_json=arguments.json)
    return 0


def _steady_map(arguments: argparse.Namespace, case: Case, paths: dict[str, Path]) -> int:
    """Diagnose and write a map of steady speeds."""
    found = diagnose_map(case)
    document = found.document
    if paths:
        write_text(paths["diagnosis.json"], to_json(document))
        write_text(paths["model.toml"], found.model.to_toml())
        write_diagnosis_report(page_from(found.account), paths["report.html"])
        if found.next_columns is not None:
            folder = paths["report.html"].parent
            paths["next.csv"] = write_columns(folder / NEXT, found.next_columns)
    lines = [f"{document['verdict']}: {document['summary']}"]
    lines += [f"note: {finding}" for finding in document["findings"]]
    if document["next_experiment"] is not None:
        lines.append(f"record next: {document['next_experiment']['sentence']}")
    lines += [str(path) for path in paths.values()]
    emit(document, "\n".join(lines), as_json=arguments.json)
    return 0


def _bench(case: Case, arguments: argparse.Namespace, paths: dict[str, Path]) -> int:
    """A spring against its design, from its loops."""
    say = progress() if arguments.verbose or arguments.fe is not None else silent
    design = None if arguments.fe is None else read_fe(arguments.fe, say)
    outcome = diagnose_bench(case, design)
    loop = next_loop(outcome)
    document = outcome.document() | {"next_experiment": None if loop is None else loop.entry}
    if paths:
        write_text(paths["diagnosis.json"], to_json(document))
        write_text(paths["model.toml"], model_to_toml(outcome.model()))
        command = f"dftfs diagnose {arguments.case}"
        command += "" if arguments.fe is None else f" --fe {arguments.fe}"
        shown = spring_account(outcome, document, command=command)
        write_diagnosis_report(page_from(shown), paths["report.html"])
    if paths and loop is not None:
        folder = paths["report.html"].parent
        paths["next.csv"] = write_columns(folder / NEXT, loop.columns)
        paths["next.toml"] = write_text(folder / "next.toml", loop.recording_toml)
    lines = [f"{document['verdict']}: {document['summary']}"]
    lines += [f"note: {finding}" for finding in document["findings"]]
    lines += [f"record next: {loop.sentence}"] if loop is not None else []
    lines += [str(path) for path in paths.values()]
    emit(document, "\n".join(lines), as_json=arguments.json)
    return 0


def read_fe(name: str, say: Callable[[str], None]) -> SpringCurve:
    """The curve that a spring should have: of a CSV file, or solved of a design."""
    if name.endswith(".csv"):
        return read_spring_curve(name)
    from dftfs.analysis.actuator import spring_curve
    from dftfs.analysis.torsion import solve_torsion
    from dftfs.analysis.torsion_problem import TorsionProblem

    design = load_design(name)
    problem = TorsionProblem(design=design, dimension=2)
    say(f"spring {design.name}: {problem.model}")
    return spring_curve(solve_torsion(problem, on_progress=say), f"{design.name}, {problem.model}")
