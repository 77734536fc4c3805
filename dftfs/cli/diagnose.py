"""`dftfs diagnose`: a case folder in, a diagnosis, its model and a report out."""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from dftfs.cli.common import emit, progress
from dftfs.cli.diagnose_routes import Result, moving_machine, spring_bench, steady_map
from dftfs.cli.output import add_pdf, output_folder, prepared, print_page
from dftfs.cli.own_effects import add_effects, load_own_effects
from dftfs.errors import DftfsError
from dftfs.staging import reason, staging_folder

if TYPE_CHECKING:  # what the work needs is imported by it: `--help` needs none of it
    from rsea_core.recordings.case import Case

FILES = ("diagnosis.json", "model.toml", "report.html", "report.page.npz")
NEXT, REMAINDER, NEXT_TOML = "next.csv", "remainder.csv", "next.toml"
SOMETIMES = (NEXT, REMAINDER, NEXT_TOML)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("case", type=Path, metavar="CASE", help="folder with a rig.toml")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for the files")
    parser.add_argument(
        "--fe",
        metavar="DESIGN",
        help="for a spring test bench: a design to solve, or a CSV curve, to compare with",
    )
    add_effects(parser)
    add_pdf(parser)
    speed = parser.add_mutually_exclusive_group()
    speed.add_argument(
        "--quick", action="store_true", help="fewer fits of fewer rows, brief report"
    )
    speed.add_argument("--thorough", action="store_true", help="finer steps, no limit of work")
    parser.add_argument("--json", action="store_true", help="print the diagnosis as JSON")
    parser.add_argument("--force", action="store_true", help="overwrite existing files")
    parser.add_argument("-v", "--verbose", action="store_true", help="print each fit as it is made")


def run(arguments: argparse.Namespace) -> int:
    """Read, diagnose, write."""
    from dftfs.files import refuse_existing
    from rsea_core.identify.spring_bench.diagnose import is_spring_bench
    from rsea_core.recordings.case import read_case

    load_own_effects(arguments, progress())
    case = read_case(arguments.case, progress())
    bench = is_spring_bench(case)
    if arguments.fe is not None and not bench:
        raise DftfsError(
            f"--fe {arguments.fe}: {case.name} is no spring test bench; that records torque_Nm"
            " against deflection, quasi-statically or without a moving machine"
        )
    paths: dict[str, Path] = {}
    if arguments.out is not None:  # a given folder is refused before the work, a new one made after
        folder = prepared(arguments, arguments.out)
        paths = {name: folder / name for name in FILES}
        every = [folder / name for name in (*FILES, *SOMETIMES)]
        refuse_existing(every, force=arguments.force)
    found = _route(case, bench, arguments)
    folder = output_folder(arguments, f"diagnose-{case.name}")
    if folder is not None:
        paths = write_files(found, folder, case)
        paths |= {pdf.name: pdf for pdf in print_page(arguments, paths["report.html"])}
    document = found.document
    lines = [f"{document['verdict']}: {document['summary']}"]
    lines += [f"note: {finding}" for finding in document["findings"]]
    if document["next_experiment"] is not None:
        lines.append(f"record next: {document['next_experiment']['sentence']}")
    lines += [str(path) for path in paths.values()]
    emit(document, "\n".join(lines), as_json=arguments.json)
    return 0


def _route(case: "Case", bench: bool, arguments: argparse.Namespace) -> Result:
    from rsea_core.identify.steady_map.points import is_steady_map

    steady = not bench and is_steady_map(case)
    return (spring_bench if bench else steady_map if steady else moving_machine)(case, arguments)


def write_files(found: Result, folder: Path, case: "Case | None" = None) -> dict[str, Path]:
    """Diagnosis, model, report, and the next experiment where there is one: all or none of them.

    They are written to a temporary folder and moved together; files of an older diagnosis that this
    one does not have are removed.
    """
    from dftfs.files import OutputError

    try:
        with staging_folder(folder) as made:
            _make(found, made, case)
            names = [name for name in (*FILES, *SOMETIMES) if (made / name).exists()]
            for name in SOMETIMES:
                if name not in names:
                    (folder / name).unlink(missing_ok=True)
            for name in names:
                (made / name).replace(folder / name)
    except OSError as error:
        raise OutputError(f"output folder {folder}: cannot be written: {reason(error)}") from None
    return {name: folder / name for name in names}


def _make(found: Result, made: Path, case: "Case | None") -> None:
    """Every file of a diagnosis in a folder of their own."""
    from dftfs.files import to_json, write_text
    from dftfs.report.diagnosis.page import page_from
    from dftfs.report.diagnosis.render import write_diagnosis_report
    from dftfs.report.provenance import case_provenance
    from rsea_core.files.csv_columns import write_columns

    write_text(made / "diagnosis.json", to_json(found.document))
    write_text(made / "model.toml", found.model_toml)
    if found.columns is not None:
        write_columns(made / NEXT, found.columns)
    if found.remainder is not None:
        write_columns(made / REMAINDER, found.remainder)
    if found.recording_toml is not None:
        write_text(made / NEXT_TOML, found.recording_toml)
    page = page_from(found.shown())
    if case is not None:
        page = replace(page, facts=page.facts + case_provenance(case))
    if found.document["next_experiment"] is not None:
        page = replace(page, record_next=found.document["next_experiment"]["sentence"])
    write_diagnosis_report(page, made / "report.html")
