"""`dftfs diagnose`: a case folder in, a diagnosis, its model and a report out."""

import argparse
from pathlib import Path

from dftfs.cli.common import emit, progress, silent
from dftfs.files import prepare_folder, refuse_existing, to_json, write_text
from dftfs.report.diagnosis_page import page_from
from dftfs.report.diagnosis_report import write_diagnosis_report
from rsea_core.case import Case, read_case
from rsea_core.csv_columns import write_columns
from rsea_core.identify.account import account
from rsea_core.identify.diagnose import diagnose
from rsea_core.identify.next_step import FILE as NEXT
from rsea_core.identify.next_step import as_entry, decisive_experiment
from rsea_core.identify.steady_diagnosis import diagnose_map
from rsea_core.identify.steady_map import is_steady_map

FILES = ("diagnosis.json", "model.toml", "report.html")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("case", type=Path, metavar="CASE", help="folder with a rig.toml")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for the files")
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
