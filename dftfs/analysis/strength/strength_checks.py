"""Strength as judged lines: first yield by direction and place, contact pressure, fatigue, set."""

from collections.abc import Sequence

from dftfs.analysis.strength.checks import Check
from dftfs.analysis.strength.fatigue import LoadBlock
from dftfs.analysis.strength.fatigue_lives import FatigueLife, fatigue_lives
from dftfs.analysis.strength.fkm import ALLOWED_DAMAGE, SURFACES, SURVIVAL, life_text
from dftfs.analysis.strength.presetting import presetting
from dftfs.analysis.strength.yield_and_set import (
    STRUCTURAL,
    PermanentSet,
    assumed_hardening,
    first_yield,
)
from dftfs.analysis.torsion.regions import ARM, CONTACT
from dftfs.analysis.torsion.result import SIGN, StiffnessResult
from dftfs.design import SpringDesign
from dftfs.errors import DesignError

_ELASTIC = "elastic FE, von Mises against {}"
_GOODMAN = (
    "S-N line with FKM's roughness and notch support, Shigley's reliability; Goodman mean stress"
    " (Shigley 6-46); Miner's rule to FKM's allowed sum"
)
_SWT = (
    "Smith, Watson & Topper 1970, principal stress, on the same S-N line; Miner's rule to FKM's"
    " allowed sum"
)


def strength_checks(
    design: SpringDesign,
    result: StiffnessResult,
    *,
    spectrum: Sequence[LoadBlock] = (),
    surface: str = "machined",
    survival: float = SURVIVAL,
    overloads: Sequence[PermanentSet] = (),
) -> tuple[Check, ...]:
    """Every line that the design's material and requirements allow to judge.

    Without an operating torque first yield is stated, not judged.

    Raises
    ------
    DesignError
        If a spectrum is given and the material has no fatigue strength.
    """
    return (
        *_yield_lines(design, result),
        *(
            _fatigue_lines(
                fatigue_lives(design, result, spectrum, surface, survival), surface, survival
            )
            if spectrum
            else ()
        ),
        *(_set_line(overload) for overload in overloads),
        *(line for overload in overloads for line in _preset_lines(design, result, overload)),
    )


def _yield_lines(design: SpringDesign, result: StiffnessResult) -> list[Check]:
    strength, asked = design.material.yield_strength_Pa, design.requirements
    if strength is None:
        return []
    limit = "-"
    if asked.operating_torque_Nm is not None:
        least = asked.min_safety_factor_yield * asked.operating_torque_Nm
        limit = f"at least {least:.4g} Nm"
    source = _ELASTIC.format(
        dict(design.material.sources).get("yield_strength_Pa", "no source recorded")
    )
    lines = []
    for direction in SIGN:
        for region in (*STRUCTURAL, CONTACT):
            found = first_yield(result, strength, direction, (region,))
            if found is None:
                continue
            torque = abs(found.torque_Nm)
            judged = asked.operating_torque_Nm is not None and region != CONTACT
            notes = [f"{strength / 1e6:.0f} MPa"]
            if found.extrapolated:
                notes.append("extrapolated beyond the curve")
            if region == CONTACT:
                notes.append("local bearing stress, mesh-dependent: not judged")
            lines.append(
                Check(
                    name=f"torque at first yield, {direction}, {region}",
                    value=torque,
                    unit="Nm",
                    limit=limit if region != CONTACT else "-",
                    passed=torque >= least if judged else None,
                    note="; ".join(notes),
                    source=source,
                )
            )
    return lines


def _fatigue_lines(lives: Sequence[FatigueLife], surface: str, survival: float) -> list[Check]:
    lines = []
    layer = SURFACES[surface].note
    for life in lives:
        rules = (("Goodman", life.goodman_damage, _GOODMAN), ("SWT", life.swt_damage, _SWT))
        for rule, value, source in rules:
            margin = _margin(life, value)
            note = (
                f"{margin}; up to {life.largest_Pa / 1e6:.0f} MPa, {life.allowed_Pa / 1e6:.0f} MPa"
                f" fully reversed allowed; {surface}{f' ({layer})' if layer else ''}, notch and"
                f" survival leave {life.factor:.2f} of the fatigue strength, {life.note}"
            )
            lines.append(
                Check(
                    name=f"fatigue damage, {life.region}, {rule}",
                    value=value,
                    unit="",
                    limit=f"at most {ALLOWED_DAMAGE:g} at {100 * survival:g} % survival",
                    passed=value <= ALLOWED_DAMAGE,
                    note=note,
                    source=source,
                )
            )
    return lines


def _margin(life: FatigueLife, damage: float) -> str:
    """How often the spectrum until failure; where that is outside the data, so it says."""
    if damage <= 0:
        return "no damage"
    total = sum(point.cycles for point in life.points)
    text = life_text(total / damage, life.strength)
    if text.startswith(("below", "beyond")):
        return f"{text} to failure"
    return f"the spectrum {1 / damage:.3g} times to failure"


def _set_line(found: PermanentSet) -> Check:
    x, y = (1e3 * c for c in found.at_m)
    where = (
        f"{found.region} at r = {(x * x + y * y) ** 0.5:.1f} mm, plastic strain"
        f" {100 * found.strain:.2g} %, {100 * found.yielded:.2g} % of the volume yielded"
        if found.strain > 0
        else "nothing yields"
    )
    return Check(
        name=f"permanent set after {found.overload_Nm:+.4g} Nm",
        value=abs(found.set_rad) * 1e3,
        unit="mrad",
        limit="-",
        passed=None,
        note=where,
        source="elastic-plastic plane stress, J2, yield to ultimate over 5 % strain (assumed)",
    )


def _preset_lines(
    design: SpringDesign, result: StiffnessResult, overload: PermanentSet
) -> list[Check]:
    """What the overload leaves in the arm's most loaded section; none where the arm stays elastic.

    Stress is taken in proportion to the torque past the arm's first yield.
    """
    material = design.material
    hardening = assumed_hardening(material)
    direction = next(d for d, sign in SIGN.items() if sign * overload.overload_Nm > 0)
    first = first_yield(result, hardening.yield_strength_Pa, direction, (ARM,))
    if first is None or abs(overload.overload_Nm) <= abs(first.torque_Nm):
        return []
    yields = abs(first.torque_Nm)
    slope = hardening.hardening_Pa / (material.youngs_modulus_Pa + hardening.hardening_Pa)
    try:
        left = presetting(abs(overload.overload_Nm) / yields, slope)
    except DesignError as problem:
        note, value = str(problem), yields
    else:
        value = left.moment * yields
        note = (
            f"first yield of the arm at {yields:.4g} Nm before; its surface keeps"
            f" {left.surface * hardening.yield_strength_Pa / 1e6:+.0f} MPa and"
            f" {100 * left.set_curvature:.2g} % of the curvature at first yield; the other way"
            f" elastic to {max(left.reverse_moment, 0.0) * yields:.4g} Nm"
        )
    return [
        Check(
            name=f"arm elastic after presetting by {overload.overload_Nm:+.4g} Nm",
            value=value,
            unit="Nm",
            limit="-",
            passed=None,
            note=note,
            source="bent rectangular strip (Hill IV.6), moment in proportion to the torque;"
            " roots of the arm not in it",
        )
    ]
