"""Writing files whole or not at all, and results as JSON."""

import dataclasses
import json
import math
import re
import tempfile
from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np

from dftfs.errors import DftfsError
from dftfs.staging import reason, sweep_stale, written_whole


class OutputError(DftfsError):
    """A folder or file that cannot be written."""


def prepare_folder(folder: Path) -> Path:
    """Make a folder if it is not there, and see that files can be written into it.

    Raises
    ------
    OutputError
        If it cannot be made or written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            sweep_stale(folder)
            return folder
    except OSError as error:
        raise OutputError(f"output folder {folder}: cannot be written: {reason(error)}") from None


def file_stem(name: str, taken: Collection[str] = ()) -> str:
    """A file's name, without its ending, that stands for any name: no folder, none twice.

    Letters, digits, "+", "-", "_" and "." stay; what follows a name that is taken is numbered.
    """
    plain = re.sub(r"[^\w.+-]+", "-", name).strip("-.")[:100] or "unnamed"
    stem, number = plain, 1
    while stem.lower() in {t.lower() for t in taken}:
        number += 1
        stem = f"{plain}-{number}"
    return stem


def refuse_existing(paths: list[Path], *, force: bool) -> None:
    """Stop before any work where a result would overwrite a file.

    Raises
    ------
    OutputError
        If one of the paths exists and ``force`` is not set, or is a folder.
    """
    for path in paths:
        if path.is_dir():
            raise OutputError(f"{path} is a folder; a file has to be written there")
        if path.exists() and not force:
            raise OutputError(
                f"{path} exists; use --force to overwrite it or --out to write to another folder"
            )


def write_text(path: Path, text: str) -> Path:
    """Write a text file through a temporary one beside it, renamed when complete.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    return write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, content: bytes) -> Path:
    """Write a file through a temporary one beside it, renamed when complete.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    try:
        with written_whole(path) as unfinished:
            unfinished.write_bytes(content)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {reason(error)}") from None
    return path


def as_plain(value: object) -> object:
    """A dataclass, array or mapping as JSON's own types; numbers that are not finite are null."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: as_plain(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {str(key): as_plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return as_plain(value.tolist())
    if isinstance(value, list | tuple | set | frozenset):
        return [as_plain(item) for item in value]
    if isinstance(value, np.bool_ | bool):
        return bool(value)
    if isinstance(value, np.integer):
        return int(value)
    if isinstance(value, np.floating | float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Path):
        return str(value)
    return value


def to_json(value: object) -> str:
    """Indented JSON of `as_plain`, ending with a newline."""
    return json.dumps(as_plain(value), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
