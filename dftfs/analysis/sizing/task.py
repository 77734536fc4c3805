"""What a spring is sized for: targets, limits, and the grid of dimensions that may be chosen.

Read from TOML (``data/sizing/*.toml`` or a user's file), in millimetres; kept in SI. Ranges that
a task does not state follow from its envelope and process (`dftfs.analysis.sizing.ranges`).
"""

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from importlib import resources
from pathlib import Path

from dftfs.analysis.sizing.grid import EXAMPLE, Grid
from dftfs.analysis.strength.fatigue_lives import rated_line
from dftfs.analysis.strength.fkm import SURFACE_OF_PROCESS
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
# what a task may leave free beyond the five: arms, rim over hub thickness, number of the material
FREE = ("n_arms", "taper", "material_number")
VARIABLES = (*SEARCHED, "outer_diameter_mm", "width_mm", "n_arms", "taper")
NUMBERS = (
    "stiffness_Nm_per_rad",
    "stiffness_tolerance_percent",
    "contact_free_torque_Nm",
    "operating_torque_Nm",
    "min_safety_factor_yield",
    "envelope_mm",
    "tip_radius_mm",
    "ring_wall_mm",
    "min_bore_mm",
    "max_mass_g",
    "max_scatter_percent",
    "min_lateral_N_per_mm",
    "max_inertia_kg_mm2",
    "equal_range_percent",
    "life_cycles",
    "survival_percent",
)
TEXT_KEYS = ("material", "process", "objective")
_OPTIONAL = {
    "objective": "mass",
    "stiffness_tolerance_percent": 1.0,
    "min_safety_factor_yield": 1.2,
    "survival_percent": 99.0,
    "compare": [],
    "centreline": "fermat",
}
_SMALLEST_mm, _LARGEST_mm = 1e-3, 1e6  # of an envelope


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
    tip_radius_m: float
    ring_wall_m: float | None
    grids: tuple[Grid, ...]
    materials: tuple[Material, ...] = ()
    min_bore_m: float | None = None
    max_mass_kg: float | None = None
    max_scatter: float | None = None
    min_lateral_N_per_m: float | None = None  # of the rim against the hub, in the plane
    max_inertia_kg_m2: float | None = None  # of the whole spring about its axis
    equal_range: float | None = None  # of both contact-free torques, difference over the larger
    life_cycles: float | None = None  # fully reversed, at the operating torque
    survival: float = 0.99
    centreline: str = "fermat"
    compare: tuple[str, ...] = ()
    load_all: bool = False  # also what cannot be made: to find how far its limits are off

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
            "min_bore_m",
            "max_mass_kg",
            "max_scatter",
            "min_lateral_N_per_m",
            "max_inertia_kg_m2",
            "equal_range",
            "life_cycles",
        ):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise DesignError(f"{name} = {value} must be positive")
        for material in self.materials or (self.material,):
            if material.yield_strength_Pa is None:
                raise DesignError(
                    f"material {material.name} has no yield strength to size for:"
                    f" {material.no_strengths}"
                )
            if self.life_cycles is not None:
                rated_line(
                    material, gradient_per_mm=0, surface=self.surface, survival=self.survival
                )
        self._check_envelope()

    def _check_envelope(self) -> None:
        """Ranges that leave no spring inside the envelope are a mistake, not a search."""
        across = 1e3 * self.envelope_m
        grid = self.by_name.get("outer_radius_mm")
        if grid is not None and not 2 * grid.low < across:
            raise DesignError(
                f"envelope_mm = {across:g} is less than twice outer_radius_mm's minimum"
                f" {grid.low:g}; without outer_radius_mm the range follows from the envelope"
            )
        inner = self.by_name["inner_radius_mm"].low
        if not 2 * inner < across:
            raise DesignError(
                f"envelope_mm = {across:g} is smaller than the hub, twice inner_radius_mm's"
                f" minimum {inner:g}; for example envelope_mm = {6 * inner:g}"
            )
        bore = 1e3 * (self.min_bore_m or 0.0)
        if not bore < across:
            raise DesignError(
                f"min_bore_mm = {bore:g} must be smaller than envelope_mm = {across:g},"
                f" for example min_bore_mm = {across / 8:g}"
            )
        made = self.process  # hub, strip and rim, with one gap, on either side of the bore
        least = bore + 2e3 * (3 * made.wall_m + made.gap_m)
        if not least < across:
            raise DesignError(
                f"envelope_mm = {across:g} leaves no room for hub, strip and rim around"
                f" min_bore_mm = {bore:g}; for example envelope_mm = {2 * least:.3g}"
            )

    @property
    def surface(self) -> str:
        """What the process leaves on the edges, by its class in the fatigue rules."""
        return SURFACE_OF_PROCESS.get(self.process.name, "as-cut")

    @cached_property
    def by_name(self) -> Mapping[str, Grid]:
        """Grids by the name of their field."""
        return {grid.name: grid for grid in self.grids}

    @property
    def searched(self) -> tuple[Grid, ...]:
        """Grids of the planar dimensions; the width follows from the stiffness."""
        names = ("outer_diameter_mm" if self._by_diameter else name for name in SEARCHED[2:3])
        order = (*SEARCHED[:2], *names, *SEARCHED[3:], *FREE)
        return tuple(self.by_name[name] for name in order if name in self.by_name)

    @property
    def _by_diameter(self) -> bool:
        return "outer_diameter_mm" in self.by_name

    def material_of(self, values: Mapping[str, float]) -> Material:
        """The material that a candidate's values name by its number, counted from 1."""
        many = self.materials or (self.material,)
        return many[int(values.get("material_number", 1)) - 1]

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
        taper = values_mm.get("taper", 1.0)
        rim = t * taper
        wall, rim_wall = (t, rim) if self.ring_wall_m is None else 2 * (1e3 * self.ring_wall_m,)
        if "outer_radius_mm" in values_mm:
            outer = values_mm["outer_radius_mm"]
        else:
            outer = values_mm["outer_diameter_mm"] / 2 - rim_wall - rim / 2
        lengths = {
            "inner_radius": inner,
            "outer_radius": outer,
            "thickness": t,
            "fillet_radius": values_mm["fillet_radius_mm"],
            "bore_radius": inner - wall,
            "hub_radius": inner,
            "rim_inner_radius": outer + rim / 2,
            "rim_outer_radius": outer + rim / 2 + rim_wall,
        }
        arms = self.by_name["n_arms"].low if "n_arms" in self.by_name else 2
        return SpiralParameters(
            **{f"{name}_m": round(value * 1e-3, 12) for name, value in lengths.items()},
            turns=values_mm["turns"],
            n_arms=int(values_mm.get("n_arms", arms)),
            tip_radius_m=self.tip_radius_m,
            curve=self.centreline,
            rim_thickness_m=None if taper == 1 else round(rim * 1e-3, 12),
        )

    def design(
        self, spiral: SpiralParameters, width_m: float, name: str, material: Material | None = None
    ) -> SpringDesign:
        """A design of this task's requirements and, unless another is given, its material."""
        return SpringDesign(
            name=name,
            spiral=spiral,
            width_m=width_m,
            material=material or self.material,
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
    known = (*NUMBERS, *TEXT_KEYS, *VARIABLES, "centreline", "compare", "process_file")
    for key in (*task, *variables, *changes):
        if key not in known:
            raise DesignError(f"{where}: unknown field {key!r}; {nearest(key, known)}")
    if "n_arms" in task:
        variables.setdefault("n_arms", task.pop("n_arms"))
    for key, value in changes.items():
        (variables if key in VARIABLES else task)[key] = value
    name = source if source in built_in_tasks() else Path(source).stem
    return _task(name, {**_OPTIONAL, **task}, variables, where)


def _task(name: str, task: dict, variables: dict, where: str) -> SizingTask:
    for key in ("stiffness_Nm_per_rad", "contact_free_torque_Nm", "envelope_mm", *TEXT_KEYS):
        if key not in task:
            raise DesignError(f"{where}: {key} is missing")
    numbers = {key: _number(task[key], key, where) for key in NUMBERS if task.get(key) is not None}
    for key in (*TEXT_KEYS, "centreline", "process_file"):
        if key != "material":
            word(task.get(key, ""), f"{where}: {key}", DesignError)
    if not isinstance(task["compare"], list):
        raise DesignError(f"{where}: compare = {short(task['compare'])} must be a list of designs")
    compare = tuple(word(name, f"{where}: compare", DesignError) for name in task["compare"])
    optional = {
        field: numbers[key] * factor if key in numbers else None
        for key, field, factor in (
            ("ring_wall_mm", "ring_wall_m", 1e-3),
            ("min_bore_mm", "min_bore_m", 1e-3),
            ("max_mass_g", "max_mass_kg", 1e-3),
            ("max_scatter_percent", "max_scatter", 1e-2),
            ("min_lateral_N_per_mm", "min_lateral_N_per_m", 1e3),
            ("max_inertia_kg_mm2", "max_inertia_kg_m2", 1e-6),
            ("equal_range_percent", "equal_range", 1e-2),
            ("life_cycles", "life_cycles", 1.0),
            ("survival_percent", "survival", 1e-2),
        )
    }
    file = Path(task["process_file"]) if "process_file" in task else None
    process = find_process(str(task["process"]), file)
    materials = _materials(task["material"])
    grids = _grids(numbers, variables, process, len(materials), where)
    thinnest = next(grid.low for grid in grids if grid.name == "thickness_mm")
    return SizingTask(
        name=name,
        material=materials[0],
        materials=materials,
        process=process,
        objective=str(task["objective"]),
        stiffness_Nm_per_rad=numbers["stiffness_Nm_per_rad"],
        stiffness_tolerance=numbers["stiffness_tolerance_percent"] / 100,
        contact_free_torque_Nm=numbers["contact_free_torque_Nm"],
        operating_torque_Nm=numbers.get("operating_torque_Nm", numbers["contact_free_torque_Nm"]),
        min_safety_factor_yield=numbers["min_safety_factor_yield"],
        envelope_m=numbers["envelope_mm"] * 1e-3,
        tip_radius_m=numbers.get("tip_radius_mm", min(0.3, 0.2 * thinnest)) * 1e-3,
        grids=grids,
        centreline=str(task["centreline"]),
        compare=compare,
        **optional,
    )


def _materials(given: object) -> tuple[Material, ...]:
    """One name, a list of names, or names separated by commas."""
    names = given if isinstance(given, list) else str(given).split(",")
    return tuple(lookup(str(name).strip()) for name in names)


def _grids(
    numbers: dict, variables: dict, process: Process, materials: int, where: str
) -> tuple[Grid, ...]:
    """The stated ranges, and derived ones for what is not stated."""
    from dftfs.analysis.sizing.ranges import derived_ranges

    if not _SMALLEST_mm <= numbers["envelope_mm"] <= _LARGEST_mm:
        raise DesignError(
            f"{where}: envelope_mm = {numbers['envelope_mm']:g} must be positive, from"
            f" {_SMALLEST_mm:g} to {_LARGEST_mm:g}"
        )
    derived = derived_ranges(numbers["envelope_mm"], process, numbers.get("min_bore_mm", 0.0))
    if "outer_radius_mm" in variables:
        derived.pop("outer_diameter_mm")
    merged = {**derived, **variables}
    arms = _grid("n_arms", merged, where)
    if any(value != int(value) for value in (arms.low, arms.high, arms.increment)):
        raise DesignError(f"{where}: n_arms = {merged['n_arms']} must be a whole number")
    many = Grid(name="material_number", low=1, high=materials, increment=1)
    return (*(_grid(key, merged, where) for key in VARIABLES if key in merged), many)


def _grid(key: str, variables: dict, where: str) -> Grid:
    given = variables[key]
    parts = given.split(":") if isinstance(given, str) else given
    parts = parts if isinstance(parts, list) else [parts]
    numbers = [_number(part, key, where) for part in parts]
    if len(numbers) == 1:
        return Grid(name=key, low=numbers[0], high=numbers[0], increment=1.0)
    if len(numbers) != 3:
        raise DesignError(
            f"{where}: {key} = {given} is one value or minimum, maximum, increment; {EXAMPLE}"
        )
    return Grid(name=key, low=numbers[0], high=numbers[1], increment=numbers[2])


def _number(value: object, key: str, where: str) -> float:
    if isinstance(value, str):  # --set and the parts of 4:13:0.5 are text
        with suppress(ValueError):
            value = float(value)
    return number(value, f"{where}: {key}", DesignError)
