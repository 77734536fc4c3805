"""`dftfs thesis`: the numbers that the thesis prints, recomputed, with a verdict."""

import argparse
from dataclasses import asdict
from pathlib import Path

from dftfs.analysis.jobs.store import user_store
from dftfs.analysis.torsion.batch_solve import MODELS
from dftfs.cli.common import add_output, emit, progress, table
from dftfs.cli.output import prepared, write_result
from dftfs.files import refuse_existing, write_bytes, write_text
from dftfs.thesis.figures import figure_list, thesis_figures
from dftfs.thesis.reproduction import Row, markdown, number, reproduce, summary
from rsea_core.control.fuzzy.thesis_rules import torque_table
from rsea_core.performance.thesis_tables import control_rows

LIST = "figures.md"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "--model", choices=MODELS, default="2d", help="model of the spring (default 2d)"
    )
    parser.add_argument(
        "--only",
        choices=("spring", "control"),
        help="only the tables of chapter 2, or those of chapters 4 and 5",
    )
    parser.add_argument("--cache", type=Path, metavar="DIR", help="folder of cached solves")
    parser.add_argument("--write", type=Path, metavar="FILE.md", help="also write the document")
    parser.add_argument("--page", type=Path, metavar="FILE.html", help="also write a page")
    parser.add_argument(
        "--figures", type=Path, metavar="DIR", help="also draw figures, and list why others are not"
    )
    parser.add_argument("--force", action="store_true", help="overwrite these files")
    add_output(parser, folder=False)


def run(arguments: argparse.Namespace) -> int:
    """Recompute all rows and print them."""
    if arguments.page is not None:
        refuse_existing([arguments.page], force=arguments.force)
    if arguments.write is not None:
        refuse_existing([arguments.write], force=arguments.force)
    if arguments.figures is not None:
        refuse_existing([prepared(arguments, arguments.figures) / LIST], force=arguments.force)
    say, rows = progress(), ()
    if arguments.only != "control":
        say(f"springs by the {arguments.model} model")
        rows += reproduce(model=arguments.model, store=user_store(arguments.cache))
    if arguments.only != "spring":
        say("controllers by simulation")
        rows += control_rows()
    if arguments.write is not None:
        write_text(arguments.write, markdown(rows, arguments.model))
    record = {
        "model": arguments.model,
        "summary": summary(rows),
        "rows": [{**asdict(row), "deviation": row.deviation} for row in rows],
    }
    text = _text(rows)
    if arguments.page is not None:
        write_result(arguments, arguments.page, "The thesis, recomputed", text)
    if arguments.figures is not None:
        drawn = thesis_figures(rows, torque_table("printed"), torque_table("corrected"))
        for name, figure in drawn.items():
            write_bytes(arguments.figures / f"{name}.png", figure.png or b"")
        write_text(arguments.figures / LIST, figure_list(list(drawn)))
    emit(record, text, as_json=arguments.json)
    return 0


def _text(rows: tuple[Row, ...]) -> str:
    header = ["table", "L", "number", "printed", "recomputed", "verdict", "erratum"]
    cells = [
        [
            row.table.split(" ")[0],
            str(row.line),
            row.what,
            number(row.printed, row.unit),
            number(row.recomputed, row.unit),
            row.verdict,
            row.errata,
        ]
        for row in rows
    ]
    counts = ", ".join(f"{count} {verdict}" for verdict, count in summary(rows).items())
    return "\n".join([table(header, cells), f"{len(rows)} numbers: {counts}"])
