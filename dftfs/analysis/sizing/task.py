"""What a spring is sized for: targets, limits, and the grid of dimensions that may be chosen.

Read from TOML (``data/sizing/*.toml`` or a user's file), in millimetres; kept in SI.
"""

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from importlib import resources
from pathlib import Path

from dftfs.design import Requirements, SpringDesign
from dftfs.errors import DesignError
from dftfs.material import Material, lookup
from dftfs.process import Process, find_process
from dftfs.spring.centreline import CENTRELINES
from dftfs.spring.parameters import SpiralParameters
from rsea_core.files.toml_tables import (
    nearest,
    number,
    parse_toml,
    read_toml,
    require_known,
    short,
    table,
    word,
)

OBJECTIVES = ("mass", "stress", "travel")
SEARCHED = ("thickness_mm", "inner_radius_mm", "outer_radius_mm", "turns", "fillet_radius_mm")
_VARIABLES = (*SEARCHED, "width_mm")
_NUMBERS = (
    "stiffness_Nm_per_rad",
    "stiffness_tolerance_percent",
    "contact_free_torque_Nm",
    "operating_torque_Nm",
    "min_safety_factor_yield",
    "envelope_mm",
    "tip_radius_mm",
    "ring_wall_mm",
    "n_arms",
)
_WORDS = ("material", "process", "objective")
_OPTIONAL = {
    "ring_wall_mm": None,
    "compare": [],
    "centreline": "fermat",
    "operating_torque_Nm": None,
}
_MOST_STEPS = 100_000


@dataclass(frozen=True, kw_only=True)
class Grid:
    """Values that a dimension may take: from ``low`` in steps of ``increment`` up to ``high``."""

    name: str
    low: float
    high: float
    increment: float

    def __post_init__(self) -> None:
        numbers = (self.low, self.high, self.increment)
        if not (all(map(math.isfinite, numbers)) and self.high >= self.low > 0):
            raise DesignError(f"{self.name}: 0 < minimum <= maximum, not {self.low}, {self.high}")
        if not self.increment > 0 or (self.high - self.low) / self.increment > _MOST_STEPS:
            raise DesignError(
                f"{self.name}: increment {self.increment:g} must be positive, and not a hundred"
                f" thousandth of the range {self.low:g} to {self.high:g}"
            )

    @property
    def steps(self) -> int:
        """Number of the last value, the first being 0."""
        return math.floor((self.high - self.low) / self.increment + 1e-9)

    def value(self, index: int) -> float:
        """Value by its number, without the round-off of many steps."""
        return round(self.low + index * self.increment, 9)

    def nearest(self, value: float) -> int:
        """Number of the nearest value inside the bounds."""
        return min(max(round((value - self.low) / self.increment), 0), self.steps)

    def holds(self, value: float) -> bool:
        """Whether a value is one of the grid's (errata S19 asks)."""
        off = abs(value - self.value(self.nearest(value)))
        return off <= 1e-6 * self.increment


@dataclass(frozen=True, kw_only=True)
class SizingTask:
    """Targets and limits of a sizing; lengths of the grids in mm as in the file."""

    name: str
    material: Material
    process: Process
    objective: str
    stiffness_Nm_per_rad: float
    stiffness_tolerance: float
    contact_free_torque_Nm: float
    operating_torque_Nm: float
    min_safety_factor_yield: float
    envelope_m: float
    n_arms: int
    tip_radius_m: float
    ring_wall_m: float | None
    grids: tuple[Grid, ...]
    centreline: str = "fermat"
    compare: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.centreline not in CENTRELINES:
            raise DesignError(
                f"centreline = {self.centreline!r} is unknown; known are {', '.join(CENTRELINES)}"
            )
        if self.objective not in OBJECTIVES:
            raise DesignError(
                f"objective = {self.objective!r} is unknown; known are {', '.join(OBJECTIVES)}"
            )
        for name in (
            "stiffness_Nm_per_rad",
            "stiffness_tolerance",
            "contact_free_torque_Nm",
            "operating_torque_Nm",
            "min_safety_factor_yield",
            "envelope_m",
        ):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0):
                raise DesignError(f"{name} = {getattr(self, name)} must be positive")
        if self.material.yield_strength_Pa is None:
            raise DesignError(
                f"material {self.material.name} has no yield strength to size for:"
                f" {self.material.no_strengths}"
            )

    @cached_property
    def by_name(self) -> Mapping[str, Grid]:
        """Grids by the name of their field."""
        return {grid.name: grid for grid in self.grids}

    @property
    def searched(self) -> tuple[Grid, ...]:
        """Grids of the planar dimensions; the width follows from the stiffness."""
        return tuple(self.by_name[name] for name in SEARCHED)

    @property
    def requirements(self) -> Requirements:
        """The task's targets as a design's requirements."""
        return Requirements(
            stiffness_Nm_per_rad=self.stiffness_Nm_per_rad,
            stiffness_tolerance=self.stiffness_tolerance,
            contact_free_torque_Nm=self.contact_free_torque_Nm,
            operating_torque_Nm=self.operating_torque_Nm,
            min_safety_factor_yield=self.min_safety_factor_yield,
        )

    def spiral(self, values_mm: Mapping[str, float]) -> SpiralParameters:
        """Planar parameters from the searched dimensions; rings as wide as the strip or as asked.

        Raises
        ------
        DesignError
            If the radii are out of order.
        """
        t, inner = values_mm["thickness_mm"], values_mm["inner_radius_mm"]
        outer = values_mm["outer_radius_mm"]
        wall = t if self.ring_wall_m is None else 1e3 * self.ring_wall_m
        lengths = {
            "inner_radius": inner,
            "outer_radius": outer,
            "thickness": t,
            "fillet_radius": values_mm["fillet_radius_mm"],
            "bore_radius": inner - wall,
            "hub_radius": inner,
            "rim_inner_radius": outer + t / 2,
            "rim_outer_radius": outer + t / 2 + wall,
        }
        return SpiralParameters(
            **{f"{name}_m": round(value * 1e-3, 12) for name, value in lengths.items()},
            turns=values_mm["turns"],
            n_arms=self.n_arms,
            tip_radius_m=self.tip_radius_m,
            curve=self.centreline,
        )

    def design(self, spiral: SpiralParameters, width_m: float, name: str) -> SpringDesign:
        """A design of this task's material and requirements."""
        return SpringDesign(
            name=name,
            spiral=spiral,
            width_m=width_m,
            material=self.material,
            requirements=self.requirements,
        )


def built_in_tasks() -> tuple[str, ...]:
    """Names of the tasks that come with the package."""
    folder = resources.files("dftfs") / "data" / "sizing"
    return tuple(sorted(item.name[:-5] for item in folder.iterdir() if item.name.endswith(".toml")))


def load_task(source: str, changes: Mapping[str, str]) -> SizingTask:
    """Read a task by name or file, with fields of [task] or [variables] replaced.

    A changed variable is one value, which fixes it, or ``min:max:increment``.

    Raises
    ------
    DesignError
        One line naming the file and the field.
    """
    if source in built_in_tasks():
        text = (resources.files("dftfs") / "data" / "sizing" / f"{source}.toml").read_text()
        document = parse_toml(text, f"task {source}", DesignError)
    elif not Path(source).suffix and not Path(source).exists():
        known = ", ".join(built_in_tasks())
        raise DesignError(f"task {source!r} is neither a file nor one of {known}")
    else:
        document = read_toml(source, DesignError)
    where = f"task {source}"
    require_known(document, ("task", "variables"), where, DesignError)
    task = dict(table(document.get("task", {}), "task", DesignError))
    variables = dict(table(document.get("variables", {}), "variables", DesignError))
    known = (*_NUMBERS, *_WORDS, *_VARIABLES, "centreline", "compare", "process_file")
    for key in (*task, *variables, *changes):
        if key not in known:
            raise DesignError(f"{where}: unknown field {key!r}; {nearest(key, known)}")
    for key, value in changes.items():
        (variables if key in _VARIABLES else task)[key] = value
    name = source if source in built_in_tasks() else Path(source).stem
    return _task(name, {**_OPTIONAL, **task}, variables, where)


def _task(name: str, task: dict, variables: dict, where: str) -> SizingTask:
    for key in (*_NUMBERS, *_WORDS):
        if key not in task:
            raise DesignError(f"{where}: {key} is missing")
    numbers = {key: _number(task[key], key, where) for key in _NUMBERS if task[key] is not None}
    if numbers["n_arms"] != int(numbers["n_arms"]):
        raise DesignError(f"{where}: n_arms = {task['n_arms']} must be a whole number")
    wall = numbers.get("ring_wall_mm")
    for key in (*_WORDS, "centreline", "process_file"):
        word(task.get(key, ""), f"{where}: {key}", DesignError)
    if not isinstance(task["compare"], list):
        raise DesignError(f"{where}: compare = {short(task['compare'])} must be a list of designs")
    compare = tuple(word(name, f"{where}: compare", DesignError) for name in task["compare"])
    file = Path(task["process_file"]) if "process_file" in task else None
    return SizingTask(
        name=name,
        material=lookup(str(task["material"])),
        process=find_process(str(task["process"]), file),
        objective=str(task["objective"]),
        stiffness_Nm_per_rad=numbers["stiffness_Nm_per_rad"],
        stiffness_tolerance=numbers["stiffness_tolerance_percent"] / 100,
        contact_free_torque_Nm=numbers["contact_free_torque_Nm"],
        operating_torque_Nm=numbers.get("operating_torque_Nm", numbers["contact_free_torque_Nm"]),
        min_safety_factor_yield=numbers["min_safety_factor_yield"],
        envelope_m=numbers["envelope_mm"] * 1e-3,
        n_arms=int(numbers["n_arms"]),
        tip_radius_m=numbers["tip_radius_mm"] * 1e-3,
        ring_wall_m=None if wall is None else wall * 1e-3,
        grids=tuple(_grid(key, variables, where) for key in _VARIABLES),
        centreline=str(task["centreline"]),
        compare=compare,
    )


def _grid(key: str, variables: dict, where: str) -> Grid:
    if key not in variables:
        raise DesignError(f"{where}: [variables] {key} is missing")
    given = variables[key]
    parts = given.split(":") if isinstance(given, str) else given
    parts = parts if isinstance(parts, list) else [parts]
    numbers = [_number(part, key, where) for part in parts]
    if len(numbers) == 1:
        return Grid(name=key, low=numbers[0], high=numbers[0], increment=1.0)
    if len(numbers) != 3:
        raise DesignError(f"{where}: {key} is one value or minimum, maximum, increment")
    return Grid(name=key, low=numbers[0], high=numbers[1], increment=numbers[2])


def _number(value: object, key: str, where: str) -> float:
    if isinstance(value, str):  # --set and the parts of 4:13:0.5 are text
        with suppress(ValueError):
            value = float(value)
    return number(value, f"{where}: {key}", DesignError)
