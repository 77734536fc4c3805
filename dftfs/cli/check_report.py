"""`dftfs check-report`: the command behind a page run again, its values compared."""

import argparse
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from dftfs.cli.common import emit, progress
from dftfs.errors import DftfsError
from dftfs.report.page_compare import compare
from dftfs.report.page_data import SUFFIX, draw_again, page_content

DROPPED = ("--pdf", "--force", "--resume", "--json", "-q", "--quiet")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument(
        "page", type=Path, metavar="PAGE.html", help="a page, its data in the same folder"
    )
    parser.add_argument(
        "--tolerance", type=float, default=1e-9, metavar="SHARE",
        help="numbers that differ by less are the same (default 1e-9)",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print the result as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Compare; exit status 1 if the page, a value or an input is another one.

    Raises
    ------
    DftfsError
        If the page or its data cannot be read, name no command, or the command fails.
    """
    page, data = arguments.page, arguments.page.with_suffix(SUFFIX)
    if not 0.0 <= arguments.tolerance < 1.0:
        raise DftfsError(f"--tolerance {arguments.tolerance}: must be from 0 to below 1")
    try:
        shown = page.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is no text"
        raise DftfsError(f"{page}: cannot be read: {reason}") from None
    if not data.is_file():
        raise DftfsError(f"{page}: its data, {data.name}, are not in the same folder")
    drawn = draw_again(data, page.parent)[1] == shown
    content = page_content(data)
    made = content.get("command")
    if not made:
        raise DftfsError(f"{data}: names no command; a page made by a Python program has none")
    with tempfile.TemporaryDirectory(prefix="dftfs-") as room:
        again = _run_again(made["arguments"], Path(made["folder"]), Path(room))
        found = compare(content["values"], page_content(again / data.name)["values"],
                        arguments.tolerance)  # fmt: skip
    good = drawn and not found.differing and not found.changed_inputs
    state = "is what its data say" if drawn else "is NOT what its data say: it was changed"
    lines = [f"{page}: {state}", f"ran again: dftfs {shlex.join(made['arguments'])}"]
    lines += [f"input changed since: {name}" for name in found.changed_inputs]
    lines += [f"{place}: {a}, now {b}" for place, a, b in found.differing[:10]]
    within = f"largest relative difference of the others {found.largest:.1e}"
    lines.append(f"{found.values} values, {len(found.differing)} differ; {within}")
    emit({"page_is_its_data": drawn, "command": made["arguments"], "comparison": found},
         "\n".join(lines), as_json=arguments.json)  # fmt: skip
    return 0 if good else 1


def _run_again(arguments: Sequence[str], folder: Path, room: Path) -> Path:
    """Run a command with another folder for its files; where they are."""
    if not folder.is_dir():
        raise DftfsError(f"{folder}: where the command ran, no longer exists")
    progress()(f"running dftfs {shlex.join(arguments)} in {folder}")
    call = [sys.executable, "-m", "dftfs", *elsewhere(arguments, room)]
    done = subprocess.run(call, cwd=folder, capture_output=True, text=True)
    if done.returncode not in (0, 1):
        reason = done.stderr.strip().rpartition("\n")[2]
        raise DftfsError(f"dftfs {shlex.join(arguments)}: status {done.returncode}: {reason}")
    return room


def elsewhere(arguments: Sequence[str], folder: Path) -> list[str]:
    """A command's arguments with another --out, and without what belongs to the first run."""
    kept, skip = [], False
    for word in arguments:
        if skip or word in DROPPED or word.startswith("--out="):
            skip = False
        elif word == "--out":
            skip = True
        else:
            kept.append(word)
    return [*kept, "--out", str(folder), "--force"]
