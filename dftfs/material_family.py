"""What a family of materials can have for E and G, and which mistake an impossible E is.

Taken from Capytaine: a check says the number given, the range and the likely mistake. The
thesis gives G of steel and nickel as E of titanium and steel (errata S1); a spring computed
so is off by a factor of 1.2 to 2.7 and looks plausible.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources

from dftfs.errors import DesignError
from rsea_core.files.toml_tables import parse_toml

# Multiples of the family's range outside which E is refused: 0.85 still catches a steel's G of
# 83 GPa given to titanium and passes 179 GPa, cold-rolled 301 along the strip.
LOWEST_OF_RANGE = 0.85
HIGHEST_OF_RANGE = 1.2
# How far, relatively, from a family's range of G a number still looks like that G.
NEAR_SHEAR_MODULUS = 0.05

_UNIT_SLIPS = {
    1e3: "MPa where GPa is expected",
    1e9: "Pa where GPa is expected",
    1e-6: "MPa where Pa is expected",
    1e-9: "GPa where Pa is expected",
}


@dataclass(frozen=True, kw_only=True)
class Family:
    """What the members of a family can have: ranges of E and G in GPa."""

    name: str
    label: str
    youngs_modulus_GPa: tuple[float, float]
    shear_modulus_GPa: tuple[float, float]
    source: str


@cache
def families() -> Mapping[str, Family]:
    """Every family whose moduli are checked, by name."""
    text = resources.files("dftfs").joinpath("data", "materials.toml").read_text(encoding="utf-8")
    return {
        name: Family(
            name=name,
            label=entry["label"],
            youngs_modulus_GPa=tuple(entry["youngs_modulus_GPa"]),
            shear_modulus_GPa=tuple(entry["shear_modulus_GPa"]),
            source=entry["source"],
        )
        for name, entry in parse_toml(text, "materials.toml", DesignError)["families"].items()
    }


def check_youngs_modulus(youngs_modulus_Pa: float, family_name: str) -> None:
    """Refuse a Young's modulus that no member of the family can have.

    Parameters
    ----------
    youngs_modulus_Pa : float
    family_name : str
        A key of ``families()``, or "other": then only what no solid can have is refused.

    Raises
    ------
    DesignError
        If the family is unknown, or E is a wrong unit, a shear modulus or out of range.
    """
    modulus_GPa = youngs_modulus_Pa / 1e9
    if family_name == "other":
        if not 1e-3 <= modulus_GPa <= 1300.0:
            raise DesignError(
                f"youngs_modulus {modulus_GPa:g} GPa is outside 0.001..1300 GPa, what a solid can"
                " have: a wrong unit?"
            )
        return
    if family_name not in families():
        allowed = ", ".join([*families(), "other"])
        raise DesignError(f"family = {family_name!r} is unknown; allowed: {allowed}")
    family = families()[family_name]
    low, high = family.youngs_modulus_GPa
    if LOWEST_OF_RANGE * low <= modulus_GPa <= HIGHEST_OF_RANGE * high:
        return
    raise DesignError(
        f"youngs_modulus {modulus_GPa:g} GPa for {family.label} {_mistake(modulus_GPa, family)}"
    )


def _mistake(modulus_GPa: float, family: Family) -> str:
    low, high = family.youngs_modulus_GPa
    expected = f"{family.label}: E {low:g}-{high:g}"
    for factor, slip in _UNIT_SLIPS.items():
        if LOWEST_OF_RANGE * low <= modulus_GPa / factor <= HIGHEST_OF_RANGE * high:
            return f"is off by a factor {factor:g}: {slip}? ({expected} GPa)"
    owner = _owner_of_shear_modulus(modulus_GPa, family) if modulus_GPa < low else None
    if owner is None:
        return f"is not possible ({expected} GPa); if it is meant, use family 'other'"
    expected += ", G {:g}-{:g}".format(*family.shear_modulus_GPa)
    if owner is not family:
        expected += "; {}: G {:g}-{:g}".format(owner.label, *owner.shear_modulus_GPa)
    return f"looks like a shear modulus ({expected} GPa; errata S1)"


def _owner_of_shear_modulus(modulus_GPa: float, own: Family) -> Family | None:
    """The family, the material's own first, whose G lies nearest to the given modulus."""

    def distance(family: Family) -> float:
        low, high = family.shear_modulus_GPa
        return max(low / modulus_GPa, modulus_GPa / high, 1.0) - 1.0

    nearest = min([own, *families().values()], key=distance)
    return nearest if distance(nearest) <= NEAR_SHEAR_MODULUS else None
