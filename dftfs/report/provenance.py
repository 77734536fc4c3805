"""Where a page comes from: date, versions, and the content of every input as a hash."""

import hashlib
import os
import platform
import shlex
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path

from dftfs import __version__

_command: dict[str, object] | None = None


def record_command(arguments: Iterable[str] | None) -> None:
    """Remember the words after `dftfs` that pages are made by; None: by no command."""
    global _command
    given = None if arguments is None else {"arguments": list(arguments), "folder": str(Path.cwd())}
    _command = given


def recorded_command() -> dict[str, object] | None:
    """The words, and the folder where they were given; None outside of the command line."""
    return _command


def provenance(inputs: Iterable[Path]) -> tuple[tuple[str, str], ...]:
    """Label and value of each fact; the date is `SOURCE_DATE_EPOCH` where that is set."""
    stated = os.environ.get("SOURCE_DATE_EPOCH", "")
    moment = datetime.fromtimestamp(int(stated), UTC) if stated.isdigit() else datetime.now(UTC)
    ran = (
        [("Command", f"dftfs {shlex.join(map(_without_folders, _command['arguments']))}")]
        if (_command)
        else []
    )
    hashes = [(f"SHA-256 of {path.name}", _hash(path)) for path in inputs if path.is_file()]
    return (
        ("Made", f"{moment:%Y-%m-%d %H:%M} UTC by dftfs {__version__}"),
        (
            "Machine",
            f"{platform.system()} {platform.machine()}, Python {platform.python_version()}",
        ),
        *ran,
        *hashes,
    )


def case_provenance(case) -> tuple[tuple[str, str], ...]:
    """That of a case: its rig file and its recordings."""
    files = ["rig.toml", *dict.fromkeys(recording.file for recording in case.recordings)]
    return provenance([case.folder / file for file in files])


def _hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def _without_folders(argument: str) -> str:
    """An argument as a page shows it: of a path from the root its name, for pages are shared."""
    return Path(argument).name if os.path.isabs(argument) else argument
