"""Where a page comes from: date, versions, and the content of every input as a hash."""

import hashlib
import os
import platform
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path

from dftfs import __version__


def provenance(inputs: Iterable[Path]) -> tuple[tuple[str, str], ...]:
    """Label and value of each fact; the date is `SOURCE_DATE_EPOCH` where that is set."""
    stated = os.environ.get("SOURCE_DATE_EPOCH", "")
    moment = datetime.fromtimestamp(int(stated), UTC) if stated.isdigit() else datetime.now(UTC)
    hashes = [(f"SHA-256 of {path.name}", _hash(path)) for path in inputs if path.is_file()]
    return (
        ("Made", f"{moment:%Y-%m-%d %H:%M} UTC by dftfs {__version__}"),
        (
            "Machine",
            f"{platform.system()} {platform.machine()}, Python {platform.python_version()}",
        ),
        *hashes,
    )


def case_provenance(case) -> tuple[tuple[str, str], ...]:
    """That of a case: its rig file and its recordings."""
    files = ["rig.toml", *dict.fromkeys(recording.file for recording in case.recordings)]
    return provenance([case.folder / file for file in files])


def _hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]
