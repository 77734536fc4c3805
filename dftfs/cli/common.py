"""What the commands share: the DESIGN argument, output options, progress, tables."""

import argparse
import os
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from dftfs.errors import DesignError

if TYPE_CHECKING:  # functions import it themselves: `--help` of a command needs no geometry
    from dftfs.design import SpringDesign


def add_design(parser: argparse.ArgumentParser) -> None:
    """DESIGN and --set."""
    from dftfs.built_in import built_in_names

    names = ", ".join(built_in_names())
    parser.add_argument(
        "design", nargs="?", default="al1", metavar="DESIGN", help=f"TOML file or one of {names}"
    )
    add_changes(parser, "change one field of the design, e.g. width_mm=10 (repeatable)")


def add_changes(parser: argparse.ArgumentParser, text: str) -> None:
    """--set, read by `changes`."""
    parser.add_argument(
        "--set", action="append", default=[], dest="changes", metavar="FIELD=VALUE", help=text
    )


def add_author(parser: argparse.ArgumentParser) -> None:
    """--author, for commands that write STEP files."""
    parser.add_argument(
        "--author", default="", metavar="NAME", help="author named in the STEP file"
    )


def add_output(parser: argparse.ArgumentParser, *, folder: bool) -> None:
    """--json, -v and, where the command writes files, --out and --force."""
    parser.add_argument("--json", action="store_true", help="print the result as JSON")
    parser.add_argument("-v", "--verbose", action="store_true", help="print more progress messages")
    if folder:
        parser.add_argument("--out", type=Path, metavar="DIR", help="folder for the files")
        parser.add_argument("--force", action="store_true", help="overwrite existing files")


def add_work(parser: argparse.ArgumentParser) -> None:
    """--jobs and --cache, for commands that solve much."""
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="number of processes")
    parser.add_argument("--cache", type=Path, metavar="DIR", help="folder of cached solves")


def read_design(arguments: argparse.Namespace) -> "SpringDesign":
    """The design that the arguments name, with their changes applied.

    Raises
    ------
    DesignError
        If a change is not FIELD=VALUE, or the design cannot be used.
    """
    from dftfs.design import load_design

    return load_design(arguments.design, changes(arguments))


def changes(arguments: argparse.Namespace) -> dict[str, str]:
    """What --set changes: field to value as text.

    Raises
    ------
    DesignError
        If a change is not FIELD=VALUE.
    """
    found = {}
    for change in arguments.changes:
        field, sign, value = change.partition("=")
        if not (sign and field.strip() and value.strip()):
            raise DesignError(f"--set {change}: write FIELD=VALUE, e.g. --set width_mm=10")
        found[field.strip()] = value.strip()
    return found


_quiet = False


def set_quiet(quiet: bool) -> None:
    """Whether `progress` prints nothing (--quiet)."""
    global _quiet
    _quiet = quiet


def progress(start: float | None = None) -> Callable[[str], None]:
    """A function that prints a line with the seconds since the start, on standard error."""
    if _quiet:
        return silent
    begun = time.perf_counter() if start is None else start

    def say(message: str) -> None:
        print(f"[{time.perf_counter() - begun:6.1f} s] {message}", file=sys.stderr, flush=True)

    return say


def silent(message: str) -> None:
    """A progress function that says nothing."""


def emit(value: object, text: str, *, as_json: bool) -> None:
    """Print the result: JSON or the text for people."""
    from dftfs.files import to_json

    print(to_json(value) if as_json else text, end="" if as_json else "\n")


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Rows of text in aligned columns."""
    widths = [max(len(str(r[k])) for r in (header, *rows)) for k in range(len(header))]
    lines = ["  ".join(str(c).ljust(w) for c, w in zip(row, widths)).rstrip() for row in rows]
    head = "  ".join(c.ljust(w) for c, w in zip(header, widths)).rstrip()
    return "\n".join([head, "  ".join("-" * w for w in widths), *lines])
