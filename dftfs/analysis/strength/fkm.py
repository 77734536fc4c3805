"""What surface, notch and survival leave of a material's fatigue strength, by family of material.

Roughness and notch support are the FKM guideline's, with constants for steel, stainless steel and
wrought aluminium. It has none for titanium, copper, nickel and the rest: there steel's roughness is
taken without notch support, and the result is labelled an estimate, as are the strength of an
alloy without a fatigue test and the layers that cutting leaves.

Source: FKM guideline, Analytical Strength Assessment of Components, 6th ed. (2012): ratios of
fatigue limit to tensile strength (table 4.2.1), notch support by stress gradient (4.3.1),
roughness (4.3.3, counted in full), allowed damage sum 0.3 for steel and wrought aluminium
(4.4.3); Shigley's Mechanical Engineering Design, 9th ed., table 6-5: reliability, 8 % standard
deviation of the fatigue strength. Recast layers: Mower, Int. J. Fatigue 64 (2014) 84 (Ti-6Al-4V),
and Klocke et al., Procedia CIRP 13 (2014) 225: rounded, an estimate.
"""

from dataclasses import dataclass
from math import log10, sqrt
from statistics import NormalDist

from dftfs.errors import DesignError
from dftfs.material import Material

ALLOWED_DAMAGE = 0.3
SURVIVAL = 0.99
SHORTEST_LIFE = 1e3  # cycles
_DEVIATION = 0.08
_SMOOTHEST_UM = 1.0  # Rz up to which a surface leaves the whole strength
_SPECIMEN_GRADIENT_PER_MM = 2 / 7.62  # R. R. Moore's rotating beam, 0.30 in


@dataclass(frozen=True, kw_only=True)
class Surface:
    """A surface: roughness Rz, and what a damaged or strengthened layer does beyond it."""

    roughness_um: float
    layer: float = 1.0
    note: str = ""


SURFACES = {
    "polished": Surface(roughness_um=1.0),
    "ground": Surface(roughness_um=4.0),
    "machined": Surface(roughness_um=16.0),
    "wire-edm": Surface(roughness_um=10.0, layer=0.8, note="recast layer 0.8, estimate"),
    "laser": Surface(roughness_um=50.0, layer=0.8, note="molten layer 0.8, estimate"),
    "water-jet": Surface(roughness_um=60.0),
    "as-cut": Surface(roughness_um=100.0),
    "printed": Surface(roughness_um=100.0, layer=0.8, note="porous layer 0.8, estimate"),
    "shot-peened": Surface(roughness_um=16.0, layer=1.1, note="peened 1.1, the table's low end"),
}
SURFACE_OF_PROCESS = {
    "wire-edm": "wire-edm",
    "water-jet": "water-jet",
    "laser": "laser",
    "milling": "machined",
    "print-metal": "printed",
    "print-polymer": "printed",
}


def surface_left_by(process_name: str) -> Surface:
    """The surface that a process leaves on a cut edge, as cut where the process is unknown."""
    return SURFACES[SURFACE_OF_PROCESS.get(process_name, "as-cut")]


@dataclass(frozen=True, kw_only=True)
class FamilyConstants:
    """FKM's constants of a family; ``notch`` (a_G, b_G in MPa) is None where it has none."""

    roughness: float
    least_ultimate_MPa: float
    fatigue_ratio: float
    notch: tuple[float, float] | None = None


_STEEL = FamilyConstants(
    roughness=0.22, least_ultimate_MPa=400.0, fatigue_ratio=0.45, notch=(0.50, 2700.0)
)
_FAMILIES = {
    "steel": _STEEL,
    "stainless-steel": FamilyConstants(
        roughness=0.22, least_ultimate_MPa=400.0, fatigue_ratio=0.40, notch=(0.40, 2400.0)
    ),
    "aluminium": FamilyConstants(
        roughness=0.22, least_ultimate_MPa=133.0, fatigue_ratio=0.30, notch=(0.05, 850.0)
    ),
}
# no constants of FKM: steel's roughness, no support, a low ratio
_OTHER_METAL = FamilyConstants(roughness=0.22, least_ultimate_MPa=400.0, fatigue_ratio=0.35)
_METALS = ("titanium", "copper", "nickel", "brass", "magnesium", "tungsten", "other")
_ESTIMATE_CYCLES = 1e6  # FKM's knee


@dataclass(frozen=True, kw_only=True)
class FatigueStrength:
    """A material's fatigue strength (amplitude, Pa), and what was measured or assumed of it."""

    strength_Pa: float
    cycles: float
    stress_ratio: float
    measured: bool
    note: str


def life_text(cycles: float, strength: FatigueStrength) -> str:
    """A life in words: a number only where the S-N line's data lie, 1e3 cycles to the strength's.

    Below 1e3 cycles strain decides, not the elastic stress; beyond the strength's own number of
    cycles nothing was tested.
    """
    if cycles < SHORTEST_LIFE:
        return f"below {SHORTEST_LIFE:.0e} cycles (outside the S-N line)".replace("e+03", "e3")
    if cycles > strength.cycles:
        what = "tests" if strength.measured else "estimate"
        return f"beyond {strength.cycles:.2g} cycles (outside the {what})"
    return f"{cycles:.2g} cycles"


def fatigue_strength(material: Material) -> FatigueStrength:
    """The tested strength where the material has one, else FKM's share of the ultimate strength.

    Raises
    ------
    DesignError
        If neither is known: no ultimate strength, or a family that no rule covers.
    """
    if material.ultimate_strength_Pa is None or not _covered(material):
        raise DesignError(f"{material.name} has no fatigue strength: no life can be stated")
    if material.fatigue_strength_Pa is not None and material.fatigue_cycles is not None:
        ratio = material.fatigue_stress_ratio
        stated = "R = -1 assumed: its source states none" if ratio is None else f"R = {ratio:g}"
        return FatigueStrength(
            strength_Pa=material.fatigue_strength_Pa,
            cycles=material.fatigue_cycles,
            stress_ratio=-1.0 if ratio is None else ratio,
            measured=True,
            note=f"tested at {stated}",
        )
    share = constants(material.family).fatigue_ratio
    return FatigueStrength(
        strength_Pa=share * material.ultimate_strength_Pa,
        cycles=_ESTIMATE_CYCLES,
        stress_ratio=-1.0,
        measured=False,
        note=f"ESTIMATE, no test data: {share:g} of the ultimate strength at 1e6 cycles, R = -1",
    )


def _covered(material: Material) -> bool:
    tested = material.fatigue_strength_Pa is not None
    return tested or material.family in (*_FAMILIES, *_METALS[:-1])


def constants(family: str) -> FamilyConstants:
    """FKM's constants, or steel's roughness alone where it has none."""
    return _FAMILIES.get(family, _OTHER_METAL)


def surface_factor(surface: str, ultimate_Pa: float, family: str = "steel") -> float:
    """1 - a_R lg(Rz / um) lg(2 Rm / Rm_min), times the layer's factor; at most the layer's.

    Raises
    ------
    DesignError
        If the surface is unknown.
    """
    if surface not in SURFACES:
        raise DesignError(f"surface = {surface!r} is unknown; known are {', '.join(SURFACES)}")
    given, own = SURFACES[surface], constants(family)
    rough = log10(max(given.roughness_um, _SMOOTHEST_UM))
    strong = log10(max(2 * ultimate_Pa / 1e6 / own.least_ultimate_MPa, 1.0))
    return given.layer * (1 - own.roughness * rough * strong)


def notch_support(gradient_per_mm: float, ultimate_Pa: float, family: str) -> float:
    """n_sigma by the related stress gradient (1/mm), at least 1; 1 where FKM has no constants.

    Raises
    ------
    DesignError
        If the gradient is negative.
    """
    if gradient_per_mm < 0:
        raise DesignError(f"stress gradient {gradient_per_mm:g} per mm must not be negative")
    notch = constants(family).notch
    if notch is None:
        return 1.0
    exponent = notch[0] + ultimate_Pa / 1e6 / notch[1]
    if gradient_per_mm <= 0.1:
        return 1 + gradient_per_mm * 10 ** -(exponent - 0.5)
    if gradient_per_mm <= 1:
        return 1 + sqrt(gradient_per_mm) * 10**-exponent
    return 1 + min(gradient_per_mm, 100.0) ** 0.25 * 10**-exponent


def support_over_specimen(gradient_per_mm: float, material: Material) -> float:
    """Support at a place over that of the test: a rotating beam, or none for an estimate."""
    ultimate = material.ultimate_strength_Pa or 0.0
    place = notch_support(gradient_per_mm, ultimate, material.family)
    if not fatigue_strength(material).measured:
        return place
    return place / notch_support(_SPECIMEN_GRADIENT_PER_MM, ultimate, material.family)


def gradients_per_mm(thickness_m: float, fillet_radius_m: float) -> tuple[float, float]:
    """Related stress gradients: the strip in bending, 2 / t; a fillet, 2.3 / r + 2 / t."""
    strip = 2e-3 / thickness_m
    return strip, 2.3e-3 / fillet_radius_m + strip


def survival_factor(survival: float) -> float:
    """Share of the mean fatigue strength that so many of all parts keep: 1 - 0.08 z.

    Raises
    ------
    DesignError
        If the survival is not from 0.5 to below 1.
    """
    if not 0.5 <= survival < 1:
        raise DesignError(f"survival_percent = {100 * survival:g} must be 50 to below 100, e.g. 99")
    return 1 - _DEVIATION * NormalDist().inv_cdf(survival)
