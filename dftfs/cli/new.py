"""`dftfs new`: a commented file to start from; each is one that the package itself runs."""

import argparse
import re
from collections.abc import Sequence
from importlib import resources
from pathlib import Path

from dftfs.errors import DftfsError
from dftfs.files import prepare_folder, refuse_existing, write_text
from dftfs.part_library import Part, find, rig_values
from rsea_core.files.toml_tables import file_name, toml_string

STARTS = {
    "design": ("dftfs", "data/designs/al1.toml", "dftfs study"),
    "rig": ("rsea_core", "data/rsea-bench.toml", "dftfs diagnose"),
    "scenario": ("dftfs", "examples/torque-1hz.toml", "dftfs simulate"),
    "comparison": ("dftfs", "examples/compare-torque-worm.toml", "dftfs compare"),
    "task": ("dftfs", "data/sizing/default.toml", "dftfs size"),
}
RECORDINGS = """
# The recordings of a case, in the order in which they were made; the files lie beside this one and
# the folder is what `dftfs diagnose` takes. Columns: docs/recordings.md.
# [[recording]]
# file = "recording-1.csv"
# role = "identification"       # or "validation": only reported on
# load = "pendulum"             # or "locked", "free", "contact", "imposed"
# description = "chirp, 0.2 to 20 Hz"
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("kind", choices=STARTS, help="what the file describes")
    parser.add_argument("file", type=Path, metavar="FILE.toml", help="file to write")
    parser.add_argument(
        "--ask", action="store_true", help="fill a sizing task or a design from six answers"
    )
    parser.add_argument("--with", nargs="+", default=[], dest="parts", metavar="PART",
                        help="rig: its motor, gear or spring, from `dftfs parts list`")  # fmt: skip
    parser.add_argument("--force", action="store_true", help="overwrite an existing file")


def run(arguments: argparse.Namespace) -> int:
    """Write the file and say which command takes it."""
    path = arguments.file
    if path.suffix != ".toml":
        raise DftfsError(f"{path}: the name has to end with .toml")
    name = file_name(path.stem, "the file's name", DftfsError)
    if arguments.parts and arguments.kind != "rig":
        raise DftfsError(f"--with {arguments.parts[0]}: only a rig is made with parts")
    chosen = find(arguments.parts) if arguments.parts else ()
    refuse_existing([path], force=arguments.force)
    prepare_folder(path.parent)
    package, place, command = STARTS[arguments.kind]
    if arguments.ask:
        from dftfs.cli.new_answers import asked, filled

        write_text(path, filled(arguments.kind, name, asked(arguments.kind)))
        print(path)
        print(f"next: {command} {path}")
        return 0
    text = resources.files(package).joinpath(place).read_text(encoding="utf-8")
    text = re.sub(r'(?m)^name = "[^"]*"', lambda _: f"name = {toml_string(name)}", text, count=1)
    text = _with_parts(text, chosen)
    text += RECORDINGS if arguments.kind == "rig" else ""
    write_text(
        path, f"# Made by `dftfs new {arguments.kind}`; every value is one to change.\n{text}"
    )
    print(path)
    takes = path.parent if arguments.kind == "rig" else path
    print(f"next: {command} {takes}")
    return 0


def _with_parts(text: str, chosen: Sequence[Part]) -> str:
    """A rig file with the values of parts; what they do not state is taken out, and said."""
    for field, value in rig_values(chosen).items():
        line = f"{field} = {value!r}" if value is not None else f"# {field}: not stated, yours?"
        text = re.sub(rf"(?m)^{field} = .*$", line, text, count=1)
    if not chosen:
        return text
    named = "".join(f"# {p.kind}: {p.name}, {p.description}. Source: {p.source}\n" for p in chosen)
    return f"{named}# The rest is the thesis' bench.\n{text[text.index('[rig]') :]}"
