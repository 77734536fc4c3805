"""A hash of what a value holds: every number of every array, and the content of files it names."""

import hashlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path

import numpy as np


def content_hash(value: object) -> str:
    """32 hexadecimal digits; equal for equal content, whatever the `repr` shows of it."""
    digest = hashlib.sha256()
    _feed(digest, value)
    return digest.hexdigest()[:32]


def _feed(digest, value: object) -> None:
    if is_dataclass(value) and not isinstance(value, type):
        digest.update(f"<{type(value).__module__}.{type(value).__qualname__}".encode())
        for f in fields(value):
            digest.update(f"|{f.name}=".encode())
            own = getattr(value, f.name)
            _feed(digest, own)
            if f.name == "file" and isinstance(own, str) and Path(own).is_file():
                digest.update(Path(own).read_bytes())
    elif isinstance(value, np.ndarray):
        digest.update(f"<array {value.dtype} {value.shape}".encode())
        digest.update(np.ascontiguousarray(value).tobytes())
    elif isinstance(value, Mapping):
        digest.update(b"<mapping")
        for key in sorted(value, key=str):
            digest.update(f"|{key!r}=".encode())
            _feed(digest, value[key])
    elif isinstance(value, list | tuple):
        digest.update(f"<{type(value).__name__} {len(value)}".encode())
        for item in value:
            digest.update(b"|")
            _feed(digest, item)
    else:
        digest.update(f"<{type(value).__name__} {value!r}".encode())
    digest.update(b">")
