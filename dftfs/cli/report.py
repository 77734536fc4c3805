"""`dftfs report`: the pages of a result folder drawn again from their data."""

import argparse
from pathlib import Path

from dftfs.cli.common import emit
from dftfs.cli.output import add_pdf, prepared, print_page
from dftfs.errors import DftfsError
from dftfs.files import write_text
from dftfs.report.page_data import SUFFIX, draw_again


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="folder of a result")
    parser.add_argument("--out", type=Path, metavar="DIR", help="another folder for the pages")
    add_pdf(parser)
    parser.add_argument("--json", action="store_true", help="print the result as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Draw every page of the folder; all are drawn before one is replaced.

    Raises
    ------
    DftfsError
        If the folder has no page's data, a file of it cannot be read, or nothing prints a PDF.
    """
    folder = arguments.folder
    if not folder.is_dir():
        raise DftfsError(
            f"{folder}: is no folder; give the one into which a command wrote its files"
        )
    found = sorted(folder.glob(f"*{SUFFIX}"))
    if not found:
        raise DftfsError(
            f"{folder}: has no data of a page (*{SUFFIX}); study, simulate, compare, diagnose,"
            " import and doctor write them beside their pages"
        )
    out = folder if arguments.out is None else prepared(arguments, arguments.out)
    pages = [draw_again(path, out) for path in found]
    written = [write_text(out / name, text) for name, text in pages]
    written += [pdf for page in written for pdf in print_page(arguments, page)]
    emit({"pages": written}, "\n".join(map(str, written)), as_json=arguments.json)
    return 0
