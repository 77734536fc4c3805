"""A spring design: the numbers a person chooses, read from TOML in millimetres, kept in SI.

Taken from Capytaine and PyBaMM: keyword-only, checked on construction, every message with the
value, the limit and what would work; unknown keys are refused with the nearest known one.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property, lru_cache
from importlib import resources
from pathlib import Path

from dftfs.built_in import built_in_names
from dftfs.errors import DesignError
from dftfs.material import Material, load_materials, lookup
from dftfs.spring.outline import SpringOutline, build_outline
from dftfs.spring.parameters import SpiralParameters
from rsea_core.files.toml_tables import (
    file_name,
    nearest,
    number,
    parse_toml,
    read_toml,
    toml_string,
    word,
)
from rsea_core.files.toml_tables import table as toml_table

_LENGTHS = (
    "inner_radius",
    "outer_radius",
    "thickness",
    "width",
    "fillet_radius",
    "tip_radius",
    "bore_radius",
    "hub_radius",
    "rim_inner_radius",
    "rim_outer_radius",
)
_OPTIONAL = ("rim_thickness",)  # a taper: without it the strip is as thick at the rim
REQUIRED = ("inner_radius_mm", "outer_radius_mm", "turns", "thickness_mm", "width_mm")
SPRING_KEYS = (
    "name",
    *(f"{name}_mm" for name in (*_LENGTHS, *_OPTIONAL)),
    "turns",
    "n_arms",
    "start_angle_deg",
    "centreline",
    "thickness_profile",
    "centreline_offset_mm",
    "material",
    "materials_file",
)
_SMALLEST_RADIUS_MM = 0.5  # a hub or rim radius below this is a length given in metres
_LARGEST_MM = 2000.0


@dataclass(frozen=True, kw_only=True)
class Requirements:
    """What the design must do; ``None`` where nothing is asked.

    ``operating_torque_Nm`` is the torque, in either direction, at which the safety factor to
    yield is judged; ``contact_free_torque_Nm`` the torque below which no coils may touch.
    """

    stiffness_Nm_per_rad: float | None = None
    stiffness_tolerance: float = 0.05
    contact_free_torque_Nm: float | None = None
    operating_torque_Nm: float | None = None
    min_safety_factor_yield: float = 1.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if value is not None and not (math.isfinite(value) and value > 0):
                raise DesignError(f"requirements: {field.name} = {value} must be positive")


@dataclass(frozen=True, kw_only=True)
class MeshChoice:
    """How fine the finite elements are: size over the default's, elements through half the width.

    Raises
    ------
    DesignError
        If one is out of range.
    """

    size: float = 1.0
    layers: int = 1

    def __post_init__(self) -> None:
        if not 0.1 <= self.size <= 4:
            raise DesignError(f"mesh size = {self.size:g} must be 0.1 to 4, for example 0.5")
        if not 1 <= self.layers <= 32:
            raise DesignError(f"mesh layers = {self.layers} must be 1 to 32, for example 2")


@dataclass(frozen=True, kw_only=True)
class SpringDesign:
    """One spring: planar parameters, axial width, material, requirements.

    Raises
    ------
    DesignError
        If the width is not positive, or the parameters do not make a solid
        (`dftfs.spring.outline.build_outline`).
    """

    name: str
    spiral: SpiralParameters
    width_m: float
    material: Material
    requirements: Requirements = Requirements()
    mesh: MeshChoice = MeshChoice()

    def __post_init__(self) -> None:
        if not (math.isfinite(self.width_m) and self.width_m > 0):
            raise DesignError(f"width_mm = {self.width_m * 1e3:.6g} must be positive")
        file_name(self.name, "name", DesignError)
        _ = self.outline

    @cached_property
    def outline(self) -> SpringOutline:
        """The planar outline that CAD, mesh and closed forms share."""
        return _outline(self.spiral)

    @property
    def mass_kg(self) -> float:
        """Mass of the part."""
        return self.outline.area_m2 * self.width_m * self.material.density_kg_per_m3

    @property
    def n_arms(self) -> int:
        """Number of arms."""
        return int(self.spiral.n_arms)


@lru_cache(maxsize=256)
def _outline(spiral: SpiralParameters) -> SpringOutline:
    """Designs that differ in width or material only share one outline, which is immutable."""
    try:
        return build_outline(spiral)
    except (ValueError, ArithmeticError) as error:  # a root that is not in its bracket
        raise DesignError(
            f"these radii, thicknesses and turns make no closed outline ({error})"
        ) from error


def load_design(source: str, overrides: Mapping[str, str] | None = None) -> SpringDesign:
    """Read a built-in design by name or a TOML file, with single fields replaced.

    Parameters
    ----------
    source : str
        ``al1`` and the like, or the path of a TOML file with a ``[spring]`` table.
    overrides : mapping, optional
        Field name as in the file (``width_mm``) to its value as text.

    Raises
    ------
    DesignError
        One line naming the file, the field, the value and what would work.
    """
    if source in built_in_names():
        text = (resources.files("dftfs") / "data" / "designs" / f"{source}.toml").read_text()
        tables = parse_toml(text, source, DesignError)
        return _from_table(tables, source, overrides or {}, folder=None)
    path = Path(source)
    if not path.suffix and not path.exists():
        raise DesignError(
            f"design {source!r} is neither a file nor one of {', '.join(built_in_names())}"
        )
    return _from_table(read_toml(path, DesignError), source, overrides or {}, folder=path.parent)


def _from_table(
    document: dict, source: str, overrides: Mapping[str, str], folder: Path | None
) -> SpringDesign:
    _refuse_unknown(document, ("spring", "requirements", "mesh"), f"design file {source}", "table")
    if not isinstance(document.get("spring"), dict):
        raise DesignError(f"design file {source}: the table [spring] is missing")
    table = dict(document["spring"])
    asked = dict(toml_table(document.get("requirements", {}), "requirements", DesignError))
    _apply(table, asked, overrides)
    where = f"design file {source}" if folder is not None else f"design {source}"
    _refuse_unknown(table, SPRING_KEYS, f"{where}, [spring]", "field")
    for key in REQUIRED:
        if key not in table:
            raise DesignError(f"{where}: {key} is missing")
    for key in (*(f"{name}_mm" for name in (*_LENGTHS, *_OPTIONAL)), "turns", "start_angle_deg"):
        if key in table:
            table[key] = number(table[key], f"{where}: {key}", DesignError)
    for key in ("name", "centreline", "material", "materials_file"):
        word(table.get(key, ""), f"{where}: {key}", DesignError)
    _check_units(table, where)
    try:
        return SpringDesign(
            name=str(table.get("name", Path(source).stem)),
            spiral=_spiral(table, where),
            width_m=table["width_mm"] * 1e-3,
            material=_material(table, folder),
            requirements=_requirements(asked, where),
            mesh=_mesh(toml_table(document.get("mesh", {}), "mesh", DesignError), where),
        )
    except DesignError as error:
        raise DesignError(str(error) if where in str(error) else f"{where}: {error}") from None


def _apply(table: dict, asked: dict, overrides: Mapping[str, str]) -> None:
    known = (*SPRING_KEYS, *REQUIREMENT_KEYS)
    for key, value in overrides.items():
        _refuse_unknown({key: value}, known, "--set, --vary or --list", "field")
        (asked if key in REQUIREMENT_KEYS else table)[key] = _plain(value)


def _plain(value: str) -> object:
    try:
        return float(value) if "." in value or "e" in value.lower() else int(value)
    except ValueError:
        return value


def _spiral(table: dict, where: str) -> SpiralParameters:
    n_arms = table.get("n_arms", 2)
    if isinstance(n_arms, bool) or not isinstance(n_arms, int):
        raise DesignError(f"{where}: n_arms = {n_arms} must be a whole number, 1 or more")
    inner, outer = table["inner_radius_mm"], table["outer_radius_mm"]
    thickness = table["thickness_mm"]
    rim_inner = table.get(
        "rim_inner_radius_mm", outer + table.get("rim_thickness_mm", thickness) / 2
    )
    defaults = {
        "fillet_radius_mm": 1.0,
        "tip_radius_mm": 0.3,
        "hub_radius_mm": inner,
        "bore_radius_mm": inner - thickness,
        "rim_inner_radius_mm": rim_inner,
        "rim_outer_radius_mm": rim_inner + thickness,
    }
    values = {**defaults, **table}
    lengths = {f"{name}_m": values[f"{name}_mm"] * 1e-3 for name in _LENGTHS if name != "width"}
    return SpiralParameters(
        **lengths,
        **{f"{name}_m": table[f"{name}_mm"] * 1e-3 for name in _OPTIONAL if f"{name}_mm" in table},
        turns=table["turns"],
        n_arms=n_arms,
        start_angle_rad=math.radians(table.get("start_angle_deg", 0.0)),
        curve=str(table.get("centreline", "fermat")),
        thickness_profile=_numbers(table, "thickness_profile", where),
        centreline_offset_m=tuple(
            value * 1e-3 for value in _numbers(table, "centreline_offset_mm", where)
        ),
    )


def _numbers(table: dict, key: str, where: str) -> tuple[float, ...]:
    """A list of numbers; empty where the field is not given."""
    given = table.get(key, [])
    if not isinstance(given, list):
        raise DesignError(f"{where}: {key} = {given} must be a list, for example [1.0, 0.9, 1.0]")
    return tuple(number(value, f"{where}: {key}", DesignError) for value in given)


def _material(table: dict, folder: Path | None) -> Material:
    if "material" not in table:
        raise DesignError("material is missing; `dftfs materials` lists the names")
    if "materials_file" not in table:
        return lookup(str(table["material"]))
    path = Path(str(table["materials_file"]))
    return lookup(str(table["material"]), extra=load_materials((folder or Path()) / path))


REQUIREMENT_KEYS = (
    "stiffness_Nm_per_rad",
    "stiffness_tolerance_percent",
    "contact_free_torque_Nm",
    "operating_torque_Nm",
    "min_safety_factor_yield",
)


def _requirements(asked: dict, where: str) -> Requirements:
    _refuse_unknown(asked, REQUIREMENT_KEYS, f"{where}, [requirements]", "field")
    values = {key: number(v, f"{where}: {key}", DesignError) for key, v in asked.items()}
    if "stiffness_tolerance_percent" in values:
        values["stiffness_tolerance"] = values.pop("stiffness_tolerance_percent") / 100
    return Requirements(**values)


def _mesh(table: dict, where: str) -> MeshChoice:
    _refuse_unknown(table, ("size", "layers"), f"{where}, [mesh]", "field")
    layers = table.get("layers", 1)
    if isinstance(layers, bool) or not isinstance(layers, int):
        raise DesignError(f"{where}, [mesh]: layers = {layers} must be a whole number, 1 or more")
    size = number(table.get("size", 1.0), f"{where}, [mesh]: size", DesignError)
    return MeshChoice(size=size, layers=layers)


def _check_units(table: dict, where: str) -> None:
    """A radius of 0.018 'mm' is a length in metres; 3 m of anything is one in micrometres."""
    for key in ("inner_radius_mm", "outer_radius_mm"):
        value = table[key]
        if 0 < value < _SMALLEST_RADIUS_MM:
            raise DesignError(
                f"{where}: {key} = {value:g} looks like metres; lengths are in millimetres:"
                f" {value * 1e3:g} would work"
            )
    for key in (f"{name}_mm" for name in (*_LENGTHS, *_OPTIONAL)):
        if table.get(key, 0.0) > _LARGEST_MM:
            raise DesignError(
                f"{where}: {key} = {table[key]:g} is over {_LARGEST_MM:g} mm, the largest length"
                " this is made for"
            )
    for key in ("thickness_mm", "width_mm", "bore_radius_mm"):
        value = table.get(key, 1.0)
        if 0 < value < 1e-3 * table["outer_radius_mm"]:
            raise DesignError(
                f"{where}: {key} = {value:g} looks like metres beside outer_radius_mm ="
                f" {table['outer_radius_mm']:g}; lengths are in mm: {value * 1e3:g} would work"
            )


def _refuse_unknown(table: Mapping, known: tuple[str, ...], where: str, kind: str) -> None:
    for key in table:
        if key not in known:
            raise DesignError(f"{where}: unknown {kind} {key!r}; {nearest(key, known)}")


def design_toml(design: SpringDesign) -> str:
    """A design as the text of its file; `load_design` reads the same design back."""
    p, asked = design.spiral, design.requirements
    lines = ["[spring]", f"name = {toml_string(design.name)}"]
    lines += [f"{name}_mm = {_mm(getattr(p, f'{name}_m'))}" for name in _LENGTHS if name != "width"]
    lines += [
        f"{name}_mm = {_mm(getattr(p, f'{name}_m'))}"
        for name in _OPTIONAL
        if getattr(p, f"{name}_m") is not None
    ]
    lines += [
        f"width_mm = {_mm(design.width_m)}",
        f"turns = {p.turns!r}",
        f"n_arms = {int(p.n_arms)}",
        f"start_angle_deg = {math.degrees(p.start_angle_rad)!r}",
        f'centreline = "{p.curve}"',
        f"material = {toml_string(design.material.name)}",
    ]
    offset = [_mm(value) for value in p.centreline_offset_m]
    lines += [f"thickness_profile = {list(p.thickness_profile)}"] if p.thickness_profile else []
    lines += [f"centreline_offset_mm = {offset}"] if offset else []
    values = {
        "stiffness_Nm_per_rad": asked.stiffness_Nm_per_rad,
        "stiffness_tolerance_percent": 100 * asked.stiffness_tolerance,
        "contact_free_torque_Nm": asked.contact_free_torque_Nm,
        "operating_torque_Nm": asked.operating_torque_Nm,
        "min_safety_factor_yield": asked.min_safety_factor_yield,
    }
    lines += ["", "[requirements]"]
    lines += [f"{key} = {float(v)!r}" for key, v in values.items() if v is not None]
    if design.mesh != MeshChoice():
        lines += ["", "[mesh]", f"size = {design.mesh.size!r}", f"layers = {design.mesh.layers}"]
    return "\n".join(lines) + "\n"


def _mm(length_m: float) -> float:
    return round(length_m * 1e3, 9)
