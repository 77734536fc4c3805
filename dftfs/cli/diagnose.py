"""`dftfs diagnose`: a case folder in, a diagnosis, its model and a report out."""

import argparse
from pathlib import Path

from dftfs.cli.common import emit, progress, silent
from dftfs.files import prepare_folder, refuse_existing, to_json, write_text
from rsea_core.case import read_case
from rsea_core.identify.diagnose import diagnose


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
        paths = {name: folder / name for name in ("diagnosis.json", "model.toml")}
        refuse_existing(list(paths.values()), force=arguments.force)
    found = diagnose(
        case,
        quick=arguments.quick,
        thorough=arguments.thorough,
        say=progress() if arguments.verbose else silent,
    )
    if paths:
        write_text(paths["diagnosis.json"], to_json(found.document))
        write_text(paths["model.toml"], found.model.to_toml())
    lines = [f"{found.document['verdict']}: {found.document['summary']}"]
    lines += [f"note: {finding}" for finding in found.document["findings"]]
    lines += [str(path) for path in paths.values()]
    emit(found.document, "\n".join(lines), as_json=arguments.json)
    return 0
