"""Materials: elastic constants, strengths and where each number comes from.

``Material`` is plain SI data that refuses values no material of its family can have; the
table in ``data/materials.toml`` and user files of the same schema are read by one loader.
Taken from PyBaMM: a source per value and near matches for a misspelt name; here the loader
enforces the first, so a number without a source cannot enter.

TOML schema, for each ``[materials.<name>]``: ``description``, ``family``, ``youngs_modulus_GPa``,
``poisson_ratio``, ``density_kg_per_m3``, ``yield_strength_MPa`` and ``ultimate_strength_MPa`` (or
``no_strengths = "why"``), ``creeps``; optionally ``strength_basis`` ("typical" or "minimum"),
``minimum_yield_strength_MPa``, ``fatigue_strength_MPa`` with ``fatigue_cycles``
and ``fatigue_stress_ratio``, ``printed_shear_modulus_GPa``, ``anisotropic``, ``as_printed``,
``aliases``, ``alloy``, ``errata``, ``note``. Every number but the two fatigue conditions has its
line in ``[materials.<name>.source]``.
"""

import difflib
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from dftfs.errors import DesignError
from dftfs.material_family import check_youngs_modulus
from rsea_core.files.toml_tables import number, parse_toml, read_toml


@dataclass(frozen=True, kw_only=True)
class MaterialProperty:
    """One number of a material as a person reads it: the unit is in ``key``."""

    key: str
    value: float
    source: str


@dataclass(frozen=True, kw_only=True)
class Material:
    """An isotropic linear-elastic material with its strengths, SI throughout.

    A strength that is not known is ``None``, and ``no_strengths`` says why.

    Attributes
    ----------
    family : str
        A key of ``material_family.families()``, or ``"other"``: moduli are not checked.
    fatigue_strength_Pa : float or None
        Stress amplitude survived for ``fatigue_cycles`` at ``fatigue_stress_ratio`` (minimum
        over maximum stress; None where the source does not state it).
    creeps, anisotropic : bool
        True for polymers: stiffness under a held load falls, and printed layers differ.
    strength_basis : str
        ``"typical"`` of a product or its guaranteed ``"minimum"``; empty where none is stated.
    minimum_yield_strength_Pa : float or None
        Beside a typical strength the one that a standard guarantees; its source begins with it.
    alloy : str
        What to buy, where the name is not that of an alloy on the market; else empty.
    as_printed : bool
        Kept only to reproduce a publication; its moduli are not checked.
    printed_shear_modulus_Pa : float or None
        The G printed beside E and nu, which an isotropic material has no room for.
    sources : tuple of (field, source)
        One for each number, by the name of the field in this class.

    Raises
    ------
    DesignError
        If a number is impossible, contradicts another or looks like a shear modulus.
    """

    name: str
    youngs_modulus_Pa: float
    poisson_ratio: float
    density_kg_per_m3: float
    yield_strength_Pa: float | None
    ultimate_strength_Pa: float | None
    fatigue_strength_Pa: float | None = None
    fatigue_cycles: float | None = None
    fatigue_stress_ratio: float | None = None
    strength_basis: str = ""
    minimum_yield_strength_Pa: float | None = None
    family: str = "other"
    creeps: bool = False
    anisotropic: bool = False
    as_printed: bool = False
    printed_shear_modulus_Pa: float | None = None
    no_strengths: str = ""
    description: str = ""
    alloy: str = ""
    note: str = ""
    errata: tuple[str, ...] = ()
    aliases: tuple[str, ...] = ()
    sources: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        _check_elastic_constants(self)
        _check_strengths(self)

    @property
    def shear_modulus_Pa(self) -> float:
        """G = E / (2 (1 + nu)), the only one consistent with E and nu."""
        return self.youngs_modulus_Pa / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def shear_modulus_deviation(self) -> float | None:
        """Printed G over E / (2 (1 + nu)), less one (errata S3); None if no G is printed."""
        if self.printed_shear_modulus_Pa is None:
            return None
        return self.printed_shear_modulus_Pa / self.shear_modulus_Pa - 1.0

    def strength_note(self, stress_Pa: float) -> str:
        """What the yield strength stands for, and the factor that the guaranteed one leaves."""
        if not self.strength_basis:
            return ""
        least = self.minimum_yield_strength_Pa
        if least is None:
            return f"{self.strength_basis} strength"
        standard = self.source("minimum_yield_strength_Pa").split(",", 1)[0]
        return (
            f"{self.strength_basis} strength; minimum {least / 1e6:g} MPa by {standard}: factor"
            f" {least / stress_Pa:.4g}"
        )

    def source(self, field: str) -> str:
        """Return where the number in ``field`` comes from.

        Raises
        ------
        DesignError
            If no source is recorded for that field.
        """
        for name, text in self.sources:
            if name == field:
                return text
        known = ", ".join(name for name, _ in self.sources) or "none"
        raise DesignError(
            f"material {self.name!r} records no source for {field!r}; it has: {known}"
        )


def properties(material: Material) -> tuple[MaterialProperty, ...]:
    """List every number that a material has, in GPa, MPa and kg/m^3, with its source.

    The source of a number without a record is "not recorded"; the conditions of a fatigue
    test carry the source of the fatigue strength.
    """
    sources = dict(material.sources)
    listed = []
    for key, (field, factor) in _NUMBERS.items():
        value = getattr(material, field)
        if value is not None:
            recorded = "fatigue_strength_Pa" if key in _NEED_NO_SOURCE else field
            source = sources.get(recorded, "not recorded")
            listed.append(MaterialProperty(key=key, value=value / factor, source=source))
    return tuple(listed)


@cache
def builtin_materials() -> tuple[Material, ...]:
    """Every material of the built-in table, in its order."""
    text = resources.files("dftfs").joinpath("data", "materials.toml").read_text(encoding="utf-8")
    return _materials_of(parse_toml(text, "materials.toml", DesignError), "materials.toml")


def load_materials(path: str | Path) -> tuple[Material, ...]:
    """Read a user's materials from a TOML file of the schema in this module's docstring.

    Raises
    ------
    DesignError
        One line that names the file, the material and the field.
    """
    path = Path(path)
    document = read_toml(path, DesignError)
    unknown = sorted(set(document) - {"materials"})
    if unknown:
        raise DesignError(f"{path}: unknown key {unknown[0]!r}; allowed: [materials.<name>]")
    return _materials_of(document, str(path))


def lookup(name: str, extra: Iterable[Material] = ()) -> Material:
    """Find a material by name or alias; case, spaces and punctuation do not matter.

    Parameters
    ----------
    name : str
        For instance "6061-T6", "al6061", "Ti-6Al-4V", "grade 2".
    extra : iterable of Material
        User materials, searched with the built-in table.

    Raises
    ------
    DesignError
        If the name is unknown (with the nearest names), or an extra material takes the name
        of another: a table entry is never shadowed.
    """
    index = _index((*builtin_materials(), *extra), "extra materials")
    found = index.get(_key(name))
    if found is not None:
        return found
    near = difflib.get_close_matches(_key(name), index, n=5, cutoff=0.5)
    names = list(dict.fromkeys(index[key].name for key in near))[:3]
    if names:
        hint = "nearest: " + ", ".join(names)
    else:
        hint = "known: " + ", ".join(dict.fromkeys(material.name for material in index.values()))
    raise DesignError(f"unknown material {name!r}; {hint}")


# --- checks --------------------------------------------------------------------------------


def _require_finite_positive(material: Material, field: str) -> None:
    value = getattr(material, field)
    if value is not None and not (math.isfinite(value) and value > 0):
        raise DesignError(f"{field} = {value!r} must be positive and finite")


def _check_elastic_constants(material: Material) -> None:
    for field in ("youngs_modulus_Pa", "density_kg_per_m3", "printed_shear_modulus_Pa"):
        _require_finite_positive(material, field)
    nu = material.poisson_ratio
    if not 0.0 <= nu < 0.5:
        raise DesignError(f"poisson_ratio = {nu!r} must be at least 0 and below 0.5")
    density = material.density_kg_per_m3
    if not 500.0 <= density <= 23000.0:
        slip = ": g/cm3 where kg/m3 is expected?" if 0.5 <= density <= 23.0 else ""
        raise DesignError(
            f"density_kg_per_m3 = {density:g} is outside 500..23000, what a solid can have{slip}"
        )
    if not material.as_printed:
        check_youngs_modulus(material.youngs_modulus_Pa, material.family)


def _check_strengths(material: Material) -> None:
    strengths = ("yield_strength_Pa", "ultimate_strength_Pa", "fatigue_strength_Pa")
    for field in strengths:
        _require_finite_positive(material, field)
        strength = getattr(material, field)
        if strength is not None and not 1e6 <= strength <= 1e10:
            raise DesignError(
                f"{field.removesuffix('_Pa')} {strength / 1e6:g} MPa is outside 1..10000 MPa, what"
                " a structural material can have: a wrong unit (Pa, MPa, GPa)?"
            )
    yielding, ultimate, fatigue = (getattr(material, field) for field in strengths)
    if yielding is not None and ultimate is not None and yielding > ultimate:
        raise DesignError(
            f"yield_strength {yielding / 1e6:g} MPa exceeds"
            f" ultimate_strength {ultimate / 1e6:g} MPa"
        )
    weakest = 1e-4 * material.youngs_modulus_Pa
    if ultimate is not None and material.family != "other" and ultimate < weakest:
        raise DesignError(
            f"ultimate_strength {ultimate / 1e6:g} MPa is below {weakest / 1e6:g} MPa, 1e-4 of E:"
            " GPa where MPa is expected?"
        )
    if fatigue is not None and ultimate is not None and fatigue >= ultimate:
        raise DesignError(
            f"fatigue_strength {fatigue / 1e6:g} MPa must be below"
            f" ultimate_strength {ultimate / 1e6:g} MPa"
        )
    least, basis = material.minimum_yield_strength_Pa, material.strength_basis
    _require_finite_positive(material, "minimum_yield_strength_Pa")
    if basis not in ("", *_BASES):
        raise DesignError(f"strength_basis = {basis!r} must be one of {', '.join(_BASES)}")
    if least is not None and not (basis == "typical" and least <= (yielding or least)):
        raise DesignError("minimum_yield_strength needs a typical yield_strength that is no less")
    if (fatigue is None) != (material.fatigue_cycles is None):
        raise DesignError("fatigue_strength and fatigue_cycles belong together: give both or none")
    _require_finite_positive(material, "fatigue_cycles")
    ratio = material.fatigue_stress_ratio
    if ratio is not None and not (fatigue is not None and -10.0 <= ratio < 1.0):
        raise DesignError(
            f"fatigue_stress_ratio = {ratio!r} needs a fatigue_strength and must lie in -10..1"
        )


# --- reading -------------------------------------------------------------------------------

# file key -> (field, factor to SI)
_NUMBERS = {
    "youngs_modulus_GPa": ("youngs_modulus_Pa", 1e9),
    "poisson_ratio": ("poisson_ratio", 1.0),
    "density_kg_per_m3": ("density_kg_per_m3", 1.0),
    "yield_strength_MPa": ("yield_strength_Pa", 1e6),
    "ultimate_strength_MPa": ("ultimate_strength_Pa", 1e6),
    "minimum_yield_strength_MPa": ("minimum_yield_strength_Pa", 1e6),
    "fatigue_strength_MPa": ("fatigue_strength_Pa", 1e6),
    "printed_shear_modulus_GPa": ("printed_shear_modulus_Pa", 1e9),
    "fatigue_cycles": ("fatigue_cycles", 1.0),
    "fatigue_stress_ratio": ("fatigue_stress_ratio", 1.0),
}
_NEED_NO_SOURCE = {"fatigue_cycles", "fatigue_stress_ratio"}
_REQUIRED = (
    "description",
    "family",
    "youngs_modulus_GPa",
    "poisson_ratio",
    "density_kg_per_m3",
    "creeps",
)
_BASES = ("typical", "minimum")
_STRENGTHS = ("yield_strength_MPa", "ultimate_strength_MPa")
_OTHER_TYPES = {
    "description": str,
    "alloy": str,
    "strength_basis": str,
    "family": str,
    "note": str,
    "no_strengths": str,
    "creeps": bool,
    "anisotropic": bool,
    "as_printed": bool,
    "aliases": list,
    "errata": list,
    "source": dict,
}


def _key(name: str) -> str:
    return re.sub(r"[^a-z0-9]", "", name.lower())


def _materials_of(document: dict[str, Any], origin: str) -> tuple[Material, ...]:
    entries = document.get("materials")
    if not isinstance(entries, dict) or not entries:
        raise DesignError(f"{origin}: no [materials.<name>] table")
    materials = []
    for name, entry in entries.items():
        try:
            materials.append(_material_of(name, entry))
        except DesignError as error:
            raise DesignError(f"{origin}: material {name!r}: {error}") from error
    _index(materials, origin)
    return tuple(materials)


def _material_of(name: str, entry: Any) -> Material:
    if not isinstance(entry, dict):
        raise DesignError(f"must be a table [materials.{name}]")
    _check_keys(entry)
    sources = entry.get("source", {})
    fields: dict[str, Any] = dict.fromkeys(("yield_strength_Pa", "ultimate_strength_Pa"))
    for key, (field, factor) in _NUMBERS.items():
        if key in entry:
            fields[field] = entry[key] * factor
    for key in entry.keys() - _NUMBERS.keys() - {"source"}:
        value = entry[key]
        fields[key] = tuple(value) if isinstance(value, list) else value
    fields["sources"] = tuple((_NUMBERS[key][0], text) for key, text in sources.items())
    return Material(name=name, **fields)


def _check_keys(entry: dict[str, Any]) -> None:
    """Refuse a key that is unknown, of the wrong type or missing, and a number without source."""
    allowed = [*_NUMBERS, *_OTHER_TYPES]
    for key, value in entry.items():
        if key not in allowed:
            near = difflib.get_close_matches(key, allowed, n=1)
            hint = f"did you mean {near[0]!r}?" if near else f"allowed: {', '.join(allowed)}"
            raise DesignError(f"unknown key {key!r}; {hint}")
        if key in _OTHER_TYPES and not isinstance(value, _OTHER_TYPES[key]):
            raise DesignError(f"{key} = {value!r} must be a {_OTHER_TYPES[key].__name__}")
        if isinstance(value, list) and not all(isinstance(item, str) for item in value):
            raise DesignError(f"{key} = {value!r} must be a list of strings")
        if key in _NUMBERS:
            number(value, key, DesignError)
    for key in _REQUIRED if entry.get("no_strengths") else (*_REQUIRED, *_STRENGTHS):
        if key not in entry:
            why = "; or say why in no_strengths" if key in _STRENGTHS else ""
            raise DesignError(f"{key} is missing{why}")
    sources = entry.get("source", {})
    for key in entry.keys() & (_NUMBERS.keys() - _NEED_NO_SOURCE):
        if not (isinstance(sources.get(key), str) and sources[key].strip()):
            raise DesignError(f'{key} has no source: give [materials.<name>.source] {key} = "..."')
    for key in sources:
        if key not in entry or key not in _NUMBERS:
            raise DesignError(f"source names {key!r}, which has no value")


def _index(materials: Iterable[Material], origin: str) -> dict[str, Material]:
    """Names and aliases to materials; two materials must not share a name."""
    index: dict[str, Material] = {}
    for material in materials:
        for name in (material.name, *material.aliases):
            other = index.setdefault(_key(name), material)
            if other != material:
                raise DesignError(
                    f"{origin}: {name!r} names both {other.name!r} and {material.name!r}:"
                    " rename one"
                )
    return index
