"""Documents as JSON text, and text files that appear whole or not at all."""

import json
import math
import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np


def as_plain(value: object) -> object:
    """Mappings, sequences and arrays as JSON's own types; numbers that are not finite are null."""
    if isinstance(value, Mapping):
        return {str(key): as_plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [as_plain(item) for item in value]
    if isinstance(value, np.ndarray | np.generic):
        return as_plain(value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value


def to_json(document: Mapping) -> str:
    """Indented JSON of `as_plain`, ending with a newline."""
    return json.dumps(as_plain(document), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def write_whole(path: str | Path, text: str) -> Path:
    """Write a text file through a temporary one beside it, renamed when complete.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    target = Path(path)
    unfinished = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        unfinished.write_bytes(text.encode("utf-8"))
        unfinished.replace(target)
    finally:
        unfinished.unlink(missing_ok=True)
    return target
