"""Finished searches of a comparison, a line each, so that an interrupted run loses none.

A line belongs to a comparison by the hash of everything that decides its result; lines of
another comparison, and a line that a kill cut short, are passed over.
"""

import hashlib
import json
from pathlib import Path

import numpy as np

from rsea_core.control.tuning.comparison import Comparison
from rsea_core.control.tuning.optimisers import Search
from rsea_core.numeric.source_version import SOURCE_VERSION


class Checkpoint:
    """An append-only file of searches."""

    def __init__(self, path: Path, key: str):
        self.path, self.key = path, key

    @classmethod
    def open(cls, path: str | Path, comparison: Comparison) -> "Checkpoint":
        """The log of a comparison in a file, which need not exist yet."""
        budget = (comparison.method, comparison.population, comparison.generations)
        said = repr((SOURCE_VERSION, comparison.task, comparison.controllers, budget))
        return cls(Path(path), hashlib.sha256(said.encode()).hexdigest()[:16])

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
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")

    def done(self) -> dict[tuple[str, int], Search]:
        """The searches of this comparison by name and seed."""
        found: dict[tuple[str, int], Search] = {}
        if not self.path.exists():
            return found
        for text in self.path.read_text(encoding="utf-8").splitlines():
            try:
                line = json.loads(text)
            except json.JSONDecodeError:
                continue
            if line.get("key") != self.key:
                continue
            found[line["name"], line["seed"]] = Search(
                method=line["method"],
                seed=line["seed"],
                best=np.array(line["best"]),
                cost=line["cost"],
                history=np.array(line["history"]),
                evaluations=line["evaluations"],
            )
        return found
