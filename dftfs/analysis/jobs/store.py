"""Results kept by the content of what they were computed from: inputs, settings, code.

A key is the SHA-256 of a canonical JSON of all three, so a result is found again only by the same
question from the same code; nothing is ever out of date, and nothing needs to be locked. An
entry is one JSON file that appears whole or not at all (`dftfs.files.write_text`): whoever is
killed while writing leaves nothing behind that could be read. Taken from joblib's Memory and from
ccache: the key holds the code.
"""

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from dftfs.files import as_plain, prepare_folder, to_json, write_bytes, write_text

# what a solve runs through: everything below the commands and the reports
SOLVER_SOURCES = ("fem", "spring", "analysis")
_PACKAGES = ("numpy", "scipy", "numba", "scikit-fem", "gmsh", "pypardiso")


@cache
def code_version(sources: tuple[str, ...] = SOLVER_SOURCES) -> str:
    """Hash of some of the package's own sources and of the packages that it computes with.

    Comments count: a cache that is dropped once too often costs seconds, one that is kept once too
    often costs a wrong number.
    """
    digest = hashlib.sha256()
    root = Path(str(resources.files("dftfs")))
    for package in sources:
        for path in sorted((root / package).rglob("*.py")):
            digest.update(path.relative_to(root).as_posix().encode())
            digest.update(path.read_bytes())
    for package in _PACKAGES:
        try:
            digest.update(f"{package}=={version(package)}".encode())
        except PackageNotFoundError:
            digest.update(f"{package} absent".encode())
    return digest.hexdigest()[:16]


def content_key(content: Mapping) -> str:
    """SHA-256 (hexadecimal) of a mapping's canonical JSON: sorted names, floats to the last bit."""
    text = json.dumps(as_plain(content), sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


@dataclass(frozen=True, kw_only=True)
class ContentStore:
    """A folder of JSON entries by key. Several processes may read and write it at once."""

    folder: Path

    def path(self, key: str) -> Path:
        """Where an entry is or would be."""
        return self.folder / key[:2] / f"{key}.json"

    def get(self, key: str) -> dict | None:
        """The entry's value; None if there is none, or what is there cannot be read as one."""
        try:
            entry = json.loads(self.path(key).read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError, json.JSONDecodeError):
            return None
        whole = isinstance(entry, dict) and entry.get("key") == key
        return entry["value"] if whole and isinstance(entry.get("value"), dict) else None

    def put(self, key: str, value: Mapping) -> None:
        """Keep a value; an entry of the same key is replaced.

        Raises
        ------
        OutputError
            If the folder cannot be written.
        """
        path = self.path(key)
        prepare_folder(path.parent)
        write_text(path, to_json({"key": key, "value": value}))

    def made(self, key: str, make: Callable[[], bytes]) -> bytes:
        """The bytes kept under a key; made and kept where there are none, or not whole."""
        path = self.path(key).with_suffix(".bin")
        try:
            digest, content = path.read_bytes().split(b"\n", 1)
            if hashlib.sha256(content).hexdigest().encode() == digest:
                return content
        except (OSError, ValueError):
            pass  # nothing there, or cut short: made again
        content = make()
        prepare_folder(path.parent)
        write_bytes(path, hashlib.sha256(content).hexdigest().encode() + b"\n" + content)
        return content


def user_store(folder: Path | None) -> ContentStore:
    """The store in a folder, made if missing; by default in the user's cache folder (XDG).

    Raises
    ------
    OutputError
        If the folder cannot be written.
    """
    if folder is None:
        root = os.environ.get("XDG_CACHE_HOME", "")
        folder = (Path(root) if root else Path.home() / ".cache") / "dftfs"
    return ContentStore(folder=prepare_folder(folder))
