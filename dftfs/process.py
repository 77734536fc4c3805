"""Manufacturing processes: the smallest gap, wall and inside radius, and how exact an edge is.

Read from ``data/processes.toml`` or a file of the same schema; every number carries its source.
"""

import difflib
import math
from dataclasses import dataclass, fields
from functools import cache
from importlib import resources
from pathlib import Path

from dftfs.errors import DesignError
from rsea_core.files.toml_tables import number, parse_toml, read_toml, table, word

_LIMITS = ("gap", "wall", "inside_radius", "edge_tolerance")
_TAPER = ("taper_least", "taper_most")
_REQUIRED = ("description", *(f"{name}_mm" for name in _LIMITS), "source")


@dataclass(frozen=True, kw_only=True)
class Process:
    """Limits of a process; each is the larger of a fixed part and a share of the part's width.

    ``edge_tolerance``: how far, either way, a cut edge may lie from where it was drawn (here the
    share adds to the fixed part). ``taper_least``, ``taper_most``: between them
    lies how much further one end of a cut is from where it was drawn than the other, on top of
    that; 0 where none is stated.

    Raises
    ------
    DesignError
        If a number is negative or not finite.
    """

    name: str
    description: str
    gap_m: float
    wall_m: float
    inside_radius_m: float
    edge_tolerance_m: float
    gap_per_width: float = 0.0
    wall_per_width: float = 0.0
    inside_radius_per_width: float = 0.0
    edge_tolerance_per_width: float = 0.0
    taper_least_m: float = 0.0
    taper_most_m: float = 0.0
    note: str = ""
    sources: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, float) and not (math.isfinite(value) and value >= 0):
                raise DesignError(f"process {self.name}: {field.name} = {value} must be 0 or more")

    def smallest_gap_m(self, width_m: float) -> float:
        """Smallest gap between two edges of a part of this width."""
        return max(self.gap_m, self.gap_per_width * width_m)

    def smallest_wall_m(self, width_m: float) -> float:
        """Thinnest wall."""
        return max(self.wall_m, self.wall_per_width * width_m)

    def smallest_inside_radius_m(self, width_m: float) -> float:
        """Smallest radius of an inside corner."""
        return max(self.inside_radius_m, self.inside_radius_per_width * width_m)

    def edge_tolerance_at_m(self, width_m: float) -> float:
        """How far an edge may lie from where it was drawn, either way."""
        return self.edge_tolerance_m + self.edge_tolerance_per_width * width_m


@cache
def builtin_processes() -> tuple[Process, ...]:
    """Every process of the built-in table."""
    text = resources.files("dftfs").joinpath("data", "processes.toml").read_text(encoding="utf-8")
    return _processes(parse_toml(text, "processes.toml", DesignError), "processes.toml")


def find_process(name: str, file: Path | None = None) -> Process:
    """A process by name, from a file of the same schema where one is given.

    Raises
    ------
    DesignError
        If the file cannot be used or the name is unknown.
    """
    known = {process.name: process for process in (_read(file) if file else builtin_processes())}
    if name not in known:
        near = difflib.get_close_matches(name, known, n=1)
        hint = f"did you mean {near[0]}? " if near else ""
        raise DesignError(f"process {name!r} is unknown; {hint}known are {', '.join(known)}")
    return known[name]


def _read(file: Path) -> tuple[Process, ...]:
    return _processes(read_toml(file, DesignError), str(file))


def _processes(document: dict, origin: str) -> tuple[Process, ...]:
    entries = document.get("processes")
    if not isinstance(entries, dict) or not entries:
        raise DesignError(f"{origin}: no [processes.<name>] table")
    return tuple(
        _process(name, entry, f"{origin}: process {name}") for name, entry in entries.items()
    )


def _process(name: str, entry: dict, where: str) -> Process:
    shares = tuple(f"{limit}_per_width" for limit in _LIMITS)
    lengths = tuple(f"{name}_mm" for name in (*_LIMITS, *_TAPER))
    known = (*_REQUIRED, *shares, *lengths[-len(_TAPER) :], "note")
    table(entry, where, DesignError)
    for key in entry:
        if key not in known:
            raise DesignError(f"{where}: unknown key {key!r}; known are {', '.join(known)}")
    for key in _REQUIRED:
        if key not in entry:
            raise DesignError(f"{where}: {key} is missing")
    sources = table(entry["source"], f"{where}: source", DesignError)
    for key in ("description", "note"):
        word(entry.get(key, ""), f"{where}: {key}", DesignError)
    values: dict[str, float] = {}
    for key in entry.keys() & {*shares, *lengths}:
        value = number(entry[key], f"{where}: {key}", DesignError)
        if not word(sources.get(key, ""), f"{where}: source of {key}", DesignError):
            raise DesignError(f"{where}: {key} has no source")
        length = key.endswith("_mm")
        values[f"{key[:-3]}_m" if length else key] = value * 1e-3 if length else value
    return Process(
        name=name,
        description=entry["description"],
        note=entry.get("note", ""),
        sources=tuple(sources.items()),
        **values,
    )
