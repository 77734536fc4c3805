"""`dftfs parts`: CAD files, drawings and a manifest of several designs in one folder."""

import argparse

from dftfs.analysis.study.run import design_hash
from dftfs.cad.parts import write_parts
from dftfs.cli.common import add_author, add_output, emit, progress
from dftfs.cli.output import default_folder
from dftfs.design import load_design

_REFERENCE = ("al1", "al2", "ss", "ti")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "designs", nargs="*", default=_REFERENCE, metavar="DESIGN", help="default al1 al2 ss ti"
    )
    add_author(parser)
    add_output(parser, folder=True)


def run(arguments: argparse.Namespace) -> int:
    """Write all parts and the manifest."""
    designs = [load_design(source) for source in arguments.designs]
    record = write_parts(
        [(design, design_hash(design)) for design in designs],
        arguments.out or default_folder(arguments, "parts"),
        overwrite=arguments.force,
        author=arguments.author,
        on_progress=progress(),
    )
    lines = [
        f"{name}: {part['mass_kg'] * 1e3:.1f} g, {len(part['files'])} files, design"
        f" {part['design_hash']}"
        for name, part in record["parts"].items()
    ]
    emit(record, "\n".join(lines), as_json=arguments.json)
    return 0
