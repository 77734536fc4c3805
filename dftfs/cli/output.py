"""Where the commands write without --out."""

import argparse
import os
from collections.abc import Iterable
from pathlib import Path

from dftfs.cli.common import progress
from dftfs.files import prepare_folder
from dftfs.report.pdf import browser, write_pdf


def output_folder(arguments: argparse.Namespace, name: str) -> Path | None:
    """The folder for the files, made: --out, else a new one below `out/`, said in one line.

    With --json and without --out nothing is written: the result is on standard output.

    Raises
    ------
    OutputError
        If it cannot be made or written to.
    """
    folder = arguments.out
    if folder is None:
        if arguments.json:
            return None
        folder = default_folder(arguments, name)
        progress()(f"files go to {folder} (--out chooses another folder)")
    return prepared(arguments, folder)


def prepared(arguments: argparse.Namespace, folder: Path) -> Path:
    """A folder that files can be written into; a command that fails removes one that it made.

    Raises
    ------
    OutputError
        If it cannot be made or written to.
    """
    if not folder.exists():
        arguments.made_folder = folder
    return prepare_folder(folder)


def default_folder(arguments: argparse.Namespace, name: str) -> Path:
    """`out/NAME`, numbered so that it is new; the last one of them with --force or --resume.

    The environment's `DFTFS_OUT` takes the place of `out`.
    """
    top, count = Path(os.environ.get("DFTFS_OUT") or "out"), 1
    last = folder = top / name
    while folder.exists():
        last, count = folder, count + 1
        folder = top / f"{name}-{count}"
    return last if arguments.force or getattr(arguments, "resume", False) else folder


class _Printed(argparse.Action):
    """--pdf: refused before any work where nothing prints."""

    def __call__(self, parser, namespace, values, option_string=None) -> None:
        browser()
        namespace.pdf = True


def add_pdf(parser: argparse.ArgumentParser) -> None:
    """--pdf, for `print_page`."""
    text = "also print the page as PDF (by an installed Chromium or Chrome)"
    parser.add_argument("--pdf", action=_Printed, nargs=0, default=False, help=text)


def print_page(arguments: argparse.Namespace, page: Path) -> list[Path]:
    """The PDF of a page, beside it, where --pdf asks for one.

    Raises
    ------
    DftfsError
        If the browser fails.
    """
    return [write_pdf(page)] if arguments.pdf else []


def write_result(
    arguments: argparse.Namespace, page: Path, title: str, text: str, pictures: Iterable[Path] = ()
) -> Path:
    """The page of a command that prints lines and tables, with the pictures that it has written."""
    from dftfs.report.result_page import write_result_page

    files = [Path(value) for value in vars(arguments).values() if isinstance(value, str | Path)]
    cases = [folder for folder in files if (folder / "rig.toml").is_file()]
    files += [path for folder in cases for path in sorted(folder.iterdir())]
    return write_result_page(
        page, title=title, kicker=arguments.parser.prog, text=text, pictures=pictures, inputs=files
    )
