"""`dftfs parts`: CAD files and drawings of several designs; `parts list`: the library of parts."""

import argparse

from dftfs.cli.common import add_author, add_output, emit, progress, table
from dftfs.cli.output import default_folder
from dftfs.design import load_design
from dftfs.part_library import find, parts

_REFERENCE = ("al1", "al2", "ss", "ti")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "designs", nargs="*", default=_REFERENCE, metavar="DESIGN",
        help="default al1 al2 ss ti; `list`, then names or kinds: published motors, gears, springs",
    )  # fmt: skip
    add_author(parser)
    add_output(parser, folder=True)


def run(arguments: argparse.Namespace) -> int:
    """Write all parts and the manifest, or print parts of the library."""
    if arguments.designs[0] == "list":
        return _list(arguments)
    from dftfs.analysis.study.run import design_hash  # the library needs no CAD kernel
    from dftfs.cad.parts import write_parts

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


def _list(arguments: argparse.Namespace) -> int:
    """The whole library, a line each; of named parts the values and the source too."""
    found, lines = find(arguments.designs[1:]), []
    if len(found) == len(parts()):
        lines = [table(("kind", "name", "what"), [(p.kind, p.name, p.description) for p in found])]
        lines.append("`dftfs parts list NAME`: values and source; `dftfs new rig FILE --with NAME`")
    else:
        for part in found:
            lines += [f"{part.kind} {part.name}: {part.description}", f"  source: {part.source}"]
            lines += [f"  {field} = {value:g}" for field, value in part.values]
    emit(found, "\n".join(lines), as_json=arguments.json)
    return 0
