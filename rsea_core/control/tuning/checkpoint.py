"""Finished searches of a comparison, a line each, so that an interrupted run loses none.

A line belongs to a controller of a comparison by the hash of the content of everything that
decides its result, arrays and files included; lines of others, and what is no whole line, are
passed over.
"""

import json
import os
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path

import numpy as np

from rsea_core.control.tuning.comparison import ComparedController, Comparison
from rsea_core.control.tuning.search_record import Search
from rsea_core.errors import InputError
from rsea_core.numeric.content_hash import content_hash
from rsea_core.numeric.source_version import SOURCE_VERSION


class Checkpoint:
    """An append-only file of searches."""

    def __init__(self, path: Path, keys: dict[str, str]):
        self.path, self.keys = path, keys

    @classmethod
    def open(cls, path: str | Path, comparison: Comparison) -> "Checkpoint":
        """The log of a comparison in a file, which need not exist yet."""
        return cls(Path(path), {c.name: _key(comparison, c) for c in comparison.controllers})

    def clear(self) -> None:
        """Forget everything."""
        self.path.unlink(missing_ok=True)

    def add(self, name: str, search: Search) -> None:
        """Append a finished search."""
        found = {f.name: getattr(search, f.name) for f in fields(Search)}
        plain = {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in found.items()}
        line = {"key": self.keys[name], "name": name, **plain}
        with self.path.open("a+b") as file:
            if file.tell() > 0:  # a line that a kill cut short must not swallow this one
                file.seek(-1, os.SEEK_END)
                cut = file.read(1) != b"\n"
                file.write(b"\n" if cut else b"")
            file.write(json.dumps(line).encode() + b"\n")

    def done(self) -> dict[tuple[str, int], Search]:
        """The searches of this comparison by name and seed."""
        found: dict[tuple[str, int], Search] = {}
        if not self.path.exists():
            return found
        for text in self.path.read_bytes().splitlines():
            try:
                line = json.loads(text)
                if self.keys.get(line["name"]) != line["key"]:
                    continue
                values = {k: np.array(v) if isinstance(v, Sequence) and not isinstance(v, str)
                          else v for k, v in line.items() if k not in ("key", "name")}  # fmt: skip
                found[line["name"], line["seed"]] = Search(**values)
            except (ValueError, TypeError, KeyError, RecursionError):
                continue  # not one of these lines, or not a whole one
        return found


def _key(comparison: Comparison, compared: ComparedController) -> str:
    budget = (comparison.method, comparison.population, comparison.generations)
    own = (compared.controller, dict(compared.bounds))
    file = getattr(comparison.task.reference, "file", None)
    files = () if file is None else (Path(file),)
    try:
        return content_hash(SOURCE_VERSION, comparison.task, own, budget, *files)
    except OSError as problem:
        raise InputError(f"{file}: cannot be read: {problem.strerror}") from problem
