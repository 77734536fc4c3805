"""Finished searches of a comparison, a line each, so that an interrupted run loses none.

A line belongs to a comparison by the hash of the content of everything that decides its result,
files included; lines of another comparison, and what is no whole line, are passed over.
"""

import json
import os
from pathlib import Path

import numpy as np

from rsea_core.control.tuning.comparison import Comparison
from rsea_core.control.tuning.optimisers import Search
from rsea_core.errors import InputError
from rsea_core.numeric.content_hash import content_hash
from rsea_core.numeric.source_version import SOURCE_VERSION


class Checkpoint:
    """An append-only file of searches."""

    def __init__(self, path: Path, key: str):
        self.path, self.key = path, key

    @classmethod
    def open(cls, path: str | Path, comparison: Comparison) -> "Checkpoint":
        """The log of a comparison in a file, which need not exist yet."""
        budget = (comparison.method, comparison.population, comparison.generations)
        file = getattr(comparison.task.reference, "file", None)
        files = () if file is None else (Path(file),)
        try:
            key = content_hash(
                SOURCE_VERSION, comparison.task, comparison.controllers, budget, *files
            )
        except OSError as problem:
            raise InputError(f"{file}: cannot be read: {problem.strerror}") from problem
        return cls(Path(path), key[:16])

    def clear(self) -> None:
        """Forget everything."""
        self.path.unlink(missing_ok=True)

    def add(self, name: str, search: Search) -> None:
        """Append a finished search."""
        line = {
            "key": self.key,
            "name": name,
            "method": search.method,
            "seed": search.seed,
            "best": search.best.tolist(),
            "cost": search.cost,
            "history": search.history.tolist(),
            "evaluations": search.evaluations,
        }
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
                if line["key"] != self.key:
                    continue
                found[line["name"], line["seed"]] = Search(
                    method=line["method"],
                    seed=line["seed"],
                    best=np.array(line["best"], dtype=float),
                    cost=float(line["cost"]),
                    history=np.array(line["history"], dtype=float),
                    evaluations=line["evaluations"],
                )
            except (ValueError, TypeError, KeyError, RecursionError):
                continue  # not one of these lines, or not a whole one
        return found
