"""`dftfs doctor [CASE]`: this machine; or recordings, and which of their errors are noticed."""

import argparse
import os
from pathlib import Path

from dftfs import __version__
from dftfs.cli.common import emit, progress, table
from dftfs.cli.output import prepared

PAGE = "doctor.html"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("case", nargs="?", type=Path, metavar="CASE",
                        help="folder with a rig.toml; none: this machine")  # fmt: skip
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for the page")
    parser.add_argument("--no-slips", action="store_true", help="quality checks only")
    parser.add_argument("--force", action="store_true", help="overwrite existing files")
    parser.add_argument("--json", action="store_true", help="print the result as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Look at a case, or at this machine."""
    return _installation(arguments) if arguments.case is None else _recordings(arguments)


def _recordings(arguments: argparse.Namespace) -> int:
    """Look at every recording; corrupt copies; write the page."""
    from dftfs.files import refuse_existing
    from dftfs.report.page_data import write_page
    from dftfs.report.provenance import case_provenance
    from rsea_core.importing.doctor.health import health
    from rsea_core.importing.doctor.slip_catalogue import case_slips, try_slips
    from rsea_core.recordings.case import read_case
    from rsea_core.recordings.finding import grouped_sentences
    from rsea_core.recordings.quality_checks import data_warnings

    if arguments.out is not None:
        page = prepared(arguments, arguments.out) / PAGE
        refuse_existing([page], force=arguments.force)
    case = read_case(arguments.case, progress())
    lines = [line for r in case.recordings for line in health(case.rig, r)]
    findings = (*case.notes(), *data_warnings(case), *case_slips(case))
    notes = grouped_sentences(findings)
    results = ()
    if not arguments.no_slips:
        progress()("forty slips on copies of the first recordings")
        results = try_slips(case)
    noticed = [r for r in results if r.noticed]
    passing = [r for r in results if r.noticed is False]
    text = [line.sentence() for line in lines]
    text += [f"note: {note}" for note in dict.fromkeys(notes)]
    lead = [f"{len(dict.fromkeys(notes))} notes on these recordings: see Notes."] if notes else []
    if results:
        tried = len(noticed) + len(passing)
        lead.append(f"slips: {len(noticed)} of {tried} that apply would be detected")
        text.append(lead[-1])
        text += [f"would be taken for missing physics: {r.name}" for r in passing]
    if arguments.out is not None:
        rows = [(x.file, x.column, x.measure, x.text) for x in lines]
        states = {True: "noticed", False: "would pass", None: "does not apply"}
        rows += [("forty slips", r.name, states[r.noticed], r.text) for r in results]
        write_page(
            page, "recordings",
            title=f"{case.name}: health of its recordings",
            head=("recording", "column", "measure", "found"), rows=rows,
            notes=list(dict.fromkeys(notes)),
            recordings=[(r.file, r.time_s, {n: r[n] for n in r.columns if n != "time_s"})
                        for r in case.recordings],
            facts=case_provenance(case), lead=[f"{x[0].upper()}{x[1:]}" for x in lead],
        )  # fmt: skip
        text.append(str(page))
    value = {"health": lines, "notes": notes, "slips": results}
    emit(value, "\n".join(text), as_json=arguments.json)
    return 0


def _installation(arguments: argparse.Namespace) -> int:
    """What of this machine can be used, is missing or makes it slow, and versions."""
    from dftfs.analysis.jobs.store import user_store
    from dftfs.cli.extras import versions
    from dftfs.cli.machine_check import GOOD, checks

    found = checks(user_store(None).folder)
    libraries = {"dftfs": __version__, **versions()}
    less = [check for check in found if check.state != GOOD]
    rows = [(check.state, check.name, check.found) for check in found]
    text = table(("", "looked at", "found"), rows)
    text += "\n" + ", ".join(f"{name} {own}" for name, own in libraries.items())
    text += f"\n{len(found) - len(less)} of {len(found)} good"
    text += "".join(f"; {check.name}: {check.state}" for check in less)
    value = {"checks": found, "versions": libraries, "processors": os.cpu_count()}
    emit(value, text, as_json=arguments.json)
    return 0
