"""A hash of what an object holds, to the last bit: the key under which its results are kept."""

import dataclasses
import hashlib
import inspect
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np


def content_hash(*values: object) -> str:
    """SHA-256 (hexadecimal) of dataclasses, mappings, sequences, arrays, numbers, texts and files.

    A `Path` counts by the bytes of its file. A dataclass counts by its class and fields; of a class
    that is not this package's own, the source counts too, so that an edited law is another one.
    """
    digest = hashlib.sha256()
    for piece in _pieces(values):
        digest.update(len(piece).to_bytes(8, "little"))
        digest.update(piece)
    return digest.hexdigest()


def _pieces(value: object) -> Iterator[bytes]:
    kind = type(value)
    yield kind.__qualname__.encode()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        yield _source(kind)
        for field in dataclasses.fields(value):
            yield field.name.encode()
            yield from _pieces(getattr(value, field.name))
    elif isinstance(value, Mapping):
        for key in value:
            yield repr(key).encode()
            yield from _pieces(value[key])
    elif isinstance(value, list | tuple):
        yield str(len(value)).encode()
        for item in value:
            yield from _pieces(item)
    elif isinstance(value, np.ndarray):
        yield f"{value.dtype}{value.shape}".encode()
        yield np.ascontiguousarray(value).tobytes()
    elif isinstance(value, Path):
        yield value.read_bytes()
    else:
        yield repr(value).encode()


def _source(kind: type) -> bytes:
    if kind.__module__.partition(".")[0] == "rsea_core":
        return b""
    try:
        return inspect.getsource(kind).encode()
    except (OSError, TypeError):
        return b""
