"""`dftfs diagnose`: a case folder in, a diagnosis, its model and a report out."""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from dftfs.cli.common import emit, progress
from dftfs.cli.fe_curve import read_fe
from dftfs.cli.output import add_pdf, output_folder, prepared, print_page
from dftfs.cli.own_effects import add_effects, load_own_effects
from dftfs.cli.progress_lines import now_and_then, still_working
from dftfs.staging import reason, staging_folder

if TYPE_CHECKING:  # what the work needs is imported by it: `--help` needs none of it
    from rsea_core.identify.result.diagnosis import Diagnosis
    from rsea_core.recordings.case import Case

REPORT = ("report.html", "report.page.npz")


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
    from rsea_core.identify.diagnose import diagnose
    from rsea_core.identify.result.diagnosis import DOCUMENT, MODEL, SOMETIMES
    from rsea_core.identify.result.document_text import headline, notes
    from rsea_core.identify.static_diagnosis import require_spring_bench
    from rsea_core.recordings.case import read_case

    load_own_effects(arguments, progress())
    case = read_case(arguments.case, progress())
    if arguments.fe is not None:
        require_spring_bench(case, f"--fe {arguments.fe}")
    paths: dict[str, Path] = {}
    if arguments.out is not None:  # a given folder is refused before the work, a new one made after
        folder = prepared(arguments, arguments.out)
        paths = {name: folder / name for name in (DOCUMENT, MODEL, *REPORT)}
        every = [*paths.values(), *(folder / name for name in SOMETIMES)]
        refuse_existing(every, force=arguments.force)
    design = None if arguments.fe is None else read_fe(arguments.fe, progress())
    say = progress() if arguments.verbose else now_and_then(progress())
    effort = {"quick": arguments.quick, "thorough": arguments.thorough}
    with still_working(progress()):
        found = diagnose(case, design=design, say=say, **effort)
    folder = output_folder(arguments, f"diagnose-{case.name}")
    if folder is not None:
        paths = write_files(found, folder, case)
        paths |= {pdf.name: pdf for pdf in print_page(arguments, paths[REPORT[0]])}
    lines = [headline(found.document), *notes(found.document), *map(str, paths.values())]
    emit(found.document, "\n".join(lines), as_json=arguments.json)
    return 0


def write_files(found: "Diagnosis", folder: Path, case: "Case | None" = None) -> dict[str, Path]:
    """Diagnosis, model, report, and the next experiment where there is one: all or none of them.

    They are moved together; files of an older diagnosis that this one does not have are removed.
    """
    from dftfs.files import OutputError
    from rsea_core.identify.result.diagnosis import DOCUMENT, MODEL, SOMETIMES, remove_older

    try:
        with staging_folder(folder) as made:
            found.save(made)
            _write_report(found, made / REPORT[0], case)
            every = (DOCUMENT, MODEL, *REPORT, *SOMETIMES)
            names = [name for name in every if (made / name).exists()]
            remove_older(folder, names)
            for name in names:
                (made / name).replace(folder / name)
    except OSError as error:
        raise OutputError(f"output folder {folder}: cannot be written: {reason(error)}") from None
    return {name: folder / name for name in names}


def _write_report(found: "Diagnosis", path: Path, case: "Case | None") -> None:
    from dftfs.report.diagnosis.page import page_from
    from dftfs.report.diagnosis.render import write_diagnosis_report
    from dftfs.report.provenance import case_provenance

    page = page_from(found.report_data())
    if case is not None:
        page = replace(page, facts=page.facts + case_provenance(case))
    if found.next_experiment is not None:
        page = replace(page, record_next=found.next_experiment["sentence"])
    write_diagnosis_report(page, path)
